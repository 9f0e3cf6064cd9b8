"""Carrying the cloth along with the body before anything is solved.

At 2 m/s the wrist moves 33 mm between two frames; a barrier that reaches 2 mm cannot push a sleeve that far. So the
cloth is moved by the body's own motion first, through one displacement field in space:

    u(x) = sum_j W_j(x) (A_j x - x),   A_j = joint j's rigid motion over the sub-step,

with W(x) the skinning weights of the skin around x, averaged with weights (1 - d/R)^2 / (d^2 + r^2)^2 and fading to the
root joint's between `carry_full` and `carry_none`. All layers and the skin next to them see the same smooth field, so
it hardly ever brings two of them closer. It changes where the solve starts, not the inertia: that stays in world space.

The sum over joints and the average over the skin change places: a skin vertex b with weights s_bk has a blended motion
M_b = sum_k s_bk A_k of its own, and with w_b as above

    u(x) = share sum_b w_b (M_b x - x) / sum_b w_b + (1 - share) (A_0 x - x),

so W is stored nowhere. Motions are held less the identity: A - 1 is small, where A x - x would lose digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.lanes import LANES, least_of_lanes, shares_of, sum_of_lanes
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.rigid_motion import displaced, mat34
from tryon_solver.linalg.upload import Upload

wp.set_module_options({"enable_backward": False})

SHARPNESS = 0.01  # m, r above: skin closer than this dominates skin further away
GRID = 64
UNMOVED = np.eye(4)
TOTAL = wp.constant(3)  # of what is found around a place: behind sum_b w_b (M_b x - x) the sum of the weights,
NEAREST = wp.constant(4)  # and how far the nearest is

Around = wp.types.vector(length=5, dtype=wp.float32)


@dataclass
class Carry:
    """The field of a step: `places` (A,) vec3 m of cloth and surface, in whose distances it is weighted; a processor's
    `grid` over the surface's, `surface` (B,), part of them; `root` (1,) mat34, the motion of everybody, `motions` (J,)
    and `blends` (B,), of the joints and of the skin; `near` (B,) int32: skin in reach of the cloth, marked as the field
    is evaluated; `upload` writes `root` and `motions`."""

    places: wp.array
    surface: wp.array
    root: wp.array
    motions: wp.array
    blends: wp.array
    near: wp.array
    grid: wp.HashGrid | None
    skin_joints: wp.array
    skin_weights: wp.array
    upload: Upload

    @staticmethod
    def build(cloth_count: int, skin_joints: np.ndarray, skin_weights: np.ndarray, joints: int, device: str) -> Carry:
        """`skin_joints` (B, K) int32 and `skin_weights` (B, K) float32 as in BodyModel."""
        body_count = len(skin_joints)
        places = wp.zeros(cloth_count + body_count, dtype=wp.vec3, device=device)
        uploaded = wp.zeros(1 + joints, dtype=mat34, device=device)
        grid = wp.HashGrid(GRID, GRID, GRID, device=device) if wp.get_device(device).is_cpu else None
        if grid is not None:
            grid.reserve(body_count)
        return Carry(
            places,
            places[cloth_count:],
            uploaded[:1],
            uploaded[1:],
            wp.zeros(body_count, dtype=mat34, device=device),
            wp.zeros(body_count, dtype=wp.int32, device=device),
            grid,
            wp.array(skin_joints, dtype=wp.int32, device=device),
            wp.array(skin_weights, dtype=wp.float32, device=device),
            Upload(uploaded),
        )

    def take(self, root: np.ndarray, motions: np.ndarray) -> None:
        """As of the next `fetch`, everybody's motion is `root` (4, 4), and the field is that of the joints' `motions` A
        (J, 4, 4)."""
        both = np.concatenate([root[None], motions]) - UNMOVED
        self.upload.write(both[:, :3].astype(np.float32))

    def fetch(self) -> None:
        """Go by the motions that were taken last; a launch, for a graph to repeat."""
        self.upload.fetch()

    def move_along(self, x: wp.array) -> None:
        """Move all of x (K,) vec3 m by everybody's motion."""
        launch(rigid_kernel, len(x), [self.root], [x], device=x.device)

    def set_places(self, x: wp.array, none: float) -> None:
        """From now on the field is weighted by the distances between cloth and surface at x (A,) m, up to `none` m."""
        wp.copy(self.places, x)
        clear(self.near)
        if self.grid is not None:
            self.grid.build(self.surface, none)  # finer, empty cells would cost more than the skin that they pass over

    def find_field(self, x: wp.array, full: float, none: float, displacement_out: wp.array) -> None:
        """u at the cloth, first among x (A,) vec3 m, for the motions that were taken; lengths in m. Marks `near`.

        `none` is that of `set_places`; `displacement_out` (A,) vec3 m keeps what it holds of the surface.
        """
        launch(
            blend_kernel,
            self.surface.size,
            [self.skin_joints, self.skin_weights, self.motions],
            [self.blends],
            device=x.device,
        )
        count, made = self.places.size - self.surface.size, [self.near, displacement_out]
        given = [self.places, self.surface, self.blends, self.motions, full, none, SHARPNESS, x]
        if self.grid is not None:
            launch(field_kernel, count, [self.grid.id, *given], made, device=x.device)
        else:
            shares = shares_of(count, LANES)
            launch(field_together_kernel, shares, [*given, count, LANES], made, device=x.device)

    def move_surface(self, skin_before: wp.array, skin_after: wp.array, displacement_out: wp.array) -> None:
        """Put the surface's part of `displacement_out` (A,) vec3 m: it goes as the skin (B,) vec3 m does."""
        count = self.surface.size
        inputs = [self.places.size - count, skin_before, skin_after]
        launch(surface_kernel, count, inputs, [displacement_out], device=skin_before.device)

    def find_travel(self, skin_before: wp.array, skin_after: wp.array, largest_out: wp.array) -> None:
        """Raise `largest_out` (1,) to the largest motion [m] of skin (B,) vec3 m that is marked as near the cloth."""
        inputs = [self.near, skin_before, skin_after]
        launch(travel_kernel, self.surface.size, inputs, [largest_out], device=skin_before.device)


