import { layOut, type Design, type Grip, type Layout, type Point } from "@tryon/core";

import { PieceDrawing, type Chosen } from "./pattern_piece.ts";
import type { Aim } from "./pattern_tools.ts";
import { put, svg } from "./svg.ts";

/** Who is told what is done to the drawing. */
export interface DrawingEvents {
  /** @returns whether the grip can be dragged now */
  begin(panel: string, grip: Grip): boolean;
  /** @param by from where the drag began, in the piece's plane [m] */
  drag(by: Point): void;
  release(): void;
  cancel(): void;
  choose(chosen: Chosen | undefined): void;
  /** a line was drawn to cut along; it is told in the plane of the piece that is named [m] */
  cut(line: (panel: string) => readonly [Point, Point]): void;
  /** a place was chosen, on the piece that is `met` if any is; it is told in the plane of the piece that is named [m] */
  place(at: (panel: string) => Point, met: string | undefined): void;
  /** this would be chosen, for people; "": nothing */
  point(label: string): void;
  /** a grip was moved by keys; `again`: the key is held down */
  nudge(panel: string, grip: Grip, by: Point, again: boolean): void;
}

interface Press {
  readonly pointer: number;
  readonly from: Point;
  moved: boolean;
  /** of one that draws a line to cut along */
  readonly cut?: SVGLineElement;
  /** begins the drag of an edge, once it is moved */
  begin?: (() => boolean) | undefined;
  /** where the pointer is [px] */
  at: Point;
  /** how far the sheet has gone on below what is held at its border [px] */
  gone: Point;
  /** the next picture, before which it goes on */
  picture?: number | undefined;
}

/** How near a grip is met [px]. */
const REACH: Readonly<Record<string, number>> = { mouse: 9, pen: 13, touch: 22 };
/** a pointer that moves less has clicked [px] */
const STILL = 3;
/** between pieces and to the border: at most, and of the room's smaller side [px, 1] */
const GAP = 26;
const GAP_SHARE = 0.06;
/** a key's move, without and with Shift [m] */
const NUDGE = 0.001;
const NUDGE_FAR = 0.01;
/** a key's move of a place that is being chosen, without and with Shift [m] */
const STEP = 0.01;
const STEP_FAR = 0.05;
/** half of the cross that marks it [px] */
const CROSS = 7;
/** what is dragged is held so far from the sheet's border [px] */
const BORDER = 8;
/** the sheet goes on before a picture by so much of how far the pointer is beyond that, at most [1, px] */
const GOES_ON = 0.2;
const GOES_ON_MOST = 14;
const ARROWS: Readonly<Record<string, Point>> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * The drawing of a pattern: all its pieces on one sheet, and what pointer and keys do to them. A pattern with the same
 * parts is drawn over the one before, so that focus and a drag stay where they are.
 */
export class PatternDrawing {
  private pieces: readonly PieceDrawing[] = [];
  private parts = "";
  private layout: Layout = { scale: 0, origins: [] };
  private press: Press | undefined;
  private design: Design | undefined;
  private chosen: Chosen | undefined;
  private aimed: Aim | undefined;
  /** marks the place that would be chosen */
  private readonly cross = svg("path", { class: "cross" });
  /** where it was moved to by keys, in the piece's plane [m] */
  private crossed: { piece: PieceDrawing; at: Point } | undefined;

  constructor(
    private readonly sheet: SVGSVGElement,
    private readonly events: DrawingEvents,
  ) {
    sheet.addEventListener("pointerdown", (event) => this.down(event));
    sheet.addEventListener("pointermove", (event) => this.move(event));
    sheet.addEventListener("pointerup", (event) => this.up(event));
    sheet.addEventListener("pointercancel", (event) => {
      if (event.pointerId === this.press?.pointer) this.escape();
    });
    sheet.addEventListener("keydown", (event) => this.key(event));
    sheet.addEventListener("pointerover", (event) => this.point(event.target));
    sheet.addEventListener("focusin", (event) => this.point(event.target));
    for (const left of ["pointerleave", "focusout"]) sheet.addEventListener(left, () => this.point(null));
    new ResizeObserver(() => this.fit()).observe(sheet);
  }

