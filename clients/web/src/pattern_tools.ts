import { lengthOf, sewnTo, type Design, type PatternEdit, type Point } from "@tryon/core";

import { byId, make, setText } from "./dom.ts";
import { nameOf, type Chosen } from "./pattern_piece.ts";

const HINT = "Drag a corner or a curve's handle; choose an edge or a piece for more";

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
  remove_piece: "Piece removed",
};

/** What can be done to the edge or the piece that is chosen, by numbers, and the list of what was done. */
export class PatternTools {
  private readonly sentence = byId("pattern-chosen");
  private readonly hem = byId("pattern-hem", HTMLFormElement);
  private readonly seam = byId("pattern-seam", HTMLFormElement);
  private readonly piece = byId("pattern-piece", HTMLFormElement);
  private readonly made = byId("pattern-made", HTMLDetailsElement);
  private chosen: Chosen | undefined;
  private listed: Design["done"] = [];

  constructor(private readonly make: (edit: PatternEdit) => void) {
    this.takes(this.hem, (panel, edge, value) => ({ kind: "lengthen", panel, edge, by: (Number(value) * this.numbers(this.hem)[0]) / 100 }));
    this.takes(this.seam, (panel, edge, value) => {
      if (value === "open") return { kind: "open_seam", panel, edge };
      return { kind: "take_in", panel, edge, by: (Number(value) * this.numbers(this.seam)[0]) / 100 };
    });
    this.takes(this.piece, (panel) => {
      const [width, height] = this.numbers(this.piece);
      return { kind: "scale_piece", panel, factors: [width / 100, height / 100] };
    });
  }

  /** Offers what can be done to what is chosen. @param by how far a grip is being dragged [m], if one is */
  show(design: Design, chosen: Chosen | undefined, by: Point | undefined): void {
    this.chosen = chosen;
    const index = design.panels.findIndex(({ name }) => name === chosen?.panel);
    const edge = chosen?.edge === undefined ? undefined : design.panels[index].edges.at(chosen.edge);
    const sewn = chosen?.edge === undefined ? undefined : sewnTo(design, index, chosen.edge);
    this.hem.hidden = !edge || sewn !== undefined;
    this.seam.hidden = sewn === undefined;
    this.piece.hidden = !chosen || edge !== undefined;
    const name = chosen ? nameOf(chosen.panel) : "";
    if (by) setText(this.sentence, `${name}: ${moved(by[0], "right", "left")}, ${moved(by[1], "up", "down")}`);
    else if (edge) {
      const to = sewn ? `seam ${sewn.seam + 1} to ${nameOf(design.panels[sewn.panel].name)}` : "open";
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
      const what = Object.hasOwn(MADE, kind) ? MADE[kind] : kind.replaceAll("_", " ");
      return make("li", {}, panel ? `${what}: ${nameOf(panel)}` : what);
    });
    this.made.querySelector("ol")!.replaceChildren(...items);
  }

  /** On a form's sending makes the edit that it stands for. @param edit told the value of the button that was used */
  private takes(form: HTMLFormElement, edit: (panel: string, edge: number, value: string) => PatternEdit): void {
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const button = event.submitter;
      if (this.chosen) this.make(edit(this.chosen.panel, this.chosen.edge ?? 0, button instanceof HTMLButtonElement ? button.value : ""));
    });
  }

  private numbers(form: HTMLFormElement): number[] {
    return [...form.querySelectorAll("input")].map((input) => input.valueAsNumber);
  }
}

function moved(by: number, ahead: string, back: string): string {
  return `${(100 * Math.abs(by)).toFixed(1)} cm ${by < 0 ? back : ahead}`;
}