@wp.kernel
def blend_kernel(
    skin_joints: wp.array2d(dtype=wp.int32),
    skin_weights: wp.array2d(dtype=wp.float32),
    motions: wp.array(dtype=mat34),
    blends_out: wp.array(dtype=mat34),
):
    """M_b - 1 of each skin vertex."""
    b = wp.tid()
    blend = mat34()
    for k in range(skin_joints.shape[1]):
        blend += skin_weights[b, k] * motions[skin_joints[b, k]]
    blends_out[b] = blend


@wp.func
def displacement_at(found: Around, here: wp.vec4, root: mat34, full: float, none: float) -> wp.vec3:
    """u(x) of what was found around x, which is `here`."""
    displacement = root * here
    total = found[TOTAL]
    if total > 0.0:
        t = wp.clamp((none - found[NEAREST]) / (none - full), 0.0, 1.0)
        share = t * t * (3.0 - 2.0 * t)
        moved = wp.vec3(found[0], found[1], found[2])
        displacement = (share / total) * moved + (1.0 - share) * displacement
    return displacement


@wp.kernel
def field_kernel(
    grid: wp.uint64,
    places: wp.array(dtype=wp.vec3),
    surface: wp.array(dtype=wp.vec3),
    blends: wp.array(dtype=mat34),
    motions: wp.array(dtype=mat34),
    full: float,
    none: float,
    sharpness: float,
    x: wp.array(dtype=wp.vec3),
    near_out: wp.array(dtype=wp.int32),
    displacement_out: wp.array(dtype=wp.vec3),
):
    """u(x) above for the cloth."""
    i = wp.tid()
    place = places[i]
    here = wp.vec4(x[i][0], x[i][1], x[i][2], 1.0)
    query = wp.hash_grid_query(grid, place, none)
    b = int(0)
    found = Around(0.0, 0.0, 0.0, 0.0, none)
    while wp.hash_grid_query_next(query, b):
        d = wp.length(surface[b] - place)
        if d < none:
            if near_out[b] == 0:  # most is marked already: reading costs less than writing it again
                near_out[b] = 1
            fade = 1.0 - d / none
            softened = d * d + sharpness * sharpness
            w = fade * fade / (softened * softened)
            moved = w * (blends[b] * here)
            for k in range(3):
                found[k] = found[k] + moved[k]
            found[TOTAL] = found[TOTAL] + w
            found[NEAREST] = wp.min(found[NEAREST], d)
    displacement_out[i] = displacement_at(found, here, motions[0], full, none)


