// Written by `python -m tryon_protocol.generate_ts` from protocol/tryon_protocol/messages.py. Don't edit.

export const SUBPROTOCOL = "tryon.v1";
export const MAJOR_VERSION = 1;
export const MAX_CLIENT_MESSAGE_BYTES = 65536;
export const POSE_CONVENTION = "model-local";
export const POSE_FRAME = "session";
export const CREDIT = 2;
export const FRAME_MAGIC = 193;
export const FRAME_KIND = 1;
export const FRAME_HEADER_BYTES = 64;
export const FLAG_OFFSETS_ZSTD = 1;
export const ORIGIN_LIMIT = 2147418112;
export const GRID = 6.25e-05;

export const Codec = { RAW: 0, KEY: 1, DELTA1: 2, DELTA2: 3 } as const;

/** An array as bytes: never without its dtype and its shape. */
export interface ArrayData {
  /** type of one element, little-endian */
  dtype: "float32" | "float64" | "int16" | "int32" | "uint16" | "uint32" | "uint8";
  /** extent of each axis, the last one varies fastest (C order) */
  shape: readonly number[];
  /** how `data` is compressed */
  codec: "none" | "zstd";
  /** elements in C order; product of shape times element size bytes inflated */
  data: Uint8Array;
}

/** What does not change from frame to frame about the garment. */
export interface ClothTopology {
  /** number N of welded cloth vertices in a frame */
  vertex_count: number;
  /** uint32 (F,3): vertex numbers of each triangle, counter-clockwise from outside */
  faces: ArrayData;
  /** float32 (F,3,2) m: pattern coordinates of each triangle corner, discontinuous at seams. Default: null */
  uv?: ArrayData | null;
  /** uint16 (F,): index into `panel_names` of each triangle's pattern piece. Default: null */
  panel_of_face?: ArrayData | null;
  /** names of the pattern pieces; empty: not told. Default: [] */
  panel_names?: readonly string[];
}

/** The body model of the session: a surface of B vertices bound to J joints, posed by PROTOCOL.md section 8. */
export interface BodyTopology {
  /** float32 (B,3) m: surface in the rest pose, Y up, facing +Z */
  rest_vertices: ArrayData;
  /** uint32 (F,3): closed triangles, counter-clockwise from outside */
  faces: ArrayData;
  /** J names, the order of a pose's rotations */
  joint_names: readonly string[];
  /** int32 (J,): parent of each joint; -1 for joint 0, parents precede children */
  parents: ArrayData;
  /** float32 (J,3) m: joint centres in the rest pose */
  rest_joints: ArrayData;
  /** uint16 (B,K): joints that move each vertex */
  skin_joints: ArrayData;
  /** float32 (B,K): their weights, each row sums to 1 */
  skin_weights: ArrayData;
}

/** First message of a client. The server answers with `welcome`, or with a fatal `error`. */
export interface HelloMessage {
  type: "hello";
  /** major protocol versions the client speaks */
  versions: readonly number[];
  /** name and version of the client program, for logs */
  client: string;
  /** frame compression the client can inflate: "zstd"; uncompressed needs no name. Default: ["zstd"] */
  codecs?: readonly string[];
  /** token from an earlier `welcome`, to be known again; null: new. Default: null */
  resume?: string | null;
}

/** One tracked pose of one body. The newest one wins; older ones that were not used yet are dropped. */
export interface PoseMessage {
  type: "pose";
  /** whose body this is, a subject listed in `welcome` */
  subject: string;
  /**
   * what `rotations` mean: "model-local", the rotation of each joint of the session's body relative to its
   * parent and to the rest pose
   */
  convention: string;
  /** coordinate system of `root`: "session", right-handed, metres, Y up, body faces +Z at rest */
  frame: string;
  /** s, when the pose was captured, on the sender's steady clock */
  t: number;
  /** number of this pose, growing; frames name the pose they were solved for */
  seq: number;
  /** m, float64 [3]: position of joint 0 in `frame` */
  root: readonly [number, number, number];
  /** [J][4]: unit quaternion x, y, z, w of each joint, in the topology's order */
  rotations: readonly (readonly [number, number, number, number])[];
  /** newest frame seq the client has decoded; 0: none yet. Default: 0 */
  ack?: number;
}

