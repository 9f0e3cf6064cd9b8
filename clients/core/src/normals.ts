/**
 * Smooth vertex normals, weighted by triangle area: n_i = normalise(sum over the triangles at i of (b - a) x (c - a)).
 *
 * @param positions vertices x 3 [m]
 * @param faces triangles x 3, vertex indices, counter-clockwise seen from the front
 * @param normalsOut vertices x 3, overwritten with unit vectors; a vertex without area gets (0, 1, 0)
 */
export function vertexNormals(positions: Float32Array, faces: Uint32Array, normalsOut: Float32Array): void {
  normalsOut.fill(0);
  for (let f = 0; f < faces.length; f += 3) {
    const a = faces[f] * 3;
    const b = faces[f + 1] * 3;
    const c = faces[f + 2] * 3;
    const ax = positions[a];
    const ay = positions[a + 1];
    const az = positions[a + 2];
    const ux = positions[b] - ax;
    const uy = positions[b + 1] - ay;
    const uz = positions[b + 2] - az;
    const vx = positions[c] - ax;
    const vy = positions[c + 1] - ay;
    const vz = positions[c + 2] - az;
    const nx = uy * vz - uz * vy;
    const ny = uz * vx - ux * vz;
    const nz = ux * vy - uy * vx;
    normalsOut[a] += nx;
    normalsOut[a + 1] += ny;
    normalsOut[a + 2] += nz;
    normalsOut[b] += nx;
    normalsOut[b + 1] += ny;
    normalsOut[b + 2] += nz;
    normalsOut[c] += nx;
    normalsOut[c + 1] += ny;
    normalsOut[c + 2] += nz;
  }
  for (let i = 0; i < normalsOut.length; i += 3) {
    const x = normalsOut[i];
    const y = normalsOut[i + 1];
    const z = normalsOut[i + 2];
    const length = Math.sqrt(x * x + y * y + z * z);
    if (length > 0) {
      normalsOut[i] = x / length;
      normalsOut[i + 1] = y / length;
      normalsOut[i + 2] = z / length;
    } else {
      normalsOut[i + 1] = 1;
    }
  }
}
