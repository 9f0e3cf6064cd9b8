/** Effects that a session can be asked for, as `GET /api/effects` describes them. */

interface FieldBase {
  readonly name: string;
  /** what it is, for people */
  readonly about: string;
  readonly unit: string;
  /** a running scene takes it up at once */
  readonly live: boolean;
  readonly default: unknown;
}

export interface NumberField extends FieldBase {
  readonly kind: "number";
  readonly low: number;
  readonly high: number;
  /** it may be null, for the usual */
  readonly open: boolean;
  readonly whole: boolean;
}

export interface VectorField extends FieldBase {
  readonly kind: "vector";
  readonly longest: number;
}

export interface ChoiceField extends FieldBase {
  readonly kind: "choice";
  readonly of: readonly string[];
}

export interface RowsField extends FieldBase {
  readonly kind: "rows";
  readonly fields: readonly EffectField[];
}

/** The name of a piece. */
export interface PanelField extends FieldBase {
  readonly kind: "panel";
  /** words that may stand in its place */
  readonly besides: readonly string[];
}

/** Where a spot is along an axis of the piece that another field names; null until it is told. */
export interface CoordinateField extends FieldBase {
  readonly kind: "coordinate";
  readonly low: number;
  readonly high: number;
  readonly axis: "x" | "y";
  readonly of: string;
}

/** Pieces, edges and curves: what is told by the pattern, or by somebody who writes it. */
export interface NamedField extends FieldBase {
  readonly kind: "panels" | "edges" | "curve";
}

export type EffectField = NumberField | VectorField | ChoiceField | RowsField | PanelField | CoordinateField | NamedField;
export type EffectParameters = Readonly<Record<string, unknown>>;

export interface EffectWord {
  readonly name: string;
  readonly title: string;
  readonly about: string;
  /** it can't be taken off */
  readonly kept: boolean;
  /** it is nothing without an entry in one of its lists */
  readonly lined: boolean;
  readonly fields: readonly EffectField[];
}

/** Is an entry of a list, as of lines with elastic, of this garment? One that names no garment is of any. */
export function isOf(garment: string, row: unknown): boolean {
  const named = garmentsNamed(row);
  return named.length === 0 || named.includes(garment);
}

/** Names of the garments whose pieces are named in it: what stands before a slash. */
function garmentsNamed(value: unknown): string[] {
  if (typeof value !== "object" || value === null) return [];
  return Object.entries(value).flatMap(([name, entry]: [string, unknown]) => {
    const names = name === "panel" || name === "first" || name === "second";
    if (!names || typeof entry !== "string") return garmentsNamed(entry);
    return entry.includes("/") ? [entry.slice(0, entry.lastIndexOf("/"))] : [];
  });
}

/** An entry for a list as it begins. */
export function newRow(fields: readonly EffectField[]): Record<string, unknown> {
  return Object.fromEntries(fields.map((field) => [field.name, field.default]));
}

/** Can somebody make entries of these fields by sliders, choices and the pattern? */
export function canBeAdded({ fields }: RowsField): boolean {
  return fields.every(({ kind }) => kind !== "curve" && kind !== "rows");
}

/** A direction as people say it: how much, towards where about the vertical [degrees, 0: to the front, 90: to the body's
 * left], and how far above the horizontal [degrees]. */
export interface Polar {
  readonly size: number;
  readonly heading: number;
  readonly rise: number;
}

/** Of a vector x, y, z, Y up, the body facing +Z. What has no direction points to the front. */
export function polarOf([x, y, z]: readonly [number, number, number]): Polar {
  const size = Math.hypot(x, y, z);
  const level = Math.hypot(x, z);
  const heading = level > 1e-9 * size ? (degrees(Math.atan2(x, z)) + 360) % 360 : 0;
  return { size, heading, rise: size > 0 ? degrees(Math.atan2(y, level)) : 0 };
}

export function vectorOf({ size, heading, rise }: Polar): [number, number, number] {
  const [about, above] = [radians(heading), radians(rise)];
  const level = size * Math.cos(above);
  return [round(level * Math.sin(about)), round(size * Math.sin(above)), round(level * Math.cos(about))];
}

/** Positions of a slider for a number: even steps, or even ratios where the bounds are far apart. */
export class Scale {
  private readonly ratios: boolean;

  constructor(
    private readonly low: number,
    private readonly high: number,
    private readonly whole: boolean,
  ) {
    this.ratios = !whole && low > 0 && high / low >= 1000;
  }

  /** how many positions there are above the lowest, 0 */
  get end(): number {
    return this.whole ? Math.min(this.high - this.low, 1000) : 200;
  }

  valueAt(position: number): number {
    const share = position / this.end;
    if (this.ratios) return tidy(this.low * (this.high / this.low) ** share);
    const value = this.low + share * (this.high - this.low);
    return this.whole ? Math.round(value) : tidy(value);
  }

  positionOf(value: number): number {
    const inside = Math.min(Math.max(value, this.low), this.high);
    const share = this.ratios ? Math.log(inside / this.low) / Math.log(this.high / this.low) : (inside - this.low) / (this.high - this.low);
    return Math.round(share * this.end);
  }
}

/** As many digits as anybody sets by hand. */
function tidy(value: number): number {
  return Number(value.toPrecision(3));
}

function round(value: number): number {
  return Math.round(1e4 * value) / 1e4 + 0;
}

function degrees(angle: number): number {
  return (180 / Math.PI) * angle;
}

function radians(angle: number): number {
  return (Math.PI / 180) * angle;
}
