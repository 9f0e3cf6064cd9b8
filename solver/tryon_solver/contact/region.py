"""The region in which a candidate list is complete: balls around anchors, which may move, one a vertex."""

from __future__ import annotations

import math
from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

KEPT_APART = wp.constant(0.999)  # of the distance of two boxes, for the rounding of their corners
SURFACE_SHARE = 0.25  # of the slack is granted to the collision surface, which seldom leaves the skin


@dataclass
class Region:
    """Where a candidate list is complete: while every vertex i is within `budget`[i] m of `anchor`[i], both (A,).

    A search may be made for anchors that move on straight paths from `centre` - `half_way` to `centre` + `half_way`,
    all at once; whoever moves them keeps `anchor` where they are. `outside` (2,) int32 is scratch, to count in.
    """

    anchor: wp.array
    budget: wp.array
    centre: wp.array
    half_way: wp.array
    outside: wp.array

    @staticmethod
    def allocate(count: int, device: str) -> Region:
        def vectors() -> wp.array:
            return wp.zeros(count, dtype=wp.vec3, device=device)

        budget = wp.zeros(count, dtype=wp.float32, device=device)
        return Region(vectors(), budget, vectors(), vectors(), wp.zeros(2, dtype=wp.int32, device=device))

    def surround(self, x: wp.array, direction: wp.array, slack: float) -> None:
        """Let it be of all that go from x (A,) m along `direction`, wherever each stops, and stray by `slack` m."""
        outputs = [self.centre, self.half_way, self.budget]
        launch(surround_kernel, len(x), [x, direction, slack], outputs, device=x.device)
        wp.copy(self.anchor, self.centre)

    def accompany(
        self, cloth_count: int, x: wp.array, direction: wp.array, solved: wp.array, share: float, slack: float
    ) -> None:
        """Let it be of what goes from x along `direction` together, and by the `share` of `solved` (A,) m beside it,
        and strays by `slack` m; its anchors are not placed."""
        inputs = [cloth_count, x, direction, solved, share, slack]
        outputs = [self.centre, self.half_way, self.budget]
        launch(accompany_kernel, len(x), inputs, outputs, device=x.device)

    def place_anchors(self) -> None:
        """Put the anchors at the ends of their ways."""
        inputs = [self.centre, self.half_way]
        launch(anchor_kernel, len(self.centre), inputs, [self.anchor], device=self.centre.device)

    def grant(self, x: wp.array, direction: wp.array, alpha: wp.array, slack: float, most: wp.array) -> None:
        """Grant who leaves it by `alpha` times `direction` from x the way there and `slack` m, `most` (1,) m at a time.
        """
        inputs = [x, direction, alpha, self.anchor, slack, most]
        launch(raise_kernel, len(x), inputs, [self.budget], device=x.device)

    def part(self, cloth_count: int, reach: float, boxes: wp.array) -> None:
        """Where nothing of body and cloth was found, grant every vertex half of what is between them.

        With D the distance of the box around the cloth's anchors, wherever on their ways, from that around the skin's,
        no stencil is nearer than `reach` m while no vertex is further than (D - reach)/2 from its anchor: the list
        stays empty and complete, until something comes so far. Where one may go further by itself, nobody is granted
        anything: what it may meet was looked for with the others where they are. `boxes` (5,) vec3 m is scratch.
        """
        boxes.fill_(wp.vec3(-math.inf))
        count, device = len(self.budget), self.budget.device
        inputs = [cloth_count, self.centre, self.half_way, self.budget]
        launch(box_kernel, count, inputs, [boxes], device=device)
        launch(part_kernel, count, [boxes, reach], [self.budget], device=device)

    def stay_near(self, x: wp.array, x_feasible: wp.array, least: wp.array, furthest: wp.array, slack: float) -> None:
        """Of what `part` has granted leave to each vertex what this step needs, and `slack` m: with all of it, who is
        granted a little more comes into reach of all that the two surfaces have. `least` (A,) m is where the
        correction was nearest to balance, if `furthest` (1,), how far it was from it there, is finite."""
        inputs = [x, x_feasible, least, furthest, self.anchor, slack]
        launch(stay_near_kernel, len(x), inputs, [self.budget], device=x.device)


