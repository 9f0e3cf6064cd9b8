"""Cloth that a correction leaves torn: the step is done again with a budget of its own (correct.py).

Where contact stops single vertices for good, in a knot that is drawn together, iterations that are few end with their
neighbours pulled away, a triangle to several times its length, and a measure over the whole cloth does not see it: it
is near balance but for these. So the largest stretch is looked at, `Settings.correction_torn`, and a torn step is
given ITERATIONS of PCG_ITERATIONS, which no nearness ends. What these leave stretched is so: a fabric or a tape that
gives more, cloth that is pulled by force. Nothing is done again for it until it is stretched MORE. Ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import find_largest_number
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.stretch import larger_kernel
from tryon_solver.stepping.progress import TRUSTED_AGAIN, Budget

wp.set_module_options({"enable_backward": False})

ITERATIONS = 12  # Newton's, of a torn step
PCG_ITERATIONS = 60  # conjugate gradients of each of these
MORE = 1.05  # times what these left


@dataclass
class TearWatch:
    """Of the triangles at `rest`, `stretch` (F,) float32; `largest` (1,) float32 is what was measured last. `beyond`,
    from which on cloth is torn; `borne`, the largest stretch that the `budget` for it left, 0 once it is less."""

    rest: RestShape
    stretch: wp.array
    largest: wp.array
    beyond: float
    budget: Budget
    borne: float = 0.0

    @staticmethod
    def build(rest: RestShape, largest: wp.array, beyond: float | None) -> TearWatch | None:
        """None where nothing is said of it."""
        if beyond is None:
            return None
        stretch = wp.zeros(rest.face_count, dtype=wp.float32, device=largest.device)
        budget = Budget(ITERATIONS, PCG_ITERATIONS, TRUSTED_AGAIN, ends_near=False)
        return TearWatch(rest, stretch, largest, beyond, budget)

    def measure(self, x: wp.array) -> None:
        """Put the largest stretch at x (A,) m, the cloth's vertices first, into `largest`, on the device."""
        triangles = [self.rest.faces, self.rest.gradients]
        launch(larger_kernel, len(self.stretch), [*triangles, x], [self.stretch], device=x.device)
        find_largest_number(self.stretch, self.largest)

    def torn(self, largest: float) -> bool:
        """Is cloth whose largest stretch is this torn?"""
        if largest <= self.beyond:
            self.bear_none()
        return largest > max(self.beyond, MORE * self.borne)

    def bear(self, largest: float) -> None:
        """The budget for torn cloth has left so much."""
        self.borne = largest

    def bear_none(self) -> None:
        """Nothing is torn."""
        self.borne = 0.0
