"""Another rest shape for a garment that is being worn: Algorithm 2's edit where triangles and seams stay.

All that is made of the rest shape is made anew on the device, where the old one stood, between two steps: what works
with it, recorded graphs among it, need not know. The state stays, and so does the subspace's basis, over the pattern's
coordinates at the start of a drag. The reduced matrix changes; the inverse of the old one serves as the search's first
Hessian until that of the new one is there (`Simulation.inverse_to_make` and `use_inverse`): it changes how fast the
search converges, not where to.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tryon_solver.geometry.garment import Garment
from tryon_solver.offsets import refuse_what_bears_no_contact
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.search import distrust_list


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
    refuse_what_bears_no_contact(sim.scene, garment, sim.plan.touches)
    sim.scene = replace(sim.scene, garment=garment)
    sim.take_shape()
    sim.matrices.fill()
    sim.inverses.clear()  # what the search uses goes on serving until `use_inverse`
    sim.set_diagonals(sim.dt)
    if sim.touching:
        distrust_list(sim)  # larger triangles feel others from further off
    sim.wake()
