"""What IPC Toolkit is asked of a way: its no to a long one beside thin fabric is asked again in pieces, and stays a no
where something is in the way."""

import ipctk
import numpy as np
from harness.oracle import ALL_THE_SAME, AT_A_GLANCE, Oracle, near_each_other
from small_scenes import icosphere, sheet

NOBODY, NOWHERE = np.zeros((0, 3), np.int32), np.zeros((0, 3))


def sheets(apart):
    """Two squares above each other, `apart` m."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    faces = np.vstack([garment.faces, garment.faces + len(x)]).astype(np.int32)
    return np.vstack([x, x + [0.003, apart, 0.002]]), faces, len(x)


def test_a_way_through_something_is_not_free():
    x, faces, count = sheets(1e-3)
    after = x.copy()
    after[count:, 1] -= 2e-3
    assert Oracle(faces, NOBODY, x, NOWHERE).colliding([(x, after)]) == [0]
    ball, ball_faces = icosphere(0.02, 1)
    over = Oracle(faces, ball_faces, x + [0, 0.05, 0], ball)
    before = np.vstack([x + [0, 0.05, 0], ball])
    assert over.colliding([(before, np.vstack([x - [0, 0.05, 0], ball]))]) == [0]


def test_of_several_ways_each_is_judged_alone():
    """Short ones and long ones in any order: the answer to each is the toolkit's to it alone."""
    x, faces, count = sheets(1e-3)
    rng, oracle, ways = np.random.default_rng(3), Oracle(faces, NOBODY, x, NOWHERE), []
    for _ in range(24):
        down = np.zeros_like(x)
        down[count:, 1] = rng.choice([2e-4, 1.5e-3, 0.05])
        aside = rng.normal(0, 2e-4, 3)
        ways.append((x + aside, x + aside - down))
    alone = [k for k, way in enumerate(ways) if not ipctk.is_step_collision_free(oracle.paths, *map(fortran, way))]
    assert 8 < len(alone) < 22
    assert max(map(len, near_each_other(ways, range(len(ways))))) > 2
    assert oracle.colliding(ways) == alone


def test_a_way_to_what_is_no_number_is_not_free():
    x, faces, _ = sheets(1e-3)
    lost = x.copy()
    lost[3, 1] = np.nan
    assert Oracle(faces, NOBODY, x, NOWHERE).colliding([(x, x), (x, lost), (lost, x)]) == [1, 2]


def test_a_no_by_tolerance_is_asked_again(monkeypatch):
    """Ten centimetres together, ten micrometres apart: both detections, then each piece, and the whole is free."""
    x, faces, _ = sheets(1e-5)
    oracle, asked, glances = Oracle(faces, NOBODY, x, NOWHERE), [], []
    really = ipctk.Candidates.is_step_collision_free

    def unsure(candidates, mesh, a, b, **how):
        asked.append(np.abs(b - a).max())
        glances.append(how.get("narrow_phase_ccd") is AT_A_GLANCE)
        return asked[-1] < 0.05 and really(candidates, mesh, a, b, **how)

    monkeypatch.setattr(ipctk.Candidates, "is_step_collision_free", unsure)
    assert oracle.colliding([(x, x + [0, 0, 0.1])]) == []
    assert len(asked) == 18
    assert min(asked[:2]) > 0.05 > max(asked[2:])
    assert glances == [True] + 17 * [False]


def test_each_eighth_way_is_asked_exactly_whatever_a_glance_says(monkeypatch):
    """The additive detection is not proven against rounding: here it clears all."""
    x, faces, count = sheets(1e-3)
    through = x.copy()
    through[count:, 1] -= 2e-3
    oracle = Oracle(faces, NOBODY, x, NOWHERE)
    really = ipctk.Candidates.is_step_collision_free

    def careless(candidates, mesh, a, b, **how):
        return bool(how) or really(candidates, mesh, a, b)

    monkeypatch.setattr(ipctk.Candidates, "is_step_collision_free", careless)
    assert oracle.colliding(20 * [(x, through)]) == [ALL_THE_SAME - 1, 2 * ALL_THE_SAME - 1]


def fortran(x):
    """As the toolkit takes positions."""
    return np.asfortranarray(x.astype(np.float64))
