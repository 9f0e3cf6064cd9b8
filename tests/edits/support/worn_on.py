"""The same garment worn on without an edit: how fast the motion alone takes it.

What a motion does to a garment is its own: a hem that a shin strikes swings, and a leg of trousers that lost its other
half flaps. The pattern as it is now is put where
it hung, at rest, led to where the motion begins, and worn through all of that. What it does there no edit has done.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

import numpy as np
from speeds import Falling, speed_of_hanging

from tryon_server.runtime.motions import load_motion
from tryon_server.runtime.solver_drape import PackedDrape, SolverDrape
from tryon_server.runtime.sources import LONGEST_MOVE, MotionSource


@dataclass(frozen=True)
class Moment:
    """Cloth (N, 3), body (B, 3) and root (3,), m."""

    cloth: np.ndarray
    body: np.ndarray
    root: np.ndarray


def fastest_worn_on(packed: PackedDrape, motion: str, span: int, enough: float) -> float:
    """m/s of the garment's fastest vertex on the body while the motion is played once, or until that is `enough`; but
    for what it has fallen in so many frames, the `span`, as long as others are watched after a change."""
    *_, drape = packed.unpacking()
    assert drape is not None
    played = load_motion(motion, drape.outfit.body)
    source = MotionSource(played, drape.pose)
    before, falling, fastest, t = moment(drape), Falling(), 0.0, drape.seconds
    for k in count():
        move = source.next(LONGEST_MOVE)
        t += move.dt
        drape.leap(move.leap)
        drape.advance(move.pose, t)
        after = moment(drape)
        if k % span == 0:
            falling = Falling()
        falling.see(after)
        if move.t > LONGEST_MOVE:  # nobody recorded the way to where the motion begins
            speeds = speed_of_hanging(before, after, move.dt)
            fastest = max(fastest, float(falling.of_itself(speeds, after).max()))
        if fastest >= enough or move.t >= played.duration:
            return fastest
        before = after
    raise AssertionError("a motion ends")


def moment(drape: SolverDrape) -> Moment:
    """Where it is."""
    place = drape.stance.root
    return Moment(drape.cloth_positions() + drape.origin, drape.body_positions() + drape.origin, np.asarray(place))
