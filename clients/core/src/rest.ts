/** The server's REST side, as far as the clients use it. Lengths in metres, areas in square metres. */
import type { EffectWord } from "./effect_words.ts";

export interface Garment {
  readonly id: string;
  readonly name: string;
  readonly panel_count: number;
  readonly seam_count: number;
  readonly area: number;
  /** of a mesh: unit, axes and rest shape as they were found, and what was mended; empty for a pattern */
  readonly notes: readonly string[];
  /** it came with the server and can't be removed */
  readonly built_in: boolean;
  /** of an upload: the name under which the same file is kept already, where another was told */
  readonly kept_as: string | null;
}

/** How a mesh is to be read; null: found out by the server, which says so or asks. */
export interface MeshReading {
  readonly units: "m" | "cm" | "mm" | "in" | "ft" | null;
  readonly up: "y" | "z" | null;
  /** what it rests in: its texture coordinates as its pattern, or the shape it comes in */
  readonly restShape: "pattern" | "shape" | null;
}

/** How a body's frames are to be read: `fps` where the file does not say, `animation` of a .glb by its name, `facing` the
 * axis of the file that it faces along. */
export interface BodyReading {
  readonly units: MeshReading["units"];
  readonly up: MeshReading["up"] | "x";
  readonly fps: number | null;
  readonly animation: string | null;
  readonly facing: Facing | null;
}

/** An axis of a file: along which a person faces, or of a motion which is up. */
export type Facing = "x" | "-x" | "y" | "-y" | "z" | "-z";

const UNTOLD: BodyReading = { units: null, up: null, fps: null, animation: null, facing: null };

/** What a BVH file's lengths are in; asf: CMU's unit. */
export type MotionUnits = "m" | "dm" | "asf" | "in" | "ft" | "cm" | "mm";

/** How a BVH file is to be read; `facing` is told of its first frame, `joints` as PART=NAME, where names don't tell. */
export interface MotionReading {
  readonly units: MotionUnits | null;
  readonly up: Facing | null;
  readonly facing: Facing | null;
  readonly joints: readonly string[];
}

const UNREAD: MotionReading = { units: null, up: null, facing: null, joints: [] };

export interface Motion {
  /** what sessions call it */
  readonly name: string;
  readonly seconds: number;
  /** what people call it */
  readonly title: string;
  /** of an uploaded motion: what was found out about its file */
  readonly found: MotionFindings | null;
  /** of an upload: the name under which the same file is kept already, where another was told */
  readonly kept_as: string | null;
}

export interface MotionFindings {
  readonly fps: number;
  readonly frame_count: number;
  readonly units: string;
  readonly up: string;
  /** part of the body and the joint of the file that moves it */
  readonly joints_mapped: Readonly<Record<string, string>>;
  readonly joints_unused: readonly string[];
  /** all of this for people */
  readonly notes: readonly string[];
}

/** A body that came as an animated mesh: it moves by itself. */
export interface Body {
  readonly id: string;
  readonly name: string;
  readonly seconds: number;
  readonly frame_count: number;
  readonly vertex_count: number;
  /** how it was read, what was mended, whether it passes through itself */
  readonly notes: readonly string[];
  /** of an upload: the name under which the same file is kept already, where another was told */
  readonly kept_as: string | null;
}

export interface Fabric {
  readonly name: string;
  readonly areal_density: number;
  readonly thickness: number;
  readonly strain_limit: number;
  /** what its numbers follow */
  readonly source: string;
  readonly look: FabricLook;
}

/** Linear RGB, 0 to 1. */
export type Colour = readonly [number, number, number];

/** How a fabric looks: maps of one tile of its weave, which the server makes; paths on it, PNG as glTF has them. */
export interface FabricLook {
  /** mean of the face */
  readonly colour: Colour;
  /** length of a tile along the pattern's u and v [m] */
  readonly tile: readonly [number, number];
  /** soft shine at grazing angles, its strength included */
  readonly sheen: Colour;
  readonly sheen_roughness: number;
  /** `?dye=RRGGBB` dyes it */
  readonly colour_map: string;
  readonly normal_map: string;
  readonly roughness_map: string;
}

/** A picture that repeats over a garment in place of its fabric's colour. */
export interface Print {
  readonly id: string;
  readonly name: string;
  /** width and height on the cloth [m] */
  readonly size: readonly [number, number];
  /** path of its file on the server */
  readonly image: string;
  readonly kept_as: string | null;
}

/** What takes the place of a fabric's own colour: a dye (#RRGGBB) or a print, by its id. */
export interface Finish {
  readonly dye: string | null;
  readonly print: string | null;
}

/** Of a sewing pattern, over its own; "fit": the one that fits, which the server looks for by trying some on. */
export type Size = number | "fit";

/** What a session is to be; null lets the server choose. */
export interface SessionWish {
  readonly garment: string;
  readonly motion: string | null;
  readonly fabric: string | null;
  readonly preset: string | null;
  readonly size: Size;
  /** id of an uploaded body, which brings its motion; null: the default one */
  readonly body: string | null;
  /** id of a session of this garment, live or ended: with its pattern as it was edited, its effects and all it wore */
  readonly continues?: string;
}

