import assert from "node:assert/strict";
import { test } from "node:test";

import { vertexNormals } from "../../clients/core/src/normals.ts";
import { buildRenderMesh, gather } from "../../clients/core/src/render_mesh.ts";

/** Two squares that share the edge 1-2; the second is another piece with coordinates of its own. */
const FACES = Uint32Array.of(0, 1, 2, 0, 2, 3, 1, 4, 2, 4, 5, 2);
const UV = Float32Array.of(0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1, 5, 0, 6, 0, 5, 1, 6, 0, 6, 1, 5, 1);
const PIECES = Uint16Array.of(0, 0, 1, 1);

test("vertices on a seam are drawn once per piece, all others once", () => {
  const mesh = buildRenderMesh(FACES, UV, PIECES);
  assert.equal(mesh.source.length, 8);
  assert.deepEqual([...mesh.source].sort(), [0, 1, 1, 2, 2, 3, 4, 5]);
  assert.deepEqual([...mesh.index].map((drawn) => mesh.source[drawn]), [...FACES]);
  assert.deepEqual([...mesh.index].flatMap((drawn) => [mesh.uv[2 * drawn], mesh.uv[2 * drawn + 1]]), [...UV]);
});

test("the seam is the one edge where two pieces meet", () => {
  const mesh = buildRenderMesh(FACES, UV, PIECES);
  assert.deepEqual([...mesh.seams].map((drawn) => mesh.source[drawn]).sort(), [1, 2]);
});

test("pieces with equal coordinates are told apart by their number", () => {
  const same = new Float32Array(UV.length);
  assert.equal(buildRenderMesh(FACES, same, PIECES).seams.length, 2);
  assert.equal(buildRenderMesh(FACES, same, null).seams.length, 0);
});

test("without pattern coordinates nothing is split", () => {
  const mesh = buildRenderMesh(FACES, null, null);
  assert.equal(mesh.source.length, 6);
  assert.equal(mesh.seams.length, 0);
});

test("gather writes every drawn vertex, from its start on and not beyond", () => {
  const simulated = Float32Array.from({ length: 18 }, (_, i) => i);
  const drawn = new Float32Array(2 + 9 + 1).fill(NaN);
  gather(Uint32Array.of(5, 0, 5), simulated, drawn, 2);
  assert.deepEqual([...drawn], [NaN, NaN, 15, 16, 17, 0, 1, 2, 15, 16, 17, NaN]);
});

test("normals of a sphere point away from its centre", () => {
  const positions: number[] = [];
  const faces: number[] = [];
  const [rows, columns] = [24, 36];
  for (let i = 0; i <= rows; i += 1) {
    for (let j = 0; j < columns; j += 1) {
      const theta = (Math.PI * (i + 0.5)) / (rows + 1);
      const phi = (2 * Math.PI * j) / columns;
      positions.push(Math.sin(theta) * Math.cos(phi), Math.cos(theta), -Math.sin(theta) * Math.sin(phi));
      const next = (j + 1) % columns;
      if (i < rows) {
        const [a, b] = [i * columns, (i + 1) * columns];
        faces.push(a + j, b + j, b + next, a + j, b + next, a + next);
      }
    }
  }
  const normals = new Float32Array(positions.length).fill(NaN);
  vertexNormals(Float32Array.from(positions), Uint32Array.from(faces), normals);
  for (let i = 3 * columns; i < positions.length - 3 * columns; i += 3) {
    const along = positions[i] * normals[i] + positions[i + 1] * normals[i + 1] + positions[i + 2] * normals[i + 2];
    assert.ok(along > 0.999, `vertex ${i / 3}: ${along}`);
    assert.ok(Math.abs(Math.hypot(normals[i], normals[i + 1], normals[i + 2]) - 1) < 1e-6);
  }
});

test("a vertex without area gets a unit normal, never a NaN", () => {
  const normals = new Float32Array(9).fill(NaN);
  vertexNormals(new Float32Array(9), Uint32Array.of(0, 1, 2), normals);
  assert.deepEqual([...normals], [0, 1, 0, 0, 1, 0, 0, 1, 0]);
});
