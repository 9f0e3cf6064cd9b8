"""Which way the back of our hand faces at rest, read off the surface: the rig has no knuckles."""

from __future__ import annotations

import numpy as np

from tryon_solver.body.model import BodyModel


def back_of_hand(model: BodyModel, side: str) -> np.ndarray:
    """(3,) unit: out of the back of the hand of the rest pose, whose palm faces down or in.

    A hand is flattest across the palm: the direction in which its vertices spread least.
    """
    joints = [model.index_of[f"{side}_{part}"] for part in ("hand", "fingers")]
    strongest = model.skin_joints[np.arange(model.vertex_count), model.skin_weights.argmax(axis=1)]
    hand = model.rest_vertices[np.isin(strongest, joints)]
    fingers = model.rest_joints[joints[1]] - model.rest_joints[joints[0]]
    if len(hand) < 4:
        return np.cross(fingers, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(fingers, [0.0, 0.0, 1.0]))
    normal = np.linalg.svd(hand - hand.mean(axis=0), full_matrices=False)[2][2]
    outward = np.array([1.0 if side == "left" else -1.0, 1.0, 0.0])
    return normal if normal @ outward > 0.0 else -normal
