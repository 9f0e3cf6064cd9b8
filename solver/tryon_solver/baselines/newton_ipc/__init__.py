"""The reference: incremental potential contact by full-space Newton in float64, of the solver's own discrete energy.

Slow and exact, for 500 to 2,000 vertices. METHOD.md section 18 says what is shared with the solver and what is not.
"""

from tryon_solver.baselines.newton_ipc.march import Motion, Reference

__all__ = ["Motion", "Reference"]
