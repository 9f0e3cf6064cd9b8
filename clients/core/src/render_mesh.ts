/**
 * The mesh that is drawn, made once per topology from the mesh that is simulated.
 *
 * A simulated vertex on a seam has one position but one pattern coordinate per piece that meets there. A renderer
 * wants one of each per vertex, so such a vertex is drawn once per different pattern coordinate. Normals are computed
 * on the simulated mesh, hence the shading stays smooth across a seam.
 */
export interface RenderMesh {
  /** simulated vertex of each drawn vertex */
  readonly source: Uint32Array;
  /** triangles x 3, drawn vertices */
  readonly index: Uint32Array;
  /** drawn vertices x 2, pattern coordinates [m] */
  readonly uv: Float32Array;
  /** line segments x 2, drawn vertices: the edges where two pieces are sewn together */
  readonly seams: Uint32Array;
}

/**
 * @param faces triangles x 3, simulated vertices
 * @param uvCorners triangles x 3 x 2, pattern coordinates of each corner [m]; null: none are known, nothing is split.
 *   Corners that agree to 1 micrometre are one
 * @param pieceOfFace pattern piece of each triangle: two pieces may use the same coordinates; null: told by them alone
 */
export function buildRenderMesh(faces: Uint32Array, uvCorners: Float32Array | null, pieceOfFace: Uint16Array | null): RenderMesh {
  const drawnOf = new Map<string, number>();
  const source: number[] = [];
  const uv: number[] = [];
  const index = new Uint32Array(faces.length);
  for (let corner = 0; corner < faces.length; corner += 1) {
    const vertex = faces[corner];
    const u = uvCorners ? uvCorners[corner * 2] : 0;
    const v = uvCorners ? uvCorners[corner * 2 + 1] : 0;
    const piece = pieceOfFace ? pieceOfFace[Math.floor(corner / 3)] : 0;
    const key = `${vertex}/${piece}/${Math.round(u * 1e6)}/${Math.round(v * 1e6)}`;
    let drawn = drawnOf.get(key);
    if (drawn === undefined) {
      drawn = source.length;
      drawnOf.set(key, drawn);
      source.push(vertex);
      uv.push(u, v);
    }
    index[corner] = drawn;
  }
  return { source: Uint32Array.from(source), index, uv: Float32Array.from(uv), seams: seamSegments(faces, index) };
}

/** Edges that two triangles share as simulated vertices but not as drawn ones: there the pieces are sewn together. */
function seamSegments(faces: Uint32Array, index: Uint32Array): Uint32Array {
  const firstSide = new Map<string, readonly [number, number]>();
  const segments: number[] = [];
  for (let f = 0; f < faces.length; f += 3) {
    for (let k = 0; k < 3; k += 1) {
      const i = f + k;
      const j = f + ((k + 1) % 3);
      const forward = faces[i] < faces[j];
      const low = forward ? i : j;
      const high = forward ? j : i;
      const key = `${faces[low]}/${faces[high]}`;
      const other = firstSide.get(key);
      if (other === undefined) {
        firstSide.set(key, [index[low], index[high]]);
      } else if (other[0] !== index[low] || other[1] !== index[high]) {
        segments.push(index[low], index[high]);
      }
    }
  }
  return Uint32Array.from(segments);
}

/** Copies three numbers per simulated vertex to the drawn vertices, which begin at `start` of `drawnOut`. */
export function gather(source: Uint32Array, simulated: Float32Array, drawnOut: Float32Array, start: number): void {
  for (let i = 0; i < source.length; i += 1) {
    const from = source[i] * 3;
    const to = start + i * 3;
    drawnOut[to] = simulated[from];
    drawnOut[to + 1] = simulated[from + 1];
    drawnOut[to + 2] = simulated[from + 2];
  }
}
