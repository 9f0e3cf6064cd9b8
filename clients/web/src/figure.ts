import type { GarmentScene, Shape } from "@tryon/core";
import * as THREE from "three";

import { FabricMaterial, skinMaterial } from "./materials.ts";

/** Body and garment as three.js objects that show the newest frame of a `GarmentScene`. */
export class Figure {
  readonly object = new THREE.Group();
  /** of the garments that are worn, from the innermost outwards; of one alone, the first */
  readonly fabrics: FabricMaterial[];
  private readonly skin = skinMaterial();
  private readonly occluder = new THREE.MeshBasicMaterial({ colorWrite: false });
  private readonly body = new THREE.Mesh<THREE.BufferGeometry, THREE.Material>(new THREE.BufferGeometry(), this.skin);
  private readonly cloth = new THREE.Mesh<THREE.BufferGeometry, THREE.Material[]>(new THREE.BufferGeometry(), []);
  private readonly seams: THREE.LineSegments;
  private readonly parts: readonly (THREE.Mesh | THREE.LineSegments)[];
  private scene: GarmentScene | undefined;
  private topologyVersion = -1;
  private frameVersion = -1;

  /** @param another makes a material for a garment that is worn with others */
  constructor(private readonly another: () => FabricMaterial) {
    const first = another();
    this.fabrics = [first];
    this.seams = new THREE.LineSegments(new THREE.BufferGeometry(), first.seam);
    this.parts = [this.body, this.cloth, this.seams];
    for (const mesh of [this.body, this.cloth]) {
      mesh.castShadow = true;
      mesh.receiveShadow = true;
    }
    for (const part of this.parts) {
      part.frustumCulled = false; // what moves every frame is in view; its bounds would have to be computed anew each time
      part.visible = false;
      this.object.add(part);
    }
  }

  /** Whether there is anything to see. */
  get shown(): boolean {
    return this.body.visible;
  }

  /**
   * With `real` the body is there in flesh and blood: the one drawn here shows nothing and only hides what is behind it,
   * in the pose of the frame on show, which is the one the garment belongs to.
   */
  occlude(real: boolean): void {
    this.body.material = real ? this.occluder : this.skin;
    this.body.renderOrder = real ? -1 : 0;
    this.body.castShadow = !real;
  }

  /**
   * Takes over what changed since the last call; returns whether anything did. What another scene showed before stays
   * until this one has a frame to show.
   */
  update(scene: GarmentScene): boolean {
    if (!scene.figures || (scene === this.scene && scene.frameVersion === this.frameVersion)) return false;
    if (scene !== this.scene || scene.topologyVersion !== this.topologyVersion) this.rebuild(scene);
    this.scene = scene;
    this.topologyVersion = scene.topologyVersion;
    this.frameVersion = scene.frameVersion;
    for (const part of this.parts) part.visible = true;
    markChanged(this.body.geometry);
    markChanged(this.cloth.geometry);
    return true;
  }

  private rebuild(scene: GarmentScene): void {
    for (const part of this.parts) part.geometry.dispose();
    if (!scene.cloth || !scene.body) return;
    this.body.geometry = geometryOf(scene.body);
    this.cloth.geometry = geometryOf(scene.cloth);
    this.shareOut(scene.garments.map(({ faces }) => faces), scene.faceCount);
    const lines = new THREE.BufferGeometry();
    lines.setAttribute("position", this.cloth.geometry.getAttribute("position"));
    lines.setIndex(new THREE.BufferAttribute(scene.cloth.seams, 1));
    this.seams.geometry = lines;
  }

  /** Draws each garment's triangles, its first and how many it has, in a material of its own. */
  private shareOut(shares: readonly (readonly [number, number])[], faceCount: number): void {
    const all = shares.length ? shares : [[0, faceCount] as const];
    while (this.fabrics.length < all.length) this.fabrics.push(this.another());
    this.cloth.material = all.map((_share, k) => this.fabrics[k].material);
    all.forEach(([first, count], k) => this.cloth.geometry.addGroup(3 * first, 3 * count, k));
  }
}

/** A geometry over the scene's own arrays: a new frame is written there and only has to be marked. */
function geometryOf(shape: Shape): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(shape.positions, 3).setUsage(THREE.DynamicDrawUsage));
  geometry.setAttribute("normal", new THREE.BufferAttribute(shape.normals, 3).setUsage(THREE.DynamicDrawUsage));
  geometry.setAttribute("uv", new THREE.BufferAttribute(shape.uv, 2));
  geometry.setIndex(new THREE.BufferAttribute(shape.index, 1));
  return geometry;
}

function markChanged(geometry: THREE.BufferGeometry): void {
  geometry.getAttribute("position").needsUpdate = true;
  geometry.getAttribute("normal").needsUpdate = true;
}
