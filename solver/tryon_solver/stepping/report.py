"""The figures of a report: worked out on the device, and read with one wait."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.advice import advise, heavy, nearest_limit, unmet
from tryon_solver.contact import pairs
from tryon_solver.linalg.read_back import read, read_by_name
from tryon_solver.linalg.vectors import find_largest, subtract
from tryon_solver.materials.fabric import Fabric
from tryon_solver.offsets import largest_offsets, least_offsets
from tryon_solver.results import StepReport
from tryon_solver.stepping.move_body import farthest
from tryon_solver.stepping.repeat import TAKEN

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def make_report(sim: Simulation) -> StepReport:
    """Figures of the call of `advance` that is ending. Waits for the device."""
    counters = sim.counters
    if sim.state.asleep and not counters.steps:
        return sim.reported.sleeping(sim.state.time, sim.debt)
    touching = in_contact(sim)
    told = sim.figures if counters.steps else None
    if told is None:
        measure_for_report(sim)
        told = read_by_name(figures(sim))
    gap, gap_offset = with_offset(sim, told["gaps"]) if touching else no_gap(sim)
    lag, error, stretch, late = float(told["lag"][0]), float(told["error"][0]), told["stretch"], sim.pace.end()
    return StepReport(
        time=sim.state.time,
        steps=counters.steps,
        substeps=counters.substeps,
        iterations=int(told["cycles"][TAKEN]),
        newton_iterations=counters.newton_iterations,
        residual=counters.residual,
        error=error,
        min_gap=gap,
        gap_offset=gap_offset,
        max_stretch=float(stretch.max()),
        body_lag=lag if counters.asked is None else farthest(sim.body_positions(), counters.asked),
        pairs=sim.pairs.size,
        overlapping=sim.pairs.overlapping,
        retries=counters.retries,
        reverts=counters.reverts,
        debt=sim.debt,
        times_ms=dict(counters.times),
        late=late,
        asleep=sim.state.asleep,
        advice=advise(
            counters,
            sim.debt,
            *strained(sim, stretch),
            lag,
            unmet(sim.settings, error, late, counters.residual),
            [one.name for one in sim.plan.contributions if one.name != "gravity" or heavy(told["gravity"])],
        ),
    )


def figures(sim: Simulation) -> dict[str, wp.array]:
    """Where the device has what a report is made of, by name."""
    return {
        "gaps": sim.pairs.smallest_gap,
        "cycles": sim.cycles,
        "lag": sim.lag,
        "stretch": sim.stretch.stretch,
        "error": sim.error,
        **{one.name: one.values["acceleration"] for one in sim.plan.contributions if one.name == "gravity"},
    }


def smallest_gap(sim: Simulation) -> tuple[float, float]:
    """Smallest gap of a contact pair at x above its offset, and that offset [m]; collects the pairs at x."""
    if not in_contact(sim):
        return no_gap(sim)
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    return with_offset(sim, read(sim.pairs.smallest_gap)[0])


def in_contact(sim: Simulation) -> bool:
    """Are there candidates of this call of `advance` to collect pairs from?"""
    return bool(sim.touching and sim.counters.steps)


def no_gap(sim: Simulation) -> tuple[float, float]:
    """What is told where there are no pairs."""
    return sim.settings.d_hat, largest_offsets(sim.scene, sim.settings)[0]


def with_offset(sim: Simulation, gaps: np.ndarray) -> tuple[float, float]:
    """The smaller of the smallest gaps (2,) m to the body and of cloth to cloth, and its offset [m]: of an outfit the
    least that one of that sort has."""
    of_body, of_cloth = least_offsets(sim.scene, sim.settings)
    body, cloth = (float(gap) for gap in gaps)
    return (body, of_body) if body <= cloth else (cloth, of_cloth)


def measure_for_report(sim: Simulation) -> None:
    """For the device: the stretch of the cloth at x, and how far the surface is behind its skin."""
    measure_lag(sim)
    sim.stretch.measure(sim.state.x)


def measure_lag(sim: Simulation) -> None:
    """Put into `lag` how far the collision surface is from the tracked skin, at most [m].

    The skin after a sub-step is free by now: it is where their difference goes."""
    body = sim.body
    if body is None:
        return
    subtract(sim.state.x[sim.cloth_count :], body.skin_now, body.skin_next)
    find_largest(body.skin_next, sim.lag)


def strained(sim: Simulation, stretch: np.ndarray) -> tuple[Fabric, np.ndarray]:
    """The fabric that advice is about, and stretches (F,) to hold against its limit."""
    scene = sim.scene
    return nearest_limit(scene.fabric_of_face(), stretch) if scene.panel_fabrics else (scene.fabric, stretch)
