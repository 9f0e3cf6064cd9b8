import { EffectDesk, EffectSheet, type ChosenPlace, type EffectParameters, type EffectRequest, type EffectWord, type Entry, type Place, type PlaceKind } from "@tryon/core";
import type { EffectsMessage, EffectState, ErrorMessage } from "@tryon/protocol";

import { byId, make, setText } from "./dom.ts";
import { effectForm, spoken } from "./effect_form.ts";
import type { PlaceEvents } from "./effect_places.ts";
import { faultLine, rowsControl, type RowEvents } from "./effect_rows.ts";
import { capitalised, significant } from "./format.ts";
import type { Notice } from "./notice.ts";
import { Pause } from "./pause.ts";

/** after a movement of a slider until it is taken for meant [ms] */
const SLIDER_WAITS_MS = 150;

const STATES: readonly { readonly state: EffectState["state"]; readonly text: string; readonly title: string }[] = [
  { state: "absent", text: "Off", title: "It costs nothing" },
  { state: "armed", text: "Armed", title: "Its kernels are compiled, and nothing else: it can act at once" },
  { state: "active", text: "On", title: "It acts" },
];
const LAST = "Without it the effect is nothing: turn it off instead";
const PENDING = { compiling: "being compiled", binding: "being taken up" } as const;

const GONE: Notice = {
  title: "What you were choosing for is gone",
  message: "Somebody else has changed or taken it away meanwhile.",
  remedy: "Add it anew if it is still wanted.",
};

/** What effects need of the page's pattern. */
export interface PatternToChooseIn {
  /** why nothing can be chosen in it; "": something can */
  readonly barred: string;
  /** has somebody choose; told of none where somebody leaves it. @param what it is for, for people */
  choosePlace(kind: PlaceKind, what: string, chosen: (place: ChosenPlace | undefined) => void): void;
}

/** The section of effects: what acts on the garment, what could, why, and what each takes. */
export class EffectsPanel {
  private readonly section = byId("effects", HTMLDetailsElement);
  private readonly list = byId("effects-list");
  private readonly auto = byId("effects-auto", HTMLInputElement);
  private readonly measure = byId("effects-measure", HTMLButtonElement);
  private readonly desk: EffectDesk;
  /** is a garment being put on first, for which effects can be asked already? */
  private dressing = false;
  private words: readonly EffectWord[] = [];
  private items: EffectItem[] = [];
  private garment = "";

  /**
   * @param send says it to the session
   * @param pattern where lines and spots are chosen
   * @param tell says what concerns more than an effect
   */
  constructor(
    send: (message: EffectRequest) => void,
    private readonly pattern: PatternToChooseIn,
    private readonly tell: (notice: Notice) => void,
  ) {
    this.desk = new EffectDesk(send, () => this.show());
    this.auto.addEventListener("change", () => this.desk.setAuto(this.auto.checked));
    this.measure.addEventListener("click", () => this.desk.measure());
    this.section.addEventListener("toggle", () => {
      this.show();
      if (this.section.open) this.section.scrollIntoView({ block: "nearest" });
    });
    this.show();
  }

  /** These are all effects that there are. */
  offer(words: readonly EffectWord[]): void {
    if (words === this.words) return;
    this.words = words;
    this.items = words.map((word) => new EffectItem(word, this.desk, () => this.garment, this.pattern, this.tell));
    this.list.replaceChildren(...this.items.map(({ element }) => element));
    this.show();
  }

  take(message: EffectsMessage): void {
    this.desk.take(message);
  }

  /** The session puts its garment on, or does no longer: what is asked for meanwhile is kept until that is worn. */
  beingDressed(dressing: boolean): void {
    if (dressing === this.dressing) return;
    this.dressing = dressing;
    this.show();
  }

  /** This garment is looked at, by its name in the session, "" for all: lists show what is of it. */
  look(garment: string): void {
    this.garment = garment;
    this.show();
  }

  /** @returns whether it is told here, where it was asked for */
  refused(error: ErrorMessage): boolean {
    const name = this.desk.refused(error);
    return this.section.open && this.items.some((item) => item.name === name && item.element.open && item.element.checkVisibility());
  }

  /** Nothing is known of the session for now; what somebody has begun here stays. */
  lost(): void {
    this.desk.forget();
  }

  /** Another session begins, of which nothing is known yet. */
  forget(): void {
    for (const item of this.items) item.forget();
    this.desk.forget();
  }

  /** There is a pattern now, or none any more. */
  patternChanged(): void {
    if (this.section.open) for (const item of this.items) item.show();
  }

