import type { StatusMessage } from "@tryon/protocol";

import { byId, make, setText } from "./dom.ts";

/** What there is to say about the garment on its body as long as it is worn: its fit, and how the files were read. */
export class FitCard {
  private readonly card = byId("fit");
  private readonly wear = byId("fit-wear", HTMLButtonElement);
  private readonly notes = byId("notes");
  private advised: number | null = null;
  private listed = "";

  /** @param wearSize wears the garment in the size that is advised */
  constructor(wearSize: (size: number) => void) {
    this.wear.addEventListener("click", () => {
      if (this.advised !== null) wearSize(this.advised);
    });
  }

  show({ fit = "", fitting_size: size = null, notes = [] }: StatusMessage): void {
    this.card.hidden = !fit;
    setText(byId("fit-text"), fit.charAt(0).toUpperCase() + fit.slice(1));
    const advised = size === null ? null : Math.round(100 * size) / 100;
    this.advised = advised !== null && advised >= 0.5 && advised <= 2 ? advised : null;
    this.wear.hidden = this.advised === null;
    setText(this.wear, this.advised === null ? "" : `Wear it at ${Math.round(100 * this.advised)} %`);
    this.notes.hidden = notes.length === 0;
    const listed = notes.join("\n");
    if (listed === this.listed) return;
    this.listed = listed;
    byId("notes-list").replaceChildren(...notes.map((note) => make("li", {}, note)));
  }
}
