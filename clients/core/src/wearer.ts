import { WEBXR_JOINTS, type PoseMessage, type SkeletonMessage } from "@tryon/protocol";

/** The parts of WebXR that are read here, by shape alone: a test passes its own. */
export interface Transform {
  readonly position: { readonly x: number; readonly y: number; readonly z: number };
  readonly orientation: { readonly x: number; readonly y: number; readonly z: number; readonly w: number };
}
export interface Posed {
  readonly transform: Transform;
  /** the place is guessed, not seen */
  readonly emulatedPosition?: boolean;
}
export interface Hand<Space> {
  get(joint: string): Space | undefined;
}
export interface InputSource<Space> {
  readonly handedness: string;
  readonly hand?: Hand<Space> | null;
  readonly gripSpace?: Space | null;
}
export interface TrackedFrame<Space> {
  /** of WebXR Body Tracking Level 1; absent where the browser has none */
  readonly body?: ReadonlyMap<string, Space> | null;
  getPose(space: Space, base: Space): Posed | null | undefined;
  getViewerPose(base: Space): Posed | null | undefined;
}

/** How the wearer is tracked at present. */
export type Tracking = "body" | "head and hands" | "nothing";

type Message = SkeletonMessage | PoseMessage;
type Vector = readonly [number, number, number];
type Quaternion = readonly [number, number, number, number];
type Convention = "webxr" | "head-hands";

const VIEWER = "viewer";
/** what the server reads of a body: fingers but for two knuckles, and joints that only carry twist, are left out */
const BODY_JOINTS = WEBXR_JOINTS.filter(
  (name) => name !== VIEWER && (!name.includes("-hand-") || /-hand-(wrist|(index|little)-phalanx-proximal)$/.test(name)),
);
const NOWHERE: Vector = [0, 0, 0];
const IDENTITY: Quaternion = [0, 0, 0, 1];
const QUARTER = Math.SQRT1_2;

/**
 * Turns what a headset tracks of its wearer into messages: the skeleton first, then a pose per frame. Where there is no
 * body, head and hands go instead and the server does the rest by inverse kinematics.
 */
export class Wearer<Space> {
  tracking: Tracking = "nothing";
  /** poses made so far on this connection */
  seq = 0;
  private announced: Convention | undefined;

  /** @param subject whose body it is, one of `welcome.subjects` */
  constructor(private readonly subject: string) {}

  /**
   * What to send for this frame; nothing while nothing is tracked.
   * @param base the session's space: its floor at 0, y up
   * @param t capture time on our steady clock [s]
   */
  read(frame: TrackedFrame<Space>, sources: Iterable<InputSource<Space>>, base: Space, t: number): Message[] {
    const viewer = frame.getViewerPose(base)?.transform;
    const found = new Map<string, Transform>();
    for (const name of frame.body ? BODY_JOINTS : []) {
      const space = frame.body?.get(name);
      const posed = space && frame.getPose(space, base);
      if (posed) found.set(name, posed.transform);
    }
    if (found.has("hips")) {
      if (viewer) found.set(VIEWER, viewer);
      this.tracking = "body";
      return this.messages("webxr", [...BODY_JOINTS, VIEWER], found, t);
    }
    if (!viewer) {
      this.tracking = "nothing";
      return [];
    }
    this.tracking = "head and hands";
    const hands = readHands(frame, sources, base);
    hands.set(VIEWER, viewer);
    return this.messages("head-hands", [VIEWER, "left-hand-wrist", "right-hand-wrist"], hands, t);
  }

  private messages(convention: Convention, names: readonly string[], found: ReadonlyMap<string, Transform>, t: number): Message[] {
    const messages: Message[] = [];
    if (this.announced !== convention) {
      this.announced = convention;
      messages.push({ type: "skeleton", subject: this.subject, convention, joint_names: names });
    }
    this.seq += 1;
    messages.push({
      type: "pose",
      subject: this.subject,
      convention,
      frame: "session",
      clock: "sender",
      t,
      seq: this.seq,
      positions: names.map((name) => placeOf(found.get(name))),
      rotations: names.map((name) => turnOf(found.get(name))),
      confidence: names.map((name) => (found.has(name) ? 1 : 0)),
    });
    return messages;
  }
}

function placeOf(transform: Transform | undefined): Vector {
  return transform ? [transform.position.x, transform.position.y, transform.position.z] : NOWHERE;
}

function turnOf(transform: Transform | undefined): Quaternion {
  const turn = transform?.orientation;
  return turn ? [turn.x, turn.y, turn.z, turn.w] : IDENTITY;
}

/** Wrists of tracked hands, or of hands that hold a controller. */
function readHands<Space>(
  frame: TrackedFrame<Space>,
  sources: Iterable<InputSource<Space>>,
  base: Space,
): Map<string, Transform> {
  const hands = new Map<string, Transform>();
  for (const { handedness, hand, gripSpace } of sources) {
    if (handedness !== "left" && handedness !== "right") continue;
    const wrist = hand?.get("wrist");
    const tracked = wrist && frame.getPose(wrist, base);
    const held = !tracked && gripSpace ? frame.getPose(gripSpace, base) : undefined;
    if (tracked) hands.set(`${handedness}-hand-wrist`, tracked.transform);
    else if (held) hands.set(`${handedness}-hand-wrist`, wristOfGrip(held.transform, handedness));
  }
  return hands;
}

/** A fist around a controller has its thumb up, so that the back of the hand faces outward: +Y of the wrist, ±X of the grip. */
function wristOfGrip(grip: Transform, side: "left" | "right"): Transform {
  const { x, y, z, w } = grip.orientation;
  const s = side === "right" ? -QUARTER : QUARTER;
  const c = QUARTER;
  return { position: grip.position, orientation: { x: x * c + y * s, y: y * c - x * s, z: z * c + w * s, w: w * c - z * s } };
}
