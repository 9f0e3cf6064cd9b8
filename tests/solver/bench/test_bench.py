"""The bench says what it measured, and what it could not."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "solver" / "bench"))

from together import Company  # noqa: E402


def bench(out, *options):
    command = [sys.executable, str(ROOT / "solver" / "bench"), "--out", str(out), "--seconds", "0.2", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=280)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A coarse T-shirt, every second frame of six judged; and what there is of it."""
    out = tmp_path_factory.mktemp("bench")
    ran = bench(out, "--vertices", "150", "--every", "2")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return json.loads((out / "results.json").read_text()), (out / "table.md").read_text()


def test_a_case_is_measured_frame_by_frame(measured):
    (result,) = measured[0]["results"]
    assert result["frames"] == 6
    assert result["cloth_vertices"] == pytest.approx(150, rel=0.2)
    assert sum(result["substeps"].values()) == 6
    assert (result["asked"], result["unclean"]) == (3, 0)
    ms = result["frame_ms"]
    assert 0 < ms["p50"] <= ms["p99"] <= ms["max"]
    stages = result["stages_ms"]
    assert {"move_body", "correct_penetration", "verify_commit"} < set(stages)
    # verbs are all that a frame does but for reading the report
    assert 0.5 * ms["p50"] < sum(times["p50"] for times in stages.values()) < 1.5 * ms["max"]
    assert result["steps"] == 1
    assert result["newton"]["p50"] > 0
    assert result["pairs"]["p50"] > 0
    assert 0 <= result["behind"] <= 6
    assert set(result["growth_mib"]) == set(result["growth_late_mib"]) == {"process"}
    assert set(result["growth_most_mib"]) == {"process"}
    assert result["waits"] is None  # a processor waits for nobody


def test_the_table_has_the_case_and_its_stages(measured):
    results, table = measured
    assert f"| {results['results'][0]['name']} |" in table
    assert "0 of 3" in table
    assert "| correct_penetration |" in table
    assert " at most, " in table  # of the process's growth


@pytest.mark.long
def test_sessions_at_once_are_measured_together(tmp_path):
    """Each begins when both are warm, and goes on until both are measured."""
    ran = bench(tmp_path, "--vertices", "150", "--every", "3", "--sessions", "2")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    (result,) = json.loads((tmp_path / "results.json").read_text())["results"]
    own = [json.loads((tmp_path / f"{result['name']}.{k}.json").read_text()) for k in range(2)]
    assert result["name"].endswith("-x2")
    assert [one["frames"] for one in own] == [6, 6]
    assert (result["frames"], result["asked"], result["unclean"]) == (12, 4, 0)
    assert result["frame_ms"]["max"] == max(one["frame_ms"]["max"] for one in own)
    assert result["slowest_p50_ms"] == max(one["frame_ms"]["p50"] for one in own)
    assert set(result["growth_mib"]) == {"process"}


@pytest.mark.long
def test_a_case_that_takes_longer_than_it_may_is_told_of_by_the_frames_that_it_has(tmp_path):
    ran = bench(tmp_path, "--vertices", "150", "--every", "1", "--longest", "1e-6")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    (result,) = json.loads((tmp_path / "results.json").read_text())["results"]
    assert (result["frames"], result["asked"]) == (1, 1)


def test_a_session_that_fails_keeps_nobody_waiting(tmp_path):
    company = [Company(tmp_path, 2, k) for k in range(2)]
    with pytest.raises(ZeroDivisionError), company[0].kept():
        raise ZeroDivisionError
    with pytest.raises(RuntimeError, match="another session"):
        company[1].meet("warm")


def test_a_case_that_fails_is_said_to_have_failed(tmp_path):
    ran = bench(tmp_path, "--vertices", "8")
    assert ran.returncode == 1
    assert "FAILED: ended with status 1" in ran.stdout
    assert "Use a smaller edge length, or more vertices" in (tmp_path / "table.md").read_text()


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--vertices", "-5", "must be 1 or more"),
        ("--sessions", "0", "must be 1 or more"),
        ("--every", "-1", "must be 1 or more"),
        ("--fps", "0", "must be above 0"),
        ("--seconds", "inf", "must be finite"),
        ("--longest", "nan", "must be above 0"),
        ("--accuracies", "nan", "must be above 0"),
        ("--deadlines", "inf", "must be finite"),
        ("--garments", "toga", "none of the demo's patterns: dress"),
        ("--seconds", "0.001", "less than a frame"),
        ("--device", "cuda:99", "there is cpu"),
        ("--motions", "nosuch", "jumping_jack"),
    ],
)
def test_an_option_that_can_not_be_is_refused_by_name(command_line, capsys, tmp_path, option, value, said):
    with pytest.raises(SystemExit) as ended:
        command_line.main(["--out", str(tmp_path), "--seconds", "0.2", option, value])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert option in error
    assert said in error


def test_a_process_that_refuses_an_option_ends_with_that_status(tmp_path):
    ran = bench(tmp_path, "--vertices", "-5")
    assert ran.returncode == 2
    assert "--vertices" in ran.stderr
    assert "must be 1 or more" in ran.stderr
    assert "Traceback" not in ran.stderr


def test_a_file_that_no_run_left_is_refused_by_name(command_line, capsys, tmp_path):
    for written in ("# a table", "[1]", "{}"):
        (tmp_path / "other.json").write_text(written)
        page, other = str(tmp_path / "page.md"), str(tmp_path / "other.json")
        assert command_line.main(["--out", str(tmp_path), "--document", page, "--of", other]) == 2
        assert "other.json is no run's results.json" in capsys.readouterr().err
    assert not (tmp_path / "page.md").exists()


@pytest.mark.long
def test_a_start_is_timed_without_and_with_kernels_in_the_cache(tmp_path):
    ran = bench(tmp_path, "--start", "--vertices", "150", "--every", "0")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    cold, warm = json.loads((tmp_path / "results.json").read_text())["starts"]
    assert (cold["kernels"], warm["kernels"]) == ("compiled", "from the cache")
    for start in (cold, warm):
        assert 0 < start["imported_s"] < start["worn_s"] < start["first_frame_s"]
    assert "## Starts" in (tmp_path / "table.md").read_text()
