"""How stiff a stitch is, and the stitches that hold pockets and patches on the fabric beneath."""

from __future__ import annotations

import numpy as np

from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import Attached, Effect

STITCH_PER_FABRIC = 2.0  # stiffness of a stitch over the fabric's own: a seam closes however much the fabric pulls


def stitch_stiffness(fabric: Fabric) -> float:
    """N/m of one stitch in this fabric."""
    return STITCH_PER_FABRIC * max(fabric.k_warp, fabric.k_weft)


def stitched_on(panels: PanelMesh, vertex: np.ndarray, fabric: Fabric) -> tuple[Effect, ...]:
    """The effects that the pattern itself calls for: none, but where a piece lies on another.

    `vertex` (V,) says which of the simulation's vertices each of the mesh is.
    """
    laid, sewn = panels.laid, panels.laid.sewn
    if not sewn.any():
        return ()
    onto, weights = vertex[laid.onto[sewn]], laid.weights[sewn]
    return (Attached(vertex[laid.vertices[sewn]], onto, weights, stitch_stiffness(fabric)),)


def without_stitches(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """What is not the pattern's, but the scene's own."""
    return tuple(effect for effect in effects if not isinstance(effect, Attached))
