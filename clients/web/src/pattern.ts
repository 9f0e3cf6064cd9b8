import { PatternDesk, type ChosenPlace, type Design, type PlaceKind, type Point } from "@tryon/core";
import type { ChangeStatus, ClientMessage, DesignMessage, EditedMessage, ErrorMessage } from "@tryon/protocol";

import { byId } from "./dom.ts";
import { NoticeBoard, type Notice } from "./notice.ts";
import { PatternDrawing } from "./pattern_drawing.ts";
import type { Chosen } from "./pattern_piece.ts";
import { PatternStatus } from "./pattern_status.ts";
import { PatternTools, type Aim } from "./pattern_tools.ts";

/** A choice in the pattern that is not for an edit. */
interface Choice {
  /** what it is for, for people */
  readonly what: string;
  readonly chosen: (place: ChosenPlace | undefined) => void;
  /** the pattern was shown for this, where it hides from which it was asked for */
  readonly covers: boolean;
}

const NO_PATTERN = "The garment that is edited has no pattern: a mesh has none";

const LET_GO: Notice = {
  title: "What you were dragging was let go",
  message: "Somebody else has changed the parts of the pattern, or another garment is edited now.",
  remedy: "Drag it again, if it is still there.",
};
const NOT_CHOSEN: Notice = {
  title: "Nothing was chosen",
  message: "Another garment is edited now, and its pattern is shown.",
  remedy: "Choose in that one, or have the other one edited again.",
};

/** The sewing pattern beside the picture, to be edited while it is worn. There is none of a garment that is a mesh. */
export class PatternPanel {
  private readonly panel = byId("pattern");
  private readonly toggle = byId("pattern-toggle", HTMLButtonElement);
  private readonly undo = byId("pattern-undo", HTMLButtonElement);
  private readonly redo = byId("pattern-redo", HTMLButtonElement);
  private readonly board = new NoticeBoard("pattern-notice");
  private readonly desk: PatternDesk;
  private readonly drawing: PatternDrawing;
  private readonly tools: PatternTools;
  private readonly changes = new PatternStatus();
  private chosen: Chosen | undefined;
  /** what a tool waits for, to do it to what is chosen */
  private aim: Aim | undefined;
  private choice: Choice | undefined;
  /** what would be chosen, for people */
  private pointed = "";
  private open = false;
  private picture = 0;
  private notes = "";

  /**
   * @param send hands a message to the session
   * @param tell says what concerns more than an edit
   * @param size in which the pattern is worn, over its own
   * @param there told when there is a pattern, and when there is none any more
   */
  constructor(
    send: (message: ClientMessage) => void,
    private readonly tell: (notice: Notice) => void,
    private readonly size: () => number,
    private readonly there: () => void,
  ) {
    this.desk = new PatternDesk({
      send,
      beforePicture: (callback) => {
        const picture = requestAnimationFrame(callback);
        return () => cancelAnimationFrame(picture);
      },
      changed: () => this.changed(),
    });
    const { desk } = this;
    this.drawing = new PatternDrawing(document.querySelector<SVGSVGElement>("#pattern-sheet")!, {
      begin: (panel, grip) => desk.begin(panel, grip),
      drag: (by) => desk.moveBy(by),
      release: () => desk.release(),
      cancel: () => desk.cancel(),
      choose: (chosen) => this.choose(chosen),
      cut: (line) => this.cut(line),
      place: (at, met) => this.place(at, met),
      point: (label) => this.point(label),
      nudge: (panel, grip, by, again) => {
        if ((again && desk.waiting) || !desk.begin(panel, grip)) return;
        desk.moveBy(by);
        desk.release();
      },
    });
    this.tools = new PatternTools(
      (edit) => desk.make(edit),
      (aim) => this.aimAt(aim),
    );
    this.toggle.addEventListener("click", () => this.show(!this.open));
    byId("pattern-close").addEventListener("click", () => {
      this.show(false);
      this.toggle.focus();
    });
    this.undo.addEventListener("click", () => desk.undo(this.changes.underWay));
    this.redo.addEventListener("click", () => desk.redo());
    const mirror = byId("pattern-mirror", HTMLInputElement);
    mirror.addEventListener("change", () => (desk.mirror = mirror.checked));
    window.addEventListener("keydown", (event) => this.key(event));
  }

  /** Takes the pattern as it is worn now. One that can't be drawn is none, and said so. */
  design(message: DesignMessage): void {
    const before = this.desk.design?.garment;
    try {
      if (!this.desk.take(message)) this.tell(LET_GO);
    } catch (error) {
      this.tell({ title: "The pattern can't be shown", message: error instanceof Error ? error.message : String(error) });
      return;
    }
    if (this.choice && this.desk.design?.garment !== before) {
      this.endChoice(undefined);
      this.tell(NOT_CHOSEN);
    }
    if (message.held) {
      this.board.hideFault();
      return;
    }
    const notes = (this.desk.design?.notes ?? []).join("; ");
    if (notes && notes !== this.notes) this.board.show({ title: "What the edit brings along", message: notes, told: true });
    else if (!notes) this.board.hide();
    this.notes = notes;
  }

  /** Takes what is done for the edits that are not worn yet. */
  status(changes: readonly ChangeStatus[]): void {
    this.changes.take(changes);
    this.changed();
  }

  edited(message: EditedMessage): void {
    this.desk.edited(message);
  }

  /** @returns whether it was an edit of this page */
  refused(error: ErrorMessage): boolean {
    if (!this.desk.refused(error)) return false;
    this.board.show({ title: "That edit can't be made", message: error.message, remedy: error.remedy });
    return true;
  }

