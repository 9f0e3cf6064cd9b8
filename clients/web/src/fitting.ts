import {
  Api,
  Client,
  RequestError,
  type Body,
  type BodyReading,
  type EffectWord,
  type Fabric,
  type Garment,
  type Link,
  type MeshReading,
  type Motion,
  type MotionReading,
  type SessionInfo,
  type SessionWish,
  type Size,
} from "@tryon/core";
import type {
  DesignMessage,
  EditedMessage,
  EffectsMessage,
  ErrorMessage,
  OutfitMessage,
  ReportMessage,
  StatusMessage,
  WelcomeMessage,
} from "@tryon/protocol";

import type { UploadKind } from "./choices.ts";
import type { Notice } from "./notice.ts";

/** Who shows what a fitting does. */
export interface FittingView {
  /** the page is busy with something of which neither link nor session tell; null: it is done */
  busy(sentence: string | null): void;
  link(link: Link): void;
  /** a connection begins: what was announced on an earlier one is forgotten */
  welcomed(welcome: WelcomeMessage): void;
  status(status: StatusMessage): void;
  report(report: ReportMessage): void;
  /** the effects of the session's scene */
  effects(effects: EffectsMessage): void;
  /** something that was asked of effects was refused; @returns whether it is said where it was asked for */
  effectRefused(error: ErrorMessage): boolean;
  /** what is worn was changed, by whomever */
  outfit(outfit: OutfitMessage): void;
  /** the sewing pattern as it is worn */
  design(design: DesignMessage): void;
  edited(edited: EditedMessage): void;
  /** an edit was refused; returns whether it was one of this page, of which more need not be said */
  editRefused(error: ErrorMessage): boolean;
  notice(notice: Notice): void;
  /** what there is to choose from, and what is chosen */
  choices(catalogue: Catalogue, wish: SessionWish): void;
  /** another session begins; its client replaces the one before */
  began(client: Client, how: Beginning): void;
}

/** How a session begins for a page: anew; as one that is there; or with all that was worn in one that is over. */
export type Beginning = "opened" | "joined" | "continued";

export interface Catalogue {
  garments: Garment[];
  motions: Motion[];
  bodies: Body[];
  fabrics: Fabric[];
  effects: EffectWord[];
}

/** Largest file that is sent to the server at all [bytes]. */
const LARGEST_FILE = 256 * 2 ** 20;
const RETRY_MS = 1_500;
/** codes of what is told of poses that are followed all the same */
const TOLD: ReadonlySet<string> = new Set(["upside_down", "lying", "off_floor", "contorted"]);
/** answers to who would go on from a session that there is nothing left of */
const GONE: ReadonlySet<number> = new Set([404, 409, 422]);
const NO_GARMENT = "No garment yet: add a sewing pattern or a mesh";

/**
 * One fitting: what is worn, by which motion, in which session. Motion and fabric change within a session; another
 * garment, size, body or detail is another session, which is opened before the present one is left, so that a refused
 * wish leaves everything as it was.
 */
export class Fitting {
  client: Client | undefined;
  private readonly catalogue: Catalogue = { garments: [], motions: [], bodies: [], fabrics: [], effects: [] };
  private session: SessionInfo | undefined;
  private wish: SessionWish = { garment: "", motion: null, fabric: null, preset: null, size: 1, body: null };
  private link: Link = { state: "connecting" };
  private playing = true;
  private fabricWorn: string | null = null;
  private motionBefore: string | null = null;
  private opening = 0;

  constructor(
    private readonly api: Api,
    private readonly workerUrl: URL,
    private readonly view: FittingView,
  ) {}

  /** Joins the session with this id if there is one, else opens one with what most people want to see first. */
  async start(joinId: string | null): Promise<void> {
    await this.loadCatalogue();
    const found = joinId === null ? undefined : await this.find(joinId);
    if (found?.state === "closed") {
      this.view.notice({ title: "That session has ended", message: found.detail, remedy: "Another one goes on with what was worn in it.", calm: true });
      const { garment, motion, preset, size, body } = found;
      await this.open({ garment, motion, fabric: null, preset, size, body }, found.id);
      return;
    }
    if (found) {
      this.enter(found, "joined");
      return;
    }
    const garment = usualGarment(this.catalogue);
    if (!garment) {
      this.view.busy(NO_GARMENT);
      return;
    }
    await this.open({ ...this.wish, garment: garment.id, motion: usualMotion(this.catalogue)?.name ?? null });
  }