@wp.kernel
def surround_kernel(
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    slack: float,
    centre_out: wp.array(dtype=wp.vec3),
    half_way_out: wp.array(dtype=wp.vec3),
    budget_out: wp.array(dtype=wp.float32),
):
    """A ball around the middle of each way, so that its vertex may stop anywhere on it and stray by the slack."""
    i = wp.tid()
    half = 0.5 * direction[i]
    centre_out[i] = x[i] + half
    half_way_out[i] = wp.vec3()
    budget_out[i] = wp.length(half) + slack


@wp.kernel
def accompany_kernel(
    cloth_count: int,
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    solved: wp.array(dtype=wp.vec3),
    share: float,
    slack: float,
    centre_out: wp.array(dtype=wp.vec3),
    half_way_out: wp.array(dtype=wp.vec3),
    budget_out: wp.array(dtype=wp.float32),
):
    """A ball that moves along the whole way, all vertices' at once, and covers what is expected of the solve."""
    i = wp.tid()
    half = 0.5 * direction[i]
    expected = 0.5 * share * solved[i]
    centre_out[i] = x[i] + half + expected
    half_way_out[i] = half
    granted = slack
    if i >= cloth_count:
        granted = SURFACE_SHARE * slack
    budget_out[i] = wp.length(expected) + granted


@wp.kernel
def raise_kernel(
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    alpha: wp.array(dtype=wp.float32),
    anchor: wp.array(dtype=wp.vec3),
    slack: float,
    most: wp.array(dtype=wp.float32),
    budget: wp.array(dtype=wp.float32),
):
    """Who would leave is granted the way there and the slack, `most` at a time."""
    i = wp.tid()
    far = wp.length(x[i] + alpha[i] * direction[i] - anchor[i])
    if far > budget[i]:
        budget[i] = wp.min(far + slack, budget[i] + most[0])


@wp.kernel
def box_kernel(
    cloth_count: int,
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    budget: wp.array(dtype=wp.float32),
    boxes: wp.array(dtype=wp.vec3),
):
    """Largest x and largest -x of the cloth's anchors on their ways, then of the others', and all their budgets'."""
    i = wp.tid()
    side = wp.where(i < cloth_count, 0, 2)
    way = wp.abs(half_way[i])
    wp.atomic_max(boxes, side, centre[i] + way)
    wp.atomic_max(boxes, side + 1, way - centre[i])
    wp.atomic_max(boxes, 4, wp.vec3(budget[i]))


@wp.kernel
def part_kernel(boxes: wp.array(dtype=wp.vec3), reach: float, budget: wp.array(dtype=wp.float32)):
    i = wp.tid()
    between = wp.max(wp.max(-boxes[3] - boxes[0], -boxes[1] - boxes[2]), wp.vec3())
    half = 0.5 * (KEPT_APART * wp.length(between) - reach)
    if boxes[4][0] <= half:
        budget[i] = half


@wp.kernel
def stay_near_kernel(
    x: wp.array(dtype=wp.vec3),
    x_feasible: wp.array(dtype=wp.vec3),
    least: wp.array(dtype=wp.vec3),
    furthest: wp.array(dtype=wp.float32),
    anchor: wp.array(dtype=wp.vec3),
    slack: float,
    budget: wp.array(dtype=wp.float32),
):
    """A ball as far as where the vertex is, where the step began and, if there is such, the iterate to go back to."""
    i = wp.tid()
    far = wp.max(wp.length(x[i] - anchor[i]), wp.length(x_feasible[i] - anchor[i]))
    if furthest[0] < wp.inf:
        far = wp.max(far, wp.length(least[i] - anchor[i]))
    budget[i] = wp.min(budget[i], far + slack)


@wp.kernel
def anchor_kernel(
    centre: wp.array(dtype=wp.vec3),
    half_way: wp.array(dtype=wp.vec3),
    anchor_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    anchor_out[i] = centre[i] + half_way[i]
