import { RequestError, type Api, type Garment, type Job, type Told, type WornItem } from "@tryon/core";

import { byId, make } from "./dom.ts";
import { sentence } from "./format.ts";
import { JobLine } from "./job_line.ts";
import type { Notice } from "./notice.ts";

/** What the wardrobe needs of the page. */
export interface WardrobeSurroundings {
  /** the session that is shown; undefined: none yet */
  session(): string | undefined;
  notice(notice: Notice): void;
  /** what is being done, of which the session does not tell; null: it is done */
  busy(sentence: string | null): void;
  /** this one of several garments is edited now; nothing: there is but one */
  edits(garment: WornItem | undefined): void;
}

/** What is worn, in order: put on, taken off, moved, and which garment is edited. The outermost comes first. */
export class Wardrobe {
  private readonly list = byId("wardrobe-worn");
  private readonly more = byId("wardrobe-add", HTMLSelectElement);
  private readonly field = byId("wardrobe", HTMLFieldSetElement);
  private garments: readonly Garment[] = [];
  private worn: readonly WornItem[] = [];
  private asked = 0;
  private readonly doing: JobLine;

  constructor(
    private readonly api: Api,
    private readonly page: WardrobeSurroundings,
  ) {
    this.doing = new JobLine(byId("wardrobe-doing"), (job) => void this.cancel(job));
    byId("wardrobe-put-on", HTMLButtonElement).addEventListener("click", () => {
      const garment = this.more.value;
      if (garment) this.change(`Putting on ${this.called(garment)}`, (session, told) => this.api.putOn(session, { garment, fabric: null }, told));
    });
  }

  /** Offers these garments to be put on. */
  offer(garments: readonly Garment[]): void {
    this.garments = garments;
    const chosen = this.more.value;
    this.more.replaceChildren(...garments.map(({ id, name }) => make("option", { value: id }, sentence(name))));
    if (garments.some(({ id }) => id === chosen)) this.more.value = chosen;
    this.show();
  }

  /** Asks what is worn; of several answers the newest counts. */
  async refresh(): Promise<void> {
    const session = this.page.session();
    const turn = ++this.asked;
    if (session === undefined) return;
    try {
      const worn = await this.api.worn(session);
      if (turn === this.asked && !this.field.disabled) this.take(this.withWhatChanged(worn));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error; // of a session that has ended the page tells elsewhere
    }
  }

  /** The same with what the last change of it was told of, which who only asks is not. */
  private withWhatChanged(worn: readonly WornItem[]): readonly WornItem[] {
    const before = this.worn;
    const same = worn.length === before.length && worn.every(({ name }, k) => name === before[k]?.name);
    return same ? worn.map((item, k) => ({ ...item, again: before[k]?.again ?? false })) : worn;
  }

  /** The session tells what is worn, whoever changed that. */
  told(worn: readonly WornItem[]): void {
    this.asked += 1; // what was asked before may be answered with what was worn before
    this.take(worn);
  }

  private take(worn: readonly WornItem[]): void {
    this.worn = worn;
    this.page.edits(worn.length > 1 ? worn.find(({ edited }) => edited) : undefined);
    this.show();
  }

  /** Has something changed; what is worn stays as it is where that is refused. */
  private change(doing: string, ask: (session: string, told: Told) => Promise<WornItem[]>): void {
    const session = this.page.session();
    if (session === undefined || this.field.disabled) return;
    this.field.disabled = true;
    this.page.busy(doing);
    ask(session, (job) => this.doing.show(job))
      .then((worn) => this.take(worn))
      .catch((error: unknown) => {
        if (!(error instanceof RequestError)) throw error;
        if (!this.doing.cancelled) this.page.notice({ title: "That can't be worn", message: error.message, place: error.place, remedy: error.remedy });
        this.show();
      })
      .finally(() => {
        this.asked += 1; // what was asked meanwhile may be answered with what was worn before
        this.field.disabled = false;
        this.doing.show(null);
        this.page.busy(null);
      });
  }

  /** Has a change stopped; where it can't be any more, it is worn in a moment, which shows. */
  private async cancel(job: Job): Promise<void> {
    try {
      await this.api.cancel(job);
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.page.notice({ title: "That can't be cancelled", message: error.message, place: error.place, remedy: error.remedy });
    }
  }

  private show(): void {
    const rows = this.worn.map((item, place) => this.row(item, place));
    this.list.replaceChildren(...rows.reverse());
  }

  private row(item: WornItem, place: number): HTMLElement {
    const twins = this.worn.filter(({ garment }) => garment === item.garment);
    const number = twins.length > 1 ? ` ${twins.indexOf(item) + 1}` : ""; // of several alike, the innermost is the first
    const called = this.called(item.garment) + number;
    const edited = make("input", { type: "radio", name: "wardrobe-edited", value: item.name });
    edited.checked = item.edited;
    edited.addEventListener("change", () => this.change(`Editing ${called}`, (session, told) => this.api.rearrange(session, null, item.name, told)));
    const fabric = item.fabric.replaceAll("_", " ");
    const says = item.again ? `${fabric}, taken off and put on again` : fabric;
    const label = make("label", { title: "Edit this garment" }, edited, `${called} `, make("small", {}, says));
    const last = this.worn.length - 1;
    const buttons = [
      this.button("↑", `Wear ${called} further out`, place === last, () => this.move(place, place + 1, called)),
      this.button("↓", `Wear ${called} further in`, place === 0, () => this.move(place, place - 1, called)),
      this.button("×", `Take ${called} off`, last === 0, () =>
        this.change(`Taking ${called} off`, (session, told) => this.api.takeOff(session, item.name, told)),
      ),
    ];
    return make("li", { "data-worn": item.name }, label, ...buttons);
  }

  private button(sign: string, says: string, disabled: boolean, press: () => void): HTMLElement {
    const button = make("button", { type: "button", class: "remove", title: says, "aria-label": says }, sign);
    button.disabled = disabled;
    button.addEventListener("click", press);
    return button;
  }

  private move(from: number, to: number, called: string): void {
    const order = this.worn.map(({ name }) => name);
    order.splice(to, 0, ...order.splice(from, 1));
    this.change(`Wearing ${called} ${to > from ? "over" : "under"} the other`, (session, told) => this.api.rearrange(session, order, null, told));
  }

  private called(garment: string): string {
    return sentence(this.garments.find(({ id }) => id === garment)?.name ?? garment);
  }
}
