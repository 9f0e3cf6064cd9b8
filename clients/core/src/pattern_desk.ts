import type { ClientMessage, DesignMessage, DesignPanel, EditedMessage, ErrorMessage } from "@tryon/protocol";

import { readDesign, sameParts, type Design, type Point } from "./pattern_design.ts";
import { moveGrip, type PatternEdit } from "./pattern_edit.ts";
import { placeOf, withGripAt, type Grip } from "./pattern_shape.ts";

/** What surrounds a desk: the connection, the display and who draws. */
export interface DeskSurroundings {
  send(message: ClientMessage): void;
  /** calls back once before the next picture; returns what cancels it */
  beforePicture(callback: () => void): () => void;
  /** what is to be seen has changed */
  changed(): void;
}

/** A grip that is elsewhere than the server's pattern has it. */
interface Moved {
  readonly panel: string;
  readonly grip: Grip;
  place: Point;
}

interface Drag extends Moved {
  /** its piece, and where it was, in the pattern that is kept */
  piece: DesignPanel;
  origin: Point;
  by: Point;
  /** the server has been asked to show it */
  held: boolean;
  cancelPicture: (() => void) | undefined;
}

/** A drag that was let go and that the server has not answered. */
interface Released extends Moved {
  readonly request: number;
  readonly held: boolean;
}

/** moves shorter than this are none [m] */
const NOWHERE = 1e-6;

/**
 * Where a sewing pattern is edited: keeps the pattern that the server tells, shows what is dragged at once, and says what
 * is dragged at most once per picture, as an edit that is held; on letting go the same edit is made for good.
 */
export class PatternDesk {
  /** do the same on the symmetric piece, or side */
  mirror = false;
  /** the pattern as it is kept, and as it was told last: while somebody drags, that is not kept */
  private kept: Design | undefined;
  private newest: Design | undefined;
  private drag: Drag | undefined;
  private released: Released | undefined;
  private requests = 0;
  private readonly asked = new Set<number>();

  constructor(private readonly around: DeskSurroundings) {}

  /** The pattern with what this page drags; nothing while none is known. */
  get design(): Design | undefined {
    const moved = this.drag ?? this.released;
    if (!this.newest || !moved) return this.newest;
    const panels = this.newest.panels.map((panel) =>
      panel.name === moved.panel ? withGripAt(this.unbent(panel, moved.grip), moved.grip, moved.place) : panel,
    );
    return { ...this.newest, panels };
  }

  /** How far the grip that is being dragged has come [m]; nothing when none is. */
  get draggedBy(): Point | undefined {
    return this.drag?.by;
  }

  /** Whether edits were asked for that the server has not answered. */
  get waiting(): boolean {
    return this.asked.size > 0;
  }

  /**
   * Takes what the server tells.
   * @returns whether what is dragged could go on; it can't in another garment, or in other parts
   * @throws Error when it can't be drawn; then there is no pattern
   */
  take(message: DesignMessage): boolean {
    const before = this.newest;
    this.newest = undefined;
    try {
      this.newest = readDesign(message);
    } finally {
      if (!this.newest) this.forget();
    }
    if (!message.held) {
      this.kept = this.newest;
      this.released = undefined;
    }
    const goesOn = !this.drag || (before?.garment === this.newest.garment && sameParts(before, this.newest));
    if (!goesOn) this.cancel();
    if (this.drag && !message.held) this.carryOver(this.drag);
    this.around.changed();
    return goesOn;
  }

  /** There is no pattern any more: another session, or a connection that was lost. */
  forget(): void {
    this.drag?.cancelPicture?.();
    this.kept = this.newest = this.drag = this.released = undefined;
    this.asked.clear();
    this.around.changed();
  }

  edited({ request }: EditedMessage): void {
    if (typeof request === "number") this.asked.delete(request);
    this.around.changed();
  }

  /** An edit was refused: what was shown of it is taken back. @returns whether it was asked for here */
  refused({ request }: ErrorMessage): boolean {
    if (typeof request !== "number" || request > this.requests) return false;
    this.asked.delete(request);
    if (this.released?.request === request) {
      if (this.released.held) this.drop();
      this.released = undefined;
      this.newest = this.kept ?? this.newest;
    }
    this.around.changed();
    return true;
  }

