"""Poses that go the server's way into the solver: the tracker's filter, the stream's pace, the drape."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from harness.kit import FRAME
from harness.scene import Ask, Run
from harness.wearer import BODY, REST, put_on, worn
from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.stream_source import StreamSource
from tryon_server.runtime.worn_garment import alone
from tryon_server.sessions.smoothing import DEFAULT_SMOOTHING, PlaceFilter, TurnFilter
from tryon_solver.body.pose import Pose
from tryon_solver.results import StepReport
from tryon_solver.scene import WORN, Effect

CLIENT = 1


@dataclass(frozen=True)
class Sent:
    """A pose that was captured at `captured` and arrives at `arrives` [s]."""

    captured: float
    arrives: float
    pose: Pose


class Filtered:
    """The server's filter between a tracker and the physics, as its sessions use it."""

    def __init__(self) -> None:
        self.last = -np.inf
        self.begin()

    def begin(self) -> None:
        """Forget what came before."""
        self.roots, self.turns = PlaceFilter(DEFAULT_SMOOTHING), TurnFilter(DEFAULT_SMOOTHING)

    def next(self, sent: Sent) -> Pose:
        """The pose as the physics gets it."""
        silence, self.last = sent.captured - self.last, sent.captured
        if silence >= DEFAULT_SMOOTHING.forget_seconds:
            self.begin()
        root = self.roots.next(sent.pose.root[None], silence)[0]
        return Pose(root, self.turns.next(sent.pose.rotations, silence))


def streamed(
    ask: Ask,
    garment: str,
    poses: list[Sent],
    stops: float,
    rests: bool = True,
    noise: bool = False,
    squeezed: bool = False,
    effects: tuple[Effect, ...] = WORN,
) -> Run:
    """The garment on a body that follows these poses; from `stops` s on they say the same."""
    sim = put_on(ask, garment, effects=effects)
    drape = SolverDrape(sim, REST, (alone(sim, (), None),), BODY)
    source, smooth = StreamSource(REST), Filtered()
    waiting = sorted(poses, key=lambda sent: (sent.arrives, sent.captured))
    at = told = REST
    number = 0

    def step(t: float) -> StepReport:
        nonlocal at, told, number
        while waiting and waiting[0].arrives <= t + 1e-9:
            sent = waiting.pop(0)
            number, told = number + 1, sent.pose
            source.take(CLIENT, number, sent.captured, smooth.next(sent))
        move = source.next(FRAME)
        if move is None:
            return replace(sim.reported, steps=0, retries=0, reverts=0, advice="")
        drape.leap(move.leap)
        at = Pose(move.pose.root - drape.origin, move.pose.rotations)
        return drape.advance(move.pose, sim.state.time + move.dt)

    # a stream's body is led on over a gap, unhurried: it stands a second or two after the tracker
    stands = stops + 2.0
    return Run(
        sim,
        lambda _t: at,
        FRAME,
        stands,
        step=step,
        worn=worn(sim, lambda _t: at),
        rests=rests,
        quiet=stands + 2.0 if rests else None,
        noise=noise,
        told=lambda: Pose(told.root - drape.origin, told.rotations),
        squeezed=squeezed,
    )
