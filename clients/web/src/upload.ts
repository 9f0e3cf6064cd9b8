import type { BodyReading, MeshReading, MotionReading } from "@tryon/core";

import { byId } from "./dom.ts";

/** Who takes the files, each with how it is to be read. */
export interface Taker {
  garment(file: File, reading: MeshReading): Promise<void>;
  motion(file: File, reading: MotionReading): Promise<void>;
  body(file: File, reading: BodyReading): Promise<void>;
  /** takes a picture that was dropped; returns whether it is one */
  picture(file: File): boolean;
}

/** A picker for one kind of file; it takes one at a time. */
class Picker {
  private readonly label: HTMLElement;

  constructor(
    label: string,
    private readonly picker: HTMLInputElement,
    private readonly add: (file: File) => Promise<void>,
  ) {
    this.label = byId(label);
    picker.addEventListener("change", () => void this.take(picker.files?.[0]));
  }

  async take(file: File | undefined): Promise<void> {
    if (!file || this.label.ariaBusy === "true") return;
    this.label.ariaBusy = "true";
    try {
      await this.add(file);
    } finally {
      this.label.ariaBusy = "false";
      this.picker.value = ""; // so that the same file can be chosen again after it was corrected
    }
  }
}

/** Takes files from the pickers or dropped anywhere on the page. */
export class Upload {
  private readonly zone = byId("drop");
  private readonly garments: Picker;
  private readonly motions: Picker;
  private readonly bodies: Picker;
  private depth = 0;

  constructor(private readonly taker: Taker) {
    const picker = (label: string, input: string, add: (file: File) => Promise<void>) => new Picker(label, byId(input, HTMLInputElement), add);
    this.garments = picker("upload", "pattern-file", (file) => taker.garment(file, meshReading()));
    this.motions = picker("upload-motion", "motion-file", (file) => taker.motion(file, motionReading()));
    this.bodies = picker("upload-body", "body-file", (file) => taker.body(file, bodyReading()));
    window.addEventListener("dragenter", (event) => this.entered(event, 1));
    window.addEventListener("dragleave", (event) => this.entered(event, -1));
    window.addEventListener("dragover", (event) => event.preventDefault());
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      this.depth = 0;
      this.zone.hidden = true;
      const file = event.dataTransfer?.files[0];
      if (file && !this.taker.picture(file)) void this.pickerOf(file, event.target).take(file);
    });
  }

  /** By its ending; a .glb is a garment unless it is dropped where bodies are added. */
  private pickerOf(file: File, target: EventTarget | null): Picker {
    if (/\.bvh$/i.test(file.name)) return this.motions;
    const onBodies = target instanceof Element && target.closest("#upload-body") !== null;
    return onBodies || /\.(npz|zip)$/i.test(file.name) ? this.bodies : this.garments;
  }

  /** Counts the elements the drag is in: entering a child comes before leaving its parent. */
  private entered(event: DragEvent, step: number): void {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    this.depth = Math.max(0, this.depth + step);
    this.zone.hidden = this.depth === 0;
  }
}

/** The unit, axis and rest shape chosen for a garment's mesh. */
function meshReading(): MeshReading {
  return { units: chosen("mesh-units"), up: chosen("mesh-up"), restShape: chosen("mesh-rest") } as MeshReading;
}

/** What is chosen for a motion. */
function motionReading(): MotionReading {
  const joints = byId("motion-joints", HTMLInputElement).value.split(",").map((joint) => joint.trim());
  return { units: chosen("motion-units"), up: chosen("motion-up"), facing: chosen("motion-facing"), joints: joints.filter(Boolean) } as MotionReading;
}

/** What is chosen for a body. */
function bodyReading(): BodyReading {
  const fps = byId("body-fps", HTMLInputElement).valueAsNumber || null;
  const animation = byId("body-animation", HTMLInputElement).value.trim() || null;
  return { units: chosen("body-units"), up: chosen("body-up"), fps, animation, facing: chosen("body-facing") } as BodyReading;
}

/** What is selected; null for the first choice, which leaves it to the server. */
function chosen(id: string): string | null {
  return byId(id, HTMLSelectElement).value || null;
}
