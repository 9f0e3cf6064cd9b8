"""Where a body pinches whatever is between its parts, decided from the skin alone.

A skin point is pinched when it lies inside another part (the skin winds around it more than one and a half times), or
faces one closer than cloth and its reach on both sides need; both dilated by 30 mm. Cloth there has no room at the
skin, so the collision surface may yield.
"""

from __future__ import annotations

import numpy as np
import warp as wp
from reference_distances import point_triangle
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

wp.set_module_options({"enable_backward": False})

FAR_ALONG_THE_SKIN = 0.1  # m: skin further away than this belongs to another part
DILATION = 0.03  # m
DEEPEST = 0.15  # m: no body part is so thick that its inside is further from its skin
JUST_INSIDE = 1e-3  # m below the skin, where it winds once around a point that no other part covers


@wp.kernel
def covered_kernel(
    mesh: wp.uint64, points: wp.array(dtype=wp.vec3), reach: float, threshold: float, out: wp.array(dtype=wp.int32)
):
    i = wp.tid()
    query = wp.mesh_query_point_sign_winding_number(mesh, points[i], reach, 2.0, threshold)
    out[i] = 0
    if query.result and query.sign < 0.0:
        out[i] = 1


class PinchedSkin:
    """Prepared for one body: its faces, and which vertices are near each other along the skin."""

    def __init__(self, rest_vertices: np.ndarray, faces: np.ndarray, closest: float) -> None:
        """`rest_vertices` (B, 3) m, closed `faces` (F, 3); skin facing skin nearer than `closest` m is pinched."""
        self.faces, self.closest = faces, closest
        edges = np.unique(np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
        length = np.linalg.norm(rest_vertices[edges[:, 0]] - rest_vertices[edges[:, 1]], axis=1)
        count = len(rest_vertices)
        graph = sparse.coo_matrix((length, (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
        along = csgraph.dijkstra(graph, directed=False, limit=FAR_ALONG_THE_SKIN)
        self.near = np.isfinite(along)  # (B, B)

    @staticmethod
    def reach(xi: float, d_hat: float) -> float:
        """Room [m] that a layer of cloth with thickness offset xi takes between two skins: contact on both sides."""
        return 2 * (xi + d_hat) + xi

    def normals(self, skin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals of faces (F, 3) and of vertices (B, 3)."""
        corner = skin[self.faces]
        scaled = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        around = np.zeros_like(skin)
        np.add.at(around, self.faces.ravel(), np.repeat(scaled, 3, axis=0))
        unit = [v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-30) for v in (scaled, around)]
        return unit[0], unit[1]

    def covered(self, skin: np.ndarray) -> np.ndarray:
        """(B,) bool: points inside another part."""
        _, normal = self.normals(skin)
        points = (skin - JUST_INSIDE * normal).astype(np.float32)
        mesh = wp.Mesh(
            wp.array(skin.astype(np.float32), dtype=wp.vec3, device="cpu"),
            wp.array(self.faces.astype(np.int32).ravel(), dtype=wp.int32, device="cpu"),
            support_winding_number=True,
        )
        out = wp.full(len(skin), -1, dtype=wp.int32, device="cpu")
        inputs = [mesh.id, wp.array(points, dtype=wp.vec3, device="cpu"), 1.0, 1.5]
        wp.launch(covered_kernel, len(skin), inputs, [out], device="cpu")
        return out.numpy() == 1

    def facing(self, skin: np.ndarray) -> np.ndarray:
        """(B,) bool: points that face another part, normals opposed, nearer than `closest`."""
        face_normal, normal = self.normals(skin)
        corner = skin[self.faces]
        centre = corner.mean(1)
        radius = np.linalg.norm(corner - centre[:, None], axis=2).max(1)
        around = cKDTree(skin).query_ball_point(centre, radius + self.closest)
        face = np.repeat(np.arange(len(self.faces)), [len(points) for points in around])
        point = np.concatenate([np.asarray(points, np.int64) for points in around])
        other = ~self.near[point[:, None], self.faces[face]].all(1)
        face, point = face[other], point[other]
        opposed = (normal[point] * face_normal[face]).sum(1) < 0
        point, face = point[opposed], face[opposed]
        found = np.zeros(len(skin), bool)
        if len(point):
            d, _ = point_triangle(np.concatenate([skin[point][:, None], corner[face]], axis=1))
            found[point[d < self.closest]] = True
        return found

    def pinched(self, skin: np.ndarray) -> np.ndarray:
        """(B,) bool: covered or facing, and all skin within 30 mm of such points."""
        core = self.covered(skin) | self.facing(skin)
        if not core.any():
            return core
        distance, _ = cKDTree(skin[core]).query(skin, distance_upper_bound=DILATION)
        return np.isfinite(distance)

    def depth(self, skin: np.ndarray) -> float:
        """m from the deepest point inside another part to that part's skin.

        Cloth between the two has a place only where one of them stays behind its skin by at least half of that.
        """
        inside = np.flatnonzero(self.covered(skin))
        face_normal, normal = self.normals(skin)
        corner = skin[self.faces]
        deepest = 0.0
        for point, faces in zip(inside, cKDTree(corner.mean(1)).query_ball_point(skin[inside], DEEPEST)):
            others = np.asarray(faces, np.int64)
            own = self.near[point, self.faces[others]].all(1) & (face_normal[others] @ normal[point] > 0)
            others = others[~own]
            if len(others):
                at = np.broadcast_to(skin[point], (len(others), 1, 3))
                deepest = max(deepest, float(point_triangle(np.concatenate([at, corner[others]], axis=1))[0].min()))
        return deepest

    def area(self, skin: np.ndarray, chosen: np.ndarray) -> float:
        """m^2 of the skin around the chosen vertices, a third of each triangle per vertex."""
        corner = skin[self.faces]
        area = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
        return float((area[:, None] / 3 * chosen[self.faces]).sum())
