import { wordsOf, type EffectParameters, type Place } from "@tryon/core";

import { make } from "./dom.ts";
import { spoken } from "./effect_form.ts";

/** Told what is wanted of the pattern, and where the answer is to be seen. */
export interface PlaceEvents {
  /** somebody wants to choose a place in the pattern; `more`: besides those that are named already */
  choose(place: Place, more: boolean, key: string): void;
  /** this word is to stand in the place of a piece */
  name(place: Place, word: string): void;
  /** none of what is named is to be */
  clear(place: Place): void;
  /** why nothing can be chosen in a pattern; "": something can */
  readonly barred: string;
}

const NOUNS: Readonly<Record<Place["kind"], string>> = { edge: "an edge", piece: "a piece", spot: "a spot" };

/** Says a place in the pattern, and has another one chosen there. */
export function placeControl(place: Place, parameters: EffectParameters, key: string, events: PlaceEvents): HTMLElement {
  const words = wordsOf(place, parameters);
  const none = place.open ? "all" : "not chosen yet";
  const line = make(
    "div",
    { class: "field place", title: place.about },
    make("span", {}, spoken(place.name)),
    make("span", { class: words.length || place.open ? "fixed" : "fixed wanting" }, words.join("; ") || none),
  );
  const does = make("div", { class: "does" });
  const button = (text: string, says: string, part: string, press: (key: string) => void, barred = "") => {
    const own = `${key}.${part}`;
    const made = make("button", { type: "button", class: "usual", title: barred || says, "aria-label": says, "data-key": own }, text);
    made.disabled = barred !== "";
    made.addEventListener("click", () => press(own));
    does.append(made);
  };
  const noun = NOUNS[place.kind];
  const name = spoken(place.name);
  button("Choose in the pattern", `Choose ${noun} in the pattern: ${name}`, "choose", (own) => events.choose(place, false, own), events.barred);
  if (place.several && words.length) {
    button("And another", `Choose another one in the pattern, too: ${name}`, "more", (own) => events.choose(place, true, own), events.barred);
    if (place.open) button("All", `All of them: ${name}`, "all", () => events.clear(place));
  }
  for (const word of place.besides) button(spoken(word), `${name}: ${spoken(word)}`, word, () => events.name(place, word));
  line.append(does);
  return line;
}
