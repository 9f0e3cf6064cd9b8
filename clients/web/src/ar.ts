import { steadyNow, Wearer, type Client, type Tracking } from "@tryon/core";

import { byId, setText } from "./dom.ts";
import type { Figure } from "./figure.ts";
import type { Stage } from "./stage.ts";

/** Whom the headset's session talks to. */
export interface ArHost {
  /** the session that is shown, if any */
  client(): Client | undefined;
  /** whose body the session takes poses for */
  subject(): string | undefined;
  /** whether the body can follow a wearer; where it can't, the page says so */
  followable(): boolean;
  /** from now on the body follows the wearer, or again what it followed before */
  follow(wearer: boolean): void;
  /** a picture was drawn in the headset */
  drawn(): void;
  failed(why: string): void;
}

const FEATURES: XRSessionInit = { requiredFeatures: ["local-floor"], optionalFeatures: ["body-tracking", "hand-tracking"] };

/**
 * The button "Enter AR" and what follows: a session of a headset that streams its wearer's poses and shows the garment
 * on them, true to scale. The session's space is the headset's own: its floor is at 0.
 */
export class Ar {
  private readonly button = byId("ar", HTMLButtonElement);
  private readonly view = byId("view");
  private session: XRSession | undefined;
  private wearer: Wearer<XRSpace> | undefined;

  constructor(
    private readonly stage: Stage,
    private readonly figure: Figure,
    private readonly host: ArHost,
  ) {
    this.button.addEventListener("click", () => void this.toggle());
    void this.offer();
  }

  /** A connection has begun: what was announced on an earlier one is forgotten. */
  welcomed(): void {
    this.wearer = undefined;
  }

  /** Browsers offer AR to pages of https only; elsewhere there is no `navigator.xr`. */
  private async offer(): Promise<void> {
    const supported = await navigator.xr?.isSessionSupported("immersive-ar").catch(() => false);
    this.button.hidden = !supported;
  }

  private async toggle(): Promise<void> {
    if (this.session) {
      await this.session.end();
      return;
    }
    if (!this.host.followable()) return;
    this.button.disabled = true;
    try {
      await this.enter(await navigator.xr!.requestSession("immersive-ar", FEATURES));
    } catch (error) {
      this.host.failed(error instanceof Error ? error.message : String(error));
    } finally {
      this.button.disabled = false;
    }
  }

  /** Shows the scene in the session, or ends it when that can't be done, and says why. */
  private async enter(session: XRSession): Promise<void> {
    this.session = session;
    session.addEventListener("end", () => this.left());
    try {
      await this.stage.present(session, (frame, space) => this.draw(session, frame, space));
    } catch (error) {
      await session.end().catch(() => undefined);
      throw error;
    }
    this.wearer = undefined;
    this.figure.occlude(true);
    this.host.follow(true);
    this.show(true);
  }

  private left(): void {
    this.session = undefined;
    this.figure.occlude(false);
    this.figure.object.position.set(0, 0, 0);
    this.stage.leave();
    this.host.follow(false);
    this.show(false);
  }

  private show(inside: boolean): void {
    this.button.ariaPressed = String(inside);
    setText(this.button, inside ? "Leave AR" : "Enter AR");
    this.tell(inside ? "nothing" : undefined);
  }

  /** What is tracked and how many poses have gone out stand in the page, for tests and the curious. */
  private tell(tracking: Tracking | undefined): void {
    if (tracking) this.view.dataset.tracking = tracking;
    else delete this.view.dataset.tracking;
    this.view.dataset.poses = String(this.wearer?.seq ?? 0);
  }

  private draw(session: XRSession, frame: XRFrame, space: XRReferenceSpace): void {
    const client = this.host.client();
    if (!client) return;
    this.send(client, session, frame, space);
    client.scene.take();
    this.figure.update(client.scene);
    const shown = client.scene.figures;
    if (shown) {
      this.figure.object.position.set(shown.anchor[0], shown.anchor[1], shown.anchor[2]);
      this.stage.moveWearer(shown.root[0], shown.root[2]);
    }
    this.host.drawn();
  }

  /** Poses go out once there is a body to follow them. */
  private send(client: Client, session: XRSession, frame: XRFrame, space: XRReferenceSpace): void {
    const subject = this.host.subject();
    if (subject === undefined || !client.scene.body) return;
    this.wearer ??= new Wearer<XRSpace>(subject);
    for (const message of this.wearer.read(frame, session.inputSources, space, steadyNow() / 1000)) client.send(message);
    this.tell(this.wearer.tracking);
  }
}

declare global {
  interface XRFrame {
    /** WebXR Body Tracking Level 1 */
    readonly body?: ReadonlyMap<string, XRSpace> | null;
  }
}
