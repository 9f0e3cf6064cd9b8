import type { MeshReading } from "@tryon/core";

import { byId } from "./dom.ts";

/** Takes a file from the picker or from one dropped anywhere on the page; one at a time. */
export class Upload {
  private readonly zone = byId("drop");
  private readonly picker = byId("pattern-file", HTMLInputElement);
  private readonly label = byId("upload");
  private readonly units = byId("mesh-units", HTMLSelectElement);
  private readonly up = byId("mesh-up", HTMLSelectElement);
  private depth = 0;

  constructor(private readonly add: (file: File, reading: MeshReading) => Promise<void>) {
    this.picker.addEventListener("change", () => void this.take(this.picker.files));
    window.addEventListener("dragenter", (event) => this.entered(event, 1));
    window.addEventListener("dragleave", (event) => this.entered(event, -1));
    window.addEventListener("dragover", (event) => event.preventDefault());
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      this.depth = 0;
      this.zone.hidden = true;
      void this.take(event.dataTransfer?.files ?? null);
    });
  }

  /** Counts the elements the drag is in: entering a child comes before leaving its parent. */
  private entered(event: DragEvent, step: number): void {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    this.depth = Math.max(0, this.depth + step);
    this.zone.hidden = this.depth === 0;
  }

  private async take(files: FileList | null): Promise<void> {
    const file = files?.[0];
    if (!file || this.label.ariaBusy === "true") return;
    this.label.ariaBusy = "true";
    try {
      await this.add(file, { units: chosen(this.units), up: chosen(this.up) } as MeshReading);
    } finally {
      this.label.ariaBusy = "false";
      this.picker.value = ""; // so that the same file can be chosen again after it was corrected
    }
  }
}

/** What is selected; null for the first choice, which leaves it to the server. */
function chosen(select: HTMLSelectElement): string | null {
  return select.value || null;
}
