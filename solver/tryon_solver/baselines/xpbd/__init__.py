"""Extended position-based dynamics on the same garment, fabric and body."""

from tryon_solver.baselines.xpbd.solver import Xpbd

__all__ = ["Xpbd"]
