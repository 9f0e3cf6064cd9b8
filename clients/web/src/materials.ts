import * as THREE from "three";

import { weaveNormals, type Weave } from "./weave.ts";

/** How a fabric looks: its surface, not its mechanics. */
export interface FabricLook {
  readonly weave: Weave;
  /** distance between neighbouring threads [m] */
  readonly pitch: number;
  /** how deep the weave's relief is drawn, 0 to 1 */
  readonly relief: number;
  readonly roughness: number;
  /** strength of the soft shine at grazing angles that fibres give, 0 to 1 */
  readonly sheen: number;
}

/** The wearer's skin: matte, warm, with a faint glow at the rims where light enters it. */
export function skinMaterial(): THREE.MeshPhysicalMaterial {
  return new THREE.MeshPhysicalMaterial({
    color: "#c3a392",
    roughness: 0.7,
    sheen: 0.3,
    sheenRoughness: 0.5,
    sheenColor: new THREE.Color("#cf9a80"),
  });
}

/**
 * Draws a seam 2 mm nearer to the eye than the cloth it lies on. The cloth itself must stay exactly where it is: pushed
 * back by an offset of its own it would sink into the skin, which is less than a millimetre away.
 */
const LIFT = "mvPosition.xyz *= 1.0 - 0.002 / length(mvPosition.xyz);\ngl_Position = projectionMatrix * mvPosition;";

/** One material for whatever is worn: it changes colour and weave, and is seen from both sides, the inside a little darker. */
export class FabricMaterial {
  readonly material: THREE.MeshPhysicalMaterial;
  readonly seam: THREE.LineBasicMaterial;
  private readonly weaves = new Map<string, THREE.Texture>();

  constructor() {
    this.material = new THREE.MeshPhysicalMaterial({ side: THREE.DoubleSide, shadowSide: THREE.DoubleSide });
    this.material.onBeforeCompile = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace(
        "#include <color_fragment>",
        "#include <color_fragment>\nif (!gl_FrontFacing) diffuseColor.rgb *= 0.72;",
      );
    };
    this.seam = new THREE.LineBasicMaterial({ transparent: true, opacity: 0.42, depthWrite: false });
    this.seam.onBeforeCompile = (shader) => {
      shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>\n${LIFT}`);
    };
  }

  /** Shows another fabric. A weave is made when it is first worn and kept. */
  setLook(look: FabricLook): void {
    const key = `${look.weave}/${look.pitch}`;
    let normals = this.weaves.get(key);
    if (!normals) {
      normals = weaveNormals(look.weave, look.pitch);
      this.weaves.set(key, normals);
    }
    this.material.normalMap = normals;
    this.material.normalScale.setScalar(look.relief);
    this.material.roughness = look.roughness;
    this.material.sheen = look.sheen;
    this.material.sheenRoughness = 0.55;
    this.material.needsUpdate = true;
  }

  /** Dyes the fabric; seams are drawn in a darker shade of the same colour. */
  setColour(colour: string): void {
    this.material.color.set(colour);
    this.material.sheenColor.set(colour).lerp(new THREE.Color("#ffffff"), 0.55);
    this.seam.color.set(colour).multiplyScalar(0.35);
  }
}
