import { EffectDesk, type EffectParameters, type EffectRequest, type EffectWord } from "@tryon/core";
import type { EffectsMessage, EffectState, ErrorMessage } from "@tryon/protocol";

import { byId, make, setText } from "./dom.ts";
import { effectForm } from "./effect_form.ts";
import { significant } from "./format.ts";
import { Pause } from "./pause.ts";

/** after a movement of a slider until it is taken for meant [ms] */
const SLIDER_WAITS_MS = 150;

const STATES: readonly { readonly state: EffectState["state"]; readonly text: string; readonly title: string }[] = [
  { state: "absent", text: "Off", title: "It costs nothing" },
  { state: "armed", text: "Armed", title: "Its kernels are compiled, and nothing else: it can act at once" },
  { state: "active", text: "On", title: "It acts" },
];
const PENDING = { compiling: "being compiled", binding: "being taken up" } as const;

/** The section of effects: what acts on the garment, what could, why, and what each takes. */
export class EffectsPanel {
  private readonly section = byId("effects", HTMLDetailsElement);
  private readonly list = byId("effects-list");
  private readonly auto = byId("effects-auto", HTMLInputElement);
  private readonly measure = byId("effects-measure", HTMLButtonElement);
  private readonly desk: EffectDesk;
  private words: readonly EffectWord[] = [];
  private items: EffectItem[] = [];
  private garment = "";

  constructor(send: (message: EffectRequest) => void) {
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
    this.items = words.map((word) => new EffectItem(word, this.desk, () => this.garment));
    this.list.replaceChildren(...this.items.map(({ element }) => element));
    this.show();
  }

  take(message: EffectsMessage): void {
    this.desk.take(message);
  }

  /** This garment is looked at, by its name in the session, "" for all: lists show what is of it. */
  look(garment: string): void {
    this.garment = garment;
    this.show();
  }

  refused(error: ErrorMessage): void {
    this.desk.refused(error);
  }

  /** Nothing is known of the session any more, or yet. */
  forget(): void {
    this.desk.forget();
  }

  private show(): void {
    this.section.hidden = !this.desk.known || this.items.length === 0;
    const states = this.items.map(({ state }) => state);
    const armed = states.filter((state) => state === "armed").length;
    setText(byId("effects-short"), `${states.filter((state) => state === "active").length} act${armed ? `, ${armed} armed` : ""}`);
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
  private shown = "";

  constructor(
    private readonly word: EffectWord,
    private readonly desk: EffectDesk,
    private readonly garment: () => string,
  ) {
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
      make("p", { class: "about" }, sentence(word.about)),
      choice,
      this.why,
      this.form,
    );
    this.element.addEventListener("toggle", () => this.show());
  }

  get state(): EffectState["state"] | undefined {
    return this.desk.effect(this.word.name)?.state;
  }

  show(): void {
    const effect = this.desk.effect(this.word.name);
    if (!effect) return;
    const { state, pending = "", why = "", ms = null, stages = {} } = effect;
    this.element.dataset.state = state;
    this.element.dataset.pending = pending;
    setText(this.said, pending ? PENDING[pending] : { absent: "", armed: "armed", active: "" }[state]);
    setText(this.ms, ms === null ? "" : `${significant(ms, 2)} ms`);
    this.ms.title = Object.entries(stages)
      .map(([stage, taken]) => `${stage.replaceAll("_", " ")}: ${significant(taken, 2)} ms a call`)
      .join("\n");
    setText(this.why, sentence(this.word.kept ? "Always on: that nothing penetrates rests on it" : why));
    for (const button of this.buttons) button.ariaPressed = String(button.dataset.state === state);
    if (this.element.open) this.showForm(effect.parameters ?? {});
  }

  /** Draws the parameters as they stand; while somebody is changing them, they stay as they are. */
  private showForm(parameters: EffectParameters): void {
    const text = this.shownAs(parameters);
    if (text === this.shown || this.pause.waits) return;
    this.shown = text;
    const change = (changed: EffectParameters) => {
      this.pause.begin(SLIDER_WAITS_MS, () => {
        this.shown = this.shownAs(changed);
        this.desk.ask(this.word.name, this.state === "armed" ? "armed" : "active", changed);
      });
    };
    this.form.replaceChildren(...effectForm(this.word.fields, parameters, this.garment(), change));
  }

  /** What a form of these parameters shows. */
  private shownAs(parameters: EffectParameters): string {
    return JSON.stringify([this.garment(), parameters]);
  }
}

function sentence(text: string): string {
  return text && `${text.charAt(0).toUpperCase()}${text.slice(1)}`;
}
