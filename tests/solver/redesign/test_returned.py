"""Cloth goes from where it hung to another stance of the body, as what an edit took away does before it comes back."""

from types import SimpleNamespace

import numpy as np
import pytest
from contact_scenes import tube
from frame_judge import FrameJudge
from worn_garment import demo_motion

from tryon_solver import PRESETS
from tryon_solver.body.model import default_body
from tryon_solver.body.pose import world_from_joint
from tryon_solver.dressing.returned import Hung, gone_along
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import Scene
from tryon_solver.simulation import build


@pytest.mark.parametrize(("begun", "radius"), [(0.1, 0.11), (0.2, 0.10)])
def test_what_hung_loose_around_a_shin_goes_through_a_step_clear_of_itself_and_of_the_legs(begun, radius):
    """A tube of this `radius` [m] around the right shin, `begun` s into a walk, and where the body takes it by 0.5 s:
    the leg swings forward past the other."""
    body = default_body()
    walk = demo_motion("walk", body)
    first, last = walk.sample(begun), walk.sample(0.5)
    joints = [body.joint_names.index(name) for name in ("right_shin", "right_foot")]
    knee, ankle = world_from_joint(body, first)[joints, :3, 3]
    garment, x = tube(24, 12, radius, float(np.linalg.norm(ankle - knee)))
    x, surface = around(x, ankle - knee) + (knee + ankle) / 2, body.surface(first)
    judge = FrameJudge(garment.faces, body.faces, x, surface)
    assert judge.judge(x, surface).clean
    new = build(Scene(garment, x, body, FABRICS["cotton_jersey"]), PRESETS["draft"], pose=first, tangled=True)
    there = new.body.moving.transforms(last)
    worn = SimpleNamespace(body=SimpleNamespace(pose=last, transforms=lambda: there))
    gone = gone_along(worn, new, Hung(None, garment.faces, x, surface, first), x)
    assert np.linalg.norm(gone - x, axis=1).min() > 0.2, "it went along"
    assert judge.judge(gone, body.surface(last)).clean


def around(x, axis):
    """(N, 3) m: what lies about the x axis, turned so that it lies about this `axis` (3,)."""
    one = axis / np.linalg.norm(axis)
    third = np.cross(one, [1.0, 0.0, 0.0])
    third /= np.linalg.norm(third)
    return x @ np.array([one, np.cross(third, one), third])
