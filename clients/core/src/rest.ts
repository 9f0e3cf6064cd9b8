/** The server's REST side, as far as the clients use it. Lengths in metres, areas in square metres. */

export interface Garment {
  readonly id: string;
  readonly name: string;
  readonly panel_count: number;
  readonly seam_count: number;
  readonly area: number;
  /** of a mesh: unit, axes and rest shape as they were found, and what was mended; empty for a pattern */
  readonly notes: readonly string[];
}

/** How a garment that is a mesh is to be read; null: found out by the server, which says so or asks. */
export interface MeshReading {
  readonly units: "m" | "cm" | "mm" | "in" | "ft" | null;
  readonly up: "y" | "z" | null;
}

export interface Motion {
  readonly name: string;
  readonly seconds: number;
}

export interface Fabric {
  readonly name: string;
  readonly areal_density: number;
  readonly thickness: number;
  readonly strain_limit: number;
  /** linear RGB, 0 to 1 */
  readonly colour: readonly [number, number, number];
}

/** What a session is to be; null lets the server choose. */
export interface SessionWish {
  readonly garment: string;
  readonly motion: string | null;
  readonly fabric: string | null;
  readonly preset: string | null;
}

export interface SessionInfo {
  readonly id: string;
  readonly garment: string;
  readonly motion: string | null;
  readonly fabric: string;
  readonly preset: string;
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
  ) {}

  garments(): Promise<Garment[]> {
    return this.ask("GET", "api/garments");
  }

  motions(): Promise<Motion[]> {
    return this.ask("GET", "api/motions");
  }

  fabrics(): Promise<Fabric[]> {
    return this.ask("GET", "api/fabrics");
  }

  /** Sends a sewing pattern, or a mesh; the server checks that it can be sewn or worn. */
  uploadGarment(content: Blob, name: string, reading: MeshReading = { units: null, up: null }): Promise<Garment> {
    const query = new URLSearchParams({ name });
    if (reading.units) query.set("units", reading.units);
    if (reading.up) query.set("up", reading.up);
    return this.ask("POST", `api/garments?${query.toString()}`, content);
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

  /** Address of a session's stream. */
  streamUrl(session: SessionInfo): string {
    const url = new URL(session.stream.replace(/^\//, ""), this.base);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    return url.href;
  }

  private async ask<T>(method: string, path: string, body?: BodyInit): Promise<T> {
    const init: RequestInit = { method, headers: { accept: "application/json" } };
    if (body !== undefined) {
      init.body = body;
      init.headers = { accept: "application/json", "content-type": "application/json" };
    }
    let response: Response;
    try {
      response = await this.fetcher(new URL(path, this.base), init);
    } catch {
      throw new RequestError("The server doesn't answer.", "", "See whether it runs, and try again.", 0);
    }
    const text = await response.text();
    const reply = parse(text);
    if (response.ok) return reply as T;
    throw refusal(reply, response.status);
  }
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
