import { accuracyAt, AccuracyDesk, DIAL_END, positionOf, PriceLog, type AccuracyChoice } from "@tryon/core";
import type { ReportMessage, SetAccuracyMessage, StatusMessage } from "@tryon/protocol";

import { byId, setText } from "./dom.ts";
import { significant } from "./format.ts";
import { Pause } from "./pause.ts";
import { inWords, PricePlot } from "./price_plot.ts";

/** after a key at the dial, or in the field, until it is taken for meant [ms]; a drag is meant where it is let go */
const DIAL_WAITS_MS = 150;
const DEADLINE_WAITS_MS = 600;

const AS_DETAIL = "as the detail has it";

/** The section of accuracy, deadline and preset: what is asked for, and a plot of what frames reach and take. */
export class AccuracyPanel {
  private readonly section = byId("accuracy", HTMLDetailsElement);
  private readonly preset = byId("solved-as", HTMLSelectElement);
  private readonly inForce = byId("solved-as-told");
  private readonly dial = byId("accuracy-dial", HTMLInputElement);
  private readonly asDetail = byId("accuracy-default", HTMLButtonElement);
  private readonly deadline = byId("deadline", HTMLInputElement);
  private readonly shortcuts = [...byId("deadlines").querySelectorAll("button")];
  private readonly plot = new PricePlot(document.querySelector<SVGSVGElement>("#price-plot")!);
  private readonly log = new PriceLog();
  private readonly desk: AccuracyDesk;
  private readonly dialPause = new Pause();
  private readonly deadlinePause = new Pause();
  private dragged = false;

  constructor(send: (message: SetAccuracyMessage) => void) {
    this.desk = new AccuracyDesk(send, (choice) => this.show(choice));
    this.preset.addEventListener("change", () => this.choose({ preset: this.preset.value || null }));
    this.dial.max = String(DIAL_END);
    this.dial.addEventListener("pointerdown", () => (this.dragged = true));
    this.dial.addEventListener("input", () => {
      this.showAccuracy(this.dialled);
      const choose = (): void => this.choose({ accuracy: this.dialled });
      if (this.dragged) this.dialPause.hold(choose);
      else this.dialPause.begin(DIAL_WAITS_MS, choose);
    });
    for (const end of ["pointerup", "pointercancel", "change"]) this.dial.addEventListener(end, () => this.letGo());
    this.asDetail.addEventListener("click", () => {
      this.dialPause.cancel();
      this.choose({ accuracy: null });
    });
    this.deadline.addEventListener("input", () => {
      this.deadlinePause.cancel();
      if (this.deadline.validity.valid) this.deadlinePause.begin(DEADLINE_WAITS_MS, () => this.choose({ deadlineMs: this.typed }));
    });
    this.deadline.addEventListener("change", () => this.deadlinePause.endNow());
    for (const button of this.shortcuts) {
      button.addEventListener("click", () => {
        this.deadlinePause.cancel();
        this.deadline.value = button.value;
        this.choose({ deadlineMs: this.typed });
      });
    }
    this.section.addEventListener("toggle", () => {
      this.draw();
      if (this.section.open) this.section.scrollIntoView({ block: "nearest" });
    });
    this.show(this.desk.choice);
  }

  /** Another session begins, which this page opened or joined. */
  began(joined: boolean): void {
    this.desk.began(joined);
    this.log.reset();
    this.draw();
  }

  welcomed(): void {
    this.desk.welcomed();
  }

  take(status: StatusMessage): void {
    this.desk.take(status);
    this.tellInForce(status.preset_in_force ?? "", status.preset_pending ?? false);
  }

  report(report: ReportMessage): void {
    if (this.log.add(report, this.desk.choice.deadlineMs)) this.draw();
  }

  private choose(changed: Partial<AccuracyChoice>): void {
    this.desk.choose({ ...this.desk.choice, ...changed });
  }

  /** The drag ends, if there is one: keys change the dial as well. */
  private letGo(): void {
    if (!this.dragged) return;
    this.dragged = false;
    this.dialPause.endNow();
  }

  private get dialled(): number {
    return accuracyAt(this.dial.valueAsNumber);
  }

  private get typed(): number | null {
    return this.deadline.value === "" ? null : this.deadline.valueAsNumber;
  }

  /** Says by which preset frames are solved, "" before any are, and whether another one is to come. */
  private tellInForce(name: string, pending: boolean): void {
    this.inForce.classList.toggle("pending", pending);
    const now = name && `frames are solved as ${this.nameOf(name)}`;
    setText(this.inForce, [now, ...(pending ? ["another is being made ready"] : [])].filter(Boolean).join("; "));
  }

  private nameOf(preset: string): string {
    return [...this.preset.options].find(({ value }) => value === preset)?.text ?? preset;
  }

  /** Shows what stands; what somebody is about to choose stays as it is. */
  private show({ accuracy, deadlineMs, preset }: AccuracyChoice): void {
    this.preset.value = preset ?? "";
    if (!this.dialPause.waits) {
      this.showAccuracy(accuracy);
      const position = accuracy === null ? this.dial.valueAsNumber : positionOf(accuracy);
      if (position !== this.dial.valueAsNumber) this.dial.value = String(position);
    }
    if (!this.deadlinePause.waits && this.typed !== deadlineMs && this.deadline.validity.valid) {
      this.deadline.value = deadlineMs === null ? "" : significant(deadlineMs, 6);
    }
    for (const button of this.shortcuts) button.ariaPressed = String(button.value === (deadlineMs === null ? "" : String(deadlineMs)));
    setText(byId("accuracy-short"), [...(preset === null ? [] : [this.nameOf(preset)]), inShort(accuracy, deadlineMs)].join(", "));
    this.draw();
  }

  private showAccuracy(accuracy: number | null): void {
    const told = accuracy === null ? AS_DETAIL : `about ${millimetres(accuracy)}`;
    this.dial.ariaValueText = told;
    this.dial.classList.toggle("idle", accuracy === null);
    this.asDetail.ariaPressed = String(accuracy === null);
    setText(byId("accuracy-told"), told);
  }

  private draw(): void {
    if (!this.section.open) return;
    const { prices } = this.log;
    this.plot.draw(prices, this.desk.choice);
    setText(byId("price-newest"), inWords(prices.at(-1), this.desk.choice.deadlineMs));
    const late = prices.filter(({ lateMs }) => lateMs > 0).length;
    setText(byId("price-late"), late ? `${late} of the last ${prices.length} frames came late` : "");
  }
}

function inShort(accuracy: number | null, deadlineMs: number | null): string {
  const error = accuracy === null ? AS_DETAIL : millimetres(accuracy);
  return deadlineMs === null ? error : `${accuracy === null ? "" : `${error}, `}in ${significant(deadlineMs, 4)} ms`;
}

function millimetres(accuracy: number): string {
  return `${significant(1000 * accuracy, 2)} mm`;
}