  /** Wears another garment, in its own size. */
  wear(garment: string): Promise<void> {
    return this.open({ ...this.wish, garment, size: 1 });
  }

  /** Wears the garment in this size. */
  async wearSize(size: Size): Promise<void> {
    if (size !== this.wish.size) await this.open({ ...this.wish, size });
  }

  /** Puts the garment on this uploaded body, which moves by itself, or on the default one. */
  standAs(body: string | null): Promise<void> {
    const { motions } = this.catalogue;
    const motion = motions.find(({ name }) => name === this.wish.motion) ?? motions.at(0);
    return this.open({ ...this.wish, body, motion: body === null ? (motion?.name ?? null) : null });
  }

  /** The session that is shown. */
  get sessionId(): string | undefined {
    return this.session?.id;
  }

  /** Whether an uploaded body is worn, which has a motion of its own and takes no poses. */
  get movesByItself(): boolean {
    return this.wish.body !== null;
  }

  /** Simulates with another detail; null lets the server choose. */
  detail(preset: string | null): Promise<void> {
    return this.open({ ...this.wish, preset });
  }

  /** Plays another motion; a body that moves by itself makes room for the default one. */
  async move(motion: string): Promise<void> {
    if (this.wish.body !== null) {
      await this.open({ ...this.wish, motion, body: null });
      return;
    }
    this.wish = { ...this.wish, motion };
    this.view.choices(this.catalogue, this.wish);
    this.client?.send({ type: "set_motion", motion, request: null });
  }

  /** The body follows the poses that this page sends, or again the motion it followed before. */
  followWearer(wearer: boolean): void {
    if (wearer) this.motionBefore = this.wish.motion;
    this.client?.send({ type: "set_motion", motion: wearer ? null : this.motionBefore, request: null });
    if (wearer && !this.playing) this.client?.send({ type: "play", request: null });
  }

  /** Sews the garment from another fabric. */
  sewFrom(fabric: string): void {
    this.wish = { ...this.wish, fabric };
    this.view.choices(this.catalogue, this.wish);
    this.client?.send({ type: "set_fabric", fabric, request: null });
  }

  /** Holds the motion or lets it run; after the end of a session, opens another one that goes on from there. */
  togglePlay(): void {
    if (this.link.state === "closed") void this.open(this.wish, this.session?.id);
    else this.client?.send(this.playing ? { type: "pause", request: null } : { type: "play", request: null });
  }

  /** Sends a garment's file to the server and wears it. What is worn stays on when the server refuses it. */
  add(file: File, reading: MeshReading): Promise<void> {
    return this.take(file, "can't be worn", "Choose a pattern's JSON file, or a mesh of at most 50,000 vertices.", async () => {
      const garment = await this.api.uploadGarment(file, file.name.replace(/\.(json|obj|glb)$/i, ""), reading);
      this.catalogue.garments = [...this.catalogue.garments.filter(({ id }) => id !== garment.id), garment];
      await this.wear(garment.id);
      return [...keptAs(garment.kept_as), ...garment.notes];
    });
  }

  /** Sends a motion's file to the server and plays it. */
  addMotion(file: File, reading: MotionReading): Promise<void> {
    return this.take(file, "can't be played", "Cut it into shorter motions.", async () => {
      const motion = await this.api.uploadMotion(file, file.name.replace(/\.bvh$/i, ""), reading);
      this.catalogue.motions = [...this.catalogue.motions.filter(({ name }) => name !== motion.name), motion];
      await this.move(motion.name);
      return [...keptAs(motion.kept_as), ...(motion.found?.notes ?? [])];
    });
  }

  /** Sends an animated mesh to the server and puts the garment on it. */
  addBody(file: File, reading: BodyReading): Promise<void> {
    return this.take(file, "can't wear anything", "Export fewer frames, or a coarser mesh.", async () => {
      const body = await this.api.uploadBody(file, file.name.replace(/\.(npz|glb|zip)$/i, ""), reading);
      this.catalogue.bodies = [...this.catalogue.bodies.filter(({ id }) => id !== body.id), body];
      await this.standAs(body.id);
      return [...keptAs(body.kept_as), ...body.notes];
    });
  }

