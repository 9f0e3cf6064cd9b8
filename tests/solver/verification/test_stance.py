"""How a body is held, measured on its skin: what keeps a garment off is found, and what does not is left alone."""

from dataclasses import replace

import held_bodies as held
import numpy as np
import pytest

from tryon_solver.body.mesh_sequence import Moment, make_sequence
from tryon_solver.body.pose import skin
from tryon_solver.dressing.fit import StanceError, TightError
from tryon_solver.dressing.fitting_room import GOOD, OPEN, FittingRoom
from tryon_solver.dressing.stance import AHEAD_MOST, CROWDED_MOST, Covered, Skin
from tryon_solver.dressing.to_fit import search
from tryon_solver.files.convention import Convention
from tryon_solver.files.mesh_body import MeshBody
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.geometry.placement import PlacementError

FACES = held.BODY.faces
REST = held.BODY.rest_vertices
SKIN = Skin(REST, FACES)
SHIRT = Covered(0.93, 1.47, sleeves=True)
TROUSERS = Covered(0.05, 1.1, sleeves=False)
FPS = 10.0
ARMS, LEGS_OUT, UNFOUND = "other skin within 4 cm", "before or behind", "can't be told from its trunk"


@pytest.mark.parametrize("covered", [SHIRT, TROUSERS])
def test_an_a_pose_is_fit_for_dressing(covered):
    found = SKIN.held(REST, covered)
    assert found.strain < GOOD
    assert found.crowded == 0.0
    assert found.uneven < 0.01
    assert found.rank < 1.0
    assert found.describe() == ""


@pytest.mark.parametrize(
    ("pose", "covered", "why"),
    [
        (held.AT_SIDES, SHIRT, ARMS),
        (held.CROSSED, SHIRT, ARMS),
        (held.LEGS_TOGETHER, TROUSERS, ARMS),
        (held.SEATED, SHIRT, LEGS_OUT),
        (held.SEATED, TROUSERS, LEGS_OUT),
        (held.RAISED, SHIRT, UNFOUND),
    ],
)
def test_what_keeps_a_garment_off_is_named(pose, covered, why):
    found = SKIN.held(skin(held.BODY, pose), covered)
    assert found.strain > 1.0
    assert why in found.describe()
    assert sum(other in found.describe() for other in (ARMS, LEGS_OUT, UNFOUND)) == 1


def test_what_a_garment_does_not_cover_does_not_matter():
    assert SKIN.held(skin(held.BODY, held.CROSSED), TROUSERS).strain < 1.0
    assert SKIN.held(skin(held.BODY, held.LEGS_TOGETHER), SHIRT).strain < 1.0
    raised = SKIN.held(skin(held.BODY, held.RAISED), replace(SHIRT, sleeves=False))
    assert raised.strain < 1.0
    assert raised.strain_to_choose == np.inf


def test_a_part_of_its_own_that_lies_on_the_body_is_no_other_skin():
    """Hair or a hat: as near to the head as an arm that is pressed against a trunk."""
    cap = (REST[FACES][..., 1] > 1.6).all(axis=1)
    used, faces = np.unique(FACES[cap], return_inverse=True)
    middle = REST[used].mean(axis=0)
    hat = middle + 1.05 * (REST[used] - middle)
    both = np.vstack([REST, hat])
    found = Skin(both, np.vstack([FACES, faces.reshape(-1, 3) + len(REST)])).held(both, Covered(0.0, 2.0, sleeves=True))
    assert found.crowded < CROWDED_MOST / 10
    assert found.ahead < AHEAD_MOST


# -- the frame in which a moving mesh is dressed -----------------------------------------------------------------------


def body_of(frames):
    return MeshBody(make_sequence(frames, FACES, 1 / FPS), Convention("m", "y", "in a test"), (), "a.npz")


@pytest.fixture(scope="module")
def from_crossed():
    """Arms crossed at first, then an A pose for a moment, then the arms hang."""
    return body_of(held.led(held.CROSSED, held.A_POSE, held.A_POSE, held.AT_SIDES, seconds=0.5, fps=FPS))


@pytest.fixture(scope="module")
def crossed():
    return body_of(held.led(held.CROSSED, held.AT_SIDES, seconds=0.4, fps=FPS))


class Tailor:
    """Refuses a garment as long as the body is dressed before some time [s]."""

    def __init__(self, until, error=TightError):
        self.until, self.error, self.at = until, error, []

    def __call__(self, body):
        stance = body.start()
        self.at.append(stance.time if isinstance(stance, Moment) else 0.0)
        if self.at[-1] < self.until:
            raise self.error("too tight", "panels.front", "Enlarge it")
        return body


