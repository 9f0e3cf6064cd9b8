"""Air that moves, or stands still: pressure by the square of the speed between it and the cloth.

The force on a triangle of area A and normal n, which air meets with the velocity r = u - v relative to it, is

    f = 1/2 rho A |r| ( c_n n n^T + c_t (I - n n^T) ) r

c_n `broadside`, c_t `along`: a flat plate's, whose part along r is drag and whose part across r is lift (Hoerner 1965,
"Fluid-dynamic drag", chapters 2 and 3; Ling et al. 1996 have it for flags). |r| and n are taken where the step starts,
from the last step's velocity, and r where it ends. So the force is the gradient of a convex potential of the step, as
strong winds as there may be, and its matrix, lumped at the vertices, is positive semidefinite:

    D(x) = dt/2 sum_i (v_i - u)^T W_i (v_i - u),   v = (x - x_start)/dt,   W_i = sum_t rho A |r|/6 (c_n n n^T + ...)

W_i/dt goes into the step's matrices by its largest eigenvalue: they know numbers on the diagonal, not blocks.

**Gusts** (Shinozuka and Deodatis 1991): u(t) = U (1 + sum_k a_k cos(2 pi f_k t + phi_k)), a_k^2 = 2 S(f_k) df_k/U^2, of
von Karman's spectrum along the wind, with the standard deviation s = I U and the eddies' length L,

    S(f) = 4 s^2 L/U (1 + 70.8 (f L/U)^2)^(-5/6)

t is the value "clock" (1,) float64 s, which each step moves on.

**Shelter** (ours): the body's surface as it stands is drawn into a grid across the wind, which keeps in each cell how
far upwind it begins. Behind that the wind has the share 1 - shelter exp(-way/length). The grid repeats itself after
CELLS cells, far outside a body, so it needs no bounds.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.materials.device import RestShape
from tryon_solver.plan import Contribution
from tryon_solver.scene import Gusts, Wind
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

CELL = 0.03  # m, of the shelter's grid
CELLS = 160  # to a side of it: 4.8 m
BEHIND = 2.0 * CELL  # m: what is so little behind the body's front, as it is drawn in cells, is at its front
NOWHERE = 1.0e30  # m
SINES = 32
SLOWEST, FASTEST = 0.02, 20.0  # of f L/U: nine tenths of the variance lie between


@wp.func
def across(wind: wp.vec3):
    """Two directions that are orthogonal to the wind and to each other."""
    d = wp.normalize(wind)
    helper = wp.vec3(0.0, 1.0, 0.0)
    if wp.abs(d[1]) > 0.9:
        helper = wp.vec3(1.0, 0.0, 0.0)
    a = wp.normalize(wp.cross(helper, d))
    return a, wp.cross(d, a)


@wp.func
def cell_of(i: int, j: int) -> int:
    """Where in the grid, which repeats itself."""
    return ((i % CELLS + CELLS) % CELLS) * CELLS + (j % CELLS + CELLS) % CELLS


@wp.kernel
def draw_body_kernel(
    faces: wp.array(dtype=wp.vec3i),
    x: wp.array(dtype=wp.vec3),
    velocity: wp.array(dtype=wp.vec3),
    front_out: wp.array(dtype=wp.float32),
):
    """In each cell the least way [m] along the wind to points of the triangles, which lie closer than cells."""
    t = wp.tid()
    wind = velocity[0]
    if wp.length_sq(wind) == 0.0:
        return
    a, b = across(wind)
    d = wp.normalize(wind)
    f = faces[t]
    x0 = x[f[0]]
    e1 = x[f[1]] - x0
    e2 = x[f[2]] - x0
    longest = wp.max(wp.max(wp.length(e1), wp.length(e2)), wp.length(e2 - e1))
    count = int(wp.ceil(longest / CELL)) + 1
    for i in range(count + 1):
        for j in range(count + 1 - i):
            p = x0 + (float(i) / float(count)) * e1 + (float(j) / float(count)) * e2
            cell = cell_of(int(wp.floor(wp.dot(p, a) / CELL)), int(wp.floor(wp.dot(p, b) / CELL)))
            wp.atomic_min(front_out, cell, wp.dot(p, d))


@wp.func
def sheltered(p: wp.vec3, wind: wp.vec3, front: wp.array(dtype=wp.float32), length: float) -> float:
    """From 0, none, to 1, close behind the body: exp(-way/length), blended between the four cells around p."""
    a, b = across(wind)
    s = wp.dot(p, wp.normalize(wind))
    u = wp.dot(p, a) / CELL - 0.5
    v = wp.dot(p, b) / CELL - 0.5
    i = int(wp.floor(u))
    j = int(wp.floor(v))
    total = float(0.0)
    for k in range(4):
        weight = wp.abs(float(1 - k // 2) - (u - float(i))) * wp.abs(float(1 - k % 2) - (v - float(j)))
        behind = s - front[cell_of(i + k // 2, j + k % 2)]
        if behind > BEHIND:
            total += weight * wp.exp(-behind / length)
    return total


@wp.kernel
def blow_kernel(
    velocity: wp.array(dtype=wp.vec3),
    sines: wp.array(dtype=wp.vec3d),
    dt: wp.array(dtype=wp.float32),
    clock: wp.array(dtype=wp.float64),
    wind_out: wp.array(dtype=wp.vec3),
):
    """The wind at the end of the step, U (1 + sum a cos(2 pi f t + phi)); `sines` (K,) of a [-], f [1/s], phi."""
    clock[0] = clock[0] + wp.float64(dt[0])
    share = wp.float64(1.0)
    for k in range(sines.shape[0]):
        share += sines[k][0] * wp.cos(wp.float64(2.0 * wp.PI) * sines[k][1] * clock[0] + sines[k][2])
    wind_out[0] = wp.float32(share) * velocity[0]


@wp.kernel
def freeze_kernel(
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.int32),
    faces: wp.array(dtype=wp.vec3i),
    area: wp.array(dtype=wp.float32),
    broadside: float,
    along: float,
    shelter: float,
    shelter_length: float,
    wind: wp.array(dtype=wp.vec3),
    front: wp.array(dtype=wp.float32),
    x_start: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    matrix_out: wp.array(dtype=wp.mat33),
    push_out: wp.array(dtype=wp.vec3),
    bound_out: wp.array(dtype=wp.float32),
):
    """W_i [N s/m], W_i u [N], and the largest eigenvalue that W_i can have; `broadside`, `along` rho c/2 [kg/m^3]."""
    i = wp.tid()
    total = wp.mat33()
    push = wp.vec3()
    bound = float(0.0)
    for k in range(starts[i], starts[i + 1]):
        t = corners[k] // 3
        f = faces[t]
        x0 = x_start[f[0]]
        normal = wp.normalize(wp.cross(x_start[f[1]] - x0, x_start[f[2]] - x0))
        u = wind[0]
        if shelter > 0.0 and wp.length_sq(u) > 0.0:
            centre = (x0 + x_start[f[1]] + x_start[f[2]]) / 3.0
            u = (1.0 - shelter * sheltered(centre, u, front, shelter_length)) * u
        r = u - (v[f[0]] + v[f[1]] + v[f[2]]) / 3.0
        weight = area[t] / 3.0 * wp.length(r)
        own = weight * (
            (broadside - along) * wp.outer(normal, normal) + along * wp.identity(n=3, dtype=wp.float32)
        )
        total += own
        push += own * u
        bound += weight * broadside
    matrix_out[i] = total
    push_out[i] = push
    bound_out[i] = bound


@wp.kernel
def add_wind_kernel(
    matrix: wp.array(dtype=wp.mat33),
    push: wp.array(dtype=wp.vec3),
    dt: wp.array(dtype=wp.float32),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    """gradient += W_i ((x - x_start)/dt - u)"""
    i = wp.tid()
    gradient_out[i] = gradient_out[i] + matrix[i] * ((x[i] - x_start[i]) / dt[0]) - push[i]


@wp.kernel
def add_bound_kernel(
    bound: wp.array(dtype=wp.float32), dt: wp.array(dtype=wp.float32), diagonal_out: wp.array(dtype=wp.float32)
):
    i = wp.tid()
    diagonal_out[i] = diagonal_out[i] + bound[i] / dt[0]


def sines_of(gusts: Gusts | None, speed: float) -> np.ndarray:
    """(K, 3) float64: amplitude over the speed, frequency [1/s] and phase of the gusts' sines at `speed` m/s."""
    if gusts is None or gusts.intensity == 0:
        return np.zeros((0, 3))
    draw = np.random.default_rng(gusts.seed)
    borders = np.geomspace(SLOWEST, FASTEST, SINES + 1) * speed / gusts.length
    width = np.diff(borders)
    frequency = borders[:-1] + width * draw.random(SINES)
    reduced = frequency * gusts.length / speed
    density = 4 * gusts.intensity**2 * gusts.length / speed * (1 + 70.8 * reduced**2) ** (-5 / 6)
    return np.column_stack([np.sqrt(2 * density * width), frequency, 2 * np.pi * draw.random(SINES)])


