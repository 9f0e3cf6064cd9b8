import type { SessionWish, Size } from "@tryon/core";

import { byId, make, RadioGroup, setText } from "./dom.ts";
import { DYES, swatchStyle } from "./fabrics.ts";
import type { Catalogue } from "./fitting.ts";
import { sentence } from "./format.ts";

/** What a person may choose. */
export interface Chosen {
  garment(id: string): void;
  size(size: Size): void;
  /** null: the default one */
  body(id: string | null): void;
  motion(name: string): void;
  fabric(name: string): void;
  /** `undefined`: the fabric's own colour */
  colour(colour: string | undefined): void;
  preset(name: string | null): void;
  /** an upload is to be removed; `called` is its name */
  remove(kind: UploadKind, id: string, called: string): void;
}

export type UploadKind = "garment" | "motion" | "body";

const OWN = "own";
const AUTO = "auto";
const DEFAULT = "default";
const SIZE_WAITS_MS = 700;
const PRESETS = [
  [AUTO, "Auto", "The server chooses what suits its processor"],
  ["draft", "Draft", "Coarse and quick, for a processor without a graphics card: a blow stretches cloth and lets it jump for a frame"],
  ["live", "Live", "Fine, in real time on a graphics card"],
  ["fit", "Fit", "Finest: to judge the fit, slower than real time"],
  ["reference", "Reference", "As fine as Fit, and every step solved to its end, however long that takes"],
] as const;

/** The panel of choices. */
export class Choices {
  private readonly garments: RadioGroup;
  private readonly size = byId("size", HTMLInputElement);
  private readonly fit = byId("size-fit", HTMLButtonElement);
  private readonly bodies: RadioGroup;
  private readonly motions: RadioGroup;
  private readonly fabrics: RadioGroup;
  private readonly colours: RadioGroup;
  private readonly presets: RadioGroup;
  private offered = "";
  private wished: Size = 1;
  private worn: number | null = null;
  private failed = false;
  /** what stands in the field of the size was written by a person and is not yet worn */
  private typed = false;

  constructor(chosen: Chosen) {
    const group = (id: string, take: (value: string) => void, kind?: UploadKind) =>
      new RadioGroup(byId(id, HTMLFieldSetElement), id, take, (value, called) => kind && chosen.remove(kind, value, called));
    this.garments = group("garments", (id) => chosen.garment(id), "garment");
    this.bodies = group("bodies", (id) => chosen.body(id === DEFAULT ? null : id), "body");
    let timer = 0;
    this.size.addEventListener("input", () => {
      this.typed = true;
      window.clearTimeout(timer); // of several steps in a row the last one counts: each is a garment to be sewn
      if (this.size.checkValidity() && this.size.value) timer = window.setTimeout(() => chosen.size(this.size.valueAsNumber / 100), SIZE_WAITS_MS);
    });
    this.fit.addEventListener("click", () => {
      window.clearTimeout(timer);
      this.typed = false;
      this.showSize();
      chosen.size("fit");
    });
    this.motions = group("motions", (name) => chosen.motion(name), "motion");
    this.fabrics = group("fabrics", (name) => chosen.fabric(name));
    this.colours = group("colours", (value) => chosen.colour(value === OWN ? undefined : value));
    this.presets = group("presets", (value) => chosen.preset(value === AUTO ? null : value));
    byId("choices").addEventListener("submit", (event) => event.preventDefault());
    this.colours.offer(
      [
        { value: OWN, title: "The fabric's own colour", content: [make("span", { class: "own" }), hidden("The fabric's own colour")] },
        ...DYES.map(([name, colour]) => ({ value: colour, title: name, content: [dyed("span", "", colour), hidden(name)] })),
      ],
      OWN,
    );
    this.presets.offer(
      PRESETS.map(([value, name, title]) => ({ value, title, content: [name] })),
      AUTO,
    );
  }

