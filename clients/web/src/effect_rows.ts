import { canBeAdded, isOf, placesOf, type EffectSheet, type Entry, type Place, type RowsField } from "@tryon/core";

import { make } from "./dom.ts";
import { effectForm, spoken, told } from "./effect_form.ts";
import type { PlaceEvents } from "./effect_places.ts";
import { capitalised } from "./format.ts";

/** Who is told what is done to the entries of a list. */
export interface RowEvents {
  /** an entry is to be added; the key is that of its first control */
  add(field: RowsField): void;
  remove(entry: Entry): void;
  /** somebody is moving a slider of it, or chose something */
  change(entry: Entry, name: string, value: unknown): Entry;
  choose(entry: Entry, place: Place, more: boolean, key: string): void;
  name(entry: Entry, place: Place, word: string): void;
  /** why nothing can be chosen in a pattern; "": something can */
  readonly barred: string;
  /** why an entry can't be taken away; "": it can */
  readonly last: string;
}

/** The entries of a list that are of the garment that is looked at: added, changed and taken away. */
export function rowsControl(field: RowsField, sheet: EffectSheet, garment: string, events: RowEvents): HTMLElement {
  const list = make("div", { class: "rows-of", title: field.about });
  const addable = canBeAdded(field);
  const entries = sheet.entries(field.name);
  const shown = entries.filter(({ row }) => garment === "" || isOf(garment, row));
  const { fault } = sheet;
  entries.forEach((entry, k) => {
    if (!shown.includes(entry)) return;
    const row = rowControl(field, entry, `${field.name}.${k}`, addable, events);
    if (fault?.list === field.name && fault.index === k) row.append(faultLine(fault.message, fault.remedy));
    list.append(row);
  });
  if (!shown.length || addable) list.prepend(told(field.name, shown.length ? "" : "none", field.about));
  if (shown.length < entries.length) list.append(make("p", { class: "others" }, `${entries.length - shown.length} of other garments`));
  if (fault?.list === field.name && fault.index === undefined) list.append(faultLine(fault.message, fault.remedy));
  if (addable) {
    const add = make("button", { type: "button", class: "usual", "data-key": `${field.name}.add` }, `Add a ${spoken(field.name).replace(/s$/, "")}`);
    add.addEventListener("click", () => events.add(field));
    list.append(add);
    if (events.barred && placesOf(field.fields).some(({ open }) => !open)) {
      add.disabled = true;
      list.append(make("p", { class: "barred" }, events.barred));
    }
  }
  return list;
}

function rowControl(field: RowsField, entry: Entry, key: string, addable: boolean, events: RowEvents): HTMLElement {
  let own = entry;
  const places: PlaceEvents = {
    barred: events.barred,
    choose: (place, more, at) => events.choose(own, place, more, at),
    name: (place, word) => events.name(own, place, word),
    clear: (place) => events.change(own, place.name, []),
  };
  const change = (name: string, value: unknown) => (own = events.change(own, name, value));
  const part = make("div", { class: entry.draft ? "row draft" : "row" }, ...effectForm(field.fields, entry.row, key, change, places));
  if (!addable) return part;
  const away = make("button", { type: "button", class: "usual", "data-key": `${key}.away` }, "Take away");
  const barred = entry.draft ? "" : events.last;
  away.disabled = barred !== "";
  away.title = barred;
  away.addEventListener("click", () => events.remove(own));
  part.append(away);
  return part;
}

/** Why something was refused, where it was asked for. */
export function faultLine(message: string, remedy: string): HTMLElement {
  return make("p", { class: "fault", role: "alert" }, capitalised(message), " ", make("span", {}, capitalised(remedy)));
}
