import type { BodySurface } from "./topology.ts";

/**
 * Linear blend skinning, PROTOCOL.md section 8: v = root + sum_k w_k (W_j (r - c_j) + p_j).
 * Everything that depends on the body alone is prepared once; posing allocates nothing.
 */
export class Skinner {
  private readonly jointCount: number;
  private readonly vertexCount: number;
  /** J x 9, row-major world rotations W */
  private readonly world: Float64Array;
  /** J x 3, joint centres relative to the root joint */
  private readonly centres: Float64Array;
  /** J x 3, p_j - W_j c_j */
  private readonly shifts: Float64Array;
  /** entries of vertex i: starts[i] to starts[i + 1] */
  private readonly starts: Uint32Array;
  private readonly joints: Uint16Array;
  private readonly weights: Float64Array;

  constructor(private readonly body: BodySurface) {
    this.jointCount = body.parents.length;
    this.vertexCount = body.restVertices.length / 3;
    this.world = new Float64Array(9 * this.jointCount);
    this.centres = new Float64Array(3 * this.jointCount);
    this.shifts = new Float64Array(3 * this.jointCount);
    const influences = this.vertexCount ? body.skinJoints.length / this.vertexCount : 0;
    const used = body.skinWeights.reduce((count, weight) => count + (weight === 0 ? 0 : 1), 0);
    this.starts = new Uint32Array(this.vertexCount + 1);
    this.joints = new Uint16Array(used);
    this.weights = new Float64Array(used);
    let entry = 0;
    for (let vertex = 0; vertex < this.vertexCount; vertex++) {
      for (let slot = vertex * influences; slot < (vertex + 1) * influences; slot++) {
        if (body.skinWeights[slot] === 0) continue;
        this.joints[entry] = body.skinJoints[slot];
        this.weights[entry] = body.skinWeights[slot];
        entry++;
      }
      this.starts[vertex + 1] = entry;
    }
  }

  /**
   * Pose the surface.
   * @param root (3) m, position of joint 0
   * @param rotations (J,4) local quaternions x, y, z, w
   * @param out (B,3) m, written
   * @param anchor (3) m, subtracted from every vertex before it is rounded to float32
   */
  pose(root: ArrayLike<number>, rotations: ArrayLike<number>, out: Float32Array, anchor: ArrayLike<number>): void {
    this.placeJoints(rotations);
    const { world, shifts, starts, joints, weights } = this;
    const rest = this.body.restVertices;
    const baseX = root[0] - anchor[0];
    const baseY = root[1] - anchor[1];
    const baseZ = root[2] - anchor[2];
    for (let vertex = 0; vertex < this.vertexCount; vertex++) {
      const x = rest[3 * vertex];
      const y = rest[3 * vertex + 1];
      const z = rest[3 * vertex + 2];
      let sumX = 0;
      let sumY = 0;
      let sumZ = 0;
      for (let entry = starts[vertex]; entry < starts[vertex + 1]; entry++) {
        const weight = weights[entry];
        const m = 9 * joints[entry];
        const s = 3 * joints[entry];
        sumX += weight * (world[m] * x + world[m + 1] * y + world[m + 2] * z + shifts[s]);
        sumY += weight * (world[m + 3] * x + world[m + 4] * y + world[m + 5] * z + shifts[s + 1]);
        sumZ += weight * (world[m + 6] * x + world[m + 7] * y + world[m + 8] * z + shifts[s + 2]);
      }
      out[3 * vertex] = baseX + sumX;
      out[3 * vertex + 1] = baseY + sumY;
      out[3 * vertex + 2] = baseZ + sumZ;
    }
  }

  private placeJoints(rotations: ArrayLike<number>): void {
    const { world, centres, shifts } = this;
    const { parents, restJoints } = this.body;
    for (let joint = 0; joint < this.jointCount; joint++) {
      const length = Math.hypot(
        rotations[4 * joint],
        rotations[4 * joint + 1],
        rotations[4 * joint + 2],
        rotations[4 * joint + 3],
      );
      const x = rotations[4 * joint] / length;
      const y = rotations[4 * joint + 1] / length;
      const z = rotations[4 * joint + 2] / length;
      const w = rotations[4 * joint + 3] / length;
      const r00 = 1 - 2 * (y * y + z * z);
      const r01 = 2 * (x * y - z * w);
      const r02 = 2 * (x * z + y * w);
      const r10 = 2 * (x * y + z * w);
      const r11 = 1 - 2 * (x * x + z * z);
      const r12 = 2 * (y * z - x * w);
      const r20 = 2 * (x * z - y * w);
      const r21 = 2 * (y * z + x * w);
      const r22 = 1 - 2 * (x * x + y * y);
      const m = 9 * joint;
      const parent = parents[joint];
      for (let row = 0; row < 3; row++) {
        const at = 9 * parent + 3 * row;
        const a = parent < 0 ? Number(row === 0) : world[at];
        const b = parent < 0 ? Number(row === 1) : world[at + 1];
        const c = parent < 0 ? Number(row === 2) : world[at + 2];
        world[m + 3 * row] = a * r00 + b * r10 + c * r20;
        world[m + 3 * row + 1] = a * r01 + b * r11 + c * r21;
        world[m + 3 * row + 2] = a * r02 + b * r12 + c * r22;
        centres[3 * joint + row] =
          parent < 0
            ? 0
            : centres[3 * parent + row] +
              a * (restJoints[3 * joint] - restJoints[3 * parent]) +
              b * (restJoints[3 * joint + 1] - restJoints[3 * parent + 1]) +
              c * (restJoints[3 * joint + 2] - restJoints[3 * parent + 2]);
      }
      for (let row = 0; row < 3; row++) {
        shifts[3 * joint + row] =
          centres[3 * joint + row] -
          (world[m + 3 * row] * restJoints[3 * joint] +
            world[m + 3 * row + 1] * restJoints[3 * joint + 1] +
            world[m + 3 * row + 2] * restJoints[3 * joint + 2]);
      }
    }
  }
}