  /** Draws a pattern. @param settled it is not one that is being dragged: pieces may be laid out anew */
  show(design: Design, chosen: Chosen | undefined, settled: boolean): void {
    this.design = design;
    const handles = design.panels.map(({ name, vertices, edges }) => [name, vertices.length, edges.map((edge) => edge.handles.length)]);
    const parts = JSON.stringify([handles, design.seams, design.patches.map(({ panel, host }) => [panel, host])]);
    if (parts !== this.parts) {
      this.parts = parts;
      this.pieces = design.panels.map((_, i) => new PieceDrawing(design, i));
      this.sheet.replaceChildren(...this.pieces.map(({ element }) => element));
      if (this.layout.origins.length !== design.panels.length) this.escape();
      if (this.press) this.draw();
      else this.fit();
    } else if (settled) this.fit();
    else this.draw();
    this.mark(chosen);
  }

  /** Marks what is chosen. */
  mark(chosen: Chosen | undefined): void {
    this.chosen = chosen;
    for (const piece of this.pieces) piece.mark(chosen?.panel === this.nameOf(piece) ? chosen : undefined);
  }

  /** Waits for what a tool needs. */
  aim(aim: Aim | undefined): void {
    this.aimed = aim;
    this.sheet.classList.toggle("cutting", aim === "cut");
    this.sheet.classList.toggle("sewing", aim === "sew");
    this.sheet.classList.toggle("placing", this.places);
    this.sheet.classList.toggle("choosing-edge", aim === "edge");
    this.sheet.classList.toggle("choosing-piece", aim === "piece");
    this.uncross();
  }

  /** Has the keys go to a piece, or to the first one. */
  focus(panel: string | undefined): void {
    (this.pieces.find((piece) => this.nameOf(piece) === panel) ?? this.pieces.at(0))?.focus();
  }

  /** Is a place waited for? */
  private get places(): boolean {
    return this.aimed === "patch" || this.aimed === "pocket" || this.aimed === "spot";
  }

  /** Tells what would be chosen: of what is pointed at, or has the keys. */
  private point(target: EventTarget | null): void {
    const piece = this.aimed && target instanceof Element ? this.pieceOf(target) : undefined;
    const wanted = piece && target instanceof Element ? piece.labelOf(target, this.aimed === "edge" || this.aimed === "sew") : "";
    this.events.point(wanted ?? "");
  }

  /** Lays the pieces out in the room there is; not below a finger that has one. */
  private fit(): void {
    if (!this.design || this.press) return;
    const { clientWidth: width, clientHeight: height } = this.sheet;
    this.layout = layOut(this.design.panels, width, height, Math.min(GAP, GAP_SHARE * Math.min(width, height)));
    this.draw();
  }

  private draw(): void {
    const { design, layout } = this;
    if (!design) return;
    for (const piece of this.pieces) piece.update(design, { scale: layout.scale, origin: layout.origins[piece.index] });
  }

  private down(event: PointerEvent): void {
    if (this.press || event.button !== 0 || !(event.target instanceof Element)) return;
    if (this.aimed === "cut") {
      this.beginCut(event);
      return;
    }
    if (this.places) {
      const inPiece = this.inPiece();
      const met = this.pieceOf(event.target);
      this.events.place((panel) => inPiece(panel, [event.clientX, event.clientY]), met && this.nameOf(met));
      return;
    }
    const met = this.aimed ? undefined : this.meet(event);
    if (!met) {
      this.events.choose(this.meant(event.target));
      return;
    }
    const panel = this.nameOf(met.piece);
    const begin = (): boolean => this.events.begin(panel, met.grip);
    const edge = met.grip.kind === "edge"; // which is mostly pressed to be chosen
    if (!edge && !begin()) return;
    const from: Point = [event.clientX, event.clientY];
    this.press = { pointer: event.pointerId, from, at: from, gone: [0, 0], moved: false, ...(edge ? { begin } : {}) };
    this.sheet.setPointerCapture(event.pointerId);
    event.preventDefault(); // the focus is the grip's, whatever lies below the pointer
    this.events.choose(met.grip.kind === "vertex" ? this.ofPiece(panel) : { panel, edge: met.grip.edge });
    met.piece.elementOf(met.grip)?.focus({ preventScroll: true });
  }

  private move(event: PointerEvent): void {
    const { press } = this;
    if (this.places && !press) this.hover(event);
    if (event.pointerId !== press?.pointer || this.layout.scale <= 0) return;
    const [x, y] = [event.clientX - press.from[0], event.clientY - press.from[1]];
    press.moved ||= Math.hypot(x, y) >= STILL;
    if (press.moved && press.begin) {
      if (!press.begin()) {
        this.letGo(() => undefined);
        return;
      }
      press.begin = undefined;
    }
    press.at = [event.clientX, event.clientY];
    if (press.cut) put(press.cut, this.onSheet(press.at, "2"));
    else if (press.moved) this.drag(press);
  }

