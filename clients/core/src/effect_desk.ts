import type {
  EffectsMessage,
  EffectState,
  ErrorMessage,
  KeptEffect,
  MeasureEffectsMessage,
  RemoveEffectMessage,
  SetEffectMessage,
} from "@tryon/protocol";

import type { EffectParameters } from "./effect_words.ts";
import { same } from "./same.ts";

export type EffectRequest = SetEffectMessage | RemoveEffectMessage | MeasureEffectsMessage;

/** Why what was asked of an effect can't be, and what that was. */
export interface EffectFault {
  readonly parameters: EffectParameters | null;
  readonly place: string;
  readonly message: string;
  readonly remedy: string;
}

/** numbers of this desk's requests begin here, apart from those of other parts of a page */
const FIRST_REQUEST = 1_000_000;

/** What this page has asked for and the session has not told yet. */
interface Owed {
  readonly request: number;
  readonly state: EffectState["state"];
  readonly parameters: EffectParameters | null;
}

/**
 * Where effects are asked for: says what is asked to the session, and follows what the session tells, whoever asked.
 * What is asked here stands as it was asked until the session has told it, or has refused it.
 */
export class EffectDesk {
  private told: EffectsMessage | undefined;
  private readonly owed = new Map<string, Owed>();
  private readonly faults = new Map<string, EffectFault>();
  private lastRequest = FIRST_REQUEST;

  /**
   * @param send says it to the session; lost while there is no connection
   * @param show told of every change
   */
  constructor(
    private readonly send: (message: EffectRequest) => void,
    private readonly show: () => void,
  ) {}

  /** Is there anything to show? */
  get known(): boolean {
    return (this.told?.effects.length ?? 0) > 0;
  }

  /** What was asked of an effect before the garment was worn, and is kept until then, or was refused then. */
  kept(name: string): KeptEffect | undefined {
    return this.told?.kept?.find((kept) => kept.name === name);
  }

  get auto(): boolean {
    return this.told?.auto ?? false;
  }

  get plan(): string {
    return this.told?.plan ?? "";
  }

  /** An effect as the session told it, or as this page asked for it. */
  effect(name: string): EffectState | undefined {
    const told = this.told?.effects.find((effect) => effect.name === name);
    const owed = this.owed.get(name);
    if (!told || !owed) return told;
    const pending = told.pending === "" || told.pending === undefined ? "binding" : told.pending;
    return { ...told, parameters: { ...(owed.parameters ?? told.parameters) }, pending };
  }

  /** What an effect is to be once the garment is worn, where that was asked for before; undefined: nothing was. */
  awaited(name: string): EffectState["state"] | undefined {
    return this.owed.get(name)?.state ?? this.kept(name)?.state;
  }

  /** What was refused last of an effect, until it is asked for anew. */
  fault(name: string): EffectFault | undefined {
    return this.faults.get(name);
  }

  /** Somebody at this page wants the effect to act, to be armed, or neither; with these parameters, or as they stand. */
  ask(name: string, state: EffectState["state"], parameters: EffectParameters | null = null): void {
    const request = (this.lastRequest += 1);
    this.owed.set(name, { request, state, parameters });
    this.faults.delete(name);
    if (state === "absent") this.send({ type: "remove_effect", name, request });
    else this.send({ type: "set_effect", name, parameters: parameters && { ...parameters }, state, request });
    this.show();
  }

  /** Have what garment and motion may call for armed, or no more. */
  setAuto(on: boolean): void {
    const request = (this.lastRequest += 1);
    if (on) this.send({ type: "set_effect", name: "auto", parameters: null, state: "armed", request });
    else this.send({ type: "remove_effect", name: "auto", request });
  }

  measure(): void {
    this.send({ type: "measure_effects", request: (this.lastRequest += 1) });
  }

  /** The session tells its effects. */
  take(message: EffectsMessage): void {
    this.told = message;
    for (const effect of message.effects) {
      const owed = this.owed.get(effect.name);
      if (owed && settled(effect, owed)) this.owed.delete(effect.name);
    }
    if (!this.known) for (const { name } of message.kept ?? []) this.owed.delete(name);
    this.show();
  }

  /** Something was refused; of which effect, if it was asked here. Then what the session told stands again. */
  refused({ request, place, message, remedy }: ErrorMessage): string | undefined {
    for (const [name, owed] of this.owed) {
      if (owed.request !== request) continue;
      this.owed.delete(name);
      this.faults.set(name, { parameters: owed.parameters, place, message, remedy });
      this.show();
      return name;
    }
    return undefined;
  }

  /** Another connection or session begins, of which nothing is known yet. */
  forget(): void {
    this.told = undefined;
    this.owed.clear();
    this.faults.clear();
    this.show();
  }
}

/** Is the effect as it was asked for? One that another takes the place of is armed, though it was to act. */
function settled(effect: EffectState, owed: Owed): boolean {
  if (effect.pending) return false;
  const state = effect.state === owed.state || (owed.state === "active" && effect.state === "armed");
  return state && (owed.parameters === null || same(effect.parameters, owed.parameters));
}
