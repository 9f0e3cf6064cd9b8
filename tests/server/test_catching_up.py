"""What was dressed in one stance comes to another one in few moves, feeling nothing of the way."""

import analytic_drape
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tryon_server.runtime.catching_up import FEWEST, STRIDE, CatchingUp, taken_off_for
from tryon_server.runtime.sources import APPROACH_TURN_MAX, LONGEST_MOVE, NEARBY
from tryon_solver.body.pose import Pose


def stance(turn=0.0, root=0.0):
    """The second joint turned by so many radians, the body so far aside [m]."""
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    rotations[1] = Rotation.from_euler("x", turn).as_quat()
    return Pose(np.array([root, 0.0, 0.0]), rotations)


def brought_to(*stances):
    """The drape at the end of its way, and how many moves it took; each stance is that of one move, the last of all
    from there on."""
    left = list(stances)
    sheet, worn = analytic_drape.WavingSheet("cotton"), AtOnce("cotton")
    catching_up = CatchingUp(iter([None, sheet]), lambda: left.pop(0) if len(left) > 1 else left[0], worn)
    *others, drape = catching_up.parts()
    assert others == [None] * len(others)
    assert worn.went_to == [drape]
    return drape, len(others)


class AtOnce(analytic_drape.WavingSheet):
    """What is worn, which has nothing that the other has."""

    def come_to(self, other, way, off=()):
        assert off == ()
        yield from way
        self.went_to = [other]


def test_a_near_stance_is_reached_in_the_fewest_moves():
    goal = stance(0.3)
    drape, moves = brought_to(goal)
    assert moves == FEWEST == drape.steps
    assert drape.current is goal


def test_the_moves_grow_with_the_way():
    _, moves = brought_to(stance(2.0))
    assert moves == np.ceil(2.0 / APPROACH_TURN_MAX / STRIDE) > FEWEST


def test_what_is_worn_comes_to_it_at_its_end_and_it_goes_along():
    sheet, worn, goal = analytic_drape.WavingSheet("cotton"), analytic_drape.WavingSheet("cotton"), stance(0.3)
    parts = CatchingUp(iter([sheet]), lambda: goal, worn).parts()
    for _ in range(FEWEST + 3):
        assert next(parts) is None, "it does not end while what is worn stands still"
    assert sheet.steps == FEWEST
    for k in range(1, 4):
        worn.advance(goal, k * analytic_drape.DRAWN / 3)
    assert next(parts) is sheet
    assert sheet.steps == FEWEST + 3
    assert sheet.seconds == pytest.approx(FEWEST * LONGEST_MOVE + analytic_drape.DRAWN)


def test_nothing_of_the_way_is_felt_and_it_ends_in_the_next_move():
    drape, _ = brought_to(stance(0.5))
    assert drape.along == [True] * FEWEST
    for t in (1.0, 2.0):
        drape.advance(stance(0.5), t)
    assert drape.along == [True] * (FEWEST + 1) + [False]


def test_it_ends_where_the_body_is_by_then():
    goals = [stance(0.1 * k) for k in range(FEWEST)]
    drape, _ = brought_to(*goals)
    assert drape.current is goals[-1]


def test_who_is_far_away_is_not_walked_to():
    goal = stance(0.0, NEARBY + 5.2)
    drape, moves = brought_to(goal)
    assert moves == FEWEST
    assert drape.origin[0] == pytest.approx(7.0)
    assert drape.current is goal


@pytest.mark.parametrize(
    ("before", "after", "off"),
    [
        ("abc", "abc", ""),
        ("ab", "ba", "a"),
        ("abc", "bac", "a"),
        ("abc", "cab", "c"),
        ("abc", "acb", "b"),
        ("abc", "bca", "a"),
        ("abc", "cba", "ab"),
        ("abc", "adc", ""),
        ("a", "ba", ""),
        ("ab", "cd", ""),
    ],
)
def test_the_fewest_are_taken_off_that_have_to_pass_through_others(before, after, off):
    """Of as few, those that come to lie farther out."""
    assert taken_off_for(before, after) == tuple(off)


class Refusing(analytic_drape.WavingSheet):
    """What is worn, and can't be led anywhere."""

    def come_to(self, _other, _way, off=()):
        yield None
        if off:
            yield from self.take_off(*off)
        raise RuntimeError("it diverged")


def wearing(sheet, *names):
    sheet.specifications, sheet.edited = dict.fromkeys(names, sheet.specification), names[-1]
    return sheet


def test_what_is_taken_off_for_it_is_missed_while_the_others_are_drawn():
    sheet, worn = (wearing(analytic_drape.WavingSheet("cotton"), *names) for names in ("bca", "abc"))
    goal, seen, begun = stance(2.0), [worn.names], 0.0
    catching_up = CatchingUp(iter([sheet]), lambda: goal, worn, again=("a",))
    for made in catching_up.parts():
        if made is not None:
            seen.append(made.names)
            begun, worn = worn.t, made
            assert catching_up.is_there == (made is sheet)
        else:
            worn.advance(goal, worn.t + analytic_drape.DRAWN / 3)
    assert seen == [tuple("abc"), tuple("bc"), tuple("bca")]
    assert begun > FEWEST * analytic_drape.DRAWN / 3, "the long way is gone before"
    assert sheet.current is goal


def test_what_is_off_is_put_on_also_where_the_others_can_t_be_led():
    """What was asked for is worn, though it jumps; where nothing is off yet, nothing changes."""
    sheet, worn = (wearing(kind("cotton"), *"ab") for kind in (analytic_drape.WavingSheet, Refusing))
    *_, last = CatchingUp(iter([sheet]), lambda: stance(0.3), worn, again=("a",)).parts()
    assert last is sheet
    assert sheet.comes_along, "to where the body is"
    with pytest.raises(RuntimeError, match="diverged"):
        list(CatchingUp(iter([sheet]), lambda: stance(0.3), worn).parts())
