import { placesOf, polarOf, Scale, vectorOf, type ChoiceField, type EffectField, type EffectParameters, type NumberField, type RowsField, type VectorField } from "@tryon/core";

import { make, setText } from "./dom.ts";
import { placeControl, type PlaceEvents } from "./effect_places.ts";
import { significant } from "./format.ts";

/** Told of another value of a field, by its name. */
type Change = (name: string, value: unknown) => void;

/**
 * Controls for parameters.
 * @param key what those of these parameters are called among all of a page, to be found again
 * @param change told of each change by a slider or a choice
 * @param places told what is wanted of the pattern
 * @param list makes the controls of a list
 */
export function effectForm(
  fields: readonly EffectField[],
  parameters: EffectParameters,
  key: string,
  change: Change,
  places: PlaceEvents,
  list?: (field: RowsField) => HTMLElement,
): HTMLElement[] {
  const shown = placesOf(fields);
  return fields.flatMap((field): HTMLElement[] => {
    const value = parameters[field.name] ?? field.default;
    const set = (wanted: unknown) => change(field.name, wanted);
    const here = `${key}.${field.name}`;
    const place = shown.find(({ name }) => name === field.name);
    if (place) return [placeControl(place, parameters, here, places)];
    switch (field.kind) {
      case "number":
        return [numberControl(field, value as number | null, here, set)];
      case "vector":
        return [vectorControl(field, value as [number, number, number], here, set)];
      case "choice":
        return [choiceControl(field, value as string, here, set)];
      case "rows":
        return list ? [list(field)] : [];
      case "coordinate":
        return []; // its piece's control tells it
      default:
        return [told(field.name, inWords(value), field.about)];
    }
  });
}

function numberControl(field: NumberField, value: number | null, key: string, change: (value: unknown) => void): HTMLElement {
  const scale = new Scale(field.low, field.high, field.whole);
  const shown = (number: number | null) => (number === null ? "the usual" : withUnit(number, field.unit));
  const line = slider(field.name, key, field.about, scale.end, value === null ? 0 : scale.positionOf(value), shown(value), (position) => {
    const number = scale.valueAt(position);
    change(number);
    return shown(number);
  });
  line.classList.toggle("idle", value === null);
  if (!field.open) return line;
  const usual = make("button", { type: "button", class: "usual", title: "Have it as usual" }, "usual");
  usual.ariaPressed = String(value === null);
  usual.addEventListener("click", () => {
    change(null);
    usual.ariaPressed = "true";
    line.classList.add("idle");
    setText(line.querySelector("output")!, shown(null));
  });
  line.querySelector("input")!.addEventListener("input", () => {
    usual.ariaPressed = "false";
    line.classList.remove("idle");
  });
  line.append(usual);
  return line;
}

/** A vector by how much, towards where about the vertical, and how far up. */
function vectorControl(field: VectorField, value: readonly [number, number, number], key: string, change: (value: unknown) => void): HTMLElement {
  let polar = polarOf(value);
  const set = (part: Partial<typeof polar>) => {
    polar = { ...polar, ...part };
    change(vectorOf(polar));
  };
  const sizes = new Scale(0, field.longest, false);
  return make(
    "div",
    { class: "vector" },
    slider(field.name, key, field.about, sizes.end, sizes.positionOf(polar.size), withUnit(polar.size, field.unit), (position) => {
      set({ size: sizes.valueAt(position) });
      return withUnit(polar.size, field.unit);
    }),
    slider("towards", `${key}.towards`, "0°: to the body's front, 90°: to its left", 72, Math.round(polar.heading / 5), `${significant(polar.heading, 3)}°`, (position) => {
      set({ heading: 5 * position });
      return `${5 * position}°`;
    }),
    slider("upwards", `${key}.upwards`, "above the horizontal", 36, Math.round(polar.rise / 5) + 18, `${significant(polar.rise, 3)}°`, (position) => {
      set({ rise: 5 * (position - 18) });
      return `${5 * (position - 18)}°`;
    }),
  );
}

function choiceControl(field: ChoiceField, value: string, key: string, change: (value: unknown) => void): HTMLElement {
  const list = make("select", { "data-key": key }, ...field.of.map((word) => make("option", { value: word }, spoken(word))));
  list.value = value;
  list.addEventListener("change", () => change(list.value));
  return make("label", { class: "field", title: field.about }, make("span", {}, spoken(field.name)), list);
}

/** A labelled slider. @param moved told of a position, returns what is said of it */
function slider(name: string, key: string, about: string, end: number, position: number, said: string, moved: (position: number) => string): HTMLElement {
  const input = make("input", { type: "range", min: "0", max: String(end), step: "1", "aria-label": spoken(name), "data-key": key });
  const output = make("output", {}, said);
  input.value = String(position);
  input.ariaValueText = said;
  input.addEventListener("input", () => {
    const text = moved(input.valueAsNumber);
    setText(output, text);
    input.ariaValueText = text;
  });
  return make("label", { class: "field slider", title: about }, make("span", {}, spoken(name)), output, input);
}

/** A line that says a value, or heads a list. */
export function told(name: string, text: string, about: string): HTMLElement {
  return make("p", { class: "field", title: about }, make("span", {}, spoken(name)), make("span", { class: "fixed" }, text));
}

/** Points of a curve for people. */
function inWords(value: unknown): string {
  return Array.isArray(value) && value.length ? value.map(String).join("; ") : "none";
}

function withUnit(value: number, unit: string): string {
  return `${significant(value, 3)}${unit && ` ${unit}`}`;
}

/** A parameter's name as people say it. */
export function spoken(name: string): string {
  return name.replaceAll("_", " ");
}
