import { lengthOf, sewnTo, type Design, type PatternEdit, type PlaceKind, type Point } from "@tryon/core";

import { byId, make, setText } from "./dom.ts";
import { nameOf, type Chosen } from "./pattern_piece.ts";

const HINT = "Drag a corner or a curve's handle; choose an edge or a piece for more";
const AIMED: Readonly<Record<Aim, string>> = {
  sew: "Choose the edge to sew it to; Escape leaves it open",
  cut: "Draw a line across the piece, from outside to outside; Escape leaves it whole",
  patch: "Choose the place of the patch's middle on the piece; Escape takes none",
  pocket: "Choose the place of the pocket's middle on the piece; Escape takes none",
  edge: "Choose an edge; Escape takes none",
  piece: "Choose a piece; Escape takes none",
  spot: "Choose a spot on a piece; Escape takes none",
};

/** What is waited for: by a tool, the edge to sew to, a line to cut along, a place to sew something on; by who chooses
 * a place for something else than an edit, that. */
export type Aim = "sew" | "cut" | "patch" | "pocket" | PlaceKind;

/** Measures of a body, as an edit names them. */
const MEASURES = ["chest", "waist", "hip", "height"];

/** What edits are called; one that is not known here is shown by its own name. */
const MADE: Readonly<Record<string, string>> = {
  move_vertex: "Corner moved",
  move_handle: "Curve bent",
  lengthen: "Edge moved",
  take_in: "Seam taken in or let out",
  scale_piece: "Piece scaled",
  scale_garment: "Garment scaled",
  gather: "Seam gathered",
  ease: "Seam eased",
  open_seam: "Seam opened",
  close_seam: "Seam closed",
  cut: "Piece cut",
  dart: "Dart added",
  patch: "Patch sewn on",
  pocket: "Pocket sewn on",
  remove_piece: "Piece removed",
  change_fabric: "Fabric changed",
};

/** A kind of edits in words for people. */
export function madeBy(kind: string): string {
  return Object.hasOwn(MADE, kind) ? MADE[kind] : kind.replaceAll("_", " ");
}

/** What can be done to the edge or the piece that is chosen, by numbers, and the list of what was done. */
export class PatternTools {
  private readonly sentence = byId("pattern-chosen");
  private readonly leave = byId("pattern-leave", HTMLButtonElement);
  private readonly hem = byId("pattern-hem", HTMLFormElement);
  private readonly seam = byId("pattern-seam", HTMLFormElement);
  private readonly gather = byId("pattern-gather", HTMLFormElement);
  private readonly ease = byId("pattern-ease", HTMLFormElement);
  private readonly dart = byId("pattern-dart", HTMLFormElement);
  private readonly piece = byId("pattern-piece", HTMLFormElement);
  private readonly cut = byId("pattern-cut", HTMLFormElement);
  private readonly patch = byId("pattern-patch", HTMLFormElement);
  private readonly measures = byId("pattern-measures", HTMLFormElement);
  private readonly garment = byId("pattern-garment", HTMLFormElement);
  private readonly made = byId("pattern-made", HTMLDetailsElement);
  private chosen: Chosen | undefined;
  private listed: Design["done"] = [];

  /**
   * @param make makes an edit
   * @param aim has the drawing wait for what an edit needs besides; or no more
   */
  constructor(make: (edit: PatternEdit) => void, aim: (aim: Aim | undefined) => void) {
    this.leave.addEventListener("click", () => aim(undefined));
    const takes = (form: HTMLFormElement, edit: (panel: string, edge: number, value: string) => PatternEdit | Aim) => {
      form.addEventListener("submit", (event) => {
        event.preventDefault();
        const value = event.submitter instanceof HTMLButtonElement ? event.submitter.value : "";
        const wanted = edit(this.chosen?.panel ?? "", this.chosen?.edge ?? 0, value);
        if (typeof wanted === "string") aim(wanted);
        else make(wanted);
      });
    };
    takes(this.hem, (panel, edge, value) => {
      if (value === "sew") return "sew";
      return { kind: "lengthen", panel, edge, by: (Number(value) * numbers(this.hem)[0]) / 100 };
    });
    takes(this.seam, (panel, edge, value) => {
      if (value === "open") return { kind: "open_seam", panel, edge };
      return { kind: "take_in", panel, edge, by: (Number(value) * numbers(this.seam)[0]) / 100 };
    });
    takes(this.gather, (panel, edge) => {
      const [to] = numbers(this.gather);
      return Number.isNaN(to) ? { kind: "gather", panel, edge } : { kind: "gather", panel, edge, to: to / 100 };
    });
    takes(this.ease, (panel, edge) => {
      const [by] = numbers(this.ease);
      return Number.isNaN(by) ? { kind: "ease", panel, edge } : { kind: "ease", panel, edge, by: by / 1000 };
    });
    takes(this.dart, (panel, edge) => {
      const [width, depth, position] = numbers(this.dart).map((number) => number / 100);
      return { kind: "dart", panel, edge, position, width, depth };
    });
    takes(this.piece, (panel) => ({ kind: "scale_piece", panel, factors: factors(this.piece) }));
    takes(this.cut, (panel, _, value) => (value === "remove" ? { kind: "remove_piece", panel } : "cut"));
    takes(this.patch, (_panel, _edge, value) => (value === "patch" ? "patch" : "pocket"));
    byId("pattern-bodies").append(...MEASURES.map(measure));
    takes(this.measures, () => bodies(this.measures));
    takes(this.garment, () => ({ kind: "scale_garment", factors: factors(this.garment) }));
  }

