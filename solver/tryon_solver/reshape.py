"""Another rest shape for a garment that is being worn: Algorithm 2's edit where triangles and seams stay.

All that is made of the rest shape is made anew and written where the old one stood, between two steps: what works with
it, recorded graphs among it, need not know. The state stays, and so does the subspace's basis, over the pattern's
coordinates at the start of a drag. The reduced matrix changes; the inverse of the old one serves as the search's first
Hessian until that of the new one is there (`Simulation.inverse_to_make` and `use_inverse`): it changes how fast the
search converges, not where to.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import warp as wp

from tryon_solver.geometry.altitudes import refuse_slivers, self_reach
from tryon_solver.geometry.garment import Garment
from tryon_solver.linalg.ell import EllMatrix
from tryon_solver.linalg.near_far import NearFar
from tryon_solver.materials.stretch import StretchMeter
from tryon_solver.plan import Contribution, StepPlan
from tryon_solver.simulation import Simulation, bind_plan

Write = tuple[wp.array, wp.array]  # what is written over, and what over it


class OtherStructureError(ValueError):
    """The shape can't be written over the old one: the garment has to be built anew."""


def reshape(sim: Simulation, garment: Garment) -> None:
    """Let the worn garment have the rest shape of `garment`, which has the same faces, from the next step on.

    What is measured in mean edges of the mesh (slack of searches, the mollifier of nearly parallel edges) stays as it
    was when the simulation was built. Wakes a garment that sleeps. Raises OtherStructureError for other faces, and
    GarmentError for triangles that can't carry the fabric's thickness; then nothing has changed.
    """
    worn = sim.scene.garment
    if garment.vertex_count != worn.vertex_count or not np.array_equal(garment.faces, worn.faces):
        raise OtherStructureError("the garment has other triangles than the one that is worn")
    refuse_slivers(garment)
    scene = replace(sim.scene, garment=garment)
    mass, area = scene.vertex_masses(), garment.vertex_areas()
    made = bind_plan(scene, sim.settings, sim.device, mass, area).contributions
    plan = StepPlan(tuple(of_shape(old, new) for old, new in zip(sim.plan.contributions, made, strict=True)))
    stiffness = plan.stiffness(sim.cloth_count)
    writes = [
        *(write for old, new in zip(sim.plan.contributions, made) for write in zip(old.at_rest, new.at_rest)),
        *over_matrix(sim.stiffness, EllMatrix.from_scipy(stiffness, sim.device)),
        *over_parts(sim, plan),
        *over_lengths(sim, garment),
    ]
    writes = [(old, as_wide(new, old)) for old, new in writes]  # what could be refused, is before anything is written
    for old, new in writes:
        wp.copy(old, new)
    sim.stiffness_diagonal.assign(stiffness.diagonal().astype(np.float32))
    sim.scene, sim.plan, sim.mass, sim.area, sim.stiffness_matrix = scene, plan, mass, area, stiffness
    sim.forget_inverses()
    sim.set_diagonals(sim.dt)
    sim.wake()


def of_shape(old: Contribution, new: Contribution) -> Contribution:
    """What acts on the device is the old one, over whose arrays is written; what the host asks for is the new one's."""
    return replace(
        old,
        stiffness=new.stiffness,
        rate_stiffness=new.rate_stiffness,
        diagonal=new.diagonal,
        energy=new.energy,
    )


def over_matrix(old: EllMatrix, new: EllMatrix) -> Iterator[Write]:
    """Columns and weights: which entries are zero depends on the shape, and those have no place in a row."""
    yield old.columns, new.columns
    yield old.weights, new.weights


def over_parts(sim: Simulation, plan: StepPlan) -> Iterator[Write]:
    """The constant parts of the correction's matrix."""
    kept: tuple[NearFar | None, ...] = sim.damped or (sim.constant_stiffness, None)
    for old, new in zip(kept, sim.constant_parts(plan)):
        if old is not None and new is not None:
            yield old.near, new.near
            yield from over_matrix(old.far, new.far)


def over_lengths(sim: Simulation, garment: Garment) -> Iterator[Write]:
    """What is measured in the pattern."""
    device = sim.device
    yield sim.stretch.gradients, StretchMeter.build(garment, device).gradients
    yield sim.contact.area, wp.array(garment.vertex_areas(), dtype=wp.float32, device=device)
    if "cloth" in sim.plan.touches:
        reach = self_reach(garment, sim.scene.fabric.thickness)
        yield sim.contact.reach_self, wp.array(reach, dtype=wp.float32, device=device)


def as_wide(new: wp.array, old: wp.array) -> wp.array:
    """`new`, with rows filled up to the length of the old one's. Raises OtherStructureError where they are longer."""
    if new.shape == old.shape:
        return new
    if new.ndim != 2 or new.shape[0] != old.shape[0] or new.shape[1] > old.shape[1]:
        raise OtherStructureError(
            "a row of the new shape's matrices has more entries than there is room for in the old one's"
        )
    entries = new.numpy()
    rows = np.zeros(old.shape, entries.dtype)
    if np.issubdtype(entries.dtype, np.integer):
        rows[:] = np.arange(len(rows))[:, None]  # as EllMatrix pads its columns
    rows[:, : entries.shape[1]] = entries
    return wp.array(rows, dtype=new.dtype, device=new.device)
