"""Hips that a motion bends further than flesh gives way are bent less; arms keep their hands out of the thighs.

Retargeting by rotation keeps the actor's angles and our proportions. Where a leaner or longer actor's belly just meets
the thighs, ours goes through them, and his shoulder beside the knee ends up in ours. No body can do it, and cloth
between has no place. So everything above the legs is turned backwards about the hips, by the smallest angle with which
no point of the trunk and of the roots of the arms lies deeper than `GIVE` inside a thigh or a shin. Legs stay where
they are. Likewise an arm whose hand passes the actor's hip is led by ours further out, where that frees it. Ours.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel
from tryon_solver.body.skeletons import SIDES

GIVE = 0.04  # m, how deep flesh may lie inside flesh: each side's skin gives way by half of that, and cloth between
MOST_UNFOLDED = np.radians(45.0)  # rad; what then still digs in does so from elsewhere than the front
ANGLES = 16  # tried up to there
EVEN = 0.15  # s on either side over which straightening comes and goes
HAND_GIVE = 0.0  # m, the same of forearms and hands, which an actor keeps beside his body
MOST_ABDUCTED = np.radians(20.0)  # rad
CLEAR_AT_REST = 0.03  # m outside a leg at rest: flesh that is next to the leg anyway is not asked
LEAST_POINTS = 200  # of the trunk are looked at
RINGS = 8  # along a limb, in which its thickness is measured
NEAR_HIP = 0.25  # share of the thigh, from the hip, that is the crease and no obstacle

ARM = ("upper_arm", "upper_arm_twist", "forearm", "forearm_twist", "hand", "fingers")
LEG = ("thigh", "thigh_twist", "shin", "shin_twist", "foot", "toes")
SHOULDER = ("clavicle", "shoulder", "upper_arm")
TRUNK = (*(f"spine_{k}" for k in range(1, 6)), *(f"{side}_{part}" for side in SIDES for part in SHOULDER))


def unfolded(model: BodyModel, world: np.ndarray, dt: float, give: float = GIVE) -> np.ndarray:
    """World rotations (T, J, 4) of all joints in frames `dt` s apart, with the hips bent less where they fold too far,
    and arms led further out where forearm or hand would pass through a thigh or a shin.

    `give` [m]: how deep the trunk may lie in a leg; infinity leaves everything as it is.
    """
    if not np.isfinite(give):
        return world
    world = _turned_free(_Flesh(model, TRUNK), bent_up, MOST_UNFOLDED, world, dt, give)
    for side in SIDES:
        hand = tuple(f"{side}_{part}" for part in ("forearm", "forearm_twist", "hand", "fingers"))

        def led_out(model: BodyModel, world: np.ndarray, angle: np.ndarray, side: str = side) -> np.ndarray:
            return abducted(model, world, angle, side)

        flesh = _Flesh(model, hand, near_hip=0.0)
        world = _turned_free(flesh, led_out, MOST_ABDUCTED, world, dt, min(give, HAND_GIVE), through=False)
    return world


def _turned_free(
    flesh: _Flesh,
    turned: Callable[[BodyModel, np.ndarray, np.ndarray], np.ndarray],
    most: float,
    world: np.ndarray,
    dt: float,
    give: float,
    through: bool = True,
) -> np.ndarray:
    """`world` with each frame `turned` by the smallest angle up to `most` that brings the flesh up to `give` m.

    Without `through` it is not turned through other flesh: only as far as it gets less deep.
    """
    over = np.flatnonzero(flesh.depth(world) > give)
    if not len(over):
        return world
    angles = np.linspace(0.0, most, ANGLES)
    depth = np.stack([flesh.depth(turned(flesh.model, world[over], np.full(len(over), a))) for a in angles])
    wanted = np.zeros(len(world))
    for k, frame in enumerate(over):
        end = len(angles) if through else _lowest(depth[:, k]) + 1
        wanted[frame] = _first_below(angles[:end], depth[:end, k], give)
    return turned(flesh.model, world, evened(wanted, max(1, round(EVEN / dt))))


def _first_below(angles: np.ndarray, depth: np.ndarray, give: float) -> float:
    """The smallest angle at which the depth has come down to `give`, or the one at which it is least."""
    enough = np.flatnonzero(depth <= give)
    if not len(enough):
        return float(angles[np.argmin(depth)])
    k = int(enough[0])
    share = (depth[k - 1] - give) / (depth[k - 1] - depth[k])
    return float(angles[k - 1] + share * (angles[k] - angles[k - 1]))


def _lowest(depth: np.ndarray) -> int:
    """Where the depth stops to fall for the first time."""
    grows = np.flatnonzero(np.diff(depth) > 0)
    return int(grows[0]) if len(grows) else len(depth) - 1


def evened(wanted: np.ndarray, reach: int) -> np.ndarray:
    """(T,): nowhere less than `wanted`, and smooth over `reach` frames: a mean of largest values around."""
    count = len(wanted)
    padded = np.pad(wanted, 2 * reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    weights = 1.0 + np.cos(np.pi * np.arange(-reach, reach + 1) / (reach + 1))
    return np.convolve(windows.max(axis=1), weights / weights.sum(), mode="valid")[:count]


def bent_up(model: BodyModel, world: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """World rotations (T, J, 4) with the hips bent less by `angle` (T,) rad: all but the legs turns backwards as one.

    The axis is the pelvis's lateral one, on which the hips lie.
    """
    legs = {f"{side}_{part}" for side in SIDES for part in LEG}
    above = [k for k, name in enumerate(model.joint_names) if name not in legs]
    left = quaternions.rotate(world[:, 0], np.broadcast_to([1.0, 0.0, 0.0], (len(world), 3)))
    back = quaternions.from_axis_angle(left, -angle)
    turned = world.copy()
    turned[:, above] = quaternions.multiply(back[:, None], world[:, above])
    return turned


def abducted(model: BodyModel, world: np.ndarray, angle: np.ndarray, side: str) -> np.ndarray:
    """World rotations (T, J, 4) with one arm turned away from the trunk by `angle` (T,) rad, about the chest's forward
    axis."""
    outward = 1.0 if side == SIDES[0] else -1.0
    chest = world[:, model.index_of["spine_5"]]
    forward = quaternions.rotate(chest, np.broadcast_to([0.0, 0.0, 1.0], (len(world), 3)))
    out = quaternions.from_axis_angle(forward, outward * angle)
    arm = [model.index_of[f"{side}_{part}"] for part in ARM]
    turned = world.copy()
    turned[:, arm] = quaternions.multiply(out[:, None], world[:, arm])
    return turned


class _Flesh:
    """Points of the skin of some joints, and the legs as tapered rods."""

    def __init__(self, model: BodyModel, joints: tuple[str, ...], near_hip: float = NEAR_HIP) -> None:
        self.model = model
        index = model.index_of
        strongest = model.skin_joints[np.arange(len(model.rest_vertices)), model.skin_weights.argmax(1)]
        self.rods = []
        for side in SIDES:
            for top, end, first in (("thigh", "shin", near_hip), ("shin", "foot", 0.0)):
                ends = index[f"{side}_{top}"], index[f"{side}_{end}"]
                own = np.isin(strongest, [index[f"{side}_{top}"], index[f"{side}_{top}_twist"]])
                self.rods.append((*ends, first, self._thickness(own, *ends)))
        upper = np.flatnonzero(np.isin(strongest, [index[name] for name in joints]))
        outside = np.ones(len(upper), bool)
        rest = model.rest_vertices[upper]
        for rod in self.rods:
            outside &= _inside(rest[None], model.rest_joints[None], rod)[0] < -CLEAR_AT_REST
        upper = upper[outside]
        self.points = upper[:: max(1, len(upper) // LEAST_POINTS)]

    def _thickness(self, own: np.ndarray, start: int, end: int) -> np.ndarray:
        """(RINGS,) m: median distance of a limb's skin from its axis, along it."""
        joints, points = self.model.rest_joints, self.model.rest_vertices[own]
        share, distance = _along(points, joints[start], joints[end])
        ring = np.clip((share * RINGS).astype(int), 0, RINGS - 1)
        return np.array([np.median(distance[ring == k]) if (ring == k).any() else 0.0 for k in range(RINGS)])

    def depth(self, world: np.ndarray) -> np.ndarray:
        """(T,) m: how deep the deepest point lies inside a leg; negative where all are outside."""
        model = self.model
        places = np.zeros((len(world), model.joint_count, 3))
        for joint, parent in enumerate(model.parents[1:], start=1):
            offset = model.rest_joints[joint] - model.rest_joints[parent]
            turned = quaternions.rotate(world[:, parent], np.broadcast_to(offset, (len(world), 3)))
            places[:, joint] = places[:, parent] + turned
        turns = quaternions.to_matrix(world)
        weights, joints = model.skin_weights[self.points].astype(np.float64), model.skin_joints[self.points]
        rest = model.rest_vertices[self.points]
        skin = np.zeros((len(world), len(self.points), 3))
        for k in range(joints.shape[1]):
            j = joints[:, k]
            arm = rest - model.rest_joints[j]
            skin += weights[:, k, None] * (places[:, j] + np.einsum("tpxy,py->tpx", turns[:, j], arm))
        return np.max([_inside(skin, places, rod).max(axis=1) for rod in self.rods], axis=0)


def _along(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of the way from start to end (..., 3) nearest to points (..., P, 3), in [0, 1], and distance from there."""
    axis = np.asarray(end - start)[..., None, :]
    away = points - np.asarray(start)[..., None, :]
    share = np.clip((away * axis).sum(-1) / (axis * axis).sum(-1), 0.0, 1.0)
    return share, np.linalg.norm(away - share[..., None] * axis, axis=-1)


def _inside(points: np.ndarray, places: np.ndarray, rod: tuple[int, int, float, np.ndarray]) -> np.ndarray:
    """(T, P) m: how deep points (T, P, 3) lie in a rod between two of the joints at `places` (T, J, 3)."""
    start, end, first, thickness = rod
    share, distance = _along(points, places[:, start], places[:, end])
    middles = (np.arange(RINGS) + 0.5) / RINGS
    depth = np.interp(share, middles, thickness) - distance
    return np.where(share >= first, depth, -np.inf)
