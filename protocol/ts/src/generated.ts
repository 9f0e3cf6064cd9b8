// Written by `python -m tryon_protocol.generate_ts` from protocol/tryon_protocol/messages.py. Don't edit.

export const SUBPROTOCOL = "tryon.v1";
export const MAJOR_VERSION = 1;
export const MAX_CLIENT_MESSAGE_BYTES = 65536;
export const POSE_CONVENTION = "model-local";
export const POSE_FRAME = "session";
export const POSE_CLOCK = "sender";
export const CREDIT = 2;
export const FRAME_MAGIC = 193;
export const FRAME_KIND = 1;
export const FRAME_HEADER_BYTES = 64;
export const FLAG_OFFSETS_ZSTD = 1;
export const ORIGIN_LIMIT = 2147418112;
export const GRID = 6.25e-05;

export const WEBXR_JOINTS: readonly string[] = ["hips", "spine-lower", "spine-middle", "spine-upper", "chest", "neck", "head", "left-shoulder", "left-scapula", "left-arm-upper", "left-arm-lower", "left-hand-wrist-twist", "right-shoulder", "right-scapula", "right-arm-upper", "right-arm-lower", "right-hand-wrist-twist", "left-hand-palm", "left-hand-wrist", "left-hand-thumb-metacarpal", "left-hand-thumb-phalanx-proximal", "left-hand-thumb-phalanx-distal", "left-hand-thumb-tip", "left-hand-index-metacarpal", "left-hand-index-phalanx-proximal", "left-hand-index-phalanx-intermediate", "left-hand-index-phalanx-distal", "left-hand-index-tip", "left-hand-middle-metacarpal", "left-hand-middle-phalanx-proximal", "left-hand-middle-phalanx-intermediate", "left-hand-middle-phalanx-distal", "left-hand-middle-tip", "left-hand-ring-metacarpal", "left-hand-ring-phalanx-proximal", "left-hand-ring-phalanx-intermediate", "left-hand-ring-phalanx-distal", "left-hand-ring-tip", "left-hand-little-metacarpal", "left-hand-little-phalanx-proximal", "left-hand-little-phalanx-intermediate", "left-hand-little-phalanx-distal", "left-hand-little-tip", "left-hand-middle-phalanx-metacarpal", "right-hand-palm", "right-hand-wrist", "right-hand-thumb-metacarpal", "right-hand-thumb-phalanx-proximal", "right-hand-thumb-phalanx-distal", "right-hand-thumb-tip", "right-hand-index-metacarpal", "right-hand-index-phalanx-proximal", "right-hand-index-phalanx-intermediate", "right-hand-index-phalanx-distal", "right-hand-index-tip", "right-hand-middle-metacarpal", "right-hand-middle-phalanx-proximal", "right-hand-middle-phalanx-intermediate", "right-hand-middle-phalanx-distal", "right-hand-middle-tip", "right-hand-ring-metacarpal", "right-hand-ring-phalanx-proximal", "right-hand-ring-phalanx-intermediate", "right-hand-ring-phalanx-distal", "right-hand-ring-tip", "right-hand-little-metacarpal", "right-hand-little-phalanx-proximal", "right-hand-little-phalanx-intermediate", "right-hand-little-phalanx-distal", "right-hand-little-tip", "right-hand-middle-phalanx-metacarpal", "left-upper-leg", "left-lower-leg", "right-upper-leg", "right-lower-leg", "left-foot-ankle-twist", "left-foot-ankle", "left-foot-subtalar", "left-foot-transverse", "left-foot-ball", "right-foot-ankle-twist", "right-foot-ankle", "right-foot-subtalar", "right-foot-transverse", "right-foot-ball", "viewer"];
export const WEBXR_REQUIRED: readonly string[] = ["hips", "left-arm-upper", "left-arm-lower", "left-hand-wrist", "right-arm-upper", "right-arm-lower", "right-hand-wrist"];
export const MEDIAPIPE_JOINTS: readonly string[] = ["nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer", "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index", "left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_heel", "right_heel", "left_foot_index", "right_foot_index"];

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

