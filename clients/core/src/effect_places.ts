import type { EffectField, EffectParameters } from "./effect_words.ts";
import type { Point } from "./pattern_design.ts";

/** What is chosen in the pattern: a piece, by the name that effects have for it; one of its edges, or a spot [m] in its
 * plane, in the size that is worn. */
export interface ChosenPlace {
  readonly panel: string;
  readonly edge?: number;
  readonly at?: Point;
}

export type PlaceKind = "edge" | "piece" | "spot";

/** Parameters that say where in the pattern something is, and are told by showing it there. */
export interface Place {
  readonly kind: PlaceKind;
  /** the field that names it, or the piece that it is on */
  readonly name: string;
  readonly about: string;
  /** it is a list of them */
  readonly several: boolean;
  /** nothing of it need be named */
  readonly open: boolean;
  /** words that may stand in the place of a piece */
  readonly besides: readonly string[];
  /** fields of a spot's coordinates along the piece's axes */
  readonly axes: Readonly<Record<"x" | "y", string>> | undefined;
}

/** The places that these fields tell of. */
export function placesOf(fields: readonly EffectField[]): Place[] {
  return fields.flatMap((field): Place[] => {
    const { name, about } = field;
    const plain = { name, about, besides: [], axes: undefined };
    if (field.kind === "edges") return [{ ...plain, kind: "edge", several: true, open: false }];
    if (field.kind === "panels") return [{ ...plain, kind: "piece", several: true, open: true }];
    if (field.kind !== "panel") return [];
    const axes = axesOn(name, fields);
    return [{ ...plain, kind: axes ? "spot" : "piece", several: false, open: false, besides: field.besides, axes }];
  });
}

/** Names of the coordinates on the piece that this field names, if there are both. */
function axesOn(panel: string, fields: readonly EffectField[]): Place["axes"] {
  const along = (axis: "x" | "y") => fields.find((field) => field.kind === "coordinate" && field.of === panel && field.axis === axis)?.name;
  const [x, y] = [along("x"), along("y")];
  return x !== undefined && y !== undefined ? { x, y } : undefined;
}

/** The first place that is to be told before parameters of these fields are whole. */
export function untold(fields: readonly EffectField[], parameters: EffectParameters): Place | undefined {
  return placesOf(fields).find((place) => !place.open && wordsOf(place, parameters).length === 0);
}

/** What a place is in these parameters, in words, one for each that is named. */
export function wordsOf(place: Place, parameters: EffectParameters): string[] {
  const value = parameters[place.name];
  if (place.kind === "edge") return edgesIn(value).map(({ panel, edge }) => `${panel}, edge ${edge}`);
  if (place.several) return namesIn(value);
  if (typeof value !== "string" || !value) return [];
  if (!place.axes) return [value];
  const at = [parameters[place.axes.x], parameters[place.axes.y]];
  return at.every((number) => typeof number === "number") ? [`${value}, at ${at.map((number) => (100 * number).toFixed(1)).join(", ")} cm`] : [];
}

/** The parameters with what was chosen; `more`: besides what is named already. */
export function withPlace(place: Place, parameters: EffectParameters, chosen: ChosenPlace, more: boolean): EffectParameters {
  const value = parameters[place.name];
  const { panel, edge, at } = chosen;
  if (place.kind === "edge") {
    const before = more ? edgesIn(value).filter((known) => known.panel !== panel || known.edge !== edge) : [];
    return { ...parameters, [place.name]: [...before, { panel, edge }] };
  }
  if (place.several) {
    const before = more ? namesIn(value).filter((known) => known !== panel) : [];
    return { ...parameters, [place.name]: [...before, panel] };
  }
  const spot = place.axes && at ? { [place.axes.x]: at[0], [place.axes.y]: at[1] } : {};
  return { ...parameters, [place.name]: panel, ...spot };
}

function edgesIn(value: unknown): { panel: string; edge: number }[] {
  return Array.isArray(value) ? (value as unknown[]).filter(isEdge) : [];
}

function namesIn(value: unknown): string[] {
  return Array.isArray(value) ? (value as unknown[]).filter((name) => typeof name === "string") : [];
}

function isEdge(entry: unknown): entry is { panel: string; edge: number } {
  return typeof entry === "object" && entry !== null && "panel" in entry && "edge" in entry;
}
