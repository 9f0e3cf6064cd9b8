"""Obstacles are followed as a person's body is, those too that outrun a step's sub-steps."""

import numpy as np
from harness.kit import on_body, square
from harness.obstacles import FollowedObstacles, Obstacles
from harness.scene import Ask
from small_scenes import slab

from tryon_solver.body.on_device import MovingBody
from tryon_solver.settings import PRESETS

AWAY = np.array([0.0, 0.0, 0.6])


def test_they_do_all_that_the_solver_asks_of_a_body():
    asked = {name for name in vars(MovingBody) if not name.startswith("_")}
    assert "part_way" in asked
    assert asked <= set(vars(FollowedObstacles))


def test_a_plate_that_outruns_the_sub_steps_of_a_step_is_come_up_with_in_the_next():
    garment, x = square(100, 0.3)
    plate, faces = slab(0.2, 0.02, 0.2, 0.03)
    body = Obstacles(((plate - [0, 0.02, 0], faces),), (lambda t: (np.zeros(3), AWAY * (t > 0)),))
    sim = on_body(Ask(100, PRESETS["draft"]), garment, x, body)
    step = sim.settings.largest_step
    reach = sim.settings.most_substeps * sim.settings.substep_travel
    assert reach < AWAY[2]
    sim.advance(body.at(step), step)
    there = sim.body.moving.transforms(sim.body.pose)[1, :3, 3] - body.transforms(body.at(0.0))[1, :3, 3]
    assert 0.9 * reach < there[2] < 1.1 * reach
    for k in range(2, 5):
        sim.advance(body.at(k * step), k * step)
    there = sim.body.moving.transforms(sim.body.pose)[1, :3, 3] - body.transforms(body.at(0.0))[1, :3, 3]
    np.testing.assert_allclose(there, AWAY, atol=1e-9)
