"""Steps from given states: by our solver, whole or in part, in float32 or float64, and by the baselines."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import warp as wp
from contact_scenes import ContactScene
from in_float64 import twin_module, twin_of
from methods import Method
from stopwatch import clock_of

from tryon_solver import simulation
from tryon_solver.baselines.chebyshev_jacobi_pd import ChebyshevJacobi
from tryon_solver.baselines.newton_ipc import Motion, Reference
from tryon_solver.baselines.newton_ipc.march import TOLERANCE
from tryon_solver.baselines.newton_ipc.newton import NotConvergedError
from tryon_solver.baselines.xpbd import Xpbd
from tryon_solver.body.pose import Pose

Contacts = tuple[np.ndarray, np.ndarray]
"""As `known_contacts` tells them."""
STAGES = {
    "move_body": "ms_body",
    "correct_penetration": "ms_correction",
    "verify_commit": "ms_check",
    "estimate_error": "ms_estimate",
}
"""Verbs whose time [ms] is told, and as what."""
AS_ONE = {"estimate_error": "conclude"}
"""Verbs that a GPU has no time of their own of, and what they are part of there."""


@dataclass(frozen=True)
class Ended:
    """Where a step took cloth and surface, (A, 3) m, what time it took (`clock_of`) [ms], and what the solver told."""

    x: np.ndarray
    ms: float
    told: dict[str, Any] = field(default_factory=dict)


class Stepper(Protocol):
    """Takes steps of a scene; `is_compiled` when it is used first."""

    is_compiled: bool

    def begin(self, motion: Motion, contacts: Contacts | None) -> None:
        """The next step begins there, its contacts having given so much."""

    def step(self, pose: Pose, dt: float) -> Ended:
        """By dt [s] to the body's pose."""


class StoppedError(Exception):
    """The trial is reached: `x` (A,) vec3 m."""

    def __init__(self, x: wp.array) -> None:
        super().__init__("the trial is reached")
        self.x = x


class Ours:
    """Our solver at the method's settings; as its twin in float64; or only as far as the trial, without correction."""

    is_compiled = True

    def __init__(self, scene: ContactScene, method: Method, device: str) -> None:
        self.scene, self.device, self.now = scene, device, clock_of(device)
        self._same: Callable[[Any], Any] = twin_of if method.solver == "float64" else lambda value: value
        build = twin_module("simulation").build if method.solver == "float64" else simulation.build
        of = (self._same(scene.scene), self._same(method.settings), device, self._same(scene.pose_at(0)))
        self.sim = build(*of, tangled=True)
        if method.solver == "trial":
            self._stop_at_trial()

    def begin(self, motion: Motion, contacts: Contacts | None) -> None:
        """As if the simulation had been built there."""
        sim, state = self.sim, self.sim.state
        n = sim.cloth_count
        sim.start_at(motion.x[:n], motion.x[n:], self._same(motion.pose))
        state.v.assign(motion.v.astype(np.float32))
        state.time, state.still, state.asleep = 0.0, 0.0, False
        sim.solved.zero_()
        sim.went_back = False
        for term in sim.stages.contact:
            term.restore(*self._same(contacts or NO_CONTACTS))

    def step(self, pose: Pose, dt: float) -> Ended:
        sim = self.sim
        begun, of_wall = self.now(), time.perf_counter()
        try:
            report = sim.advance(self._same(pose), sim.state.time + dt)
        except StoppedError as stopped:  # the simulation is then back where the step began
            return Ended(stopped.x.numpy().astype(np.float64), 1e3 * (self.now() - begun))
        ms = 1e3 * (self.now() - begun)
        busy = ms / (1e3 * (time.perf_counter() - of_wall))  # verbs are timed by the wall
        x = sim.state.x.numpy().astype(np.float64)
        told = {
            "estimate": float(f"{1e3 * report.error:.5g}"),
            "newton": report.newton_iterations,
            "void": report.retries > 0,
            "pairs": report.pairs,
        }
        times = report.times_ms
        whole = {verb: AS_ONE.get(verb, verb) for verb in STAGES}
        shares = {STAGES[verb]: round(busy * times.get(one, times.get(verb, 0.0)), 3) for verb, one in whole.items()}
        return Ended(x, ms, {**told, **shares})

    def _stop_at_trial(self) -> None:
        """Let a step end where the correction would begin."""
        timed = self.sim.timed

        def until_correction(verb: Callable[..., None], *arguments: object) -> None:
            if verb.__name__ == "correct_penetration":
                wp.synchronize_device(self.device)
                raise StoppedError(wp.clone(self.sim.state.x))
            timed(verb, *arguments)

        self.sim.timed = until_correction  # type: ignore[method-assign]


NO_CONTACTS: Contacts = (np.zeros((0, 4), np.int32), np.zeros((0, 3)))


class Baseline:
    """One of ours that are written in numpy, in float64."""

    is_compiled = False

    def __init__(self, scene: ContactScene, method: Method) -> None:
        self.now = clock_of("cpu")
        at = {name: int(value) for name, value in method.at.items() if name != "tolerance"}
        self.more: dict[str, float] = {}
        self.solver: Xpbd | ChebyshevJacobi | Reference
        if method.solver == "xpbd":
            self.solver = Xpbd(scene.scene, **{"substeps": 1, **at})
        elif method.solver == "chebyshev":
            self.solver = ChebyshevJacobi(scene.scene, **{"substeps": 1, **at})
        else:
            self.solver = Reference(scene.scene)
            self.more = {"tolerance": method.at.get("tolerance", TOLERANCE)}

    def begin(self, motion: Motion, _contacts: Contacts | None) -> None:
        self.motion = motion

    def step(self, pose: Pose, dt: float) -> Ended:
        """A step that Newton does not come to the end of ends nowhere: it is not a number."""
        begun = self.now()
        try:
            self.motion = self.solver.step(self.motion, pose, dt, **self.more)
            x = self.motion.x
        except NotConvergedError:
            x = np.full_like(self.motion.x, np.nan)
        ms = 1e3 * (self.now() - begun)
        solved = self.solver.solved if isinstance(self.solver, Reference) else None
        return Ended(x, ms, {} if solved is None else {"newton": solved.iterations})


class Inertia:
    """No solver."""

    is_compiled = False

    def __init__(self, scene: ContactScene) -> None:
        self.now, self.data = clock_of("cpu"), Reference(scene.scene)  # its skin, nothing else

    def begin(self, motion: Motion, _contacts: Contacts | None) -> None:
        self.motion = motion

    def step(self, pose: Pose, dt: float) -> Ended:
        """To x + h v."""
        begun = self.now()
        x = self.motion.x[: len(self.motion.v)] + dt * self.motion.v
        ms = 1e3 * (self.now() - begun)
        return Ended(np.vstack([x, self.data.skin(pose)]), ms)


def stepper_of(scene: ContactScene, method: Method, device: str) -> Stepper:
    """The method's, ready for a state."""
    if method.solver in ("ours", "trial", "float64"):
        return Ours(scene, method, device)
    if method.solver in ("xpbd", "chebyshev", "newton_ipc"):
        return Baseline(scene, method)
    if method.solver == "inertia":
        return Inertia(scene)
    from peer_steps import ByNewton  # an optional group of packages

    return ByNewton(scene, method, device)
