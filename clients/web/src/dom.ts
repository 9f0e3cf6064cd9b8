/**
 * The element with this id.
 * @throws Error naming it, when the page and its script are of different builds
 */
export function byId(id: string): HTMLElement;
export function byId<E extends HTMLElement>(id: string, kind: new () => E): E;
export function byId(id: string, kind: new () => HTMLElement = HTMLElement): HTMLElement {
  const element = document.getElementById(id);
  if (element instanceof kind) return element;
  throw new Error(`the page has no ${kind.name} #${id}; reload it to get page and script of one build`);
}

/** A new element with attributes and children. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Readonly<Record<string, string>> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Writes `text` only when it differs: an unchanged figure costs no layout. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** One choice of a group: what it stands for and how it is shown. */
export interface Option {
  readonly value: string;
  readonly content: readonly (Node | string)[];
  readonly title?: string;
  /** what it is called, where it can be removed */
  readonly removable?: string;
}

/** A group of radio buttons: the browser gives it keys, focus and names for screen readers. */
export class RadioGroup {
  private readonly list: HTMLElement;

  /**
   * @param host fieldset whose last element takes the choices
   * @param remove told of the choice that is to be removed, and what it is called
   */
  constructor(
    private readonly host: HTMLFieldSetElement,
    private readonly name: string,
    private readonly chosen: (value: string) => void,
    private readonly remove: (value: string, name: string) => void = () => undefined,
  ) {
    this.list = host.lastElementChild as HTMLElement;
    this.list.addEventListener("change", (event) => this.chosen((event.target as HTMLInputElement).value));
  }

  /** Offers these choices instead of the earlier ones; a group without any is hidden. */
  offer(options: readonly Option[], selected: string | undefined): void {
    this.host.hidden = options.length === 0;
    this.list.replaceChildren(
      ...options.map((option) => {
        const input = make("input", { type: "radio", name: this.name, value: option.value });
        input.checked = option.value === selected;
        const parts = [input, ...option.content, ...this.removal(option)];
        return make("label", option.title === undefined ? {} : { title: option.title }, ...parts);
      }),
    );
  }

  /** The button that removes a choice, where it can be removed. */
  private removal({ value, removable }: Option): HTMLElement[] {
    if (removable === undefined) return [];
    const button = make("button", { type: "button", class: "remove", title: `Remove ${removable}`, "aria-label": `Remove ${removable}` }, "×");
    button.addEventListener("click", () => this.remove(value, removable));
    return [button];
  }

  /** Marks a choice without telling `chosen`. An unknown value marks none. */
  select(value: string | undefined): void {
    for (const input of this.list.querySelectorAll("input")) input.checked = input.value === value;
  }
}