/**
 * One garment of what is worn: which vertices, triangles and pattern pieces of the cloth are its own. They lie
 * one after the other.
 */
export interface GarmentTopology {
  /** its name among what is worn, as edits name it */
  name: string;
  /** what it is made of */
  fabric: string;
  /** its first vertex and how many it has */
  vertices: readonly [number, number];
  /** its first triangle and how many it has */
  faces: readonly [number, number];
  /** its first pattern piece and how many it has */
  panels: readonly [number, number];
}

/** What does not change from frame to frame about what is worn. */
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
  /** what is worn, from the innermost outwards; empty: one garment, of which nothing is told. Default: [] */
  garments?: readonly GarmentTopology[];
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

/** An edge of a piece. */
export interface DesignEdge {
  /** vertices where it starts and ends */
  ends: readonly [number, number];
  /** what it is drawn as */
  shape: "arc" | "cubic" | "line" | "quadratic";
  /** m: what `move_handle` moves, in its order; of a line at its thirds, of an arc its middle */
  handles: readonly (readonly [number, number])[];
  /** m: points along it, ends included, to draw it by */
  points: readonly (readonly [number, number])[];
}

/** A piece of the pattern, in its own plane. */
export interface DesignPanel {
  /** by which edits name it */
  name: string;
  /** for people; "": none */
  label: string;
  /** m: its corners, by the numbers that edits use */
  vertices: readonly (readonly [number, number])[];
  /** around its outline, by the numbers that edits use */
  edges: readonly DesignEdge[];
}

/** Two edges that are sewn together. */
export interface DesignSeam {
  /** number of a panel, and of an edge in it */
  first: readonly [number, number];
  /** what it is sewn to */
  second: readonly [number, number];
  /** by which people know it: it stays as other seams come and go; 0: its place in the list. Default: 0 */
  number?: number;
}

/** A piece that lies on another and is sewn on it, as a pocket is. */
export interface DesignPatch {
  /** number of the piece */
  panel: number;
  /** number of the panel that it lies on */
  host: number;
  /** m: its outline there, in that panel's plane */
  points: readonly (readonly [number, number])[];
}

/** A change of the pattern that was asked for and is not worn yet. */
export interface ChangeStatus {
  /** what was asked for */
  step: "edit" | "redo" | "undo";
  /** of the edit; empty of undo and redo */
  kind: string;
  /** the piece that the edit names; empty where it names none */
  panel: string;
  /** the garment that it names; empty: the edited one */
  garment: string;
  /** s, when it was asked for, server's clock as in `pong` */
  since: number;
  /**
   * waiting: others are made first, or the garment is put on; remeshing: its mesh is made; building: that is put
   * on where the garment is worn; dressing: it is put on anew; settling: it is brought to where the body is;
   * refused: see detail; of one that was asked for without a connection, lately
   */
  doing: "building" | "dressing" | "refused" | "remeshing" | "settling" | "waiting";
  /** the same, for people. Default: "" */
  detail?: string;
  /** share of that done, 0 to 1; null: not known. Default: null */
  progress?: number | null;
}

/** What accuracy one frame was solved to, and what that took. */
export interface FramePrice {
  /** ms of wall time from pose taken to frame solved */
  solver_ms: number;
  /** m, as `report.error`; null: unknown */
  error: number | null;
  /** as `report.late_ms`. Default: 0 */
  late_ms?: number;
}

/** An edit that was made and is kept. */
export interface DesignEdit {
  /** its number in this session; never given twice */
  id: number;
  /** what kind of edit it is */
  kind: string;
  /** the piece it names; "": the whole garment */
  panel: string;
}

/** An effect in this session. */
export interface EffectState {
  /** its name; GET /api/effects says what each is and takes */
  name: string;
  /** absent: costs nothing; armed: its kernels are compiled, nothing else; active: it acts */
  state: "absent" | "active" | "armed";
  /** what is under way on the way to what was asked for; "": nothing. Default: "" */
  pending?: "" | "binding" | "compiling";
  /** all of them, as they stand; of what is absent as last, or by default */
  parameters?: Record<string, unknown>;
  /** for people: why it is what it is. Default: "" */
  why?: string;
  /** a frame's calls of its stages, as measured last; null: not measured. Default: null */
  ms?: number | null;
  /** ms of a call of each stage, as measured last */
  stages?: Record<string, number>;
}

