"""Animations of a .glb: which one is read, from when on, and keys that can't be followed."""

import json

import numpy as np
import pytest
from small_glb import glb, skinned

from tryon_solver.files.gltf import parse_glb
from tryon_solver.files.gltf_animation import Channel
from tryon_solver.files.mesh_body import is_moving_mesh, read_frames
from tryon_solver.files.raw_mesh import MeshFileError

IDLE = ((0.0, 1.0), (0.0, 1.0))
JUMP = ((0.0, 0.5), (0.0, 3.0))
NONE = ((), ())
POSE = ((0.0,), (2.0,))
HELD = ((0.0, 0.5, 1.0), (2.0, 2.0, 2.0))
LATE = ((2.0, 3.0), (1.0, 5.0))


def written(path, *lifts, names):
    path.write_bytes(skinned(lifts=lifts, names=names))
    return path


def height(raw, frame):
    return raw.frames[frame][0, 2]


def test_of_several_animations_the_first_is_read_and_all_are_told(tmp_path):
    raw = read_frames(written(tmp_path / "a.glb", IDLE, JUMP, names=("idle", "jump")))
    assert raw.notes[1] == (
        "it has 2 animations ('idle', 'jump'); 'idle' is read, the first; --body-animation names another"
    )
    assert height(raw, -1) == pytest.approx(1.0)


def test_an_animation_is_read_by_its_name(tmp_path):
    path = written(tmp_path / "a.glb", IDLE, JUMP, names=("idle", "jump"))
    raw = read_frames(path, animation="jump")
    assert len(raw.frames) == 31
    assert height(raw, -1) == pytest.approx(3.0)
    assert raw.notes[1] == "it has 2 animations ('idle', 'jump'); 'jump' is read, as told"


@pytest.mark.parametrize("first", [NONE, POSE, HELD])
def test_an_animation_that_moves_nothing_is_passed_over_and_told(tmp_path, first):
    path = written(tmp_path / "a.glb", first, JUMP, names=("TPose", "jump"))
    assert is_moving_mesh(path)
    raw = read_frames(path)
    assert height(raw, -1) == pytest.approx(3.0)
    assert "'jump' is read, the first that moves anything; --body-animation" in raw.notes[1]


def test_what_moves_beside_the_mesh_moves_nothing_of_it():
    """The first animation moves a camera, say, the second the bone."""
    content = skinned(lifts=(IDLE, JUMP), names=("camera", "jump"))
    document, blob = json.loads(content[20:].split(b"BIN\0")[0][:-4]), content.split(b"BIN\0", 1)[1]
    document["nodes"].append({})
    document["animations"][0]["channels"][0]["target"]["node"] = 2
    scene = parse_glb(glb(document, blob))
    assert scene.animation.played == 1
    document["nodes"][2]["children"] = [1]
    assert parse_glb(glb(document, blob)).animation.played == 0, "what the bone hangs from"


@pytest.mark.parametrize(
    ("path", "interpolation", "values", "moves"),
    [
        ("translation", "LINEAR", [[100.0, 0, 0], [100.0 + 1e-5, 0, 0]], False),
        ("translation", "LINEAR", [[0, 0, 0], [0, 1e-3, 0]], True),
        ("rotation", "LINEAR", [[0, 0.6, 0, 0.8], [0, -0.6, 0, -0.8]], False),
        ("rotation", "LINEAR", [[0, 0.6, 0, 0.8], [0, 0.8, 0, 0.6]], True),
        ("weights", "STEP", [[0.0], [0.0]], False),
        ("scale", "CUBICSPLINE", [[[0.0], [1.0], [0.0]], [[0.0], [1.0], [0.0]]], False),
        ("scale", "CUBICSPLINE", [[[0.0], [1.0], [2.0]], [[0.0], [1.0], [0.0]]], True),
    ],
)
def test_a_channel_changes_when_its_value_does(path, interpolation, values, moves):
    channel = Channel(0, path, 0, np.array([0.0, 1.0]), np.array(values, float), interpolation)
    assert channel.changes() == moves


