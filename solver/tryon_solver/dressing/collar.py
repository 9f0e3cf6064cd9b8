"""Whether a garment that the shoulders should hold is too large for them: it falls off however it is sewn. Ours."""

from __future__ import annotations

import numpy as np

from tryon_solver.dressing.fit import DressingError
from tryon_solver.dressing.opening import as_drawn, body_girth, is_around, rest_girth
from tryon_solver.geometry.body_parts import find_trunk
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.panel_mesh import PanelMesh


def slips_off(panels: PanelMesh, body: np.ndarray, body_faces: np.ndarray) -> DressingError | None:
    """The error of a garment whose collar, where the pattern places it on the standing body (B, 3) m with those faces
    (F, 3), is wider than the shoulders with the arms; None where it is not, or no shoulder holds it."""
    garment, x = as_drawn(panels)
    trunk = find_trunk(body, body_faces)
    loops = [loop for loop in boundary_loops(garment.faces) if is_around(x[loop], trunk.middle)]
    if x[:, 1].max() <= trunk.armpit or len(loops) < 2:
        return None
    upper = max(loops, key=lambda ids: x[ids, 1].mean())
    collar, _ = rest_girth(garment, upper)
    # half way up from the armpits, where the arms are part of the shoulders however they are held
    shoulders = body_girth(body, body_faces, trunk, 0.5 * (trunk.armpit + x[upper, 1].mean()), arms=True)
    if collar <= shoulders:
        return None
    fits = np.floor(100 * shoulders / collar) / 100
    return DressingError(
        f"its uppermost opening is {100 * collar:.0f} cm around, the shoulders with the arms {100 * shoulders:.0f} cm: "
        "the garment falls off them, it is too large for this body",
        "garment",
        f"Choose a size below {fits:.2f} of this one, or narrow that opening in the pattern",
    )