/** Acknowledges frames when no pose is being sent. At most `welcome.credit` frames travel unacknowledged. */
export interface AckMessage {
  type: "ack";
  /** newest frame seq the client has decoded */
  seq: number;
}

/** The client can't decode what comes next (it lacks the base): the next frame shall stand alone. */
export interface KeyframeRequestMessage {
  type: "keyframe_request";
  /** for logs. Default: "" */
  reason?: string;
}

/** Let the session's time run on, from where `pause` stopped it. */
export interface PlayMessage {
  type: "play";
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Stop the session's time: body and cloth stand still as they are, and nothing is simulated until `play`. */
export interface PauseMessage {
  type: "pause";
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Choose what moves the body: a motion the server plays, or the poses clients send. */
export interface SetMotionMessage {
  type: "set_motion";
  /** a name of `welcome.motions`; null: poses sent by a client */
  motion: string | null;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Choose the fabric of the garment. */
export interface SetFabricMessage {
  type: "set_fabric";
  /** a name of `welcome.fabrics` */
  fabric: string;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Asks for a `pong` at once: round trip and clock offset. */
export interface PingMessage {
  type: "ping";
  /** s, the client's steady clock at sending; repeated in the answer */
  t: number;
}

/** The client leaves; the server closes with code 1000. */
export interface ByeMessage {
  type: "bye";
  /** for logs. Default: "" */
  reason?: string;
}

/** Answer to `hello`: what was agreed, and the state of the session. */
export interface WelcomeMessage {
  type: "welcome";
  /** major protocol version both sides speak from here on */
  version: number;
  /** identifier of the session */
  session: string;
  /** changes when the server restarts: sequence numbers begin anew */
  epoch: string;
  /** name and version of the server program, for logs */
  server: string;
  /** s, the server's steady clock at sending */
  clock: number;
  /** most frames that travel unacknowledged to this client */
  credit: number;
  /** topology that follows; 0: none yet, the garment is being dressed */
  topology_id: number;
  /** bodies of this session that poses may be sent for */
  subjects: readonly string[];
  /** motions the server can play here */
  motions: readonly string[];
  /** fabrics to choose from */
  fabrics: readonly string[];
  /** for `hello.resume` after a lost connection. Default: null */
  resume_token?: string | null;
}

/** Everything that frames refer to. Sent before the first frame, and again with a new id whenever it changes. */
export interface TopologyMessage {
  type: "topology";
  /** number that frames repeat */
  topology_id: number;
  /** m, edge q of the grid that positions are rounded to */
  grid: number;
  /** the garment */
  cloth: ClothTopology;
  /** the body model */
  body: BodyTopology;
}

/** State of the session, sent on joining and on every change. */
export interface StatusMessage {
  type: "status";
  /**
   * preparing: starting or compiling; dressing; running; paused: held by a client; waiting: no pose has arrived
   * lately; failed: see detail, the session can't go on; closed
   */
  state: "closed" | "dressing" | "failed" | "paused" | "preparing" | "running" | "waiting";
  /** one sentence for people */
  detail: string;
  /** motion being played; null: poses sent by a client */
  motion: string | null;
  /** fabric in use */
  fabric: string;
  /** false while held by `pause` */
  playing: boolean;
  /** share done of preparing or dressing, 0 to 1; null: not known. Default: null */
  progress?: number | null;
}

/** What the solver did for one published frame. Sent at most a few times a second, the newest wins. */
export interface ReportMessage {
  type: "report";
  /** the frame this speaks of */
  seq: number;
  /** s, simulated time of that frame */
  t_sim: number;
  /** outer iterations of the last step */
  iterations: number;
  /** relative residual at the end of the last step, dimensionless */
  residual: number;
  /** m, smallest distance between surfaces among near pairs; null: none near */
  min_gap: number | null;
  /** largest principal stretch, 1 is unstretched */
  max_stretch: number;
  /** m, largest distance of the simulated body from the posed skin */
  body_lag: number;
  /** contact pairs in the last step */
  pairs: number;
  /** steps voided and redone for this frame */
  retries: number;
  /** ms of wall time spent for this frame, by stage */
  times_ms: Record<string, number>;
  /** ms of wall time from pose taken to frame solved */
  solver_ms: number;
  /** 1/s, published frames per wall second, recent mean */
  frames_per_second: number;
  /** simulated seconds per wall second, recent mean; 1 is real time */
  real_time_factor: number;
}

/** Something the client sent, or the session itself, is at fault. Unless `fatal`, the connection goes on. */
export interface ErrorMessage {
  type: "error";
  /** name of the fault, PROTOCOL.md section 6 */
  code: string;
  /** where it lies, such as "$.rotations[3]" */
  place: string;
  /** what is wrong */
  message: string;
  /** what to change */
  remedy: string;
  /** true: the server closes the connection after this message. Default: false */
  fatal?: boolean;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Answer to `ping`. */
export interface PongMessage {
  type: "pong";
  /** s, `ping.t` repeated: the client's clock */
  t: number;
  /** s, the server's steady clock at answering */
  clock: number;
}

/** The server is about to close this connection in good order (it restarts, or the session ends). */
export interface GoodbyeMessage {
  type: "goodbye";
  /** one sentence for people */
  reason: string;
  /** s to wait before connecting again; null: don't, the session has ended. Default: null */
  retry_after?: number | null;
}

export type ClientMessage =
  | HelloMessage
  | PoseMessage
  | AckMessage
  | KeyframeRequestMessage
  | PlayMessage
  | PauseMessage
  | SetMotionMessage
  | SetFabricMessage
  | PingMessage
  | ByeMessage;

export const CLIENT_MESSAGE_TYPES: readonly ClientMessage["type"][] = ["hello", "pose", "ack", "keyframe_request", "play", "pause", "set_motion", "set_fabric", "ping", "bye"];

export type ServerMessage =
  | WelcomeMessage
  | TopologyMessage
  | StatusMessage
  | ReportMessage
  | ErrorMessage
  | PongMessage
  | GoodbyeMessage;

export const SERVER_MESSAGE_TYPES: readonly ServerMessage["type"][] = ["welcome", "topology", "status", "report", "error", "pong", "goodbye"];

export function isHelloMessage(message: { type: string }): message is HelloMessage {
  return message.type === "hello";
}

export function isPoseMessage(message: { type: string }): message is PoseMessage {
  return message.type === "pose";
}

export function isAckMessage(message: { type: string }): message is AckMessage {
  return message.type === "ack";
}

export function isKeyframeRequestMessage(message: { type: string }): message is KeyframeRequestMessage {
  return message.type === "keyframe_request";
}

export function isPlayMessage(message: { type: string }): message is PlayMessage {
  return message.type === "play";
}

export function isPauseMessage(message: { type: string }): message is PauseMessage {
  return message.type === "pause";
}

export function isSetMotionMessage(message: { type: string }): message is SetMotionMessage {
  return message.type === "set_motion";
}

export function isSetFabricMessage(message: { type: string }): message is SetFabricMessage {
  return message.type === "set_fabric";
}

export function isPingMessage(message: { type: string }): message is PingMessage {
  return message.type === "ping";
}

export function isByeMessage(message: { type: string }): message is ByeMessage {
  return message.type === "bye";
}

export function isWelcomeMessage(message: { type: string }): message is WelcomeMessage {
  return message.type === "welcome";
}

export function isTopologyMessage(message: { type: string }): message is TopologyMessage {
  return message.type === "topology";
}

export function isStatusMessage(message: { type: string }): message is StatusMessage {
  return message.type === "status";
}

export function isReportMessage(message: { type: string }): message is ReportMessage {
  return message.type === "report";
}

export function isErrorMessage(message: { type: string }): message is ErrorMessage {
  return message.type === "error";
}

export function isPongMessage(message: { type: string }): message is PongMessage {
  return message.type === "pong";
}

export function isGoodbyeMessage(message: { type: string }): message is GoodbyeMessage {
  return message.type === "goodbye";
}
