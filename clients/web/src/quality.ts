/** How finely the picture is drawn, so that it keeps up with the frames on whatever draws it. */

/** Whether this browser draws by its processor alone, for want of a graphics card: it says so in its renderer's name. */
export function drawsInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return false;
  const details = context.getExtension("WEBGL_debug_renderer_info");
  const name = details ? String(context.getParameter(details.UNMASKED_RENDERER_WEBGL)) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

const SLOW_MS = 45;
const SAMPLES = 12;
const LOWEST = 0.5;
const STILL_MS = 350;

/**
 * Chooses the drawn pixels per CSS pixel: as many as the screen has, up to two; fewer while pictures take too long. What
 * has stood still for a moment is drawn once more, finely.
 */
export class PixelRatio {
  /** for a picture that stands still */
  readonly still: number;
  /** for pictures that follow each other; only goes down, since one that keeps changing its sharpness disturbs */
  moving: number;
  private count = 0;
  private total = 0;
  private last = -Infinity;

  constructor(screenRatio: number, software: boolean) {
    this.still = software ? 1.5 : Math.min(screenRatio, 2);
    this.moving = software ? Math.min(screenRatio, 1) * 0.75 : this.still;
  }

  /** Notes one of the pictures that follow each other, drawn at `nowMs`. */
  drawn(nowMs: number): void {
    const interval = nowMs - this.last;
    this.last = nowMs;
    if (interval > STILL_MS || this.moving <= LOWEST) return;
    this.total += interval;
    this.count += 1;
    if (this.count < SAMPLES) return;
    if (this.total / this.count > SLOW_MS) this.moving = Math.max(LOWEST, this.moving * 0.8);
    this.total = this.count = 0;
  }

  /** Whether the picture has stood still long enough to be drawn finely. */
  stillAt(nowMs: number): boolean {
    return nowMs - this.last > STILL_MS;
  }
}
