import * as THREE from "three";

/** How a fabric's surface looks close by. `knit` has columns of V-shaped stitches, `plain` crosses over and under, `twill` runs diagonally. */
export type Weave = "knit" | "plain" | "twill";

const SIZE = 128;
/** steepness of the relief between neighbouring texels of the finest level */
const SLOPE = 2.1;
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
 * Tangent-space normals of one tile of the weave, 8 threads wide, tileable. Seen from so far that a thread is smaller than
 * a pixel the cloth is flat: a coarser picture of the weave would only show patterns that are not there.
 *
 * @param threadPitch distance between neighbouring threads [m]; pattern coordinates are metres
 */
export function weaveNormals(weave: Weave, threadPitch: number): THREE.DataTexture {
  const levels: Level[] = [];
  for (let size = SIZE; size >= 1; size /= 2) levels.push({ data: normals(weave, size), width: size, height: size });
  const texture = new THREE.DataTexture(levels[0].data, SIZE, SIZE, THREE.RGBAFormat);
  texture.mipmaps = levels;
  texture.generateMipmaps = false;
  texture.wrapS = THREE.RepeatWrapping;
  texture.wrapT = THREE.RepeatWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = THREE.LinearMipmapLinearFilter;
  texture.anisotropy = 4;
  texture.repeat.setScalar(1 / (THREADS * threadPitch));
  texture.needsUpdate = true;
  return texture;
}

interface Level {
  readonly data: Uint8Array<ArrayBuffer>;
  readonly width: number;
  readonly height: number;
}

/** RGBA of one level of `size` x `size` texels; its relief fades towards two texels for a thread. */
function normals(weave: Weave, size: number): Uint8Array<ArrayBuffer> {
  const texels = new Uint8Array(size * size * 4);
  const slope = SLOPE * Math.max(0, 1 - (2 * THREADS) / size) * (size / SIZE);
  const at = (i: number, j: number) => height(weave, ((i + size) % size) / size, ((j + size) % size) / size);
  for (let j = 0; j < size; j += 1) {
    for (let i = 0; i < size; i += 1) {
      const nx = (at(i - 1, j) - at(i + 1, j)) * slope;
      const ny = (at(i, j - 1) - at(i, j + 1)) * slope;
      const scale = 127.5 / Math.hypot(nx, ny, 1);
      texels.set([127.5 + nx * scale, 127.5 + ny * scale, 127.5 + scale, 255], (j * size + i) * 4);
    }
  }
  return texels;
}
