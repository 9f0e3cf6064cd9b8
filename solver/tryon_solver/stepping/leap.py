"""Bodies that jerk harder than a body does: a tracker slips, or finds its wearer somewhere else.

The cloth is moved along with the body whatever it does, and inertia then asks it back to where it would be without. A
slip of 10 cm in a frame of 1/60 s would fling it by 6 m/s, and a wearer who is found in another place would leave it
there, on the floor. So what the body's motion changes by from one step to the next is felt only as far as a body may
have done it: of a change k of the velocity with which a vertex is carried, (h/|k|)^2 k beyond h = `hardest_kick`. For
the rest the step starts where it would if the room had moved along. A body that goes on so fast is followed, later.

A garment that nobody sees yet is brought to where a body is without feeling any of the way (`Simulation.come_along`).
Not what has fallen from the body: metres away the turn of the body's root is metres long, and would be its speed in the
end. What flies then (fly.py) keeps its own way and its own velocity.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

FALLEN = 1.0  # m: what is farther off has fallen from the body, a piece that was cut off: nobody waits for it, and it
# does not come along


@wp.func
def slip_of(kick: wp.vec3, hardest: float) -> wp.vec3:
    """What of a change of velocity is not felt."""
    size = wp.length(kick)
    if size > hardest:
        return (1.0 - (hardest / size) * (hardest / size)) * kick
    return wp.vec3()


@wp.kernel
def feel_kernel(
    hardest: float,
    step: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    felt: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    dt = step[0]
    carried = (x[i] - x_start[i]) / dt
    slipped = slip_of(carried - felt[i], hardest)
    x_start[i] = x_start[i] + dt * slipped
    felt[i] = carried - slipped


def feel_motion(sim: Simulation) -> None:
    """Let the step start, for who the body has carried from `x_start` to x, where it feels that motion as one
    of a body; `felt` (A,) m/s is the velocity with which it was carried that it has felt so far."""
    state, body = sim.state, sim.body
    assert body is not None
    inputs = [sim.settings.hardest_kick, state.dt, state.x]
    launch(feel_kernel, sim.all_count, inputs, [body.felt, state.x_start], device=sim.device)


@wp.kernel
def join_kernel(
    dt: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    felt_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    felt_out[i] = (x[i] - x_start[i]) / dt[0]
    x_start[i] = x[i]


@wp.kernel
def go_along_kernel(felt: wp.array(dtype=wp.vec3), v: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    v[i] = v[i] + felt[i]


def join_motion(sim: Simulation) -> None:
    """Let the step start at rest where the body has carried everybody to from `x_start`; `felt` is the
    velocity with which it did. Who flies is not at rest; where it starts `Flight.keep_start` says, which is to
    follow."""
    state, body = sim.state, sim.body
    assert body is not None
    if sim.flight is None:
        state.v.zero_()
    else:
        sim.flight.come_to_rest(sim)
    launch(join_kernel, sim.all_count, [state.dt, state.x, state.x_start], [body.felt], device=sim.device)


def go_along(sim: Simulation) -> None:
    """Give the cloth, where it comes along and goes at `v` as seen from the body, the body's own velocity, too."""
    body = sim.body
    if not sim.comes_along or body is None:
        return
    if sim.flight is None:
        launch(go_along_kernel, sim.cloth_count, [body.felt], [sim.state.v], device=sim.device)
    else:
        sim.flight.go_along(sim)
