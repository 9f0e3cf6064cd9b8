import { RequestError, type Api, type Print } from "@tryon/core";

import { byId, make, RadioGroup } from "./dom.ts";
import type { Notice } from "./notice.ts";

const NONE = "";
const PICTURE = /\.(png|jpe?g)$/i;

/** Prints to choose from, and a picker that adds one. */
export class PrintPanel {
  private readonly group: RadioGroup;
  private readonly label = byId("upload-print");
  private readonly width = byId("print-width", HTMLInputElement);
  private prints: readonly Print[] = [];
  private worn: Print | undefined;
  private readonly listed: Promise<void>;

  /**
   * @param chosen told of the print that is to be worn; undefined: none
   * @param say shows what came of an upload
   */
  constructor(
    private readonly api: Api,
    private readonly chosen: (print: Print | undefined) => void,
    private readonly say: (notice: Notice) => void,
  ) {
    this.group = new RadioGroup(
      byId("prints", HTMLFieldSetElement),
      "prints",
      (id) => this.wear(this.prints.find((print) => print.id === id)),
      (id, called) => {
        if (confirm(`Remove ${called} from the server? Nobody can choose it any more.`)) void this.remove(id, called);
      },
    );
    const picker = byId("print-file", HTMLInputElement);
    picker.addEventListener("change", () => {
      const file = picker.files?.[0];
      if (file) void this.add(file).finally(() => (picker.value = "")); // so that it can be chosen again, corrected
    });
    this.listed = this.read();
  }

  /** Shows that the print of this id is worn, which was chosen elsewhere; null: none. Returns it. */
  async join(id: string | null): Promise<Print | undefined> {
    await this.listed;
    this.worn = this.prints.find((print) => print.id === id);
    this.show();
    return this.worn;
  }

  /** Whether a file is one of these, by its ending. */
  takes(file: File): boolean {
    return PICTURE.test(file.name);
  }

  /** Sends a picture to the server and wears it. */
  async add(file: File): Promise<void> {
    if (this.label.ariaBusy === "true") return;
    this.label.ariaBusy = "true";
    try {
      if (!this.width.checkValidity()) throw new RequestError("Its width on the cloth isn't told.", "width", "Give it in cm, 0.5 to 500.", 0);
      const print = await this.api.uploadPrint(file, file.name.replace(PICTURE, ""), this.width.valueAsNumber / 100);
      this.prints = [...this.prints.filter(({ id }) => id !== print.id), print];
      this.wear(print);
    } catch (error) {
      this.refused(`${file.name} can't be printed`, error);
    } finally {
      this.label.ariaBusy = "false";
    }
  }

  private async read(): Promise<void> {
    try {
      this.prints = await this.api.prints();
      this.show();
    } catch (error) {
      if (!(error instanceof RequestError)) throw error; // that the server doesn't answer is told elsewhere
    }
  }

  private async remove(id: string, called: string): Promise<void> {
    try {
      await this.api.removePrint(id);
    } catch (error) {
      if (!(error instanceof RequestError && error.status === 404)) {
        this.refused(`${called} can't be removed`, error);
        return;
      } // somebody else has removed it
    }
    this.prints = this.prints.filter((print) => print.id !== id);
    if (this.worn?.id === id) this.wear(undefined);
    else this.show();
  }

  private wear(print: Print | undefined): void {
    this.worn = print;
    this.show();
    this.chosen(print);
  }

  private show(): void {
    const offered = this.prints.map(({ id, name, image, size }) => {
      const cloth = make("span", { class: "cloth" });
      cloth.style.setProperty("--texture", `url("${this.api.fileUrl(image)}")`);
      cloth.style.setProperty("--texture-size", "cover");
      const title = `${name}: ${(100 * size[0]).toFixed(1)} × ${(100 * size[1]).toFixed(1)} cm on the cloth`;
      return { value: id, title, removable: name, content: [cloth, name] };
    });
    const none = { value: NONE, title: "The fabric in its colour", content: [make("span", { class: "cloth" }), "None"] };
    this.group.offer(offered.length ? [none, ...offered] : [], this.worn?.id ?? NONE);
  }

  private refused(title: string, error: unknown): void {
    if (!(error instanceof RequestError)) throw error;
    this.say({ title, message: error.message, place: error.place, remedy: error.remedy });
  }
}