  private show(): void {
    const { known } = this.desk;
    this.section.hidden = !(known || this.dressing) || this.items.length === 0;
    this.measure.disabled = !known;
    const states = this.items.map(({ state }) => state);
    const armed = states.filter((state) => state === "armed").length;
    const kept = this.items.filter(({ name }) => this.desk.awaited(name) !== undefined).length;
    const acting = `${states.filter((state) => state === "active").length} act${armed ? `, ${armed} armed` : ""}`;
    setText(byId("effects-short"), known ? acting : kept ? `${kept} kept until it is worn` : "");
    if (!this.section.open) return;
    this.auto.checked = this.desk.auto;
    for (const item of this.items) item.show();
  }
}

/** One effect: its state and what it takes, and, unfolded, why and its parameters. */
class EffectItem {
  readonly element: HTMLDetailsElement;
  private readonly ms = make("span", { class: "ms" });
  private readonly said = make("span", { class: "said-state" });
  private readonly why = make("p", { class: "why" });
  private readonly form = make("div", { class: "form" });
  private readonly buttons: HTMLButtonElement[];
  private readonly pause = new Pause();
  private readonly sheet: EffectSheet;
  private shown = "";

  constructor(
    private readonly word: EffectWord,
    private readonly desk: EffectDesk,
    private readonly garment: () => string,
    private readonly pattern: PatternToChooseIn,
    private readonly tell: (notice: Notice) => void,
  ) {
    this.sheet = new EffectSheet(word, (parameters) =>
      this.pause.begin(SLIDER_WAITS_MS, () => this.desk.ask(word.name, this.state === "armed" ? "armed" : "active", parameters)),
    );
    this.buttons = STATES.map(({ state, text, title }) => {
      const button = make("button", { type: "button", title, "data-state": state }, text);
      button.addEventListener("click", () => this.desk.ask(word.name, state));
      return button;
    });
    const choice = make("div", { class: "chips", role: "group", "aria-label": `State of ${word.title}` }, ...this.buttons);
    choice.hidden = word.kept;
    this.element = make(
      "details",
      { class: "effect", "data-name": word.name },
      make("summary", {}, make("i", { class: "lamp" }), make("b", {}, word.title), this.said, this.ms),
      make("p", { class: "about" }, capitalised(word.about)),
      choice,
      this.why,
      this.form,
    );
    this.element.addEventListener("toggle", () => this.show());
  }

  get name(): string {
    return this.word.name;
  }

  get state(): EffectState["state"] | undefined {
    return this.desk.effect(this.word.name)?.state;
  }

  show(): void {
    const effect = this.desk.effect(this.word.name);
    if (!effect) {
      this.showAwaited();
      return;
    }
    const { state, pending = "", why = "", ms = null, stages = {} } = effect;
    this.element.dataset.state = state;
    this.element.dataset.pending = pending;
    setText(this.said, pending ? PENDING[pending] : { absent: "", armed: "armed", active: "" }[state]);
    setText(this.ms, ms === null ? "" : `${significant(ms, 2)} ms`);
    this.ms.title = Object.entries(stages)
      .map(([stage, taken]) => `${stage.replaceAll("_", " ")}: ${significant(taken, 2)} ms a call`)
      .join("\n");
    const refused = this.desk.kept(this.word.name)?.refused ?? "";
    setText(this.why, capitalised(this.word.kept ? "Always on: that nothing penetrates rests on it" : refused ? `refused: ${refused}` : why));
    for (const button of this.buttons) button.ariaPressed = String(button.dataset.state === state);
    if (this.element.open) this.showForm(effect.parameters ?? {});
  }

  /** Before the garment is worn: what the effect is to be then. Its parameters are asked for once they are known. */
  private showAwaited(): void {
    const state = this.desk.awaited(this.word.name);
    this.element.dataset.state = "absent";
    this.element.dataset.pending = state === undefined ? "" : "kept";
    setText(this.said, state === undefined ? "" : { absent: "off", armed: "armed", active: "on" }[state] + " once it is worn");
    setText(this.ms, "");
    setText(this.why, "");
    for (const button of this.buttons) button.ariaPressed = String(button.dataset.state === state);
    this.form.replaceChildren();
    this.shown = "";
  }

  /** Drops what nobody has been asked for yet. */
  forget(): void {
    this.pause.cancel();
    this.sheet.forget();
  }

