import { WEBXR_JOINTS, WEBXR_REQUIRED, type PoseMessage, type SkeletonMessage } from "@tryon/protocol";

/** The parts of WebXR that are read here, by shape alone: a test passes its own. */
export interface Transform {
  readonly position: { readonly x: number; readonly y: number; readonly z: number };
  readonly orientation: { readonly x: number; readonly y: number; readonly z: number; readonly w: number };
}
export interface Posed {
  readonly transform: Transform;
  /** the place is guessed, not seen: a device that only knows how it is turned, or has lost its place */
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
/** after such a silence the server has forgotten which joints it saw [s] */
const SILENCE = 0.5;
/** m in a grip's axes: from the middle of the fist back to the wrist, and out to the back of the hand; as the hands of a Quest have it */
const WRIST_BEHIND_GRIP = 0.065;
const WRIST_OUT_OF_GRIP = 0.036;

/**
 * Turns what a headset tracks of its wearer into messages: the skeleton first, then a pose per frame. Where there is no
 * body, head and hands go instead and the server does the rest by inverse kinematics.
 */
export class Wearer<Space> {
  tracking: Tracking = "nothing";
  /** poses made so far on this connection */
  seq = 0;
  private announced: Convention | undefined;
  private newest = -Infinity;

  /** @param subject whose body it is, one of `welcome.subjects` */
  constructor(private readonly subject: string) {}

  /**
   * What to send for this frame; nothing while nothing is tracked. A body is sent once all is seen of it that the server
   * must have seen once; till then, head and hands.
   * @param base the session's space: its floor at 0, y up
   * @param t capture time on our steady clock [s]
   */
  read(frame: TrackedFrame<Space>, sources: Iterable<InputSource<Space>>, base: Space, t: number): Message[] {
    const head = frame.getViewerPose(base);
    const viewer = head?.transform;
    if (head?.emulatedPosition) {
      this.tracking = "nothing"; // what is measured from the head is where the head is guessed to be
      return [];
    }
    if (t - this.newest >= SILENCE) this.announced = undefined;
    const found = new Map<string, Transform>();
    for (const name of frame.body ? BODY_JOINTS : []) {
      const space = frame.body?.get(name);
      const posed = space && frame.getPose(space, base);
      if (posed) found.set(name, posed.transform);
    }
    const known = this.announced === "webxr" ? ["hips"] : WEBXR_REQUIRED;
    if (known.every((name) => found.has(name))) {
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
    this.newest = t;
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

/** Wrists of tracked hands, or of hands that hold a controller; not where their places are guessed. */
function readHands<Space>(
  frame: TrackedFrame<Space>,
  sources: Iterable<InputSource<Space>>,
  base: Space,
): Map<string, Transform> {
  const hands = new Map<string, Transform>();
  const seen = (space: Space | null | undefined) => {
    const posed = space ? frame.getPose(space, base) : undefined;
    return posed?.emulatedPosition ? undefined : posed?.transform;
  };
  for (const { handedness, hand, gripSpace } of sources) {
    if (handedness !== "left" && handedness !== "right") continue;
    const tracked = seen(hand?.get("wrist"));
    const held = tracked ? undefined : seen(gripSpace);
    if (tracked) hands.set(`${handedness}-hand-wrist`, tracked);
    else if (held) hands.set(`${handedness}-hand-wrist`, wristOfGrip(held, handedness));
  }
  return hands;
}

/**
 * The wrist of a fist around a controller. A grip has -Z towards the thumb and its X square to the palm, out of the back
 * of a right hand and into that of a left one (WebXR Device API, gripSpace), so that -Y is along the hand. A wrist has -Z
 * along the hand and +Y out of its back (WebXR Hand Input).
 */
function wristOfGrip(grip: Transform, side: "left" | "right"): Transform {
  const { x, y, z, w } = grip.orientation;
  const s = side === "right" ? 1 : -1;
  const orientation = {
    x: 0.5 * (x - w - s * (y - z)),
    y: 0.5 * (y - z + s * (x - w)),
    z: 0.5 * (z + y - s * (w + x)),
    w: 0.5 * (w + x + s * (y + z)),
  };
  const out = s * WRIST_OUT_OF_GRIP;
  const back = WRIST_BEHIND_GRIP;
  const position = {
    x: grip.position.x + out * (1 - 2 * (y * y + z * z)) + back * 2 * (x * y - z * w),
    y: grip.position.y + out * 2 * (x * y + z * w) + back * (1 - 2 * (x * x + z * z)),
    z: grip.position.z + out * 2 * (x * z - y * w) + back * 2 * (y * z + x * w),
  };
  return { position, orientation };
}
