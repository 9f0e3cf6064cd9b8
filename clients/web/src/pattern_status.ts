import type { ChangeStatus } from "@tryon/protocol";

import { byId, setText } from "./dom.ts";
import { nameOf } from "./pattern_piece.ts";
import { madeBy } from "./pattern_tools.ts";

/** what is asked for is worn as a rule before this, and a line that comes and goes at once says nothing [s] */
const SOON = 0.5;
const LEADS: Readonly<Record<ChangeStatus["doing"], string>> = {
  waiting: "waits",
  remeshing: "remeshing",
  building: "building",
  dressing: "dressing anew",
  settling: "settling",
  refused: "refused",
};

/** The line that says what is done for the edits that are not worn yet, and for how long. */
export class PatternStatus {
  private readonly line = byId("pattern-status");
  private changes: readonly ChangeStatus[] = [];
  /** when each was first told of, by when it was asked for [s, this page's clock] */
  private seen = new Map<number, number>();
  private timer: ReturnType<typeof setInterval> | undefined;

  /** Whether an edit is on its way, that can be taken back. */
  get underWay(): boolean {
    return this.changes.some(({ doing, step }) => doing !== "refused" && step !== "undo");
  }

  take(changes: readonly ChangeStatus[]): void {
    this.changes = changes;
    const now = seconds();
    this.seen = new Map(changes.map(({ since }) => [since, this.seen.get(since) ?? now]));
    clearInterval(this.timer);
    this.timer = changes.some(({ doing }) => doing !== "refused") ? setInterval(() => this.show(), 1000 * SOON) : undefined;
    this.show();
  }

  private show(): void {
    const now = seconds();
    const told = describeChanges(this.changes, ({ since }) => now - (this.seen.get(since) ?? now));
    this.line.hidden = told === "";
    setText(this.line, told);
  }
}

function seconds(): number {
  return performance.now() / 1000;
}

/**
 * The first of the changes in words, and how many there are behind it; "": there is nothing to say.
 * @param age for how long it is known that a change is under way [s]
 */
export function describeChanges(changes: readonly ChangeStatus[], age: (change: ChangeStatus) => number): string {
  const shown = changes.filter((change) => change.doing === "refused" || age(change) >= SOON);
  const first = shown.find(({ doing }) => doing !== "refused") ?? shown.at(-1);
  if (!first) return "";
  const { doing, detail = "", progress, panel } = first;
  const what = { edit: madeBy(first.kind), undo: "Undo", redo: "Redo" }[first.step];
  const share = typeof progress === "number" ? ` (${Math.round(100 * progress)} %)` : "";
  const told = detail ? `: ${detail}${share}` : share;
  const more = shown.filter((one) => one.doing !== "refused").length - 1;
  const seconds = doing === "refused" ? "" : `, ${Math.round(age(first))} s`;
  return `${panel ? `${what}, ${nameOf(panel)}` : what}: ${LEADS[doing]}${told}${seconds}${more > 0 ? `; ${more} more behind it` : ""}`;
}
