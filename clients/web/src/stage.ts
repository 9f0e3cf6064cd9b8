import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

import { studioEnvironment } from "./environment.ts";
import { Floor } from "./floor.ts";
import { drawsInSoftware, PixelRatio } from "./quality.ts";

const BACKGROUND = new THREE.Color("#e7e3dc");
/** where the camera starts, relative to the wearer's place on the floor [m] */
const VIEW_FROM = new THREE.Vector3(1.2, 1.4, 3.35);
const LOOK_AT_HEIGHT = 0.88;
const LIGHT_AT_HEIGHT = 0.85;
const LIGHT_FROM = new THREE.Vector3(1.5, 3.9, 2.4);
/** time constant of the camera's following [s] */
const FOLLOW_SECONDS = 0.35;
/** a wearer this far from where the camera is has not walked there: the camera is there at once [m] */
const FOLLOW_AT_ONCE = 5;
/** a camera this near to where it should be stays [m] */
const FOLLOW_EXACTLY = 5e-4;

/**
 * Camera, light, floor and the drawing of one picture. Knows nothing of garments or servers.
 *
 * A picture is drawn only when something changed (`invalidate`, a moved camera, a resized canvas), so an idle page
 * costs nothing. Nothing is allocated per picture.
 */
export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(32, 1, 0.1, 60);
  private readonly renderer: THREE.WebGLRenderer;
  private readonly ratio: PixelRatio;
  private readonly controls: OrbitControls;
  private readonly floor = new Floor();
  private readonly key = new THREE.DirectionalLight("#fff7ee", 1.6);
  private readonly wearer = new THREE.Vector3();
  private readonly followed = new THREE.Vector3();
  private readonly shift = new THREE.Vector3();
  private lastMs = 0;
  private dirty = true;
  private drawnRatio = NaN;
  /** the point of the session's space where this scene's origin lies [m] */
  private readonly anchor = new THREE.Vector3();
  /** whether the camera goes along with the wearer */
  follow = true;

  /** @throws Error when the browser offers no WebGL 2 */
  constructor(private readonly canvas: HTMLCanvasElement) {
    const software = drawsInSoftware();
    this.ratio = new PixelRatio(window.devicePixelRatio, software);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !software, powerPreference: "high-performance" });
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.renderer.toneMappingExposure = 1.0;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene.background = BACKGROUND;
    this.scene.environment = studioEnvironment(this.renderer);
    this.scene.environmentIntensity = 0.95;
    this.scene.add(this.key, this.key.target, this.floor.object);
    this.castShadow(software ? 1.5 : 6);
    this.moveWearer(0, 0);

    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.09;
    this.controls.minDistance = 0.35;
    this.controls.maxDistance = 12;
    this.controls.maxPolarAngle = Math.PI * 0.53;
    this.controls.zoomToCursor = true;
    this.controls.listenToKeyEvents(canvas);
    this.controls.addEventListener("change", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("webglcontextrestored", () => this.invalidate());
    this.resize();
    this.resetView();
  }

  /** @param radius how far the shadow's edge is blurred, by noise that a coarse picture would show [texels] */
  private castShadow(radius: number): void {
    const shadow = this.key.shadow;
    this.key.castShadow = true;
    shadow.mapSize.set(1024, 1024);
    shadow.camera.left = -1.3;
    shadow.camera.right = 1.3;
    shadow.camera.top = 1.6;
    shadow.camera.bottom = -1.3;
    shadow.camera.near = 1;
    shadow.camera.far = 7;
    shadow.radius = radius;
    shadow.bias = -0.0004;
    shadow.normalBias = 0.006;
  }

  /** Asks for a new picture. */
  invalidate(): void {
    this.dirty = true;
  }

  /** Puts the camera back to where it started, in front of the wearer. */
  resetView(): void {
    const narrow = this.camera.aspect < 1; // a phone held upright: the buttons take the lower part of the picture
    this.followed.copy(this.wearer);
    this.camera.position.copy(VIEW_FROM).multiplyScalar(narrow ? 1.25 : 1).add(this.wearer);
    this.controls.target.set(this.wearer.x, narrow ? LOOK_AT_HEIGHT - 0.11 : LOOK_AT_HEIGHT, this.wearer.z);
    this.controls.update();
    this.invalidate();
  }

  /**
   * What is drawn next is relative to this point of the session's space [m]. What the stage keeps is seen from there at
   * once, so that nothing moves in the picture.
   */
  moveOrigin([x, y, z]: readonly [number, number, number]): void {
    this.shift.set(x, y, z).sub(this.anchor);
    if (this.shift.lengthSq() === 0) return;
    this.anchor.set(x, y, z);
    for (const place of [this.camera.position, this.controls.target, this.followed]) place.sub(this.shift);
    this.controls.update();
    this.invalidate();
  }

  /**
   * Tells where the wearer stands, x and z from the scene's origin [m]. Light, shadow and floor go along at once, the
   * camera while `follow` is on.
   */
  moveWearer(x: number, z: number): void {
    this.wearer.set(x, 0, z);
    this.key.position.copy(LIGHT_FROM).add(this.wearer);
    this.key.target.position.set(x, LIGHT_AT_HEIGHT, z);
    this.floor.moveTo(x, z);
  }

  /** Brings the camera nearer to the wearer: smoothly, so that it does not sway with every step. */
  private followWearer(seconds: number): void {
    if (!this.follow) return;
    this.shift.subVectors(this.wearer, this.followed);
    const distance = this.shift.length();
    if (distance < FOLLOW_EXACTLY) return;
    if (distance < FOLLOW_AT_ONCE) this.shift.multiplyScalar(1 - Math.exp(-Math.min(seconds, 0.5) / FOLLOW_SECONDS));
    this.followed.add(this.shift);
    this.camera.position.add(this.shift);
    this.controls.target.add(this.shift);
    this.invalidate();
  }

  /** Whether a headset shows the scene instead of the canvas. */
  get presenting(): boolean {
    return this.renderer.xr.isPresenting;
  }

  /**
   * Shows the scene in a headset, over the room and without what belongs to the page's picture, until `leave`.
   * @param each called before each picture, with the session's space, whose floor is at 0
   */
  async present(session: XRSession, each: (frame: XRFrame, space: XRReferenceSpace) => void): Promise<void> {
    const { xr } = this.renderer;
    xr.enabled = true;
    xr.setReferenceSpaceType("local-floor");
    await xr.setSession(session);
    this.scene.background = null;
    this.floor.object.visible = false;
    this.renderer.setAnimationLoop((_time: number, frame?: XRFrame) => {
      const space = xr.getReferenceSpace();
      if (frame && space) each(frame, space);
      this.renderer.render(this.scene, this.camera);
    });
  }

  /** Gives the scene back to the canvas, once the headset's session has ended. */
  leave(): void {
    this.renderer.setAnimationLoop(null);
    this.renderer.xr.enabled = false;
    this.scene.background = BACKGROUND;
    this.floor.object.visible = true;
    this.drawnRatio = NaN;
    this.camera.scale.set(1, 1, 1);
    this.resize();
    this.resetView();
  }

  private resize(): void {
    if (this.presenting) return;
    const width = Math.max(1, this.canvas.clientWidth);
    const height = Math.max(1, this.canvas.clientHeight);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  /** Draws if anything changed since the last picture; returns whether it drew. @param nowMs any steady clock */
  draw(nowMs: number): boolean {
    if (this.presenting) return false;
    this.followWearer((nowMs - this.lastMs) / 1000);
    this.lastMs = nowMs;
    this.controls.update();
    if (this.dirty) {
      this.dirty = false;
      this.render(this.ratio.moving);
      this.ratio.drawn(nowMs);
      return true;
    }
    if (this.drawnRatio < this.ratio.still && this.ratio.stillAt(nowMs)) this.render(this.ratio.still);
    return false;
  }

  private render(ratio: number): void {
    if (ratio !== this.drawnRatio) this.renderer.setPixelRatio(ratio);
    this.drawnRatio = ratio;
    this.renderer.render(this.scene, this.camera);
  }
}
