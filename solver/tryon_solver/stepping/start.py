"""Is the position in which a scene starts free of contact? All that follows rests on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tryon_solver.contact import crossings, distances, verify
from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.geometry.garment import GarmentError
from tryon_solver.stepping.search import search_around

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

REMEDY = "move them apart, or build the scene as tangled and free it with dressing.untangle"


def refuse_touching_start(sim: Simulation) -> None:
    """Raises GarmentError, naming the place, where the start crosses or is closer than a commit may be."""
    if not sim.touching:
        return
    refuse_crossing(sim)
    state, candidates, sizes = sim.state, sim.candidates, sim.contact.sizes
    sim.work.direction.zero_()
    search_around(sim, state.x, sim.work.direction)
    count = verify.violations(candidates, sim.cloth_count, sizes, state.x, sim.work.hits)
    sim.searches = 0
    if not count:
        return
    worst = int(np.argmin(candidates.distance.numpy()[: candidates.size]))
    a, b, c, d = (named(sim, int(v)) for v in candidates.ids.numpy()[worst])
    pair = f"{a} and the triangle of {b}, {c} and {d}"
    if int(candidates.kind.numpy()[worst]) != distances.POINT_TRIANGLE:
        pair = f"the edge of {a} and {b} and the edge of {c} and {d}"
    raise GarmentError(
        f"at the start {pair} touch or nearly do ({count} pairs are closer than half the thickness between them, "
        f"{1e3 * sizes.xi_self:.2f} mm of cloth on cloth and {1e3 * sizes.xi_body:.2f} mm on the body); {REMEDY}"
    )


def refuse_crossing(sim: Simulation) -> None:
    """Raises GarmentError for an edge that passes through a triangle, of those that may touch each other."""
    n, garment, group = sim.cloth_count, sim.scene.garment, sim.group.numpy()
    x, touches = sim.state.x.numpy(), sim.plan.touches
    edges, faces = garment.edges(), garment.faces
    searched = [(edges, faces)] if "cloth" in touches else []
    if "body" in touches and sim.scene.body is not None:
        skin = sim.scene.body.faces + n
        searched += [(edges, skin), (Connectivity(skin, len(x)).edges, faces)]
    for ours, theirs in searched:
        found = crossings.CrossingSearch(ours, theirs, group, sim.device).find(x)
        if len(found):
            a, b = (named(sim, int(v)) for v in ours[found[0, 0]])
            c, d, e = (named(sim, int(v)) for v in theirs[found[0, 1]])
            raise GarmentError(
                f"at the start the edge of {a} and {b} passes through the triangle of {c}, {d} and {e} "
                f"({len(found)} such crossings); {REMEDY}"
            )


def named(sim: Simulation, vertex: int) -> str:
    """A vertex for people: the body's have their own numbers."""
    return f"vertex {vertex}" if vertex < sim.cloth_count else f"the body's vertex {vertex - sim.cloth_count}"