  /** Has what is dragged follow the pointer, as far as the sheet's border: held there, the sheet goes on below it. */
  private drag(press: Press): void {
    const held = this.heldAt(press);
    const [x, y] = [0, 1].map((k) => held[k] - press.from[k] - press.gone[k]);
    this.events.drag([x / this.layout.scale, -y / this.layout.scale]);
    if (held[0] === press.at[0] && held[1] === press.at[1]) return;
    press.picture ??= requestAnimationFrame(() => {
      press.picture = undefined;
      if (this.press === press) this.goOn(press);
    });
  }

  private goOn(press: Press): void {
    const held = this.heldAt(press);
    const [x, y] = [0, 1].map((k) => {
      const by = GOES_ON * (held[k] - press.at[k]);
      return Math.max(-GOES_ON_MOST, Math.min(by, GOES_ON_MOST));
    });
    press.gone = [press.gone[0] + x, press.gone[1] + y];
    this.layout = { ...this.layout, origins: this.layout.origins.map((origin) => [origin[0] + x, origin[1] + y]) };
    this.draw();
    this.drag(press);
  }

  /** Where in the window what is dragged is held [px]: at the pointer, or at the border, where it does not begin beyond. */
  private heldAt({ at, from }: Press): Point {
    const { left, top, right, bottom } = this.sheet.getBoundingClientRect();
    return [
      Math.max(Math.min(left + BORDER, from[0]), Math.min(at[0], Math.max(right - BORDER, from[0]))),
      Math.max(Math.min(top + BORDER, from[1]), Math.min(at[1], Math.max(bottom - BORDER, from[1]))),
    ];
  }

  private up(event: PointerEvent): void {
    const { press } = this;
    if (event.pointerId !== press?.pointer) return;
    this.move(event);
    if (this.press !== press) return; // it could not be begun
    const { moved, cut, from, begin } = press;
    if (cut) this.letGo(() => moved && this.endCut(from, [event.clientX, event.clientY]));
    else if (begin) this.letGo(() => undefined);
    else this.letGo(() => (moved ? this.events.release() : this.events.cancel()));
  }

  /** Ends the drag that is under way, if one is, without keeping it. */
  escape(): boolean {
    const { press } = this;
    if (!press) return false;
    this.letGo(() => !press.cut && !press.begin && this.events.cancel());
    return true;
  }

  private beginCut(event: PointerEvent): void {
    const from: Point = [event.clientX, event.clientY];
    const cut = svg("line", { class: "scissors", ...this.onSheet(from, "1"), ...this.onSheet(from, "2") });
    this.sheet.append(cut);
    this.press = { pointer: event.pointerId, from, at: from, gone: [0, 0], moved: false, cut };
    this.sheet.setPointerCapture(event.pointerId);
    event.preventDefault();
  }

  private endCut(from: Point, to: Point): void {
    const inPiece = this.inPiece();
    this.events.cut((panel) => [inPiece(panel, from), inPiece(panel, to)]);
  }

  /** Tells of a place in the window [px] where it is in a piece's plane [m]. */
  private inPiece(): (panel: string, at: Point) => Point {
    const sheet = this.sheet.getBoundingClientRect();
    const { scale, origins } = this.layout;
    return (panel, [x, y]) => {
      const origin = origins[this.pieces.find((piece) => this.nameOf(piece) === panel)?.index ?? 0];
      return [(x - sheet.left - origin[0]) / scale, (origin[1] + sheet.top - y) / scale];
    };
  }

  /** Marks the place below the pointer, where it is on a piece. */
  private hover(event: PointerEvent): void {
    this.uncross();
    if (!(event.target instanceof Element) || !this.pieceOf(event.target)) return;
    const sheet = this.sheet.getBoundingClientRect();
    this.drawCross([event.clientX - sheet.left, event.clientY - sheet.top]);
  }

  private drawCross([x, y]: Point): void {
    put(this.cross, { d: `M${x - CROSS} ${y}h${2 * CROSS}M${x} ${y - CROSS}v${2 * CROSS}` });
    this.sheet.append(this.cross);
  }

  private uncross(): void {
    this.crossed = undefined;
    this.cross.remove();
  }