  /** Shows what there is and what is chosen. */
  show({ garments, motions, bodies, fabrics }: Catalogue, wish: SessionWish): void {
    const mesh = (garments.find(({ id }) => id === wish.garment)?.notes.length ?? 0) > 0;
    this.size.disabled = this.fit.disabled = mesh;
    byId("sizes").title = mesh ? "A mesh is worn in the size it comes in" : "Over the pattern's own size";
    if (wish.size !== this.wished) this.typed = false;
    this.wished = wish.size;
    if (!this.typed) this.showSize();
    const offered = JSON.stringify([garments, motions, bodies, fabrics]);
    if (offered !== this.offered) {
      this.offered = offered;
      this.garments.offer(
        garments.map(({ id, name, panel_count, area, built_in }) => ({
          value: id,
          ...(built_in ? {} : { removable: sentence(name) }),
          content: [make("span", {}, make("b", {}, sentence(name)), make("small", {}, `${panel_count} pieces, ${area.toFixed(2)} m² of fabric`))],
        })),
        wish.garment,
      );
      this.motions.offer(
        motions.map(({ name, title, found }) => ({
          value: name,
          title: found?.notes.join("; ") ?? "",
          content: [sentence(title)],
          ...(found ? { removable: sentence(title) } : {}),
        })),
        wish.motion ?? undefined,
      );
      const own = bodies.map(({ id, name, seconds, notes }) => ({
        value: id,
        title: notes.join("; "),
        removable: sentence(name),
        content: [make("span", {}, make("b", {}, sentence(name)), make("small", {}, seconds > 0 ? `moves by itself, ${seconds.toFixed(1)} s` : "stands still"))],
      }));
      const usual = { value: DEFAULT, content: [make("span", {}, make("b", {}, "Default"), make("small", {}, "moves as chosen above"))] };
      this.bodies.offer(own.length ? [usual, ...own] : [], wish.body ?? DEFAULT);
      this.fabrics.offer(
        fabrics.map((fabric) => {
          const cloth = make("span", { class: "cloth" });
          for (const [property, value] of Object.entries(swatchStyle(fabric))) cloth.style.setProperty(property, value);
          const title = `${Math.round(fabric.areal_density * 1000)} g/m², stretches up to ${Math.round((fabric.strain_limit - 1) * 100)} %`;
          return { value: fabric.name, title, content: [cloth, sentence(fabric.name)] };
        }),
        wish.fabric ?? undefined,
      );
      return;
    }
    this.garments.select(wish.garment);
    this.bodies.select(wish.body ?? DEFAULT);
    this.motions.select(wish.motion ?? undefined);
    this.fabrics.select(wish.fabric ?? undefined);
    this.presets.select(wish.preset ?? AUTO);
  }

  /** Shows the colour that was chosen elsewhere; null: the fabric's own. */
  dyedIn(colour: string | null): void {
    this.colours.select(colour ?? OWN);
  }

  /** Shows the size in which the garment is worn, where it was the server that chose it, or that none was found. */
  wornIn(size: number | null, failed: boolean): void {
    this.worn = size;
    this.failed = failed;
    if (this.wished === "fit" && !this.typed) this.showSize();
  }

  private showSize(): void {
    const size = this.wished === "fit" ? this.worn : this.wished;
    this.size.value = size === null ? "" : String(Math.round(100 * size));
    const fits = this.wished === "fit";
    this.fit.ariaPressed = String(fits);
    const found = this.worn !== null ? "Worn in the size that fits" : this.failed ? "No size that fits was found" : "Looking for the size that fits";
    setText(this.fit, fits ? found : "Find the size that fits");
  }
}

function dyed(tag: "span", kind: string, colour: string): HTMLElement {
  const element = make(tag, kind ? { class: kind } : {});
  element.style.setProperty("--dye", colour);
  return element;
}

/** Text for screen readers only. */
function hidden(text: string): HTMLElement {
  return make("span", { class: "unseen" }, text);
}