  /** There is no pattern, or not yet. */
  forget(): void {
    this.drawing.escape();
    this.aimAt(undefined);
    this.desk.forget();
    this.changes.take([]);
    this.board.hide();
    this.notes = "";
  }

  /** Why nothing can be chosen in it; "": something can. */
  get barred(): string {
    return this.desk.design ? "" : NO_PATTERN;
  }

  /**
   * Has somebody choose a place in the pattern, for something else than an edit; shows it, where it is not shown.
   * @param what the choice is for, for people
   * @param chosen told of it, or of none where somebody leaves it
   */
  choosePlace(kind: PlaceKind, what: string, chosen: Choice["chosen"]): void {
    if (this.barred) {
      chosen(undefined);
      return;
    }
    const asks = document.activeElement;
    const shown = this.open;
    this.show(true);
    this.choice = { what, chosen, covers: !shown && !(asks?.checkVisibility() ?? true) };
    this.aimAt(kind);
    this.drawing.focus(this.chosen?.panel);
  }

  private show(open: boolean): void {
    this.drawing.escape();
    this.open = open;
    this.aimAt(undefined);
  }

  /** Ends the choice that is under way, if one is. */
  private endChoice(place: ChosenPlace | undefined): void {
    const { choice } = this;
    if (!choice) return;
    this.choice = undefined;
    if (choice.covers) this.open = false;
    this.aimAt(undefined);
    choice.chosen(place);
  }

  private point(label: string): void {
    if (label === this.pointed) return;
    this.pointed = label;
    if (this.aim) this.changed();
  }

  private choose(chosen: Chosen | undefined): void {
    if (this.choice) {
      this.chosen = chosen;
      const kind = chosen?.edge === undefined ? "piece" : "edge";
      if (chosen && (this.aim === kind || this.aim === "piece")) this.endChoice(this.aim === "piece" ? { panel: chosen.panel } : chosen);
      else this.draw(); // of a piece that is chosen the edges can be reached by keys
      return;
    }
    const from = this.chosen;
    if (this.aim === "sew" && from?.edge !== undefined && chosen?.edge !== undefined) {
      this.desk.make({ kind: "close_seam", panel: from.panel, edge: from.edge, to_panel: chosen.panel, to_edge: chosen.edge });
    }
    this.chosen = chosen;
    this.aimAt(undefined);
  }

  private cut(line: (panel: string) => readonly [Point, Point]): void {
    const panel = this.chosen?.panel;
    if (panel !== undefined) this.desk.make({ kind: "cut", panel, line: line(panel), sewn: this.tools.sewn });
    this.aimAt(undefined);
  }

  private place(at: (panel: string) => Point, met: string | undefined): void {
    if (this.choice) {
      if (met === undefined) return;
      const [x, y] = at(met).map((number) => round(number * this.size()));
      this.endChoice({ panel: met, at: [x, y] });
      return;
    }
    const { aim } = this;
    const panel = this.chosen?.panel;
    if (panel !== undefined && (aim === "patch" || aim === "pocket")) {
      const [width, height] = this.tools.size;
      this.desk.make({ kind: aim, panel, at: at(panel), width, height });
    }
    this.aimAt(undefined);
  }

  private aimAt(aim: Aim | undefined): void {
    if (!isPlace(aim)) this.endChoice(undefined);
    this.aim = aim;
    this.pointed = "";
    this.drawing.aim(aim);
    this.draw();
  }

  /** Draws before the next picture, once however much changes until then. */
  private changed(): void {
    this.picture ||= requestAnimationFrame(() => {
      this.picture = 0;
      this.draw();
    });
  }

  private draw(): void {
    const { design } = this.desk;
    if (this.toggle.hidden === Boolean(design)) this.there();
    this.toggle.hidden = !design;
    this.panel.hidden = !design || !this.open;
    this.toggle.ariaExpanded = String(!this.panel.hidden);
    this.panel.ariaBusy = String(this.desk.waiting);
    this.undo.disabled = !design?.done.length && !this.changes.underWay;
    this.redo.disabled = !design?.undone;
    if (!design || this.panel.hidden) return;
    if (!isThere(design, this.chosen)) {
      this.chosen = undefined;
      if (!this.choice) {
        this.aim = undefined;
        this.drawing.aim(undefined);
      }
    }
    const by = this.desk.draggedBy;
    this.drawing.show(design, this.chosen, !design.held && !by && !this.desk.waiting);
    this.tools.show(design, this.chosen, by, this.aim, this.pointed, this.choice?.what);
  }

  private key(event: KeyboardEvent): void {
    if (this.panel.hidden) return;
    if (event.key === "Escape") {
      if (this.drawing.escape() || this.aim) event.preventDefault();
      if (this.aim) this.aimAt(undefined);
    }
    const writing = event.target instanceof HTMLInputElement && event.target.type !== "checkbox" && event.target.type !== "radio";
    if (writing || event.altKey || !(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    event.preventDefault();
    if (event.shiftKey) this.desk.redo();
    else this.desk.undo(this.changes.underWay);
  }
}

function isThere(design: Design, chosen: Chosen | undefined): boolean {
  const panel = design.panels.find(({ name }) => name === chosen?.panel);
  return panel !== undefined && (chosen?.edge === undefined || chosen.edge < panel.edges.length);
}

function isPlace(aim: Aim | undefined): aim is PlaceKind {
  return aim === "edge" || aim === "piece" || aim === "spot";
}

/** A place as it is told: to a tenth of a millimetre. */
function round(metres: number): number {
  return Math.round(1e4 * metres) / 1e4;
}