  /** Draws the parameters as they stand; while somebody is changing them, they stay as they are. */
  private showForm(parameters: EffectParameters): void {
    if (this.pause.waits) return;
    this.sheet.take(parameters, this.desk.fault(this.word.name));
    this.draw();
  }

  /** Draws the form anew where it shows something else; who was at a control of it still is. */
  private draw(): void {
    const text = this.shownAs();
    if (text === this.shown) return;
    this.shown = text;
    const { sheet, word } = this;
    const garment = this.garment();
    const rows = this.rowEvents();
    const change = (name: string, value: unknown) => this.slide(() => sheet.set(name, value));
    const controls = effectForm(word.fields, sheet.current, word.name, change, this.placeEvents(), (field) => rowsControl(field, sheet, garment, rows));
    const { fault } = sheet;
    if (fault && fault.list === undefined) controls.unshift(faultLine(fault.message, fault.remedy));
    const at = this.form.contains(document.activeElement) ? (document.activeElement as HTMLElement).dataset.key : undefined;
    this.form.replaceChildren(...controls);
    if (at !== undefined) this.focus(at);
  }

  private placeEvents(): PlaceEvents {
    return {
      barred: this.pattern.barred,
      choose: (place, more, key) => this.choose(undefined, place, more, key),
      name: (place, word) => this.act(() => this.sheet.place(undefined, place, { panel: word }, false)),
      clear: (place) => this.act(() => this.sheet.set(place.name, [])),
    };
  }

  private rowEvents(): RowEvents {
    const { sheet } = this;
    return {
      barred: this.pattern.barred,
      last: this.word.lined && sheet.count === 1 ? LAST : "",
      add: ({ name }) => {
        const entry = this.act(() => sheet.begin(name));
        const place = sheet.untold(entry);
        const key = `${name}.${sheet.entries(name).length - 1}`;
        if (place) this.choose(entry, place, false, `${key}.${place.name}.choose`, true);
        else this.focus(key);
      },
      remove: (entry) => {
        this.act(() => sheet.remove(entry));
        this.focus(`${entry.list}.add`);
      },
      change: (entry, name, value) => this.slide(() => sheet.change(entry, { ...entry.row, [name]: value }) ?? entry),
      choose: (entry, place, more, key) => this.choose(entry, place, more, key),
      name: (entry, place, word) => this.act(() => sheet.place(entry, place, { panel: word }, false)),
    };
  }

  /**
   * Has a place chosen in the pattern, and what an entry lacks besides after that.
   * @param key of the control that is gone on from
   * @param fresh the entry was begun for this: it is dropped where nothing is chosen
   */
  private choose(entry: Entry | undefined, place: Place, more: boolean, key: string, fresh = false): void {
    this.pattern.choosePlace(place.kind, `${this.word.title}, ${spoken(place.name)}`, (chosen) => {
      if (!chosen) {
        if (fresh && entry) this.act(() => this.sheet.remove(entry));
        this.focus(fresh && entry ? `${entry.list}.add` : key);
        return;
      }
      const panel = this.garment() ? `${this.garment()}/${chosen.panel}` : chosen.panel;
      const now = this.act(() => this.sheet.place(entry, place, { ...chosen, panel }, more));
      this.focus(key);
      if (entry && !now) this.tell(GONE);
      const next = now?.draft ? this.sheet.untold(now) : undefined;
      if (now && next) this.choose(now, next, false, key.replace(`.${place.name}.`, `.${next.name}.`));
    });
  }

  /** Does something that is seen by more than the control that did it, and asked for at once. */
  private act<Result>(does: () => Result): Result {
    this.pause.endNow();
    const result = does();
    if (this.pause.waits) this.pause.endNow();
    else this.draw();
    return result;
  }

  /** Does something that the control that did it shows already, and asks for it when it has come to rest. */
  private slide<Result>(does: () => Result): Result {
    const result = does();
    this.shown = this.shownAs();
    return result;
  }

  /** Has the keys go to a control of the form, or to the first one that is part of what has this key. */
  private focus(key: string): void {
    const all = [...this.form.querySelectorAll<HTMLElement>("[data-key]")];
    const met = all.find((control) => control.dataset.key === key) ?? all.find((control) => control.dataset.key?.startsWith(`${key}.`));
    (met ?? this.element.querySelector("summary"))?.focus();
  }

  /** What the form shows. */
  private shownAs(): string {
    const { sheet, word } = this;
    const lists = word.fields.filter(({ kind }) => kind === "rows").map(({ name }) => sheet.entries(name));
    return JSON.stringify([this.garment(), this.pattern.barred, sheet.current, lists, sheet.fault]);
  }
}
