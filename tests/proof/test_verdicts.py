"""Broken limits are found, named and end in the exit status; a case that fails says why."""

import json
import subprocess
import sys
from pathlib import Path

import limits
import numpy as np
from case import Case, LiveCase, case_of
from table import markdown

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
