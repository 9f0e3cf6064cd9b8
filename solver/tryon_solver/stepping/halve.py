"""Steps are halved where a body goes so far in one that carrying the cloth along with it tears the cloth.

What lies on a thigh is carried with the thigh, what lies on the belly with the belly, and what contact stops stays
behind: between the two, triangles are drawn out to several times their length before anything is solved, the finer the
mesh the more. The correction mends that as long as it is little. A step half as long carries half as far, and what is
mended after each takes fewer iterations than all at once. So what carrying stretched any triangle by is measured in
each step, and the ones that follow are half as long, a quarter or an eighth, until it is little again. Ours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import find_largest_number
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.stretch import larger_stretch

wp.set_module_options({"enable_backward": False})

MOST = 3  # times that a step is halved
LITTLE = 0.25  # of what makes steps shorter, that makes them longer again: twice that far carries twice as much


@wp.kernel
def growth_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    before: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    growth_out: wp.array(dtype=wp.float32),
):
    """By how much each triangle's larger principal stretch has grown."""
    t = wp.tid()
    v = faces[t]
    g = gradients[t, 1]
    h = gradients[t, 2]
    growth_out[t] = larger_stretch(v, g, h, x) - larger_stretch(v, g, h, before)


@dataclass
class Halving:
    """Of the triangles at `rest`; `growth` (F,) float32, and `largest` (1,) float32, the largest of them in this step.
    `most` of it makes steps shorter, of which each is now halved `times`; `grown` is it, as it was read."""

    rest: RestShape
    growth: wp.array
    largest: wp.array
    most: float
    times: int = 0
    grown: float = 0.0

    @staticmethod
    def build(rest: RestShape, largest: wp.array, most: float) -> Halving:
        """With whole steps."""
        return Halving(rest, wp.zeros(rest.face_count, dtype=wp.float32, device=largest.device), largest, most)

    def measure(self, before: wp.array, x: wp.array) -> None:
        """Put into `largest`, on the device, what triangles were stretched by from `before` to x (A,) m, at most."""
        inputs = [self.rest.faces, self.rest.gradients, before, x]
        launch(growth_kernel, len(self.growth), inputs, [self.growth], device=x.device)
        find_largest_number(self.growth, self.largest)

    def look(self) -> None:
        """The step has stretched a triangle by `grown` before it was solved: how long is the next one?"""
        if self.grown < LITTLE * self.most:
            self.times = max(0, self.times - 1)
        while self.grown > self.most and self.times < MOST:
            self.grown *= 0.5
            self.times += 1

    def parts(self) -> Iterator[tuple[float, float]]:
        """Where the steps of an interval begin and how long they are, as shares of it, each as found best by then."""
        finest, done = 1 << MOST, 0
        while done < finest:
            size = finest >> self.times
            while done % size:  # steps became longer half way to the end of one of these
                size //= 2
            self.grown = 0.0  # as of one that is passed over
            yield done / finest, size / finest
            self.look()
            done += size
