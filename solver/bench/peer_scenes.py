"""Two scenes that every solver can be given: a square that falls on a sphere, a sleeve on a bending limb.

The square of 1 m falls by 5 cm onto a sphere of 0.3 m. The sleeve, 6.5 cm in radius and 60 cm long, is held at its
upper ring around two capsules of 5 cm; the lower one bends by 90 degrees and back, and stands for the last third of the
time.
Metres, seconds, Y up. The bodies are rigid parts, which all solvers have; a person's body most have not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from contact_scenes import tube
from peer_case import FPS
from scipy.spatial.transform import Rotation
from small_scenes import icosphere, sheet

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import WORN, Effect, Pins, Scene

Part = tuple[np.ndarray, np.ndarray]
MOVES = 2 / 3  # of the time; then everything stands
BALL, DROP, SIDE = 0.3, 0.05, 1.0  # m
LIMB, SLEEVE, LENGTH, REACH = 0.05, 0.065, 0.6, 0.4  # m; REACH: from the elbow to a capsule's far middle
BEND = np.pi / 2


@dataclass(frozen=True)
class PeerScene:
    """`scene` in our terms; `parts`: vertices (B, 3) m and faces of each rigid part as it stands at first, all of them
    about the origin; `turn(t)` (P, 4) unit quaternions x y z w about the origin at a time [s]; `held` (K,) vertices."""

    scene: Scene
    parts: tuple[Part, ...]
    turn: Callable[[float], np.ndarray]
    held: np.ndarray
    seconds: float

    @property
    def frames(self) -> int:
        return round(self.seconds * FPS)

    @property
    def moves(self) -> bool:
        """Does any part?"""
        return len(self.parts) > 1

    def pose(self, t: float) -> Pose:
        """The parts as joints of one body."""
        return Pose(np.zeros(3), local(self.turn(t)))

    def surface(self, t: float) -> np.ndarray:
        """(B, 3) m, the parts where they are led."""
        return np.vstack([Rotation.from_quat(q).apply(v) for q, (v, _) in zip(self.turn(t), self.parts)])


def local(turns: np.ndarray) -> np.ndarray:
    """Joints' rotations in their parent's frame, the first part being every other's parent, from those in the world."""
    first = Rotation.from_quat(turns[0])
    return np.vstack([turns[:1], *((first.inv() * Rotation.from_quat(q)).as_quat()[None] for q in turns[1:])])


def sphere_drop(vertices: int, seconds: float) -> PeerScene:
    """About so many vertices, flat above the sphere."""
    n = max(3, round(np.sqrt(vertices)))
    garment, x = sheet(n, n, SIDE, SIDE)
    x = x + np.array([0, BALL + DROP, 0])
    return scene_of(garment, x, (icosphere(BALL, 4),), lambda _t: np.array([[0.0, 0, 0, 1]]), (), seconds)


def limb_tube(vertices: int, seconds: float) -> PeerScene:
    """About so many vertices, as many along the sleeve as around it."""
    n = max(6, round(np.sqrt(vertices)))
    garment, x = tube(n, n, SLEEVE, LENGTH)  # along x, rows of n
    upper, lower = capsule(0.0, REACH), capsule(-REACH, 0.0)

    def turn(t: float) -> np.ndarray:
        angle = BEND * np.sin(np.pi * min(t / (MOVES * seconds), 1.0)) ** 2
        return np.array([[0.0, 0, 0, 1], Rotation.from_euler("z", angle).as_quat()])

    last_ring = range(n * (n - 1), n * n)
    return scene_of(garment, x, (upper, lower), turn, last_ring, seconds)


def scene_of(
    garment: Garment,
    x: np.ndarray,
    parts: tuple[Part, ...],
    turn: Callable[[float], np.ndarray],
    held: Sequence[int],
    seconds: float,
) -> PeerScene:
    """The scene in our terms; what is held, by springs."""
    counts = [len(v) for v, _ in parts]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    body = BodyModel(
        np.vstack([v for v, _ in parts]),
        np.vstack([f + s for (_, f), s in zip(parts, starts)]).astype(np.int32),
        tuple(f"part {k}" for k in range(len(parts))),
        np.array([-1, *([0] * (len(parts) - 1))], np.int32),
        np.zeros((len(parts), 3)),
        np.repeat(np.arange(len(parts), dtype=np.int32), counts)[:, None],
        np.ones((sum(counts), 1), np.float32),
    )
    vertices = np.array(held, np.int32)
    effects: tuple[Effect, ...] = (*WORN, Pins(vertices)) if len(vertices) else WORN
    return PeerScene(Scene(garment, x, body, effects=effects), parts, turn, vertices, seconds)


def capsule(start: float, end: float, around: int = 32, cap: int = 8, along: int = 14) -> tuple[np.ndarray, np.ndarray]:
    """A closed one of radius LIMB along x, its hemispheres about `start` < `end` [m]: vertices and outward faces."""
    angles = np.linspace(0, np.pi / 2, cap + 1)
    profile = [(LIMB * np.sin(a), start - LIMB * np.cos(a)) for a in angles[1:]]
    profile += [(LIMB, place) for place in np.linspace(start, end, along + 1)[1:-1]]
    profile += [(LIMB * np.cos(a), end + LIMB * np.sin(a)) for a in angles[:-1]]
    turns = 2 * np.pi * np.arange(around) / around
    rings = [np.column_stack([np.full(around, p), r * np.cos(turns), r * np.sin(turns)]) for r, p in profile]
    x = np.vstack([[[start - LIMB, 0, 0]], *rings, [[end + LIMB, 0, 0]]])
    here = np.arange(around)
    there = (here + 1) % around
    last = len(x) - 1
    top = last - around
    faces = [np.column_stack([0 * here, 1 + there, 1 + here])]
    faces += [np.column_stack([0 * here + last, top + here, top + there])]
    for ring in range(len(profile) - 1):
        a, b = 1 + ring * around, 1 + (ring + 1) * around
        faces += [np.column_stack([a + here, a + there, b + there]), np.column_stack([a + here, b + there, b + here])]
    return x, np.vstack(faces).astype(np.int32)


SCENES: dict[str, Callable[[int, float], PeerScene]] = {"sphere-drop": sphere_drop, "limb-tube": limb_tube}
