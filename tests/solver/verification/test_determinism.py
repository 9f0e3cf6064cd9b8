"""Two runs of one scene on the CPU end in equal bytes, frame by frame."""

import os
from dataclasses import replace

import numpy as np
import pytest
from contact_scenes import sleeve_on_limb
from scipy.spatial.transform import Rotation
from small_scenes import fabric, icosphere, layers, rigid_body

from tryon_solver.body.pose import Pose
from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

FRAMES = int(os.environ.get("TRYON_FRAMES", "60"))  # 300 in `make reference`
DT = 1 / 60
SETTINGS = replace(PRESETS["draft"], largest_step=DT, deterministic=True)


def ball_at(time):
    """A ball that swings and turns: contact comes and goes."""
    place = [0.03 * np.sin(5 * time), 0.02 * np.sin(7 * time), 0.02 * np.sin(3 * time)]
    turned = Rotation.from_rotvec([0.0, 0.8 * np.sin(2 * time), 0.3 * np.sin(4 * time)]).as_quat()
    return Pose(np.array(place), turned[None])


def limb_at(time):
    """A limb that bends to and fro."""
    bent = Rotation.from_euler("y", 0.6 * np.sin(3 * time)).as_quat()
    return Pose(np.zeros(3), np.array([[0.0, 0, 0, 1], bent]))


def sleeve():
    """A sewn sleeve around a limb with a joint."""
    return replace(sleeve_on_limb().scene, effects=WORN)


def scene():
    """Two layers over a ball: cloth on cloth and cloth on body are searched for at once, on two threads."""
    garment, x = layers(2, 9, 9, 0.2, 0.006)
    vertices, faces = icosphere(0.08, 2)
    return Scene(garment, x + np.array([0.003, 0.0845, 0.004]), rigid_body(vertices, faces), fabric(), WORN)


@pytest.mark.parametrize(
    ("make", "pose_at"),
    [(scene, ball_at), pytest.param(sleeve, limb_at, marks=pytest.mark.long)],
    ids=["layers", "sleeve"],
)
def test_equal_bytes_frame_by_frame(make, pose_at):
    """All of the state, at every frame; the runs take turns, so that neither has the threads to itself."""
    first, second = (build(make(), SETTINGS, "cpu", pose_at(0.0)) for _ in range(2))
    assert len(first.touching) == 2
    start, pairs, moved = first.cloth_positions(), 0, 0.0
    for k in range(1, FRAMES + 1):
        one, other = (sim.advance(pose_at(k * DT), k * DT) for sim in (first, second))
        assert first.state.x.numpy().tobytes() == second.state.x.numpy().tobytes(), f"frame {k}"
        assert first.state.v.numpy().tobytes() == second.state.v.numpy().tobytes(), f"frame {k}"
        assert (one.pairs, one.newton_iterations, one.min_gap) == (other.pairs, other.newton_iterations, other.min_gap)
        pairs = max(pairs, one.pairs)
        moved = max(moved, float(np.abs(first.cloth_positions() - start).max()))
    assert np.isfinite(first.cloth_positions()).all()
    assert pairs > 100
    assert moved > 0.02


def test_where_it_cannot_be_had_it_is_refused():
    with pytest.raises(ValueError, match="deterministic"):
        build(scene(), SETTINGS, "cuda:0", ball_at(0.0))


def test_a_step_is_the_same_whatever_longer_ones_the_settings_allow():
    """Steps of 1/90 s by settings that name just these and by others, on cloth in contact."""
    pose, dt = ball_at(0.0), 1 / 90
    first, second = (build(scene(), replace(SETTINGS, largest_step=step), "cpu", pose) for step in (dt, 1 / 30))
    for k in range(1, 31):
        reports = [sim.advance(ball_at(k * dt), k * dt) for sim in (first, second)]
        assert [report.steps for report in reports] == [1, 1]
        assert first.state.x.numpy().tobytes() == second.state.x.numpy().tobytes(), f"frame {k}"
    assert reports[0].pairs > 0
