"""Two runs of one scene on a device end in equal bytes, frame by frame."""

import os
from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from contact_scenes import sleeve_on_limb
from scipy.spatial.transform import Rotation
from small_scenes import fabric, icosphere, layers, rigid_body
from worn_garment import DEMO

from tryon_solver import dress
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.body.pose import Pose
from tryon_solver.body.retarget import retarget
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS
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


ON_GPU = pytest.mark.gpu


def alike(make, settings, device, pose_at, frames=FRAMES):
    """All of the state, at every frame; the runs take turns, so that neither has the threads to itself."""
    first, second = (build(make(), settings, device, pose_at(0.0)) for _ in range(2))
    start, pairs, moved = first.cloth_positions(), 0, 0.0
    for k in range(1, frames + 1):
        one, other = (sim.advance(pose_at(k * DT), k * DT) for sim in (first, second))
        assert first.state.x.numpy().tobytes() == second.state.x.numpy().tobytes(), f"frame {k}"
        assert first.state.v.numpy().tobytes() == second.state.v.numpy().tobytes(), f"frame {k}"
        assert (one.pairs, one.newton_iterations, one.min_gap) == (other.pairs, other.newton_iterations, other.min_gap)
        pairs = max(pairs, one.pairs)
        moved = max(moved, float(np.abs(first.cloth_positions() - start).max()))
    assert np.isfinite(first.cloth_positions()).all()
    assert moved > 0.02
    return first, pairs


@pytest.mark.parametrize("device", ["cpu", pytest.param("cuda:0", marks=ON_GPU)])
@pytest.mark.parametrize(
    ("make", "pose_at"),
    [(scene, ball_at), pytest.param(sleeve, limb_at, marks=pytest.mark.long)],
    ids=["layers", "sleeve"],
)
def test_equal_bytes_frame_by_frame(device, make, pose_at):
    if device != "cpu" and not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    sim, pairs = alike(make, SETTINGS, device, pose_at)
    assert len(sim.touching) == 2
    assert pairs > 100


@pytest.mark.gpu
@pytest.mark.parametrize("preset", ["draft", "live"])
def test_a_worn_garment_repeats_on_a_gpu_from_its_dressing_on(preset):
    """A T-shirt of 2,500 vertices dressed twice, each time from its pattern, and worn for a second of jumping jack."""
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    settings = replace(PRESETS[preset], deterministic=True)
    body = default_body()
    motion = retarget(parse_bvh((DEMO / "motions" / "jumping_jack.bvh").read_text()), body)
    panels = mesh_with_vertices(load_pattern(DEMO / "patterns" / "tshirt.json"), 2500)
    runs = []
    for _ in range(2):
        dressed = dress(panels, body, FABRICS["cotton_jersey"], settings, "cuda:0")
        sim, lead = dressed.simulation, blend_in(dressed.pose, motion, 1.0)
        start, frames = sim.state.time, [sim.cloth_positions()]
        for k in range(1, 121):
            t = k * DT
            pose = lead.sample(t) if t < lead.duration else motion.sample(t - lead.duration, loop=True)
            sim.advance(pose, start + t)
            frames.append(sim.cloth_positions())
        runs.append(np.array(frames))
    assert np.isfinite(runs[0]).all()
    assert np.abs(runs[0] - runs[0][0]).max() > 0.2
    differing = (runs[0] != runs[1]).any((1, 2))
    assert not differing.any(), f"frame {int(differing.argmax())} of {len(differing)}"


def test_a_run_by_a_clock_is_not_said_to_repeat():
    with pytest.raises(ValueError, match=r"deterministic.*deadline"):
        replace(SETTINGS, deadline=0.01)


def test_a_step_is_the_same_whatever_longer_ones_the_settings_allow():
    """Steps of 1/90 s by settings that name just these and by others, on cloth in contact."""
    pose, dt = ball_at(0.0), 1 / 90
    first, second = (build(scene(), replace(SETTINGS, largest_step=step), "cpu", pose) for step in (dt, 1 / 30))
    for k in range(1, 31):
        reports = [sim.advance(ball_at(k * dt), k * dt) for sim in (first, second)]
        assert [report.steps for report in reports] == [1, 1]
        assert first.state.x.numpy().tobytes() == second.state.x.numpy().tobytes(), f"frame {k}"
    assert reports[0].pairs > 0