  /** Sends a file, saying so meanwhile, and says how it was read; `refusal` says what it is not good for otherwise. */
  private async take(file: File, refusal: string, smaller: string, send: () => Promise<readonly string[]>): Promise<void> {
    try {
      refuseLarge(file, smaller);
      this.view.busy(`Reading ${file.name}`);
      const notes = await send();
      if (notes.length) this.view.notice({ title: `How ${file.name} was read`, message: notes.join("; "), told: true });
    } catch (error) {
      this.refused(`${file.name} ${refusal}`, error);
    } finally {
      this.view.busy(this.client ? null : this.catalogue.garments.length ? "Not started" : NO_GARMENT);
    }
  }

  /** Removes an upload from the server. What this page wears, plays or stands as gives way to the default. */
  async remove(kind: UploadKind, id: string, called: string): Promise<void> {
    const { api, catalogue } = this;
    try {
      if (kind === "garment") await api.removeGarment(id);
      else if (kind === "motion") await api.removeMotion(id);
      else await api.removeBody(id);
    } catch (error) {
      if (!(error instanceof RequestError && error.status === 404)) {
        this.refused(`${called} can't be removed`, error);
        return;
      } // somebody else has removed it
    }
    const { garment, motion, body } = this.wish;
    catalogue.garments = catalogue.garments.filter((known) => kind !== "garment" || known.id !== id);
    catalogue.motions = catalogue.motions.filter((known) => kind !== "motion" || known.name !== id);
    catalogue.bodies = catalogue.bodies.filter((known) => kind !== "body" || known.id !== id);
    this.view.choices(catalogue, this.wish);
    const [firstGarment, firstMotion] = [usualGarment(catalogue), usualMotion(catalogue)];
    if (kind === "motion" && this.motionBefore === id) this.motionBefore = firstMotion?.name ?? null;
    if (kind === "garment" && garment === id && firstGarment) await this.wear(firstGarment.id);
    else if (kind === "motion" && motion === id && firstMotion) await this.move(firstMotion.name);
    else if (kind === "body" && body === id) await this.standAs(null);
    this.view.notice({ title: `${called} is removed`, message: "", calm: true });
  }

  private async loadCatalogue(): Promise<void> {
    for (;;) {
      try {
        await this.readCatalogue();
        return;
      } catch (error) {
        if (!(error instanceof RequestError)) throw error;
        this.view.busy(`${error.message} Trying again`);
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      }
    }
  }

  private async readCatalogue(): Promise<void> {
    const { api } = this;
    const asked = [api.garments(), api.motions(), api.bodies(), api.fabrics(), api.effects()] as const;
    const [garments, motions, bodies, fabrics, effects] = await Promise.all(asked);
    Object.assign(this.catalogue, { garments, motions, bodies, fabrics, effects });
    this.view.choices(this.catalogue, this.wish);
  }

  /** Offers what there is by now; without an answer, what there was. */
  private async readAgain(): Promise<void> {
    await this.readCatalogue().catch((error: unknown) => {
      if (!(error instanceof RequestError)) throw error;
    });
  }

  private async find(id: string): Promise<SessionInfo | undefined> {
    try {
      return await this.api.session(id);
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.view.notice({ title: "That session isn't there", message: error.message, remedy: "A new one was opened.", calm: true });
    }
    return undefined;
  }

  /**
   * Opens a session and leaves the present one; of several wishes in a row the last one counts.
   * @param continues the session, which is over, that it goes on from
   */
  private async open(wish: SessionWish, continues?: string): Promise<void> {
    const turn = ++this.opening;
    const left = this.session;
    this.view.choices(this.catalogue, wish);
    try {
      // the fabric is the one that the pattern came to be of
      const session = await this.api.openSession(continues === undefined ? wish : { ...wish, fabric: null, continues });
      if (turn !== this.opening) {
        await this.end(session);
        return;
      }
      this.wish = wish;
      this.enter(session, continues === undefined ? "opened" : "continued");
      if (left && left.id !== session.id) await this.end(left);
    } catch (error) {
      if (turn !== this.opening) return;
      if (continues !== undefined && error instanceof RequestError && GONE.has(error.status)) {
        this.view.notice({ title: "What was worn can't be gone on from", message: error.message, remedy: "It is worn as it was at first." });
        await this.open(wish);
        return;
      }
      this.view.choices(this.catalogue, this.wish);
      this.refused("That could not be started", error);
      if (error instanceof RequestError && error.status === 404) void this.readAgain(); // somebody has removed it
      if (!this.client) this.view.busy("Not started");
    }
  }

