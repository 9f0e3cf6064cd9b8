"""Another cut of a garment that is worn, with all that follows from its mesh alone.

Made by a process beside the simulation, as a rule: nothing here needs the solver's device, and what is handed over
saves the simulation that time between two frames.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from scipy.sparse import csr_matrix

from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.overlay import Overlay
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.weld import WeldedMesh, weld
from tryon_solver.subspace.basis import basis_by_edges


@dataclass(frozen=True, eq=False)
class NewCut:
    """The mesh, in the size that is worn; that sewn together, and as the garment that is simulated; its subspace's
    basis; and what of it lies where over the cut that is worn."""

    mesh: PanelMesh
    welded: WeldedMesh
    garment: Garment
    basis: csr_matrix
    overlay: Overlay

    @staticmethod
    def of(mesh: PanelMesh, worn: PanelMesh, spacing: float) -> NewCut:
        """Of `mesh`, to be put on from the mesh `worn`; splines `spacing` mean edges apart. Raises GarmentError."""
        with ThreadPoolExecutor(2) as others:  # numpy and scipy let go of Python for most of the time
            overlay = others.submit(Overlay.of, worn, mesh)
            welded = weld(mesh)
            garment = welded.garment()
            complete = others.submit(garment.connectivity.complete)
            basis = basis_by_edges(garment, spacing)
            complete.result()
            return NewCut(mesh, welded, garment, basis, overlay.result())
