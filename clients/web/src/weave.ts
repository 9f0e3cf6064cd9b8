import * as THREE from "three";

/** How a fabric's surface looks close by. `knit` has columns of V-shaped stitches, `plain` crosses over and under, `twill` runs diagonally. */
export type Weave = "knit" | "plain" | "twill";

const SIZE = 128;
/** threads across one tile */
const THREADS = 8;

/** Height of the cloth's surface in [0, 1] at the point (u, v) of the tile [0, 1)^2; periodic in both. */
function height(weave: Weave, u: number, v: number): number {
  const x = u * THREADS;
  const y = v * THREADS;
  if (weave === "knit") {
    const column = Math.abs((x % 2) - 1);
    const slanted = y + column * 0.9;
    return 0.25 + 0.75 * Math.abs(Math.sin(Math.PI * slanted)) * Math.sin(Math.PI * Math.min(1, column * 0.9 + 0.08));
  }
  const warp = Math.abs(Math.sin(Math.PI * x));
  const weft = Math.abs(Math.sin(Math.PI * y));
  const i = Math.floor(x);
  const j = Math.floor(y);
  const over = weave === "plain" ? (i + j) % 2 === 0 : (((i - j) % 4) + 4) % 4 < 2;
  return over ? warp * (0.6 + 0.4 * weft) : weft * (0.6 + 0.4 * warp);
}

/**
 * Tangent-space normals of one tile of the weave, 8 threads wide, tileable.
 *
 * @param threadPitch distance between neighbouring threads [m]; pattern coordinates are metres
 */
export function weaveNormals(weave: Weave, threadPitch: number): THREE.DataTexture {
  const texels = new Uint8Array(SIZE * SIZE * 4);
  const slope = 1.6;
  const at = (i: number, j: number) => height(weave, ((i + SIZE) % SIZE) / SIZE, ((j + SIZE) % SIZE) / SIZE);
  for (let j = 0; j < SIZE; j += 1) {
    for (let i = 0; i < SIZE; i += 1) {
      const nx = (at(i - 1, j) - at(i + 1, j)) * slope;
      const ny = (at(i, j - 1) - at(i, j + 1)) * slope;
      const scale = 127.5 / Math.hypot(nx, ny, 1);
      const texel = (j * SIZE + i) * 4;
      texels[texel] = 127.5 + nx * scale;
      texels[texel + 1] = 127.5 + ny * scale;
      texels[texel + 2] = 127.5 + scale;
      texels[texel + 3] = 255;
    }
  }
  const texture = new THREE.DataTexture(texels, SIZE, SIZE, THREE.RGBAFormat);
  texture.wrapS = THREE.RepeatWrapping;
  texture.wrapT = THREE.RepeatWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = THREE.LinearMipmapLinearFilter;
  texture.generateMipmaps = true;
  texture.anisotropy = 4;
  texture.repeat.setScalar(1 / (THREADS * threadPitch));
  texture.needsUpdate = true;
  return texture;
}