  /** Begins to drag a grip. @returns whether there is such a one */
  begin(panel: string, grip: Grip): boolean {
    if (this.drag) return false;
    const piece = this.piece(panel);
    const origin = piece && placeOf(piece, grip);
    if (!origin) return false;
    this.newest = this.design; // what was let go stays where it is until the server answers
    this.drag = { panel, grip, piece, origin, place: origin, by: [0, 0], held: false, cancelPicture: undefined };
    return true;
  }

  /** @param by from where the drag began, in the piece's plane [m] */
  moveBy(by: Point): void {
    const { drag } = this;
    if (!drag) return;
    drag.by = by;
    drag.place = [drag.origin[0] + by[0], drag.origin[1] + by[1]];
    drag.cancelPicture ??= this.around.beforePicture(() => {
      drag.cancelPicture = undefined;
      drag.held = true;
      this.sendEdit(moveGrip(drag.piece, drag.grip, drag.by), true);
    });
    this.around.changed();
  }

  /** Lets go: what was dragged is kept. */
  release(): void {
    const { drag } = this;
    if (!drag) return;
    const edit = moveGrip(drag.piece, drag.grip, drag.by);
    if (Math.hypot(...drag.by) < NOWHERE || (edit.kind === "lengthen" && Math.abs(edit.by) < NOWHERE)) {
      this.cancel();
      return;
    }
    const { panel, grip, place, held } = drag;
    this.endDrag(drag);
    this.released = { panel, grip, place, held, request: this.make(edit) };
    this.around.changed();
  }

  /** Drops what is being dragged: it is again where it was. */
  cancel(): void {
    const { drag } = this;
    if (!drag) return;
    this.endDrag(drag);
    if (drag.held) this.drop();
    this.newest = this.kept ?? this.newest;
    this.around.changed();
  }

  /** Makes an edit for good. @returns the number by which it is answered */
  make(edit: PatternEdit): number {
    return this.ask(this.sendEdit(edit, false));
  }

  /** Takes the last edit back; one that is `underWay`, and not worn yet, is one, too. */
  undo(underWay = false): void {
    if (!this.kept || this.drag || (!this.kept.done.length && !this.asked.size && !underWay)) return;
    const request = this.next();
    this.around.send({ type: "undo", ...this.whose, request });
    this.ask(request);
  }

  /** Makes again the edit that was taken back last. */
  redo(): void {
    if (!this.kept?.undone || this.drag) return;
    const request = this.next();
    this.around.send({ type: "redo", ...this.whose, request });
    this.ask(request);
  }

  private piece(name: string): DesignPanel | undefined {
    return this.design?.panels.find((panel) => panel.name === name);
  }

  /** The piece with the edge of a handle as it is kept: bent flat, the server may tell it as one with other handles. */
  private unbent(panel: DesignPanel, grip: Grip): DesignPanel {
    const edge = grip.kind === "handle" ? this.kept?.panels.find(({ name }) => name === panel.name)?.edges.at(grip.edge) : undefined;
    return edge ? { ...panel, edges: panel.edges.map((told, i) => (grip.kind === "handle" && i === grip.edge ? edge : told)) } : panel;
  }

  /** The pattern below a drag has become another one: the drag counts from there. */
  private carryOver(drag: Drag): void {
    const panel = this.kept?.panels.find(({ name }) => name === drag.panel);
    drag.piece = panel ?? drag.piece;
    drag.origin = placeOf(drag.piece, drag.grip) ?? drag.origin;
    drag.place = [drag.origin[0] + drag.by[0], drag.origin[1] + drag.by[1]];
  }

  private endDrag(drag: Drag): void {
    drag.cancelPicture?.();
    this.drag = undefined;
  }

  /** The server shows again what is kept. */
  private drop(): void {
    this.around.send({ type: "edit", edit: null, hold: true, request: this.next() });
  }

  private sendEdit(edit: PatternEdit, hold: boolean): number {
    const request = this.next();
    this.around.send({ type: "edit", edit, mirror: this.mirror, hold, ...this.whose, request });
    return request;
  }

  /** The garment whose pattern is shown: somebody else may have another one edited meanwhile. */
  private get whose(): { garment?: string } {
    return this.newest?.garment ? { garment: this.newest.garment } : {};
  }

  private ask(request: number): number {
    this.asked.add(request);
    this.around.changed();
    return request;
  }

  private next(): number {
    this.requests += 1;
    return this.requests;
  }
}
