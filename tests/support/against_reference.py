"""The solver against the reference: one step from its states, and whole drapes from the same start."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from contact_scenes import DT, ContactScene
from contact_state import contact_gradient, find_pairs
from reference_distances import stencil_keys

from tryon_solver.baselines.newton_ipc import Motion, Reference
from tryon_solver.baselines.newton_ipc.distance import EDGE_EDGE
from tryon_solver.baselines.newton_ipc.march import TOLERANCE
from tryon_solver.baselines.newton_ipc.newton import solve
from tryon_solver.contact import pairs
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation, build

KEPT_IN = Path(__file__).resolve().parents[2] / ".cache" / "tryon" / "reference"


@dataclass(frozen=True)
class ReferenceStep:
    """Step `number` of the reference, `before` it and `after` it."""

    number: int
    before: Motion
    after: Motion
    last_move: float  # m


def reference_steps(case: ContactScene, count: int) -> Iterator[ReferenceStep]:
    """The reference's first steps of a scene; kept on disk."""
    ref = Reference(case.scene, kept_in=KEPT_IN)
    motion = ref.start(case.pose_at(0))
    for number in range(1, count + 1):
        after = ref.step(motion, case.pose_at(number), DT)
        assert ref.solved is not None
        yield ReferenceStep(number, motion, after, ref.solved.last_move)
        motion = after


def simulation_at(case: ContactScene, motion: Motion, settings: Settings, device: str = "cpu") -> Simulation:
    """The solver in the reference's state. The scene's own start need not be free of the body in that pose."""
    sim = build(case.scene, settings, device, motion.pose, tangled=True)
    sim.state.x.assign(motion.x.astype(np.float32))
    sim.state.v.assign(motion.v.astype(np.float32))
    restore_contacts(sim, motion)
    return sim


def restore_contacts(sim: Simulation, motion: Motion) -> None:
    """Let the solver's contacts have given what the reference's have."""
    for term in sim.stages.contact:
        term.restore(*known_contacts(sim, motion))


def known_contacts(sim: Simulation, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """The reference's contacts as the solver lists them, (P, 4), and how far each has given, (P, 3) m; both know them
    by their vertices. Searches around the reference's state."""
    sim.searches = 0  # each doubles how far the next one looks
    find_pairs(sim, motion.x)
    size, known = sim.candidates.size, motion.known
    kinds, ids = sim.candidates.kind.numpy()[:size], sim.candidates.ids.numpy()[:size]
    place = {key: k for k, key in enumerate(stencil_keys(kinds, ids).tolist())}
    found = ids[[place[key] for key in stencil_keys(known.kinds, known.ids).tolist()]]
    same_first_edge = (np.sort(found[:, :2], axis=1) == np.sort(known.ids[:, :2], axis=1)).all(axis=1)
    turned = (known.kinds == EDGE_EDGE) & ~same_first_edge
    return found, np.where(turned[:, None], -known.given, known.given)


def rms(difference: np.ndarray) -> float:
    """Root mean square length of (N, 3) vectors."""
    return float(np.sqrt((difference**2).sum(1).mean()))


def one_step(case: ContactScene, step: ReferenceStep, settings: Settings) -> np.ndarray:
    """(A, 3) m: where the solver takes cloth and surface in the same step."""
    sim = simulation_at(case, step.before, settings)
    report = sim.advance(case.pose_at(step.number), DT)
    assert report.retries == 0
    return np.vstack([sim.cloth_positions(), sim.body_positions()]).astype(np.float64)


def one_step_error(case: ContactScene, step: ReferenceStep, settings: Settings) -> float:
    """RMS over the cloth's vertices [m] of where the solver and the reference are after the same step."""
    n = len(step.before.v)
    return rms(one_step(case, step, settings)[:n] - step.after.x[:n])


def off_balance(case: ContactScene, step: ReferenceStep, x: np.ndarray) -> float:
    """RMS over the cloth's vertices [m] of how far the reference goes when it solves the step from x (A, 3) m."""
    ref = Reference(case.scene)
    problem = ref.problem(step.before, case.pose_at(step.number), DT)
    n = len(step.before.v)
    return rms(solve(problem, ref.search, x, TOLERANCE).x[:n] - x[:n])


def force_on_body(sim: Simulation) -> np.ndarray:
    """(3,) N: barrier and friction summed over the collision surface; the gradient there is minus the force."""
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    return -contact_gradient(sim, friction=True)[sim.cloth_count :].sum(0)