def test_animations_without_a_name_of_their_own_go_by_their_number(tmp_path):
    path = written(tmp_path / "a.glb", IDLE, JUMP, IDLE, JUMP, names=("", "walk", "walk", ""))
    assert parse_glb(path.read_bytes()).animation.names == ("animation 0", "walk 1", "walk 2", "animation 3")
    assert height(read_frames(path, animation="walk 1"), -1) == pytest.approx(3.0)


def test_a_name_that_no_animation_has_is_answered_with_those_there_are(tmp_path):
    path = written(tmp_path / "a.glb", IDLE, JUMP, names=("idle", "jump"))
    with pytest.raises(MeshFileError, match="no animation 'fly'") as caught:
        read_frames(path, animation="fly")
    assert caught.value.remedy == "Say one of: 'idle', 'jump'"
    with pytest.raises(MeshFileError, match="no animation 'fly'") as caught:
        read_frames(written(tmp_path / "b.glb", names=()), animation="fly")
    assert caught.value.remedy == "Leave --body-animation out"


def test_only_a_glb_has_animations(tmp_path):
    np.savez(tmp_path / "a.npz", vertices=np.zeros((1, 3, 3)), faces=[[0, 1, 2]])
    with pytest.raises(MeshFileError, match=r"only a \.glb has animations"):
        read_frames(tmp_path / "a.npz", animation="walk")


def test_one_animation_alone_needs_no_words(tmp_path):
    assert len(read_frames(written(tmp_path / "a.glb", IDLE, names=("idle",))).notes) == 1


def test_a_late_start_begins_at_the_first_key(tmp_path):
    path = written(tmp_path / "a.glb", LATE, names=("late",))
    scene = parse_glb(path.read_bytes())
    assert (scene.begins, scene.duration) == (2.0, 1.0)
    assert scene.positions(0.0)[0, 2] == pytest.approx(1.0), "before the first key its value holds"
    raw = read_frames(path)
    assert len(raw.frames) == 61
    np.testing.assert_allclose([height(raw, k) for k in (0, 30, 60)], [1.0, 3.0, 5.0], rtol=1e-6)
    assert raw.notes[1] == "its first key is at 2.00 s: it begins there"


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ((0.0, 0.5, 0.5), "key 2 is at 0.5 s and key 1 before it at 0.5 s"),
        ((1.0, 0.5, 0.0), "key 1 is at 0.5 s and key 0 before it at 1 s"),
    ],
)
def test_keys_out_of_order_are_refused_by_sampler_and_key(times, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        parse_glb(skinned(lifts=(IDLE, (times, (0.0, 1.0, 2.0))), names=("a", "b")), "a.glb", "b")
    assert caught.value.place == "a.glb, animation 1, sampler 0"
    assert caught.value.remedy


def test_a_garment_tells_which_animations_beginning_it_lies_at():
    mesh = parse_glb(skinned(lifts=(LATE, JUMP), names=("late", "jump"))).raw_mesh()
    assert mesh.vertices[0, 2] == pytest.approx(1.0)
    assert mesh.notes[0] == "it has 2 animations ('late', 'jump'); 'late' is read, the first"


def test_vertices_without_weights_are_refused_by_the_first():
    with pytest.raises(MeshFileError, match=r"2 of its 3 vertices hang on no joint.* the first is vertex 1") as caught:
        parse_glb(skinned(weights=(1.0, 0.0, 0.0)), "a.glb")
    assert caught.value.place == "a.glb, mesh 'cloak', WEIGHTS_0[1]"
    assert "weight" in caught.value.remedy


def test_weights_that_do_not_sum_to_one_are_shares():
    np.testing.assert_allclose(parse_glb(skinned(weights=(0.5, 1.0, 3.0))).positions(0.5)[:, 2], 2.0)
