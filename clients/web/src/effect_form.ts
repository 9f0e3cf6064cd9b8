import { canBeAdded, isOf, newRow, polarOf, Scale, vectorOf, type ChoiceField, type EffectField, type EffectParameters, type NumberField, type RowsField, type VectorField } from "@tryon/core";

import { make, setText } from "./dom.ts";
import { significant } from "./format.ts";

/** Told of another value of a field, and of its name. */
type Change = (value: unknown) => void;

/**
 * Controls for all parameters of an effect.
 * @param garment that is looked at: of lists only what is of it is shown; "" shows all
 * @param change told of all parameters, as somebody changes one of them
 */
export function effectForm(
  fields: readonly EffectField[],
  parameters: EffectParameters,
  garment: string,
  change: (parameters: EffectParameters) => void,
): HTMLElement[] {
  let current = parameters;
  return fields.map((field) =>
    control(field, current[field.name] ?? field.default, garment, (value) => {
      current = { ...current, [field.name]: value };
      change(current);
    }),
  );
}

function control(field: EffectField, value: unknown, garment: string, change: Change): HTMLElement {
  switch (field.kind) {
    case "number":
      return numberControl(field, value as number | null, change);
    case "vector":
      return vectorControl(field, value as [number, number, number], change);
    case "choice":
      return choiceControl(field, value as string, change);
    case "rows":
      return rowsControl(field, value as readonly EffectParameters[], garment, change);
    default:
      return told(field.name, inWords(value), field.about);
  }
}

function numberControl(field: NumberField, value: number | null, change: Change): HTMLElement {
  const scale = new Scale(field.low, field.high, field.whole);
  const shown = (number: number | null) => (number === null ? "the usual" : withUnit(number, field.unit));
  const line = slider(spoken(field.name), field.about, scale.end, value === null ? 0 : scale.positionOf(value), shown(value), (position) => {
    const number = scale.valueAt(position);
    change(number);
    return shown(number);
  });
  line.classList.toggle("idle", value === null);
  if (!field.open) return line;
  const usual = make("button", { type: "button", class: "usual", title: "Have it as usual" }, "usual");
  usual.ariaPressed = String(value === null);
  usual.addEventListener("click", () => {
    change(null);
    usual.ariaPressed = "true";
    line.classList.add("idle");
    setText(line.querySelector("output")!, shown(null));
  });
  line.querySelector("input")!.addEventListener("input", () => {
    usual.ariaPressed = "false";
    line.classList.remove("idle");
  });
  line.append(usual);
  return line;
}

/** A vector by how much, towards where about the vertical, and how far up. */
function vectorControl(field: VectorField, value: readonly [number, number, number], change: Change): HTMLElement {
  let polar = polarOf(value);
  const set = (part: Partial<typeof polar>) => {
    polar = { ...polar, ...part };
    change(vectorOf(polar));
  };
  const sizes = new Scale(0, field.longest, false);
  return make(
    "div",
    { class: "vector" },
    slider(spoken(field.name), field.about, sizes.end, sizes.positionOf(polar.size), withUnit(polar.size, field.unit), (position) => {
      set({ size: sizes.valueAt(position) });
      return withUnit(polar.size, field.unit);
    }),
    slider("towards", "0°: to the body's front, 90°: to its left", 72, Math.round(polar.heading / 5), `${significant(polar.heading, 3)}°`, (position) => {
      set({ heading: 5 * position });
      return `${5 * position}°`;
    }),
    slider("upwards", "above the horizontal", 36, Math.round(polar.rise / 5) + 18, `${significant(polar.rise, 3)}°`, (position) => {
      set({ rise: 5 * (position - 18) });
      return `${5 * (position - 18)}°`;
    }),
  );
}

function choiceControl(field: ChoiceField, value: string, change: Change): HTMLElement {
  const list = make("select", {}, ...field.of.map((word) => make("option", { value: word }, spoken(word))));
  list.value = value;
  list.addEventListener("change", () => change(list.value));
  return make("label", { class: "field", title: field.about }, make("span", {}, spoken(field.name)), list);
}

/** The entries that are of the garment that is looked at; where sliders and choices can make one, entries are added and
 * taken away. */
function rowsControl(field: RowsField, rows: readonly EffectParameters[], garment: string, change: Change): HTMLElement {
  let current = [...rows];
  const list = make("div", { class: "rows-of", title: field.about });
  const addable = canBeAdded(field);
  const rowOf = (row: EffectParameters): HTMLElement => {
    let own = row;
    const controls = effectForm(field.fields, row, garment, (parameters) => {
      current = current.map((entry) => (entry === own ? parameters : entry));
      own = parameters;
      change(current);
    });
    const part = make("div", { class: "row" }, ...controls);
    if (addable) {
      const away = make("button", { type: "button", class: "usual" }, "Take away");
      away.addEventListener("click", () => {
        current = current.filter((entry) => entry !== own);
        part.remove();
        change(current);
      });
      part.append(away);
    }
    return part;
  };
  const shown = rows.filter((row) => garment === "" || isOf(garment, row));
  list.append(...shown.map(rowOf));
  if (!shown.length || addable) list.prepend(told(field.name, shown.length ? "" : "none", field.about));
  if (shown.length < rows.length) list.append(make("p", { class: "others" }, `${rows.length - shown.length} of other garments`));
  if (addable) {
    const add = make("button", { type: "button", class: "usual" }, "Add");
    add.addEventListener("click", () => {
      const row = newRow(field.fields);
      current = [...current, row];
      add.before(rowOf(row));
      change(current);
    });
    list.append(add);
  }
  return list;
}

/** A labelled slider. @param moved told of a position, returns what is said of it */
function slider(name: string, about: string, end: number, position: number, said: string, moved: (position: number) => string): HTMLElement {
  const input = make("input", { type: "range", min: "0", max: String(end), step: "1", "aria-label": name });
  const output = make("output", {}, said);
  input.value = String(position);
  input.ariaValueText = said;
  input.addEventListener("input", () => {
    const text = moved(input.valueAsNumber);
    setText(output, text);
    input.ariaValueText = text;
  });
  return make("label", { class: "field slider", title: about }, make("span", {}, name), output, input);
}

function told(name: string, text: string, about: string): HTMLElement {
  return make("p", { class: "field", title: about }, make("span", {}, spoken(name)), make("span", { class: "fixed" }, text));
}

/** Pieces, edges or points of a curve for people. */
function inWords(value: unknown): string {
  if (!Array.isArray(value)) return String(value);
  if (!value.length) return "all";
  return value.map((entry: unknown) => (isEdge(entry) ? `${entry.panel}, edge ${entry.edge}` : String(entry))).join("; ");
}

function isEdge(entry: unknown): entry is { panel: string; edge: number } {
  return typeof entry === "object" && entry !== null && "panel" in entry && "edge" in entry;
}

function withUnit(value: number, unit: string): string {
  return `${significant(value, 3)}${unit && ` ${unit}`}`;
}

function spoken(name: string): string {
  return name.replaceAll("_", " ");
}
