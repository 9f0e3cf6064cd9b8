"""The triangles that can touch: cloth and body in one index space, each vertex and edge owned by one triangle.

Vertices 0..cloth_count-1 are cloth, the rest the body's collision surface. A triangle pair found by the broad phase is
expanded to point-triangle and edge-edge stencils over the vertices and edges the two triangles *own*, so that each
stencil appears once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False})


@dataclass
class Surface:
    """Triangles of one kind with their bounding boxes and tree.

    `faces` (F,) vec3i ids in the shared index space; `owned` (F,) int32: bit k set when the triangle owns its vertex k,
    bit 3+k when it owns the edge from vertex k to vertex k+1.
    """

    faces: wp.array
    owned: wp.array
    lower: wp.array
    upper: wp.array
    face_count: int
    bvh: wp.Bvh | None = None

    @staticmethod
    def build(faces: np.ndarray, device: str) -> Surface:
        """`faces` (F, 3) int32 in the shared index space."""
        count = len(faces)
        return Surface(
            wp.array(faces.astype(np.int32), dtype=wp.vec3i, device=device),
            wp.array(ownership(faces), dtype=wp.int32, device=device),
            wp.zeros(count, dtype=wp.vec3, device=device),
            wp.zeros(count, dtype=wp.vec3, device=device),
            count,
        )

    def refit(self, vertex_lower: wp.array, vertex_upper: wp.array) -> None:
        """Boxes of the triangles from boxes of the vertices [m], and the tree over them."""
        device = self.faces.device
        wp.launch(
            face_boxes_kernel,
            self.face_count,
            [self.faces, vertex_lower, vertex_upper],
            [self.lower, self.upper],
            device=device,
        )
        if self.bvh is None:
            self.bvh = wp.Bvh(self.lower, self.upper)
        else:
            self.bvh.refit()


def ownership(faces: np.ndarray) -> np.ndarray:
    """(F,) int32 bits as in `Surface.owned`: the first triangle that has a vertex or an edge owns it."""
    owned = np.zeros(len(faces), np.int32)
    _, first = np.unique(faces.ravel(), return_index=True)
    np.bitwise_or.at(owned, first // 3, (1 << (first % 3)).astype(np.int32))
    corners = np.sort(np.stack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]], axis=1).reshape(-1, 2), axis=1)
    _, first = np.unique(corners, axis=0, return_index=True)
    np.bitwise_or.at(owned, first // 3, (8 << (first % 3)).astype(np.int32))
    return owned


@wp.kernel
def face_boxes_kernel(
    faces: wp.array(dtype=wp.vec3i),
    vertex_lower: wp.array(dtype=wp.vec3),
    vertex_upper: wp.array(dtype=wp.vec3),
    lower_out: wp.array(dtype=wp.vec3),
    upper_out: wp.array(dtype=wp.vec3),
):
    t = wp.tid()
    f = faces[t]
    lower_out[t] = wp.min(wp.min(vertex_lower[f[0]], vertex_lower[f[1]]), vertex_lower[f[2]])
    upper_out[t] = wp.max(wp.max(vertex_upper[f[0]], vertex_upper[f[1]]), vertex_upper[f[2]])


@wp.kernel
def swept_boxes_kernel(
    x: wp.array(dtype=wp.vec3),
    displacement: wp.array(dtype=wp.vec3),
    margin: float,
    lower_out: wp.array(dtype=wp.vec3),
    upper_out: wp.array(dtype=wp.vec3),
):
    """Box of each vertex's straight path from x to x + displacement, grown by `margin` m on every side."""
    i = wp.tid()
    a = x[i]
    b = a + displacement[i]
    grow = wp.vec3(margin, margin, margin)
    lower_out[i] = wp.min(a, b) - grow
    upper_out[i] = wp.max(a, b) + grow
