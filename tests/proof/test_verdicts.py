"""Broken limits are found, named and end in the exit status; a case that fails says why."""

import json
import subprocess
import sys
from pathlib import Path

import limits
import numpy as np
import pytest
from case import Case, LiveCase, case_of
from frame_figures import FrameFigures
from table import markdown
from verdict import broken_by_frames, broken_by_share, broken_by_weight, late

PROOF = Path(__file__).parent
CASE = Case("skirt", "walk", "cotton_jersey", "draft", "cpu", 0.04, 30.0, 0.2, 0.1, 0.0, 0.1, 2)


def test_over_names_the_first_and_the_worst_frame():
    (broken,) = limits.over("lag", [1, 2, 3, 4], [0.1, 0.3, 0.2, 0.4], 0.25)
    assert (broken.first, broken.worst, broken.frames, broken.value) == (2, 4, 2, 0.4)
    assert list(limits.over("lag", [1, 2], [0.25, 0.1], 0.25)) == []


def test_what_is_not_a_number_breaks_every_limit():
    (broken,) = limits.over("lag", [1, 2], [np.nan, 9.0], 10.0)
    assert (broken.first, broken.worst) == (1, 1)
    assert list(limits.run_over("trembling", np.nan, 1.0))
    assert list(limits.run_under("hem", np.nan, 1.0))


def test_what_was_not_measured_breaks_nothing():
    assert list(limits.run_over("trembling", None, 1.0)) == []
    assert list(limits.run_under("hem", None, 1.0)) == []


@pytest.mark.parametrize(
    ("motion", "share"),
    [("walk", 0.0), ("walk_02_01", 0.0), ("toe_touch_13_29", 0.0), ("cartwheel_49_08", 0.02), ("run", 0.02)],
)
def test_late_frames_are_allowed_by_the_motions_name(motion, share):
    assert limits.late_share(motion) == share


@pytest.mark.parametrize("motion", ["turn", "walking", "runner_1", "bend_scoop_lift_arm_02_06"])
def test_in_other_motions_the_lag_has_no_limit(motion):
    assert limits.late_share(motion) is None


def lagging(millimetres):
    """Figures of frames that are sound but for the lag."""
    return [
        FrameFigures(None, True, 0.0, 1e-3 * lag, 0.0, 0.0, 0.0, 1.0, 1.0, True, 0.0, np.zeros((1, 3)))
        for lag in millimetres
    ]


def broken(motion, figures):
    """Which limits such a clip breaks, whose own frames are all but the first and the last."""
    allowed = limits.late_share(motion)
    share = late(figures, len(figures) - 2)["late_share"]
    found = [*broken_by_frames(figures, 1.15, allowed), *broken_by_share(share, allowed)]
    return [(b.limit, b.frames) for b in found]


def test_one_late_frame_breaks_the_limit_of_a_walk_and_not_that_of_a_run():
    figures = lagging([0, 0, 10.1, *[0] * 48, 0])
    assert broken("walk", figures) == [("skin to surface, max [m]", 1)]
    assert broken("run_02_03", figures) == []
    assert broken("bend_scoop", figures) == []


def test_two_late_frames_in_fifty_break_the_limit_of_a_run():
    figures = lagging([0, 11, 30, *[0] * 48, 0])
    assert late(figures, 50) == {"late_frames": 2, "late_share": 0.04}
    assert broken("run", figures) == [("share of frames with skin to surface over 10 mm", 0)]
    assert broken("bend_scoop", figures) == []


def test_a_lag_that_is_no_number_is_late():
    assert late(lagging([np.nan, 0, 0]), 3)["late_frames"] == 1


def test_the_weight_must_be_borne_on_average():
    """A single frame may be off; a number that is none, and a mean that is off, may not."""
    assert list(broken_by_weight([0.9, 1.1, 1.002, 1.0])) == []
    assert list(broken_by_weight([])) == []
    (off,) = broken_by_weight([1.02] * 30)
    assert off.value == pytest.approx(0.02)
    assert list(broken_by_weight([1.0, np.nan]))


def test_hem_must_move():
    assert list(limits.run_under("hem", 0.009, limits.HEM_TRAVEL))
    assert list(limits.run_under("hem", 0.011, limits.HEM_TRAVEL)) == []


def test_a_case_survives_its_way_through_json():
    case = Case(**{**CASE.__dict__, "settings": (("searches", 3), ("scheme", "contact_coarse"))})
    live = LiveCase("skirt", "walk", "denim", "draft", "http://127.0.0.1:1", 10, 2)
    assert case_of(json.loads(json.dumps(case.plain()))) == case
    assert case_of(json.loads(json.dumps(live.plain()))) == live


def run(out, *options):
    chosen = ["--presets", "draft", "--edges", "0.05", "--fps", "30", "--jobs", "1", "--out", str(out)]
    times = ["--lead", "0.2", "--seconds", "0.1", "--standing", "0.2"]
    return subprocess.run(
        [sys.executable, str(PROOF), *chosen, *times, *options],
        capture_output=True,
        text=True,
        check=False,
        timeout=250,
    )


def test_a_short_case_is_dressed_played_and_judged(tmp_path):
    """A skirt of 5 cm edges, half a second at the least budget: it need not keep the limits of accuracy."""
    done = run(tmp_path, "--garments", "skirt", "--motions", "walk", "--every", "1")
    (path,) = tmp_path.glob("*.json")
    result = json.loads(path.read_text())
    assert result["frames"] == result["frames_asked"] == result["worn_frames"] == 16
    assert result["self_intersecting"] == result["body_intersecting"] == result["inside"] == 0
    assert 0 < result["wire_error"] < limits.WIRE
    assert 0.2 < result["force_over_weight"] < 5
    assert len(result["series"]["retries"]) == 15
    assert 0 < result["pose_error"] < limits.POSE
    assert not {"not a number", "intersections", "no longer worn"} & {b["limit"] for b in result["broken"]}
    assert done.returncode == (1 if result["broken"] else 0)
    assert (tmp_path / "table.md").read_text() in done.stdout


def test_a_case_that_fails_is_named_and_ends_in_the_exit_status(tmp_path):
    done = run(tmp_path, "--garments", str(tmp_path / "nothing.json"), "--motions", "walk")
    assert done.returncode == 1
    assert "nothing walk draft 50 mm cpu: FAILED" in done.stdout


def test_table_says_what_was_broken():
    broken = [*limits.over("stretch, max", [7, 8], [1.3, 1.4], 1.265)]
    result = {
        "case": CASE.plain(),
        "failure": "frame 9 can't be published",
        "broken": [b.plain() for b in broken],
    }
    text = markdown([result], {"commit": "abc"})
    assert "commit: abc" in text
    assert "skirt walk draft 40 mm cpu: FAILED, frame 9 can't be published" in text
    assert "stretch, max: 1.4 (frame 8) against 1.265, in 2 frames, first 7" in text
