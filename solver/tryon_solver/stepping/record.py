"""Verbs that a GPU runs as one graph."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tryon_solver.linalg.device_loop import KeptGraph, keeps_graphs

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def recorded(sim: Simulation, verb: Callable[[Simulation], None], done: bool = False) -> None:
    """Run a verb whose verbs neither read nor allocate, unless it is `done`. On a GPU they are recorded once, and
    launched as one graph for as long as that stands; of their times there is one then, under the verb's own name."""
    if done:
        return
    if not keeps_graphs(sim.device):
        verb(sim)
        return
    graph = sim.graphs.setdefault(verb.__name__, KeptGraph())

    def launch(_sim: Simulation) -> None:
        graph.run(lambda: over_any_pairs(sim, lambda: verb(sim)), baked(sim), sim.device)

    launch.__name__ = verb.__name__
    sim.timed(launch)


def as_one(sim: Simulation, name: str, body: Callable[[], None]) -> None:
    """Launch what `body` launches, which must neither allocate nor read back; on a GPU as one graph of that name."""
    if not keeps_graphs(sim.device):
        body()
        return
    sim.graphs.setdefault(name, KeptGraph()).run(lambda: over_any_pairs(sim, body), baked(sim), sim.device)


def over_any_pairs(sim: Simulation, body: Callable[[], None]) -> None:
    """Launch what `body` launches, within a graph over whatever number of pairs there may be when it is repeated."""
    size = sim.pairs.size
    if size:
        sim.pairs.cover_in_graph()
    body()
    sim.pairs.size = size


def unrecorded(sim: Simulation, verb: Callable[[Simulation], None]) -> None:
    """Run a verb of which some verb reads or allocates."""
    verb(sim)


def baked(sim: Simulation) -> tuple[object, ...]:
    """What a graph was recorded for: settings, whether there were pairs, whether candidates are idle and the cloth
    rests among none, where the arrays are that grow and how far.

    What contacts keep grows later than the pairs: a graph that was recorded between the two would go on keeping it
    where nobody looks any more."""
    lists, pairs = sim.candidates, sim.pairs
    kept = tuple(term.room() for term in sim.stages.contact)
    any_at_all = pairs.size > 0, lists.idle, sim.rests
    return sim.recorded_settings, any_at_all, lists.places, pairs.ids.ptr, pairs.capacity, kept