/** An effect that was asked for before the garment was worn, and has not come to be as asked yet. */
export interface KeptEffect {
  /** its name, as it was asked for */
  name: string;
  /** what it is to be once the garment is worn */
  state: "absent" | "active" | "armed";
  /** that it was asked for with; null: as they will stand. Default: null */
  parameters?: Record<string, unknown> | null;
  /** for people: why the worn garment can't have it, and what to do about it; "": it waits. Default: "" */
  refused?: string;
}

/** A garment that the session wears. */
export interface WornGarment {
  /** its name in `cloth.garments`, as edits name it */
  name: string;
  /** id of the garment that it is */
  garment: string;
  /** what it is made of */
  fabric: string;
  /** of its pattern, over its own; "fit": the one that fits */
  size: number | "fit";
  /** edits are of this one */
  edited: boolean;
  /** it was taken off and put on again for this change. Default: false */
  again?: boolean;
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

/**
 * What a tracker's poses consist of: its joints, in the order of the poses' arrays, and its own rest pose. Sent
 * before the first pose of another convention than "model-local", and again when any of it changes. The rest
 * pose stands upright, in metres, Y up, facing +Z.
 */
export interface SkeletonMessage {
  type: "skeleton";
  /** whose body this is, a subject listed in `welcome` */
  subject: string;
  /** "webxr", "head-hands", "mediapipe", "smpl" or "bvh": whose names and numbers these are */
  convention: string;
  /** [K]: the convention's names of the joints that are sent */
  joint_names: readonly string[];
  /** [K]: parent of each joint, -1 for joint 0; "bvh" needs it; []: not told. Default: [] */
  parents?: readonly number[];
  /** [K][3] m: joints in the rest pose; "bvh" needs it; []: not told. Default: [] */
  rest_positions?: readonly (readonly [number, number, number])[];
  /**
   * [K][4]: x, y, z, w of each joint's axes in the rest pose, for conventions whose poses hold world rotations;
   * []: not told. Default: []
   */
  rest_rotations?: readonly (readonly [number, number, number, number])[];
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** One tracked pose of one body. The newest one wins; older ones that were not used yet are dropped. */
export interface PoseMessage {
  type: "pose";
  /** whose body this is, a subject listed in `welcome` */
  subject: string;
  /**
   * what the arrays mean: "model-local", the rotation of each joint of the session's body relative to its parent
   * and to the rest pose, or the convention of an earlier `skeleton`
   */
  convention: string;
  /**
   * coordinate system of the positions: "session", right-handed, metres, Y up, floor at 0; "mediapipe-world", as
   * MediaPipe gives its world landmarks
   */
  frame: string;
  /** s, when the pose was captured, on the clock named by `clock` */
  t: number;
  /** number of this pose, growing; frames name the pose they were solved for */
  seq: number;
  /** m, float64 [3]: position of joint 0, for "model-local", "smpl" and "bvh"; null: none. Default: null */
  root?: readonly [number, number, number] | null;
  /**
   * [J][4]: unit quaternion x, y, z, w of each joint: local, in the order of the topology or of `skeleton`; in
   * the world for "webxr" and "head-hands"; [] for "mediapipe". Default: []
   */
  rotations?: readonly (readonly [number, number, number, number])[];
  /** m, [K][3]: place of each joint of `skeleton`, for "webxr", "head-hands", "mediapipe"; else []. Default: [] */
  positions?: readonly (readonly [number, number, number])[];
  /** [K]: how surely each joint is seen, 0 to 1; below 0.5 its numbers are not used; []: all are. Default: [] */
  confidence?: readonly number[];
  /**
   * whose steady clock `t` is on: "sender", or "server" for one who has converted it by `ping`. Default:
   * "sender"
   */
  clock?: string;
  /**
   * how the server filters this stream: "one-euro" or "none"; null: "none" for "model-local", "one-euro" for
   * trackers. Default: null
   */
  smoothing?: string | null;
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

/**
 * Choose how accurately the session's frames are solved from the next one on, and what each may take; and, once
 * it is built beside what is worn, by which preset. Nothing is dressed anew. Whatever is chosen, no frame
 * penetrates.
 */
export interface SetAccuracyMessage {
  type: "set_accuracy";
  /** m, 1e-6 to 0.1: `report.error` that a frame is solved down to; null: as the preset has it. Default: null */
  accuracy?: number | null;
  /** ms, 1 to 10 000: wall time that solving a frame may take; null: what it takes. Default: null */
  deadline_ms?: number | null;
  /** draft, live, fit or reference; null: that which the session was opened with. Default: null */
  preset?: string | null;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/**
 * Have an effect act in the session, change it, or have it armed: its kernels compiled and nothing else.
 * Answered by `effects`, or by `error` and nothing has changed. An effect that acts already and is only changed
 * in what may be written to a running scene does so from the next frame on; otherwise it is made ready beside
 * the simulation and taken up between two frames. Asked for before the garment is worn it is `kept` until then,
 * which `effects` says at once; what that garment can't have is refused then.
 */
export interface SetEffectMessage {
  type: "set_effect";
  /** a name of `effects`, or "auto": arm what garment and motion may call for */
  name: string;
  /** parameters by name, those left out as they are by default; null: as they stand. Default: null */
  parameters?: Record<string, unknown> | null;
  /** what it is to be. Default: "active" */
  state?: "active" | "armed";
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Have an effect act no longer in the session, nor be armed. Answered as `set_effect`. */
export interface RemoveEffectMessage {
  type: "remove_effect";
  /** a name of `effects`, or "auto" */
  name: string;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Have what each effect takes measured, in the scene as it is. Answered by `effects`. */
export interface MeasureEffectsMessage {
  type: "measure_effects";
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/**
 * Put a garment on over what is worn, or at another place in the order; it is the one that edits are of then.
 * Answered by `outfit` once it is worn, or by `error` and nothing has changed. Frames of what is worn go on
 * meanwhile.
 */
export interface PutOnMessage {
  type: "put_on";
  /** id of a garment, from GET /api/garments */
  garment: string;
  /** one of `welcome.fabrics`; null: its pattern's own. Default: null */
  fabric?: string | null;
  /** of its pattern, over its own. Default: 1.0 */
  size?: number;
  /** from the innermost, 0; null: outermost, or where the one was that it replaces. Default: null */
  position?: number | null;
  /** a worn garment that it takes the place of. Default: null */
  replaces?: string | null;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Take a garment off; the others stay as they are. Answered as `put_on`. */
export interface TakeOffMessage {
  type: "take_off";
  /** a name of `cloth.garments` */
  garment: string;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/**
 * Wear the same garments in another order, or edit another one of them. Answered as `put_on`; what has to pass
 * through others is taken off for it and put on again.
 */
export interface ReorderMessage {
  type: "reorder";
  /** names of all that is worn, from the innermost outwards; null: as they are. Default: null */
  order?: readonly string[] | null;
  /** which one edits are of; null: the same. Default: null */
  edited?: string | null;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/**
 * Change the garment's pattern while it is worn. The server answers `edited`, or `error` and nothing has
 * changed. With `hold` the change is shown and not kept, as while it is dragged: the next `edit` takes its
 * place, and of those that come between two frames the newest counts. It is always a change of the pattern that
 * is kept.
 */
export interface EditMessage {
  type: "edit";
  /** `kind` and the fields of that kind, PROTOCOL.md section 3.2; null: show what is kept */
  edit: Record<string, unknown> | null;
  /** do the same on the symmetric piece, or side. Default: false */
  mirror?: boolean;
  /** show it, don't keep it; there is no `edited`. Default: false */
  hold?: boolean;
  /** a name of `topology.cloth.garments`, edited from now on; "": the edited one. Default: "" */
  garment?: string;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Take the last edit back. Answered as `edit`. */
export interface UndoMessage {
  type: "undo";
  /** a name of `topology.cloth.garments`, edited from now on; "": the edited one. Default: "" */
  garment?: string;
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
}

/** Make the edit again that was taken back last. Answered as `edit`. */
export interface RedoMessage {
  type: "redo";
  /** a name of `topology.cloth.garments`, edited from now on; "": the edited one. Default: "" */
  garment?: string;
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
  /** for people: what there is to say about the fit of the dressed garment; "": it fits. Default: "" */
  fit?: string;
  /** size of the pattern, over its own, that `fit` advises; null: none. Default: null */
  fitting_size?: number | null;
  /** for people: how garment and body were read from files that say little, and what was mended. Default: [] */
  notes?: readonly string[];
  /** size in which the dressed pattern is worn, over its own; null: not dressed, or a mesh. Default: null */
  worn_size?: number | null;
  /** m, as chosen by `set_accuracy`. Default: null */
  accuracy?: number | null;
  /** ms, as chosen by `set_accuracy`. Default: null */
  deadline_ms?: number | null;
  /** likewise; null: that which the session was opened with. Default: null */
  preset?: string | null;
  /** by which frames are solved; "": none are yet. Default: "" */
  preset_in_force?: string;
  /** what was chosen is not in force yet: it is built beside. Default: false */
  preset_pending?: boolean;
  /** of the pattern, that are not worn yet, in their order. Default: [] */
  changes?: readonly ChangeStatus[];
}

/** What the solver did for one published frame. Sent at most a few times a second, the newest wins. */
export interface ReportMessage {
  type: "report";
  /** the frame this speaks of */
  seq: number;
  /** s, time of the pose that frame shows, poses' clock */
  t_sim: number;
  /** outer iterations of the last step */
  iterations: number;
  /** relative residual at the end of the last step, dimensionless */
  residual: number;
  /**
   * m, smallest distance of a contact pair less its offset; below 0 it is closer than its offset, at -gap_offset
   * its surfaces would touch; null: none near
   */
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
  /** m, that pair's offset, the thickness kept between its surfaces: they are the sum apart. Default: null */
  gap_offset?: number | null;
  /** for people: what is out of bounds, and what to try; "": nothing is. Default: "" */
  advice?: string;
  /** nothing moves: the garment is left as it is until it does. Default: false */
  asleep?: boolean;
  /** m, estimated RMS distance of the cloth from where a step's equations balance; null: unknown. Default: null */
  error?: number | null;
  /** ms that solving took beyond `status.deadline_ms`. Default: 0 */
  late_ms?: number;
  /**
   * each frame solved since the report before, published or not, the oldest first, of more than 256 the newest;
   * none of a garment asleep. Default: []
   */
  solved?: readonly FramePrice[];
}

/**
 * The effects of the session's scene. Sent on joining once the garment is dressed, and on every change; before,
 * with what is `kept` alone, once something is.
 */
export interface EffectsMessage {
  type: "effects";
  /** all that there are, those that are absent, too; none while the garment is put on first */
  effects: readonly EffectState[];
  /** what garment and motion may call for is armed by itself. Default: false */
  auto?: boolean;
  /** asked for before the garment was worn, in their order. Default: [] */
  kept?: readonly KeptEffect[];
  /** for people: the stages of a step and who takes part in each, with ms where measured. Default: "" */
  plan?: string;
}

/** What the session wears now. Sent to all clients when that was changed, over the websocket or by REST. */
export interface OutfitMessage {
  type: "outfit";
  /** from the innermost outwards */
  worn: readonly WornGarment[];
  /** of the command that this answers, to who sent it. Default: null */
  request?: number | null;
}

/**
 * The edited garment's sewing pattern as it is worn. Sent on joining once it is dressed, and on every change of
 * it. A garment that is a mesh has none.
 */
export interface DesignMessage {
  type: "design";
  /** true: this shows an edit that is not kept (`edit.hold`) */
  held: boolean;
  /** the pieces */
  panels: readonly DesignPanel[];
  /** how they are sewn */
  seams: readonly DesignSeam[];
  /** edits that `undo` can take back, oldest first */
  done: readonly DesignEdit[];
  /** how many edits `redo` can make again */
  undone: number;
  /** for people: which pieces followed, which seams fit no longer as they did. Default: [] */
  notes?: readonly string[];
  /** what lies on other pieces, as pockets do. Default: [] */
  patches?: readonly DesignPatch[];
  /** which of `topology.cloth.garments` it is of; "": it has no name. Default: "" */
  garment?: string;
}

/** Answer to `edit`, `undo` and `redo`: it is done, and kept whatever happens to the server. */
export interface EditedMessage {
  type: "edited";
  /** of the edit that is the last one now; 0: none is left */
  id: number;
  /** value: the same triangles in another shape; topology: another mesh, dressed anew */
  change: "topology" | "value";
  /** number chosen by the client and repeated in the `error` that answers this command; null: none. Default: null */
  request?: number | null;
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
  | SkeletonMessage
  | PoseMessage
  | AckMessage
  | KeyframeRequestMessage
  | PlayMessage
  | PauseMessage
  | SetMotionMessage
  | SetFabricMessage
  | SetAccuracyMessage
  | SetEffectMessage
  | RemoveEffectMessage
  | MeasureEffectsMessage
  | PutOnMessage
  | TakeOffMessage
  | ReorderMessage
  | EditMessage
  | UndoMessage
  | RedoMessage
  | PingMessage
  | ByeMessage;

export const CLIENT_MESSAGE_TYPES: readonly ClientMessage["type"][] = ["hello", "skeleton", "pose", "ack", "keyframe_request", "play", "pause", "set_motion", "set_fabric", "set_accuracy", "set_effect", "remove_effect", "measure_effects", "put_on", "take_off", "reorder", "edit", "undo", "redo", "ping", "bye"];

export type ServerMessage =
  | WelcomeMessage
  | TopologyMessage
  | StatusMessage
  | ReportMessage
  | EffectsMessage
  | OutfitMessage
  | DesignMessage
  | EditedMessage
  | ErrorMessage
  | PongMessage
  | GoodbyeMessage;

export const SERVER_MESSAGE_TYPES: readonly ServerMessage["type"][] = ["welcome", "topology", "status", "report", "effects", "outfit", "design", "edited", "error", "pong", "goodbye"];

export function isHelloMessage(message: { type: string }): message is HelloMessage {
  return message.type === "hello";
}

export function isSkeletonMessage(message: { type: string }): message is SkeletonMessage {
  return message.type === "skeleton";
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

export function isSetAccuracyMessage(message: { type: string }): message is SetAccuracyMessage {
  return message.type === "set_accuracy";
}

export function isSetEffectMessage(message: { type: string }): message is SetEffectMessage {
  return message.type === "set_effect";
}

export function isRemoveEffectMessage(message: { type: string }): message is RemoveEffectMessage {
  return message.type === "remove_effect";
}

export function isMeasureEffectsMessage(message: { type: string }): message is MeasureEffectsMessage {
  return message.type === "measure_effects";
}

export function isPutOnMessage(message: { type: string }): message is PutOnMessage {
  return message.type === "put_on";
}

export function isTakeOffMessage(message: { type: string }): message is TakeOffMessage {
  return message.type === "take_off";
}

export function isReorderMessage(message: { type: string }): message is ReorderMessage {
  return message.type === "reorder";
}

export function isEditMessage(message: { type: string }): message is EditMessage {
  return message.type === "edit";
}

export function isUndoMessage(message: { type: string }): message is UndoMessage {
  return message.type === "undo";
}

export function isRedoMessage(message: { type: string }): message is RedoMessage {
  return message.type === "redo";
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

export function isEffectsMessage(message: { type: string }): message is EffectsMessage {
  return message.type === "effects";
}

export function isOutfitMessage(message: { type: string }): message is OutfitMessage {
  return message.type === "outfit";
}

export function isDesignMessage(message: { type: string }): message is DesignMessage {
  return message.type === "design";
}

export function isEditedMessage(message: { type: string }): message is EditedMessage {
  return message.type === "edited";
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
