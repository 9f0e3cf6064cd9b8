import { byId, setText } from "./dom.ts";
import { capitalised } from "./format.ts";

/** What went wrong, or what a person should know: where, and what to do about it. */
export interface Notice {
  readonly title: string;
  readonly message: string;
  readonly place?: string;
  readonly remedy?: string;
  /** good news rather than a fault */
  readonly calm?: boolean;
  /** no fault, but to be read: it stays */
  readonly told?: boolean;
}

/** The one message shown at a place. It stays until it is dismissed or replaced, calm ones leave by themselves. */
export class NoticeBoard {
  private readonly board: HTMLElement;
  private timer = 0;

  /** @param id of the board in the page; those of its parts begin with it */
  constructor(private readonly id = "notice") {
    this.board = byId(id);
    byId(`${id}-close`).addEventListener("click", () => this.hide());
  }

  show(notice: Notice): void {
    window.clearTimeout(this.timer);
    setText(byId(`${this.id}-title`), notice.title);
    setText(byId(`${this.id}-message`), capitalised(notice.message));
    this.line("place", notice.place);
    this.line("remedy", capitalised(notice.remedy ?? ""));
    this.board.classList.toggle("calm", notice.calm === true || notice.told === true);
    this.board.hidden = false;
    if (notice.calm) this.timer = window.setTimeout(() => this.hide(), 6_000);
  }

  /** Takes a fault off that is over; good news stay for their time. */
  hideFault(): void {
    if (!this.board.classList.contains("calm")) this.hide();
  }

  hide(): void {
    this.board.hidden = true;
  }

  private line(part: string, text: string | undefined): void {
    const element = byId(`${this.id}-${part}`);
    element.hidden = !text;
    setText(element, text ?? "");
  }
}
