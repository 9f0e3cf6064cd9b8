"""A stranger's body is put where patterns expect one, wherever it stands and whichever way it looks."""

from dataclasses import replace

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.body.mesh_sequence import make_sequence
from tryon_solver.body.pose import skin
from tryon_solver.files.convention import Convention, Told
from tryon_solver.files.garment_convention import find_for_garment
from tryon_solver.files.mesh_body import RawFrames, make_body
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.standing import facing, find_stand, stands_on_its_head

BODY = default_body()
REST = BODY.rest_vertices


def about_y(degrees):
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def walk(strangers):
    motion = strangers.motion_from_rest(BODY, "walk", 1.0)
    return np.stack([skin(BODY, motion.pose(k)) for k in range(30)])


@pytest.mark.parametrize("degrees", [0, 40, 90, 135, 180, -90])
@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.0, -0.9, 0.0), (1.0, 0.5, -5.0)])
def test_a_body_is_brought_back(degrees, shift):
    strange = REST @ about_y(degrees).T + shift
    stand = find_stand(strange, BODY.faces, "a.npz")
    back = strange @ stand.turn.T + stand.shift
    # what is so near to its place that it is left there, and the part of a facing that is no quarter turn
    assert np.abs(back - REST).max() < 0.05
    told = " ".join(stand.notes)
    assert ("to face +Z" in told) == (degrees != 0)
    assert ("on the floor" in told) == (shift[1] != 0)
    assert ("x = z = 0" in told) == (shift[0] != 0)
    assert bool(stand.notes) == (degrees != 0 or any(shift))


def test_what_is_said_has_the_right_numbers():
    told = find_stand(REST @ about_y(90).T + [3.0, -0.9, 4.0], BODY.faces, "a.npz").notes
    assert told[0] == "put where patterns expect a body: turned by 90° about the vertical, to face +Z"
    assert told[1] == "stood on the floor: raised by 0.90 m"
    assert told[2].startswith("moved by 5.0")


def test_a_walking_body_faces_where_it_walks(strangers):
    """In every frame, one foot before the other, within what its trunk turns."""
    for x in walk(strangers):
        towards = facing(x @ about_y(70).T, BODY.faces)
        assert towards is not None
        assert towards @ about_y(70)[:, 2] > np.cos(np.deg2rad(15.0))
        assert not stands_on_its_head(x, BODY.faces)
        assert stands_on_its_head(x * [-1.0, -1.0, 1.0], BODY.faces)


def test_a_body_that_lies_is_refused():
    with pytest.raises(MeshFileError, match=r"does not stand: it is 0\.\d\d m high and 1\.72 m long") as caught:
        find_stand(REST[:, [0, 2, 1]] * [1, 1, -1], BODY.faces, "a.npz")
    assert "--body-up" in caught.value.remedy


def without_legs():
    """Faces of the body without its legs, and its vertices."""
    used, faces = np.unique(BODY.faces[(REST[BODY.faces][..., 1] > 0.5).all(axis=1)], return_inverse=True)
    return REST[used], faces.reshape(-1, 3)


def test_a_body_without_feet_is_left_and_told_or_refused_where_it_is_clearly_elsewhere():
    x, faces = without_legs()
    stand = find_stand(x, faces, "a.npz")
    np.testing.assert_array_equal(stand.shift, 0.0)
    assert stand.angle == 0.0
    assert stand.notes[0].startswith("its feet don't tell which way it faces")
    for shift in ([0.0, -0.9, 0.0], [1.0, 0.0, 0.0]):
        with pytest.raises(MeshFileError, match="its feet don't tell which way it faces, and it does not stand") as bad:
            find_stand(x + shift, faces, "a.npz")
        assert bad.value.remedy


@pytest.mark.parametrize("degrees", [0, 90, 180, -90])
def test_a_facing_that_is_told_wins_over_what_is_found(degrees):
    """Without feet that tell the body is then put like another; with feet that would tell otherwise, it is believed."""
    ahead = about_y(degrees)[:, 2]
    x, faces = without_legs()
    stand = find_stand(x @ about_y(degrees).T + [1.0, -0.9, 0.0], faces, "a.npz", ahead)
    np.testing.assert_allclose(stand.turn @ ahead, [0.0, 0.0, 1.0], atol=1e-9)
    assert any("to face +Z (as told)" in note for note in stand.notes) == (degrees != 0)
    assert any("moved by" in note for note in stand.notes)
    np.testing.assert_allclose(find_stand(REST, BODY.faces, "a.npz", ahead).turn @ ahead, [0.0, 0.0, 1.0], atol=1e-9)


