"""A garment that elastic holds around the waist, brought to where it hangs by itself.

Seams that are drawn together around the hips, without gravity, push a skirt or a pair of trousers up to where the body
is narrow, and past that; friction would hold it there until its wearer walks, and let it slide for a minute. Who puts
trousers on pulls them to where they sit. Friction may hold a garment anywhere between the heights at which it alone
would not be enough; the steps of a walk, which loosen it for moments, lead to the one that needs none. So the garment
comes to rest without any first: where gravity, elastic and the body's slope are in balance. Ours.

Of garments that hold by their cut alone this is not done: without friction their weight drives them onto the hips like
a wedge, until the fabric bears no more (trousers of canvas press the skin in by 3.4 mm there, where 1.9 hold them).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tryon_solver.dressing.holding import Holding
from tryon_solver.dressing.opening import Opening
from tryon_solver.geometry.body_parts import find_trunk
from tryon_solver.simulation import Simulation

LONGEST = 1.5  # s: trousers of jersey come down by 4 cm in 0.2 s and are at rest after 0.5 to 1
AT_REST = 0.01  # m/s of the fastest vertex


def hang(simulation: Simulation, pose: Any, opening: Opening | None, held: Holding) -> None:
    """Let a garment that was just put on, hangs by this opening and is `held` slide to its place on the body in this
    pose.

    One without elastic stays where it is; so does one that shoulders hold, which has no such opening, one that is too
    wide to hold, which is told (opening.py), and one that ends below the hips, where the body narrows and nothing but
    friction holds.
    """
    if not len(held.elastic) or opening is None or opening.advice:
        return
    skin, body = simulation.body_positions().astype(np.float64), simulation.scene.body
    assert body is not None
    if opening.height < find_trunk(skin, np.asarray(body.faces)).hips - float(skin[:, 1].min()):
        return
    friction = next((c.values["coefficients"] for c in simulation.plan.contributions if c.name == "friction"), None)
    if friction is None:
        return
    rough, step, begun = friction.numpy().copy(), simulation.settings.largest_step, simulation.state.time
    friction.zero_()
    for k in range(round(LONGEST / step)):
        simulation.advance(pose, begun + (k + 1) * step)
        if np.abs(simulation.state.v.numpy()[: simulation.cloth_count]).max() < AT_REST:
            break
    friction.assign(rough)
    simulation.wake()