/** A garment to be put on: null lets the server choose the fabric, or have it outermost. */
export interface WearWish {
  readonly garment: string;
  readonly fabric: string | null;
}

/** A garment of what a session wears, from the innermost outwards. */
export interface WornItem {
  /** its name among what is worn */
  readonly name: string;
  readonly garment: string;
  readonly fabric: string;
  /** of its pattern, over its own; "fit": the one that fits */
  readonly size: Size;
  readonly edited: boolean;
  /** in the change that this tells of it was taken off and put on again */
  readonly again?: boolean;
}

/** A change of what is worn that takes longer than who asks may wait: how it stands. */
export interface Job {
  readonly state: "running" | "done" | "refused" | "cancelled";
  /** what is done for it, for people */
  readonly detail: string;
  /** how much of that is done, 0 to 1; null: not known */
  readonly progress: number | null;
  /** path of it */
  readonly location: string;
}

/** Is told how a change stands, as long as it is not done. */
export type Told = (job: Job) => void;

/** for so long the answer is waited for before the first telling [s] */
const FIRST_WAIT = 1;

export interface SessionInfo {
  readonly id: string;
  readonly garment: string;
  readonly motion: string | null;
  readonly fabric: string;
  readonly preset: string;
  /** as it was asked for */
  readonly size: Size;
  /** in which it is worn; null: not dressed, or a mesh */
  readonly worn_size: number | null;
  readonly body: string | null;
  readonly state: string;
  readonly detail: string;
  /** path of the websocket */
  readonly stream: string;
}

/** Something the server refused or could not do: what, where, and what to do about it. */
export class RequestError extends Error {
  constructor(
    message: string,
    readonly place: string,
    readonly remedy: string,
    /** HTTP status; 0 when no answer came */
    readonly status: number,
  ) {
    super(message);
    this.name = "RequestError";
  }
}

/** Every method rejects with a `RequestError`. */
export class Api {
  /** @param base address of the server, such as `http://127.0.0.1:8000/` */
  constructor(
    private readonly base: URL,
    private readonly fetcher: typeof fetch = (input, init) => fetch(input, init),
    /** Passes the time between two questions how a change stands [s]. */
    private readonly pass: (seconds: number) => Promise<void> = (seconds) => new Promise((go) => setTimeout(go, 1000 * seconds)),
  ) {}

  garments(): Promise<Garment[]> {
    return this.ask("GET", "api/garments");
  }

  motions(): Promise<Motion[]> {
    return this.ask("GET", "api/motions");
  }

  effects(): Promise<EffectWord[]> {
    return this.ask("GET", "api/effects");
  }

  fabrics(): Promise<Fabric[]> {
    return this.ask("GET", "api/fabrics");
  }

  /** Sends a sewing pattern, or a mesh; the server checks that it can be sewn or worn. */
  uploadGarment(content: Blob, name: string, reading: MeshReading = { units: null, up: null, restShape: null }): Promise<Garment> {
    const query = new URLSearchParams({ name });
    if (reading.units) query.set("units", reading.units);
    if (reading.up) query.set("up", reading.up);
    if (reading.restShape) query.set("rest_shape", reading.restShape);
    return this.ask("POST", `api/garments?${query.toString()}`, content);
  }

  async removeGarment(id: string): Promise<void> {
    await this.ask("DELETE", `api/garments/${encodeURIComponent(id)}`);
  }

  /** Sends a BVH file; the server checks that the default body can follow it. */
  uploadMotion(content: Blob, name: string, reading: MotionReading = UNREAD): Promise<Motion> {
    const query = new URLSearchParams({ name });
    if (reading.units) query.set("units", reading.units);
    if (reading.up) query.set("up", reading.up);
    if (reading.facing) query.set("facing", reading.facing);
    for (const joint of reading.joints) query.append("joint", joint);
    return this.ask("POST", `api/motions?${query.toString()}`, content);
  }

  async removeMotion(name: string): Promise<void> {
    await this.ask("DELETE", `api/motions/${encodeURIComponent(name)}`);
  }

  bodies(): Promise<Body[]> {
    return this.ask("GET", "api/bodies");
  }

  /** Sends an animated mesh; the server makes it ready to be worn on. */
  uploadBody(content: Blob, name: string, reading: BodyReading = UNTOLD): Promise<Body> {
    const query = new URLSearchParams({ name });
    if (reading.units) query.set("units", reading.units);
    if (reading.up) query.set("up", reading.up);
    if (reading.fps) query.set("fps", String(reading.fps));
    if (reading.animation) query.set("animation", reading.animation);
    if (reading.facing) query.set("facing", reading.facing);
    return this.ask("POST", `api/bodies?${query.toString()}`, content);
  }

  async removeBody(id: string): Promise<void> {
    await this.ask("DELETE", `api/bodies/${encodeURIComponent(id)}`);
  }

  prints(): Promise<Print[]> {
    return this.ask("GET", "api/prints");
  }

  /** Sends a picture, PNG or JPEG, that is to be so wide on the cloth [m]. */
  uploadPrint(content: Blob, name: string, width: number): Promise<Print> {
    const query = new URLSearchParams({ name, width: String(width) });
    return this.ask("POST", `api/prints?${query.toString()}`, content);
  }