def bind(spec: Wind, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec without density, or that neither presses nor strokes, is idle."""
    device, rest, scene = context.device, context.rest, context.scene
    count = scene.garment.vertex_count
    velocity: wp.array = wp.array([spec.velocity], dtype=wp.vec3, device=device)
    sines: wp.array = wp.array(
        sines_of(spec.gusts, float(np.linalg.norm(spec.velocity))), dtype=wp.vec3d, device=device
    )
    clock = wp.zeros(1, dtype=wp.float64, device=device)
    wind = wp.zeros(1, dtype=wp.vec3, device=device)
    matrix = wp.zeros(count, dtype=wp.mat33, device=device)
    push = wp.zeros(count, dtype=wp.vec3, device=device)
    bound = wp.zeros(count, dtype=wp.float32, device=device)
    lee = Lee(context, velocity) if spec.shelter else None
    front = wp.zeros(0, dtype=wp.float32, device=device) if lee is None else lee.front

    def start_step(state: State) -> None:
        if lee is not None:
            lee.draw(state.x)
        launch(blow_kernel, 1, [velocity, sines, state.dt], [clock, wind], device=device)
        launch(
            freeze_kernel,
            count,
            [
                *triangles_of(rest),
                0.5 * spec.density * spec.broadside,
                0.5 * spec.density * spec.along,
                spec.shelter,
                spec.shelter_length,
                wind,
                front,
                state.x_start,
                state.v,
            ],
            [matrix, push, bound],
            device=device,
        )

    def add_velocity_gradient(state: State, x: wp.array, gradient: wp.array) -> None:
        inputs = [matrix, push, state.dt, state.x_start, x]
        launch(add_wind_kernel, count, inputs, [gradient], device=device)

    def add_diagonal(state: State, diagonal: wp.array) -> None:
        launch(add_bound_kernel, count, [bound, state.dt], [diagonal], device=device)

    return Contribution(
        "wind",
        start_step=start_step,
        add_velocity_gradient=add_velocity_gradient,
        add_diagonal=add_diagonal,
        values={"velocity": velocity, "clock": clock},
    )


def triangles_of(rest: RestShape) -> list[wp.array]:
    """The triangles around each vertex, and all triangles: what `freeze_kernel` takes first."""
    return [rest.starts, rest.corners, rest.faces, rest.area]


class Lee:
    """Where the body keeps the wind off: `front` (CELLS CELLS,) float32 m."""

    def __init__(self, context: BuildContext, velocity: wp.array) -> None:
        body = context.scene.body
        assert body is not None
        faces = (body.faces + context.scene.garment.vertex_count).astype(np.int32)
        self._faces: wp.array = wp.array(faces, dtype=wp.vec3i, device=context.device)
        self._velocity = velocity
        self.front = wp.zeros(CELLS * CELLS, dtype=wp.float32, device=context.device)

    def draw(self, x: wp.array) -> None:
        """Of the body as it stands in x (A,) m."""
        self.front.fill_(NOWHERE)
        launch(
            draw_body_kernel, len(self._faces), [self._faces, x, self._velocity], [self.front], device=x.device
        )