  /** Whether the parts of a piece that is cut are sewn together. */
  get sewn(): boolean {
    return this.cut.querySelector("input")?.checked ?? false;
  }

  /** Width and height of what is sewn on a piece [m]. */
  get size(): Point {
    return factors(this.patch);
  }

  /**
   * Offers what can be done to what is chosen.
   * @param by how far a grip is being dragged [m], if one is
   * @param aim what is waited for
   * @param pointed of what would be chosen
   * @param what the choice is for, where it is not for an edit
   */
  show(design: Design, chosen: Chosen | undefined, by: Point | undefined, aim: Aim | undefined, pointed = "", what = ""): void {
    this.chosen = chosen;
    const index = design.panels.findIndex(({ name }) => name === chosen?.panel);
    const edge = chosen?.edge === undefined ? undefined : design.panels[index].edges.at(chosen.edge);
    const sewn = chosen?.edge === undefined ? undefined : sewnTo(design, index, chosen.edge);
    const edits = what === "";
    this.leave.hidden = aim === undefined;
    this.hem.hidden = !edits || !edge || sewn !== undefined;
    this.seam.hidden = this.gather.hidden = this.ease.hidden = !edits || sewn === undefined;
    this.dart.hidden = !edits || edge === undefined;
    this.piece.hidden = this.cut.hidden = this.patch.hidden = !edits || !chosen || edge !== undefined;
    this.garment.hidden = this.measures.hidden = !edits || chosen !== undefined;
    const name = chosen ? nameOf(chosen.panel) : "";
    if (aim) setText(this.sentence, `${what && `${what}: `}${pointed || AIMED[aim]}`);
    else if (by) setText(this.sentence, `${name}: ${moved(by[0], "right", "left")}, ${moved(by[1], "up", "down")}`);
    else if (edge) {
      const to = sewn ? `seam ${sewn.seam} to ${nameOf(design.panels[sewn.panel].name)}` : "open";
      setText(this.sentence, `Edge ${chosen?.edge ?? ""} of ${name}: ${(100 * lengthOf(edge)).toFixed(1)} cm, ${to}`);
    } else setText(this.sentence, chosen ? `Piece ${name}` : HINT);
    this.list(design);
  }

  private list({ done }: Design): void {
    if (done === this.listed) return;
    this.listed = done;
    this.made.hidden = done.length === 0;
    setText(this.made.querySelector("summary")!, done.length === 1 ? "1 edit made" : `${done.length} edits made`);
    const items = done.map(({ kind, panel }) => {
      return make("li", {}, panel ? `${madeBy(kind)}: ${nameOf(panel)}` : madeBy(kind));
    });
    this.made.querySelector("ol")!.replaceChildren(...items);
  }
}

function numbers(form: HTMLFormElement): number[] {
  return [...form.querySelectorAll<HTMLInputElement>("input[type=number]")].map((input) => input.valueAsNumber);
}

/** Where a measure of two bodies is told [cm]. */
function measure(name: string): HTMLElement {
  const input = (whose: string): HTMLElement =>
    make("input", { type: "number", min: "20", max: "300", step: "any", "aria-label": `${name}, ${whose}, cm` });
  return make("label", {}, `${name} `, input("made for"), " → ", input("wanted"));
}

/** The edit that scales the garment from one body to another: what is told of both, in centimetres. */
function bodies(form: HTMLFormElement): PatternEdit {
  const given = numbers(form);
  const told = (second: 0 | 1): Record<string, number> =>
    Object.fromEntries(MEASURES.map((name, k) => [name, given[2 * k + second] / 100] as const).filter(([, length]) => !Number.isNaN(length)));
  return { kind: "scale_garment", made_for: told(0), wanted: told(1) };
}

/** Width and height in per cent, as factors. */
function factors(form: HTMLFormElement): Point {
  const [width, height] = numbers(form);
  return [width / 100, height / 100];
}

function moved(by: number, ahead: string, back: string): string {
  return `${(100 * Math.abs(by)).toFixed(1)} cm ${by < 0 ? back : ahead}`;
}