  async removePrint(id: string): Promise<void> {
    await this.ask("DELETE", `api/prints/${encodeURIComponent(id)}`);
  }

  /** What a session chose last for the looks of its fabric. */
  finish(session: string): Promise<Finish> {
    return this.ask("GET", `api/sessions/${encodeURIComponent(session)}/finish`);
  }

  chooseFinish(session: string, finish: Finish): Promise<Finish> {
    return this.ask("PUT", `api/sessions/${encodeURIComponent(session)}/finish`, JSON.stringify(finish));
  }

  openSession(wish: SessionWish): Promise<SessionInfo> {
    return this.ask("POST", "api/sessions", JSON.stringify(wish));
  }

  session(id: string): Promise<SessionInfo> {
    return this.ask("GET", `api/sessions/${encodeURIComponent(id)}`);
  }

  async endSession(id: string): Promise<void> {
    await this.ask("DELETE", `api/sessions/${encodeURIComponent(id)}`);
  }

  /** Address of what a session shows now, as a .glb. */
  glbUrl(session: string): string {
    return this.fileUrl(`api/sessions/${encodeURIComponent(session)}/garment.glb`);
  }

  /** Address of a file that the server told the path of. */
  fileUrl(path: string): string {
    return new URL(path.replace(/^\//, ""), this.base).href;
  }

  /** What a session wears, from the innermost outwards. */
  worn(session: string): Promise<WornItem[]> {
    return this.ask("GET", wornPath(session));
  }

  /** Puts a garment on over what is worn; answered once it is worn. */
  putOn(session: string, wish: WearWish, told?: Told): Promise<WornItem[]> {
    return this.change("POST", wornPath(session), JSON.stringify(wish), told);
  }

  takeOff(session: string, name: string, told?: Told): Promise<WornItem[]> {
    return this.change("DELETE", `${wornPath(session)}/${encodeURIComponent(name)}`, undefined, told);
  }

  /** Wears the same in this order, from the innermost outwards, and edits the garment of this name; null: as it is. */
  rearrange(session: string, order: readonly string[] | null, edited: string | null, told?: Told): Promise<WornItem[]> {
    return this.change("PUT", wornPath(session), JSON.stringify({ order, edited }), told);
  }

  /** Asks a change to stop; who waits for it hears whether that came in time. */
  async cancel(job: Job): Promise<void> {
    await this.send("DELETE", job.location.replace(/^\//, ""), undefined, "respond-async");
  }

  /** Address of a session's stream. */
  streamUrl(session: SessionInfo): string {
    const url = new URL(session.stream.replace(/^\//, ""), this.base);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    return url.href;
  }

  private async ask<T>(method: string, path: string, body?: BodyInit): Promise<T> {
    return (await this.send(method, path, body)).reply as T;
  }

  /** Asks for what may take long, and again until it is done: proxies cut off who waits for a minute. */
  private async change<T>(method: string, path: string, body: BodyInit | undefined, told: Told | undefined): Promise<T> {
    let answer = await this.send(method, path, body, `wait=${FIRST_WAIT}`);
    while (answer.status === 202) {
      const job = answer.reply as Job;
      told?.(job);
      await this.pass(answer.retryAfter);
      answer = await this.send("GET", job.location.replace(/^\//, ""));
    }
    return answer.reply as T;
  }

  private async send(method: string, path: string, body?: BodyInit, prefer?: string): Promise<Answer> {
    const headers: Record<string, string> = { accept: "application/json" };
    const init: RequestInit = { method, headers };
    if (prefer !== undefined) headers.prefer = prefer;
    if (body !== undefined) {
      init.body = body;
      headers["content-type"] = "application/json";
    }
    let response: Response;
    try {
      response = await this.fetcher(new URL(path, this.base), init);
    } catch {
      throw new RequestError("The server doesn't answer.", "", "See whether it runs, and try again.", 0);
    }
    const text = await response.text();
    const reply = parse(text);
    if (response.ok) return { status: response.status, retryAfter: Number(response.headers.get("retry-after") ?? 1), reply };
    throw refusal(reply, response.status);
  }
}

interface Answer {
  readonly status: number;
  /** after which to ask again [s] */
  readonly retryAfter: number;
  readonly reply: unknown;
}

function wornPath(session: string): string {
  return `api/sessions/${encodeURIComponent(session)}/garments`;
}

function parse(text: string): unknown {
  try {
    return text ? JSON.parse(text) : undefined;
  } catch {
    return undefined;
  }
}

/** The server's four fields as an error; a reply of something in between, say a proxy, keeps its status at least. */
function refusal(reply: unknown, status: number): RequestError {
  const problem: Record<string, unknown> = typeof reply === "object" && reply !== null ? { ...reply } : {};
  const text = (field: string, otherwise: string) => (typeof problem[field] === "string" ? problem[field] : otherwise);
  return new RequestError(
    text("message", `The server answered with status ${status}.`),
    text("place", ""),
    text("remedy", "Try again; the server's log says more."),
    status,
  );
}
