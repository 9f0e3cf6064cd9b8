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

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

FALLEN = 1.0  # m: what is farther off has fallen from the body, a piece that was cut off: nobody waits for it, and it
# does not come along


def feel_motion(sim: Simulation) -> None:
    """Let the step start, for who the body has carried from `x_start`, where it feels that motion as one of a body;
    `felt` (A,) m/s is the velocity with which it was carried that it has felt so far. By where it was led besides
    (lead.py) no body jerks."""
    state, body = sim.state, sim.body
    assert body is not None
    body.feel(sim.settings.hardest_kick, state, state.x if sim.lead is None else sim.x_carried)


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
    body.join(state)


def go_along(sim: Simulation) -> None:
    """Give the cloth, where it comes along and goes at `v` as seen from the body, the body's own velocity, too."""
    body = sim.body
    if not sim.comes_along or body is None:
        return
    if sim.flight is None:
        body.go_along(sim.state.v)
    else:
        sim.flight.go_along(sim)