  private enter(session: SessionInfo, how: Beginning): void {
    this.client?.close();
    this.session = session;
    const { garment, motion, fabric, size, body } = session;
    this.wish = { garment, motion, fabric, preset: this.wish.preset, size, body };
    this.view.link({ state: "connecting" }); // what the session before it was doing is not said of this one
    history.replaceState(null, "", `?${new URLSearchParams({ session: session.id }).toString()}`);
    const client = new Client(this.workerUrl, {
      link: (link) => {
        this.link = link;
        this.view.link(link);
      },
      welcome: (welcome) => this.view.welcomed(welcome),
      status: (status) => this.follow(status),
      report: (report) => this.view.report(report),
      effects: (effects) => this.view.effects(effects),
      outfit: (outfit) => this.view.outfit(outfit),
      design: (design) => this.view.design(design),
      edited: (edited) => this.view.edited(edited),
      error: (error) => this.fault(error),
      goodbye: (goodbye) => {
        if (goodbye.retry_after === null) this.view.notice({ title: "The session has ended", message: goodbye.reason, calm: true });
      },
    });
    this.client = client;
    this.view.began(client, how);
    this.view.choices(this.catalogue, this.wish);
    client.open(this.api.streamUrl(session));
  }

  /** Ends a session that this page left; that it may have ended by itself meanwhile is no fault. */
  private async end(session: SessionInfo): Promise<void> {
    await this.api.endSession(session.id).catch((error: unknown) => {
      if (!(error instanceof RequestError)) throw error;
    });
  }

  private follow(status: StatusMessage): void {
    this.playing = status.playing;
    this.fabricWorn = status.fabric;
    if (status.motion !== this.wish.motion || status.fabric !== this.wish.fabric) {
      this.wish = { ...this.wish, motion: status.motion, fabric: status.fabric };
      this.view.choices(this.catalogue, this.wish);
    }
    this.view.status(status);
  }

  private fault(error: ErrorMessage): void {
    if (error.code === "unknown_session") {
      void this.open(this.wish, this.session?.id); // the server was restarted, or has ended it while nobody watched
      return;
    }
    if (error.code === "edit_refused" && this.wish.fabric !== this.fabricWorn) {
      this.wish = { ...this.wish, fabric: this.fabricWorn };
      this.view.choices(this.catalogue, this.wish);
    }
    if (error.code === "effect_refused" && this.view.effectRefused(error)) return;
    if (this.view.editRefused(error)) return;
    if (TOLD.has(error.code)) {
      this.view.notice({ title: "How the body is tracked", message: error.message, remedy: error.remedy, told: true });
      return;
    }
    const place = error.place === "$" ? "" : error.place;
    this.view.notice({ title: "The server can't do that", message: error.message, place, remedy: error.remedy });
  }

  private refused(title: string, error: unknown): void {
    if (!(error instanceof RequestError)) throw error;
    this.view.notice({ title, message: error.message, place: error.place, remedy: error.remedy });
  }
}

/** What most people want to see first. */
function usualGarment({ garments }: Catalogue): Garment | undefined {
  return garments.find(({ id }) => /t[-_ ]?shirt/i.test(id)) ?? garments.at(0);
}

function usualMotion({ motions }: Catalogue): Motion | undefined {
  return motions.find(({ name }) => name === "walk") ?? motions.at(0);
}

/** What there is to say of a file that was there already under another name. */
function keptAs(name: string | null): string[] {
  return name === null ? [] : [`it is here already and keeps its name, ${name}`];
}

function refuseLarge(file: File, remedy: string): void {
  if (file.size <= LARGEST_FILE) return;
  throw new RequestError(`The file has ${Math.round(file.size / 2 ** 20)} MB.`, file.name, remedy, 0);
}