def test_a_facing_is_told_in_the_axes_of_the_file():
    x, faces = without_legs()
    strange = 100 * (x @ about_y(90).T)[:, [0, 2, 1]] * [1.0, -1.0, 1.0]  # cm, Z up, facing +X
    told = Told("cm", "z", facing="x")
    body = make_body(RawFrames(strange[None].astype(np.float32), faces, 1 / 30, told, "a.npz", ())).for_patterns()
    assert "turned by 90° about the vertical, to face +Z (as told)" in " ".join(body.notes)
    own = body.sequence.rest_vertices[: len(x)]
    np.testing.assert_allclose(own - own.mean(axis=0), x - x.mean(axis=0), atol=1e-4)


def raw(frames):
    return RawFrames(frames.astype(np.float32), BODY.faces, 1 / 30, Told(), "a.npz", ())


@pytest.mark.long
def test_a_body_upside_down_is_turned_over_with_what_lies_on_it(strangers):
    frames = walk(strangers)[:4]
    over = [-1.0, -1.0, 1.0]
    body = make_body(raw(frames * over))
    assert body.convention == Convention("m", "y", body.convention.because, over=True)
    assert "m, Y down" in body.notes[0]
    assert body.notes[1] == "its feet were above its head: it was turned over"
    np.testing.assert_allclose(body.sequence.rest_vertices, frames[0], atol=1e-5)
    belt = (REST[BODY.faces][..., 1] > 0.9).all(axis=1) & (REST[BODY.faces][..., 1] < 1.2).all(axis=1)
    found = find_for_garment(
        1.02 * REST * over, BODY.faces[belt], body.sequence.rest_vertices, Told(), body.convention, "g.obj"
    )
    assert (found.unit, found.up, found.over) == ("m", "y", True)
    np.testing.assert_allclose(found.apply(REST * over), REST, atol=1e-12)
    assert not make_body(raw(frames)).convention.over


def test_a_body_that_begins_in_a_handstand_is_not_turned_over(strangers):
    """Later frames stand: nobody is turned over in the middle of a file. A pattern needs a first frame that stands."""
    frames = walk(strangers)[:6].copy()
    turning = np.linspace(np.pi, 0.0, 6)
    for k, angle in enumerate(turning):
        c, s = np.cos(angle), np.sin(angle)
        middle = np.array([0.0, 0.9, 0.0])
        frames[k] = (frames[k] - middle) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + middle
    body = make_body(replace(raw(frames), dt=0.3))
    assert not body.convention.over
    np.testing.assert_allclose(body.sequence.rest_vertices, frames[0], atol=1e-5)
    with pytest.raises(MeshFileError, match="its feet are above its head in its first frame, and below in later ones"):
        body.for_patterns()


def test_for_patterns_every_frame_goes_along_and_between_them_too(strangers):
    """The file's own coordinates stay those of the body, which mesh garments share."""
    frames = walk(strangers)[:12] @ about_y(90).T + [5.0, -0.9, 0.0]
    body = make_body(raw(frames))
    np.testing.assert_allclose(body.sequence.surface(body.sequence.sample(0.1)), frames[3], atol=1e-5)
    placed = body.for_patterns()
    assert placed.notes[: len(body.notes)] == body.notes
    assert any("stood on the floor: raised by 0.90 m" in note for note in placed.notes)
    stand = find_stand(body.sequence.rest_vertices, body.sequence.faces, "a.npz")
    for t in (0.0, 0.1, 0.117, 0.3):
        expected = body.sequence.surface(body.sequence.sample(t)) @ stand.turn.T + stand.shift
        np.testing.assert_allclose(placed.sequence.surface(placed.sequence.sample(t)), expected, atol=1e-5)
        np.testing.assert_allclose(
            placed.sequence.transforms(placed.sequence.sample(t))[:, :3, :3],
            stand.turn @ body.sequence.transforms(body.sequence.sample(t))[:, :3, :3] @ stand.turn.T,
            atol=1e-9,
        )
    assert abs(placed.sequence.rest_vertices[:, 1].min()) < 0.02


def test_a_sequence_that_is_put_elsewhere_is_the_one_made_there():
    frames = np.stack([REST, REST + [0.0, 0.0, 0.03]])
    turn, shift = about_y(40), np.array([1.0, -0.9, 2.0])
    there = make_sequence((frames @ turn.T + shift).astype(np.float32), BODY.faces, 0.1)
    put = make_sequence(frames.astype(np.float32), BODY.faces, 0.1).put(turn, shift)
    for t in (0.0, 0.05, 0.1):
        np.testing.assert_allclose(put.surface(put.sample(t)), there.surface(there.sample(t)), atol=2e-6)
