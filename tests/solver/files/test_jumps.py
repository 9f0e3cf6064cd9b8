"""Bodies that jump are refused by frame and vertex before anything is built on them."""

import re

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.files.convention import Told
from tryon_solver.files.jumps import SPEED_MAX, refuse_jumps
from tryon_solver.files.mesh_body import RawFrames, make_body
from tryon_solver.files.raw_mesh import MeshFileError

BODY = default_body()
USED = np.arange(BODY.vertex_count)
DT = 1 / 50


def standing(count=4):
    return np.tile(BODY.rest_vertices.astype(np.float32), (count, 1, 1))


def raw(frames, files=()):
    return RawFrames(frames, BODY.faces, DT, Told("m", "y"), "b.npz", (), files)


def thrown():
    frames = standing()
    frames[2, 17] = 1e20
    return frames


def astray():
    frames = standing()
    frames[2, 17] += [0.0, 1.0, 0.0]
    return frames


def elsewhere():
    frames = standing()
    frames[3] += [5.0, 0.0, 0.0]
    return frames


def in_another_unit(factor):
    frames = standing()
    frames[1:] *= factor
    return frames


@pytest.mark.parametrize(
    ("frames", "place", "words"),
    [
        (thrown(), "b.npz, frame 2", "vertex 17 is 1e+20 m from the origin"),
        (astray(), "b.npz, frame 2", "vertex 17 moves 1 m from the frame before, which is 50 m/s"),
        (elsewhere(), "b.npz, frame 3", f"{len(USED)} of {len(USED)} vertices do so"),
        (in_another_unit(100.0), "b.npz, frame 1", "times off; vertex"),
        (in_another_unit(0.01), "b.npz, frame 1", "times off; vertex"),
        (in_another_unit(2.54), "b.npz, frame 1", "m/s"),
    ],
)
def test_a_body_that_jumps_is_refused(frames, place, words):
    with pytest.raises(MeshFileError, match=re.escape(words)) as caught:
        make_body(raw(frames))
    assert caught.value.place == place
    assert caught.value.remedy


def test_the_limit_is_a_speed():
    frames = standing(2)
    frames[1] += np.float32([0.0, 0.0, 0.95 * SPEED_MAX * DT])
    refuse_jumps(frames, USED, DT, str)
    with pytest.raises(MeshFileError, match="m/s"):
        refuse_jumps(frames, USED, 0.9 * DT, str)


def test_vertices_of_no_triangle_may_be_anywhere():
    frames = thrown()
    refuse_jumps(frames, np.delete(USED, 17), DT, str)


def test_the_file_of_a_frame_is_named():
    with pytest.raises(MeshFileError) as caught:
        make_body(raw(astray(), ("f/0.obj", "f/1.obj", "f/9.obj", "f/10.obj")))
    assert caught.value.place == "f/9.obj"