  /** A place of a piece is chosen by keys: from its middle on arrows move it; a corner is one. @returns whether it was */
  private keyPlace(event: KeyboardEvent, piece: PieceDrawing, arrow: Point | undefined): boolean {
    const panel = this.nameOf(piece);
    if (this.aimed !== "spot" && panel !== this.chosen?.panel) return false; // what is sewn on is sewn on that
    const vertices = this.design?.panels[piece.index].vertices ?? [];
    const grip = event.target instanceof Element ? piece.gripOf(event.target) : undefined;
    const begun = this.crossed?.piece === piece ? this.crossed.at : undefined;
    const enter = event.key === "Enter" || event.key === " ";
    if (enter && grip?.kind === "vertex") this.events.place(() => vertices[grip.vertex], panel);
    else if (enter && begun) this.events.place(() => begun, panel);
    else if (enter) this.crossAt(piece, middleOf(vertices));
    else if (begun && arrow) {
      const far = event.shiftKey ? STEP_FAR : STEP;
      this.crossAt(piece, [begun[0] + arrow[0] * far, begun[1] + arrow[1] * far]);
    } else return false;
    return true;
  }

  private crossAt(piece: PieceDrawing, at: Point): void {
    this.crossed = { piece, at };
    const [x, y] = this.layout.origins[piece.index];
    this.drawCross([x + this.layout.scale * at[0], y - this.layout.scale * at[1]]);
  }

  /** Attributes of one end of a line, of a place in the window [px]. */
  private onSheet([x, y]: Point, end: "1" | "2"): Readonly<Record<string, number>> {
    const sheet = this.sheet.getBoundingClientRect();
    return { [`x${end}`]: x - sheet.left, [`y${end}`]: y - sheet.top };
  }

  private letGo(told: () => unknown): void {
    const { press } = this;
    this.press = undefined;
    if (press?.picture !== undefined) cancelAnimationFrame(press.picture);
    press?.cut?.remove();
    if (press && this.sheet.hasPointerCapture(press.pointer)) this.sheet.releasePointerCapture(press.pointer);
    told();
  }

  private key(event: KeyboardEvent): void {
    if (!(event.target instanceof Element) || event.ctrlKey || event.metaKey || event.altKey) return;
    const piece = this.pieceOf(event.target);
    if (!piece) return;
    const grip = piece.gripOf(event.target);
    const arrow = ARROWS[event.key] as Point | undefined;
    if (this.places) {
      if (!this.keyPlace(event, piece, arrow)) return;
    } else if (grip && arrow && !this.aimed) {
      const far = event.shiftKey ? NUDGE_FAR : NUDGE;
      this.events.nudge(this.nameOf(piece), grip, [arrow[0] * far, arrow[1] * far], event.repeat);
    } else if (!grip && (event.key === "Enter" || event.key === " ")) this.events.choose(this.meant(event.target));
    else return;
    event.preventDefault();
  }

  /** The grip nearest to a pointer, if it is in reach, of two at one place the one drawn last; else the edge below it. */
  private meet(event: PointerEvent): { piece: PieceDrawing; grip: Grip } | undefined {
    const sheet = this.sheet.getBoundingClientRect();
    const [x, y] = [event.clientX - sheet.left, event.clientY - sheet.top];
    let nearest = REACH[event.pointerType] ?? REACH.mouse;
    let met: { piece: PieceDrawing; grip: Grip } | undefined;
    for (const piece of this.pieces) {
      for (const { grip, at } of piece.grips(event.pointerType !== "touch")) {
        const away = Math.hypot(at[0] - x, at[1] - y);
        if (away > nearest) continue;
        nearest = away;
        met = { piece, grip };
      }
    }
    return met ?? this.edgeBelow(event.target);
  }

  private edgeBelow(target: EventTarget | null): { piece: PieceDrawing; grip: Grip } | undefined {
    const piece = target instanceof Element ? this.pieceOf(target) : undefined;
    const edge = target instanceof Element ? piece?.edgeOf(target) : undefined;
    return piece && edge !== undefined ? { piece, grip: { kind: "edge", edge } } : undefined;
  }

  /** What an element stands for, to be chosen. */
  private meant(element: Element): Chosen | undefined {
    const piece = this.pieceOf(element);
    if (!piece) return undefined;
    const edge = piece.edgeOf(element);
    return edge === undefined ? { panel: this.nameOf(piece) } : { panel: this.nameOf(piece), edge };
  }

  /** What stays chosen when a corner of this piece is taken. */
  private ofPiece(panel: string): Chosen {
    return this.chosen?.panel === panel ? this.chosen : { panel };
  }

  private pieceOf(element: Element): PieceDrawing | undefined {
    return this.pieces.find((piece) => piece.element.contains(element));
  }

  private nameOf(piece: PieceDrawing): string {
    return this.design?.panels[piece.index].name ?? "";
  }
}

/** The middle of the box around these. */
function middleOf(points: readonly Point[]): Point {
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  return [(Math.min(...xs) + Math.max(...xs)) / 2, (Math.min(...ys) + Math.max(...ys)) / 2];
}
