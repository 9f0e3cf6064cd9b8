"""Contact that cannot be costs nothing: while the body is far no kernel of contact is launched but those that say so,
and a body that rushes in from there still meets the cloth.

A square hangs by its upper edge; a ball that is led around a point aside of it is within it one step later, and is led
on through it.
"""

from collections import Counter

import numpy as np
import pytest
from frame_judge import FrameJudge
from scipy.spatial.transform import Rotation
from small_scenes import fabric, icosphere, sheet

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.linalg import launch as launching
from tryon_solver.scene import Adhesion, BodyContact, Friction, Gravity, Pins, Scene, SelfContact, StrainLimit
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

DT = 1 / 60
ARM = 2.0  # m, from the point that the ball is led around
RADIUS = 0.1
FAR, THERE, THROUGH = 70.0, 1.0, -20.0  # degrees from where the ball's middle is in the middle of the cloth
IDLE, LED_ON, FRAMES = 12, 15, 18  # frames
# the test of the bound, what friction knows, and whether cloth that may touch a body flies beside it
ASKED = {"outside_kernel", "leaving_kernel", "stay_kernel", "enter_kernel", "add_velocity_kernel", "set_off_kernel"}


def led_ball():
    """A ball at the end of an arm that turns about the vertical through (0, 0, -ARM)."""
    ball, faces = icosphere(RADIUS, 2)
    return BodyModel(
        ball,
        faces,
        ("root", "arm"),
        np.array([-1, 0], np.int32),
        np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -ARM]]),
        np.ones((len(ball), 1), np.int32),
        np.ones((len(ball), 1), np.float32),
    )


def stance(degrees):
    """The arm's angle from where the ball is in the cloth's way."""
    rotations = np.array([[0, 0, 0, 1], Rotation.from_euler("y", degrees, degrees=True).as_quat()])
    return Pose(np.zeros(3), rotations.astype(float))


def hung(*effects):
    """A square across the ball's way, 13 by 13."""
    garment, flat = sheet(13, 13, 0.36, 0.36)
    x = np.column_stack([0.01 * np.sin(20 * flat[:, 0]), -flat[:, 2], flat[:, 0]])
    top = np.arange(12 * 13, 13 * 13, dtype=np.int32)
    return Scene(garment, x, led_ball(), fabric(), (Gravity(), StrainLimit(), Pins(top), *effects))


def stance_at(frame):
    """Far, then in the cloth at once, then beyond it."""
    return stance(FAR if frame <= IDLE else THERE if frame <= LED_ON else THROUGH)


def launches(monkeypatch):
    """Counts every launch from now on by its kernel's name."""
    counts, once = Counter(), launching._Packed.launch

    def counted(self, *arguments):
        counts[self.command.kernel.key] += 1
        once(self, *arguments)

    monkeypatch.setattr(launching._Packed, "launch", counted)
    return counts


def test_a_body_that_rushes_in_from_afar_meets_the_cloth():
    scene = hung(BodyContact())
    sim = build(scene, PRESETS["draft"], "cpu", stance(FAR))
    judge = FrameJudge(
        scene.garment.faces, scene.body.faces, sim.cloth_positions().astype(float), sim.body_positions().astype(float)
    )
    pairs, middles = [], [sim.body_positions().mean(axis=0)]
    for k in range(1, FRAMES + 1):
        report = sim.advance(stance_at(k), k * DT)
        pairs.append(report.pairs)
        surface = sim.body_positions().astype(float)
        middles.append(surface.mean(axis=0))
        seen = judge.judge(sim.cloth_positions().astype(float), surface)
        assert (seen.finite, seen.body_intersecting) == (True, False), f"frame {k}"
    assert max(pairs[:IDLE]) == 0 < max(pairs)
    assert np.linalg.norm(np.diff(middles, axis=0), axis=1).max() > 1.0, "m, in one step"


def test_a_far_body_launches_nothing_of_contact(monkeypatch):
    """Neither search nor filter nor pairs, for as many frames as a list serves; without the bound there are some."""
    counts = launches(monkeypatch)
    made = []
    for effects in ((), (BodyContact(),), (BodyContact(), Friction(), Adhesion(100.0, 0.005))):
        sim = build(hung(*effects), PRESETS["draft"], "cpu", stance(FAR))
        for k in range(1, 4):
            sim.advance(stance(FAR), k * DT)
        counts.clear()
        for k in range(4, IDLE):
            sim.advance(stance(FAR), k * DT)
        made.append(set(counts))
    bare, *others = made
    for kernels in others:
        assert kernels - bare <= ASKED
    counts.clear()
    for k in range(IDLE, FRAMES):
        sim.advance(stance_at(k), k * DT)
    assert {"face_boxes_kernel", "collect_kernel", "deflect_kernel"} <= set(counts)


def test_cloth_that_rests_and_may_touch_itself_launches_nothing_of_it(monkeypatch):
    """Nor does it look where it would go as one, until it goes somewhere."""
    counts = launches(monkeypatch)
    garment, x = sheet(9, 9, 0.3, 0.3)
    made = []
    for effects in ((), (SelfContact(),)):
        sim = build(Scene(garment, x, None, fabric(), (StrainLimit(), *effects)), PRESETS["draft"])
        for k in range(1, 9):
            sim.advance(None, k * DT)
        counts.clear()
        for k in range(9, 14):
            sim.advance(None, k * DT)
        made.append(Counter(counts))
    assert set(made[1]) - set(made[0]) <= ASKED
    assert sum(made[1].values()) <= sum(made[0].values()) + 5 * 8
    sim.state.v.fill_(np.array([0.0, 3.0, 0.0]))
    counts.clear()
    for k in range(14, 17):
        sim.advance(None, k * DT)
    assert counts["find_way_kernel"] >= 2, "all but the step in which it leaves"
    np.testing.assert_allclose(sim.cloth_positions() - x, np.broadcast_to([0, 9 * DT, 0], x.shape), atol=1e-4)


@pytest.mark.parametrize("others", [(), (SelfContact(),)], ids=["body", "self"])
def test_what_is_granted_is_under_half_of_what_is_between(others):
    """The ball's distance from the cloth is known: its centre's less its radius. The grant is no trifle, unless
    the cloth may touch itself, too."""
    sim = build(hung(BodyContact(), *others), PRESETS["draft"], "cpu", stance(FAR))
    for k in range(1, 4):
        sim.advance(stance(FAR), k * DT)
    anchors, budget = sim.region.anchor.numpy().astype(float), sim.region.budget.numpy().astype(float)
    centre = anchors[sim.cloth_count :].mean(axis=0)
    between = np.linalg.norm(anchors[: sim.cloth_count] - centre, axis=1).min() - RADIUS
    (reach,) = {surface.reach.farthest for surface in sim.touching if surface is not sim.cloth}
    assert budget[: sim.cloth_count].max() + budget[sim.cloth_count :].max() + reach < between
    assert (budget.min() > 0.25 * between) == (not others)