def test_a_garment_that_goes_on_in_the_first_frame_is_worn_from_there(from_crossed):
    room, tailor = FittingRoom(from_crossed.sequence, SHIRT, from_crossed), Tailor(0.0)
    worn = room.put_on(tailor)
    assert tailor.at == [0.0]
    assert worn is room.body
    assert room.note == ""
    np.testing.assert_array_equal(worn.places, from_crossed.sequence.places)


@pytest.mark.parametrize("error", [TightError, PlacementError])
def test_what_is_refused_where_the_arms_are_crossed_is_put_on_in_the_first_frame_that_is_fit(from_crossed, error):
    room, tailor = FittingRoom(from_crossed.sequence, SHIRT, from_crossed), Tailor(0.1, error)
    worn = room.put_on(tailor)
    frame = round(tailor.at[-1] * FPS)
    assert 1 <= frame <= 5
    assert worn.dressed_at == pytest.approx(frame / FPS)
    measured = [SKIN.held(worn.surface(worn.sample(k / FPS)), SHIRT).rank for k in range(frame + 1)]
    assert measured[-1] <= OPEN < min(measured[:-1])
    assert room.note.startswith(f"dressed in frame {frame + 1} of 16, at {frame / FPS:.2f} s")
    assert "then led to frame 1" in room.note
    assert ARMS in room.note


def test_where_nothing_is_as_open_as_an_a_pose_the_most_open_stance_is_chosen():
    """The arms leave the trunk a little, and lie on it again."""
    off = held.turned(("upper_arm", held.Z, -22.0))
    frames = held.led(held.AT_SIDES, off, held.AT_SIDES, seconds=0.4, fps=FPS)
    body = body_of(frames)
    worn = FittingRoom(body.sequence, SHIRT, body).put_on(Tailor(0.1))
    assert worn.dressed_at == pytest.approx(0.4)
    assert SKIN.held(frames[4].astype(float), SHIRT).rank > OPEN


def test_what_is_refused_there_too_is_refused_with_the_frame_and_as_what_it_is(from_crossed):
    tailor = Tailor(9.0)
    with pytest.raises(TightError, match=r"in frame \d, in which the body is held fit for it, too tight") as caught:
        FittingRoom(from_crossed.sequence, SHIRT, from_crossed).put_on(tailor)
    assert len(tailor.at) == 2
    assert caught.value.remedy == "Enlarge it"


def test_a_garment_too_small_for_an_a_pose_is_tried_once_and_too_tight():
    standing = body_of(np.array([REST] * 3, np.float32))
    tailor = Tailor(9.0)
    with pytest.raises(TightError, match=r"^panels\.front: too tight"):
        FittingRoom(standing.sequence, SHIRT, standing).put_on(tailor)
    assert tailor.at == [0.0]


def test_where_no_frame_is_fit_the_pose_is_told_with_what_to_do(crossed):
    tailor = Tailor(9.0)
    with pytest.raises(StanceError, match=r"how the body is held, not the size: .*; as it is, too tight") as caught:
        FittingRoom(crossed.sequence, SHIRT, crossed).put_on(tailor)
    assert tailor.at == [0.0]
    assert "in none of its 5 frames" in caught.value.message
    assert caught.value.place == "body"
    assert "A pose" in caught.value.remedy


def test_a_still_body_is_asked_for_another_stance():
    still = replace(held.BODY, rest_vertices=skin(held.BODY, held.CROSSED))
    with pytest.raises(StanceError, match="how the body is held") as caught:
        FittingRoom(still, SHIRT).put_on(Tailor(9.0))
    assert "frame" not in caught.value.message + caught.value.remedy


def test_a_size_is_not_looked_for_on_a_body_that_is_held_so(crossed):
    room, sizes = FittingRoom(crossed.sequence, SHIRT, crossed), []
    room.look_ahead()

    def put_on(size):
        sizes.append(size)
        return room.put_on(Tailor(9.0))

    with pytest.raises(StanceError):
        search(put_on, None)
    assert sizes == [1.0]


def test_a_size_is_looked_for_in_the_frame_that_is_fit(from_crossed):
    room = FittingRoom(from_crossed.sequence, SHIRT, from_crossed)
    room.look_ahead()
    assert room.body.start().time > 0.0
    assert "then led to frame 1" in room.note


def test_a_pattern_is_put_on_who_lies_at_first_and_stands_up():
    lying = REST[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    up = body_of(np.array([lying, lying, REST, REST], np.float32))
    room, tailor = FittingRoom(up.sequence, SHIRT, up), Tailor(0.0)
    room.put_on(tailor)
    assert tailor.at == [pytest.approx(0.2)]
    assert "in the first frame it does not stand" in room.note
    flat = body_of(np.array([lying, lying], np.float32))
    with pytest.raises(MeshFileError, match="does not stand"):
        FittingRoom(flat.sequence, SHIRT, flat)
