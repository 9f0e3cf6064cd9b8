"""The real drape: the solver's simulation behind the server's interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from tryon_protocol import GRID, check_grid
from tryon_solver.body.model import BodyModel, default_body
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.dress import Dressed, DressingError, dress
from tryon_solver.geometry.garment import GarmentError
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import PatternError, load_pattern
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.results import StepReport
from tryon_solver.settings import PRESETS

from tryon_server.runtime.drape import DrapeError, Outfit, Progress
from tryon_server.runtime.order import DrapeOrder

EDGE_LENGTHS = {"draft": 0.02, "live": 0.01, "fit": 0.007}
"""Length of the mesh's edges [m] by preset: a T-shirt has about 2.5, 10 and 20 thousand vertices."""

TRY_ANOTHER = "Correct the pattern, or choose a longer edge length or another fabric."


class SolverDrape:
    """A garment dressed by the solver, as the server's worker drives it."""

    def __init__(self, dressed: Dressed, body: BodyModel) -> None:
        self._simulation = dressed.simulation
        self._dressed_at = dressed.simulation.state.time
        welded = dressed.welded
        self.outfit = Outfit(
            vertex_count=welded.vertex_count,
            faces=welded.vertex_of_corner,
            uv=welded.uv_corners,
            panel_of_face=welded.panel_of_face,
            panel_names=dressed.panels.panel_names,
            body=body,
        )
        self.pose: Pose = dressed.pose

    def advance(self, pose: Pose, t: float) -> StepReport:
        """Simulate from the last pose's time to ``pose`` at time ``t`` [s], counted from the dressing."""
        return self._simulation.advance(pose, self._dressed_at + t)

    def cloth_positions(self) -> npt.NDArray[np.float32]:
        """(N, 3) positions of the cloth [m]."""
        return self._simulation.cloth_positions()

    def body_positions(self) -> npt.NDArray[np.float32]:
        """(B, 3) positions of the body's simulated surface [m]."""
        return self._simulation.body_positions()


def build_drape(order: DrapeOrder, progress: Progress) -> SolverDrape:
    """Mesh the pattern, load the body and dress it.

    Raises:
        DrapeError: something in the order does not fit, or the garment can't be put on; says what to try.
    """
    preset = order.preset
    settings = PRESETS[preset]
    fabric = FABRICS[order.fabric]
    device = order.device
    try:
        progress("Reading the body", None)
        body = load_body(order.body)
        progress("Meshing the pattern", None)
        panels = mesh_pattern(load_pattern(order.pattern), order.edge_length or EDGE_LENGTHS[preset])
        check_grid(GRID, min(fabric.thickness, settings.body_offset))
        dressed = dress(panels, body, fabric, settings, device, progress=progress)
    except PatternError as error:
        raise DrapeError(f"{error.place}: {error.message}.", error.remedy) from error
    except (PlacementError, GarmentError, DressingError) as error:
        raise DrapeError(f"The garment can't be put on: {error}.", TRY_ANOTHER) from error
    return SolverDrape(dressed, body)


def load_body(path: Path | None) -> BodyModel:
    """The body in this file, or the default body."""
    return default_body() if path is None else BodyModel.load(path)
