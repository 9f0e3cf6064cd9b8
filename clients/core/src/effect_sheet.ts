import type { EffectFault } from "./effect_desk.ts";
import { untold, withPlace, type ChosenPlace, type Place } from "./effect_places.ts";
import { newRow, type EffectParameters, type EffectWord, type RowsField } from "./effect_words.ts";
import { same } from "./same.ts";

/** An entry of one of an effect's lists: one that the session has, or a draft. */
export interface Entry {
  readonly list: string;
  readonly row: EffectParameters;
  readonly draft: boolean;
}

/** Why what was asked for can't be: of an entry by its place among those of its list, drafts last; of what else is of
 * the list of that name, or of all. */
export interface SheetFault {
  readonly list: string | undefined;
  readonly index: number | undefined;
  readonly message: string;
  readonly remedy: string;
}

/**
 * An effect's parameters while somebody works on them. An entry of a list that is not whole yet, or was refused, is a
 * draft: it is kept here, and asked for once it is whole.
 */
export class EffectSheet {
  private parameters: EffectParameters = {};
  private readonly drafted = new Map<string, readonly EffectParameters[]>();
  private refusal: EffectFault | undefined;
  private told: SheetFault | undefined;

  /** @param ask asks the session for these parameters */
  constructor(
    private readonly word: EffectWord,
    private readonly ask: (parameters: EffectParameters) => void,
  ) {}

  get current(): EffectParameters {
    return this.parameters;
  }

  get fault(): SheetFault | undefined {
    return this.told;
  }

  /** The entries of a list, drafts last. */
  entries(list: string): Entry[] {
    const entry = (draft: boolean) => (row: EffectParameters) => ({ list, row, draft });
    return [...this.rows(list).map(entry(false)), ...this.drafts(list).map(entry(true))];
  }

  /** How many entries the effect has in all its lists that the session has, too. */
  get count(): number {
    return this.lists.reduce((sum, { name }) => sum + this.rows(name).length, 0);
  }

  /** The effect is so, and this was refused of it last. What was refused as one entry more is a draft again. */
  take(parameters: EffectParameters, refusal: EffectFault | undefined): void {
    this.parameters = parameters;
    if (refusal === this.refusal) return;
    this.refusal = refusal;
    this.told = undefined;
    if (!refusal) return;
    const { list, index } = placeOf(refusal.place);
    const known = list === undefined ? 0 : this.rows(list).length;
    const drafts = list === undefined ? 0 : this.drafts(list).length;
    for (const { name } of this.lists) {
      const more = rowsIn(refusal.parameters?.[name]).slice(this.rows(name).length);
      if (more.length) this.drafted.set(name, [...this.drafts(name), ...more]);
    }
    const of = this.lists.some(({ name }) => name === list) ? list : undefined;
    const among = index !== undefined && index >= known ? index + drafts : index;
    this.told = { list: of, index: of === undefined ? undefined : among, message: refusal.message, remedy: refusal.remedy };
  }

  /** Another value of one of its parameters. */
  set(name: string, value: unknown): void {
    this.want({ ...this.parameters, [name]: value });
  }

  /** Begins an entry; one that is whole as it begins is asked for at once. */
  begin(list: string): Entry {
    const row = newRow(this.fieldOf(list).fields);
    return this.keep({ list, row, draft: true }, row, -1);
  }

  /** Another entry in its place, as somebody changes it. @returns it as it is now; nothing if it is gone */
  change(entry: Entry, row: EffectParameters): Entry | undefined {
    const k = this.find(entry);
    return k < 0 ? undefined : this.keep(entry, row, k);
  }

  /** What was chosen in the pattern for an entry, or for what the effect has besides its lists. */
  place(entry: Entry | undefined, place: Place, chosen: ChosenPlace, more: boolean): Entry | undefined {
    if (entry) return this.change(entry, withPlace(place, entry.row, chosen, more));
    this.want(withPlace(place, this.parameters, chosen, more));
    return undefined;
  }

  /** The place that an entry has yet to be told. */
  untold({ list, row }: Entry): Place | undefined {
    return untold(this.fieldOf(list).fields, row);
  }

  remove(entry: Entry): void {
    const k = this.find(entry);
    if (k < 0) return;
    if (entry.draft) {
      this.drafted.set(entry.list, without(this.drafts(entry.list), k));
      this.told = undefined;
    } else this.set(entry.list, without(this.rows(entry.list), k));
  }

  /** Drops what is not asked for. */
  forget(): void {
    this.drafted.clear();
    this.told = undefined;
  }

  /** Keeps an entry as it is now: as a draft, or, once it is whole, by asking for it. @param k its place; -1: new */
  private keep({ list, draft }: Entry, row: EffectParameters, k: number): Entry {
    if (!draft) {
      this.set(list, replaced(this.rows(list), k, row));
      return { list, row, draft };
    }
    const drafts = this.drafts(list);
    if (this.untold({ list, row, draft })) {
      this.drafted.set(list, k < 0 ? [...drafts, row] : replaced(drafts, k, row));
      return { list, row, draft };
    }
    this.drafted.set(list, without(drafts, k));
    this.set(list, [...this.rows(list), row]);
    return { list, row, draft: false };
  }

  private want(parameters: EffectParameters): void {
    this.parameters = parameters;
    this.told = undefined;
    this.ask(parameters);
  }

  private find({ list, row, draft }: Entry): number {
    return (draft ? this.drafts(list) : this.rows(list)).findIndex((known) => same(known, row));
  }

  private rows(list: string): readonly EffectParameters[] {
    return rowsIn(this.parameters[list]);
  }

  private drafts(list: string): readonly EffectParameters[] {
    return this.drafted.get(list) ?? [];
  }

  private get lists(): RowsField[] {
    return this.word.fields.filter((field) => field.kind === "rows");
  }

  private fieldOf(list: string): RowsField {
    const field = this.lists.find(({ name }) => name === list);
    if (!field) throw new Error(`${this.word.name} has no list ${list}`);
    return field;
  }
}

function rowsIn(value: unknown): readonly EffectParameters[] {
  return Array.isArray(value) ? (value as EffectParameters[]) : [];
}

function without<T>(rows: readonly T[], k: number): T[] {
  return rows.filter((_, i) => i !== k);
}

function replaced<T>(rows: readonly T[], k: number, row: T): T[] {
  return rows.map((known, i) => (i === k ? row : known));
}

/** Of which list a refusal is, and of which of its entries: `$.parameters.lines[1].along[0]` is of the second line. */
function placeOf(place: string): { list: string | undefined; index: number | undefined } {
  const found = /^(?:\$\.)?parameters\.(\w+)(?:\[(\d+)\])?/.exec(place);
  return { list: found?.[1], index: found?.[2] === undefined ? undefined : Number(found[2]) };
}
