"""The same garment gone on without a change: how fast it would have gone by itself from where it was.

Cloth that an earlier edit let loose, as the fronts of trousers that lost their backs, is thrown by the legs that kick
it, for seconds; a change that is made meanwhile has not done it. What was worn when the change was asked for goes on
from there, with its velocities, while the body does what it did.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import warp as wp
from edited_session import Shown
from speeds import Falling, speed_of_hanging
from worn_on import moment

from tryon_server.runtime.solver_drape import PackedDrape, SolverDrape
from tryon_solver.simulation import Simulation

LEAPT = 0.5  # m that a root does not go in a frame: the motion began anew elsewhere, and the garment was put there


@dataclass
class Going:
    """A garment as it went in a frame, and the frames since.

    Attributes:
        v: (N, 3) m/s of its cloth.
        went: what of the steps before it is led by.
    """

    packed: PackedDrape
    v: np.ndarray
    frames: list[Shown]
    went: tuple[np.ndarray, ...] = ()

    @classmethod
    def of(cls, drape: SolverDrape, packed: PackedDrape, shown: Shown) -> Going:
        """As it goes in the frame that was shown last, `packed` as it is."""
        simulation = drape.simulation
        went = tuple(array.numpy().copy() for array in led_by(simulation))
        return cls(packed, simulation.state.v.numpy().copy(), [shown], went)

    def leaps(self) -> bool:
        """Is it put elsewhere on the way?"""
        roots = np.array([shown.stance.root for shown in self.frames])
        return bool(np.linalg.norm(np.diff(roots, axis=0), axis=1).max(initial=0.0) > LEAPT)


def led_by(simulation: Simulation) -> tuple[wp.array, ...]:
    """Where a simulation has it."""
    lead = simulation.lead
    return () if lead is None else (simulation.solved, lead.before, lead.time)


def begun(going: Going) -> SolverDrape:
    """The garment, about to go on."""
    *_, drape = going.packed.unpacking()
    assert drape is not None
    drape.simulation.state.v.assign(going.v)
    for array, values in zip(led_by(drape.simulation), going.went):
        array.assign(values)
    return drape


def fastest_gone_on(going: Going, enough: float) -> float:
    """m/s of the garment's fastest vertex on the body, but for what it has fallen since, as it goes on to the last
    frame seen, or until that is `enough`. 0 where it is put elsewhere on the way, which is not played."""
    if going.leaps():
        return 0.0
    drape = begun(going)
    before, falling, fastest, t = moment(drape), Falling(), 0.0, drape.seconds
    falling.see(before)
    for last, shown in pairwise(going.frames):
        dt = shown.frame.t_sim - last.frame.t_sim
        if dt <= 0.0:  # it stood still meanwhile
            continue
        t += dt
        drape.advance(shown.stance, t)
        after = moment(drape)
        falling.see(after)
        speeds = speed_of_hanging(before, after, dt)
        fastest = max(fastest, float(falling.of_itself(speeds, after).max()))
        if fastest >= enough:
            break
        before = after
    return fastest
