import type { FabricLook } from "@tryon/core";
import * as THREE from "three";

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

/** One picture that repeats over the pattern: where it is, and its size [m]. */
export interface Repeat {
  readonly url: string;
  readonly size: readonly [number, number];
}

/** What a garment is to look like: its fabric's look, a colour that takes the place of its own, a print over that. */
export interface Surface {
  readonly look: FabricLook;
  readonly dye: string | undefined;
  readonly print: Repeat | undefined;
}

/** One material for whatever is worn: it changes colour and weave, and is seen from both sides, the inside a little darker. */
export class FabricMaterial {
  readonly material: THREE.MeshPhysicalMaterial;
  readonly seam: THREE.LineBasicMaterial;
  private readonly loader = new THREE.TextureLoader();
  private readonly textures = new Map<string, Promise<THREE.Texture>>();
  private worn: Surface | undefined;

  /**
   * @param address of a file that the server told the path of
   * @param changed called when a picture has come
   */
  constructor(
    private readonly address: (path: string) => string,
    private readonly changed: () => void,
  ) {
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

  /** Shows another surface: in its mean colour at once, with its weave as soon as the pictures are here. */
  wear(surface: Surface): void {
    this.worn = surface;
    const { look, dye, print } = surface;
    const { material } = this;
    const colour = dye === undefined ? new THREE.Color(...look.colour) : new THREE.Color(dye);
    this.seam.color.copy(colour).multiplyScalar(0.35);
    if (!material.map) material.color.copy(colour);
    material.sheen = 1;
    material.sheenColor.setRGB(...look.sheen);
    material.sheenRoughness = look.sheen_roughness;
    const query = dye === undefined ? "" : `?dye=${dye.replace("#", "")}`;
    const own: Repeat = { url: this.address(look.colour_map) + query, size: look.tile };
    const maps = Promise.all([
      this.texture(print ?? own, THREE.SRGBColorSpace),
      this.texture({ url: this.address(look.normal_map), size: look.tile }, THREE.NoColorSpace),
      this.texture({ url: this.address(look.roughness_map), size: look.tile }, THREE.NoColorSpace),
    ]);
    maps.then(
      ([map, normalMap, roughnessMap]) => {
        if (this.worn !== surface) return; // another one has been chosen meanwhile
        material.color.setScalar(1);
        Object.assign(material, { map, normalMap, roughnessMap, metalnessMap: roughnessMap, roughness: 1, metalness: 1 });
        this.show();
      },
      () => {
        if (this.worn !== surface) return; // without its pictures a fabric still has its colour
        Object.assign(material, { map: null, normalMap: null, roughnessMap: null, metalnessMap: null, roughness: 0.9, metalness: 0 });
        material.color.copy(colour);
        this.show();
      },
    );
    this.show();
  }

  private show(): void {
    this.material.needsUpdate = true;
    this.changed();
  }

  /** A repeating picture; one that was fetched is kept. */
  private texture({ url, size }: Repeat, colourSpace: THREE.ColorSpace): Promise<THREE.Texture> {
    const key = `${url} ${size.join(" ")}`;
    let coming = this.textures.get(key);
    if (!coming) {
      coming = this.loader.loadAsync(url).then((texture) => {
        texture.colorSpace = colourSpace;
        texture.wrapS = THREE.RepeatWrapping;
        texture.wrapT = THREE.RepeatWrapping;
        texture.anisotropy = 8;
        texture.repeat.set(1 / size[0], 1 / size[1]);
        return texture;
      });
      coming.catch(() => this.textures.delete(key)); // to be asked for again
      this.textures.set(key, coming);
    }
    return coming;
  }
}