@wp.func_native("""
    wp::vec_t<5, decltype(none + none)> found;
    found[4] = none;
#if defined(__CUDA_ARCH__)
    __shared__ int lists[8][256];
    const int thread = threadIdx.x % 32;
    int* list = lists[threadIdx.x / 32];
    float lowest[3], highest[3];
    for (int k = 0; k < 3; ++k) {
        lowest[k] = highest[k] = place[k];
        for (int apart = 16; apart > 0; apart >>= 1) {
            lowest[k] = fminf(lowest[k], __shfl_xor_sync(0xffffffffu, lowest[k], apart));
            highest[k] = fmaxf(highest[k], __shfl_xor_sync(0xffffffffu, highest[k], apart));
        }
        lowest[k] -= none;
        highest[k] += none;
    }
    const int count = surface.shape[0];
    for (int first = 0; first < count; first += 256) {
        int listed = 0;
        for (int b = first + thread; b < first + 256; b += 32) {
            bool near = b < count;
            if (near) {
                const wp::vec_t<3, float> p = surface.data[b];
                for (int k = 0; k < 3; ++k)
                    near = near && p[k] >= lowest[k] && p[k] <= highest[k];
            }
            const unsigned together = __ballot_sync(0xffffffffu, near);
            if (near)
                list[listed + __popc(together & ((1u << thread) - 1u))] = b;
            listed += __popc(together);
        }
        __syncwarp();
        for (int n = thread % lanes; n < listed; n += lanes) {
            const int b = list[n];
            const float d = wp::length(wp::sub(surface.data[b], place));
            if (d < none) {
                if (near_out.data[b] == 0)
                    near_out.data[b] = 1;
                const float fade = 1.0f - d / none;
                const float softened = d * d + sharpness * sharpness;
                const float w = fade * fade / (softened * softened);
                const wp::mat_t<3, 4, float> blend = blends.data[b];
                for (int k = 0; k < 3; ++k)
                    found[k] += w * (blend.data[k][0] * here[0] + blend.data[k][1] * here[1]
                        + blend.data[k][2] * here[2] + blend.data[k][3]);
                found[3] += w;
                found[4] = fminf(found[4], d);
            }
        }
        __syncwarp();
    }
#endif
    return found;
""")
def found_together(
    place: wp.vec3,
    here: wp.vec4,
    surface: wp.array(dtype=wp.vec3),
    blends: wp.array(dtype=mat34),
    none: float,
    sharpness: float,
    lanes: int,
    near_out: wp.array(dtype=wp.int32),
) -> Around:
    """Of what is around a place, in the same order each time, this thread's share of `lanes`, by the 32 threads of a
    GPU that run in step, in blocks of at most 256: they list the skin around all of their places, each testing every
    32nd of it, and then go through the list. A grid of cells was looked through for 120 us a frame, whatever the number
    of places, and sorted for 100."""


@wp.kernel
def field_together_kernel(
    places: wp.array(dtype=wp.vec3),
    surface: wp.array(dtype=wp.vec3),
    blends: wp.array(dtype=mat34),
    motions: wp.array(dtype=mat34),
    full: float,
    none: float,
    sharpness: float,
    x: wp.array(dtype=wp.vec3),
    count: int,
    lanes: int,
    near_out: wp.array(dtype=wp.int32),
    displacement_out: wp.array(dtype=wp.vec3),
):
    """The same for `count` vertices, each shared by `lanes` threads (linalg/lanes.py)."""
    share = wp.tid() // lanes
    i = wp.min(share, count - 1)
    here = wp.vec4(x[i][0], x[i][1], x[i][2], 1.0)
    found = found_together(places[i], here, surface, blends, none, sharpness, lanes, near_out)
    for k in range(4):
        found[k] = sum_of_lanes(found[k])
    found[NEAREST] = least_of_lanes(found[NEAREST])
    if share == i and wp.tid() % lanes == 0:  # who only fills up the last 32 has another list, and other last bits
        displacement_out[i] = displacement_at(found, here, motions[0], full, none)


@wp.kernel
def rigid_kernel(motion: wp.array(dtype=mat34), x: wp.array(dtype=wp.vec3)):
    """Moves everything by one rigid motion."""
    i = wp.tid()
    x[i] = x[i] + displaced(motion[0], x[i])


@wp.kernel
def surface_kernel(
    cloth_count: int,
    skin_before: wp.array(dtype=wp.vec3),
    skin_after: wp.array(dtype=wp.vec3),
    displacement_out: wp.array(dtype=wp.vec3),
):
    """The collision surface moves as the skin does.

    Where it has yielded it stays so much behind: only the correction knows what presses on it and lets it return.
    """
    j = wp.tid()
    displacement_out[cloth_count + j] = skin_after[j] - skin_before[j]


@wp.kernel
def travel_kernel(
    near: wp.array(dtype=wp.int32),
    skin_before: wp.array(dtype=wp.vec3),
    skin_after: wp.array(dtype=wp.vec3),
    largest_out: wp.array(dtype=wp.float32),
):
    """Largest motion of skin that is in reach of the cloth."""
    j = wp.tid()
    if near[j] != 0:
        wp.atomic_max(largest_out, 0, wp.length(skin_after[j] - skin_before[j]))
