"""`python tests/hard_cases`: what it lists, what it writes, and the status it ends with."""

import json
import sys

import pytest
from harness.others import TELLING
from process_pool import Tasks
from sample_runs import result
from scenes import SCENES


def saying(words, status=0, file=None, text="{}"):
    """A command that prints, perhaps writes a file, and ends."""
    write = f"import pathlib; pathlib.Path({str(file)!r}).write_text({text!r});" if file else ""
    return [sys.executable, "-c", f"import sys; {write} print({words!r}); sys.exit({status})"]


def test_tasks_that_write_fail_and_linger(tmp_path):
    (tmp_path / "dies.json").write_text('{"left": "by an earlier run"}')
    told = []
    results = Tasks(tmp_path, 2, longest=8.0).run(
        {
            "lingers": [sys.executable, "-c", "import time; time.sleep(60)"],
            "writes": saying("done", file=tmp_path / "writes.json", text='{"x": 1}'),
            "dies": saying("out of room", status=3),
        },
        lambda name, _result: told.append(name),
    )
    assert list(results) == ["lingers", "writes", "dies"]
    assert results["writes"] == {"x": 1}
    assert results["dies"] == {"failure": "ended with status 3: out of room"}
    assert results["lingers"]["failure"].startswith("ended with status")
    assert sorted(told) == sorted(results)


def test_every_case_is_listed_with_what_it_stresses(command_line, capsys):
    assert command_line.main(["--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [scene.name for scene in SCENES]
    assert all(len(line.split()) > 3 for line in lines)


def test_a_name_that_no_case_has_is_told(command_line, capsys):
    assert command_line.main(["--scenes", "nothing_of_the_kind"]) == 2
    assert "no case is called nothing_of_the_kind" in capsys.readouterr().err


def test_newton_is_asked_for_by_name_where_it_is_not_installed(command_line, capsys, monkeypatch):
    monkeypatch.setattr(command_line.importlib.util, "find_spec", lambda _name: None)
    assert command_line.main(["--solver", "vbd"]) == 2
    assert "pip install '.[peers]'" in capsys.readouterr().err


def test_the_telling_cases_are_listed(command_line, capsys):
    assert command_line.main(["--list", "--telling"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sorted(line.split()[0] for line in lines) == sorted(TELLING)


def test_a_case_runs_in_a_process_of_its_own_and_is_written_down(command_line, tmp_path, capsys):
    chosen = ["--scenes", "unreferenced", "--out", str(tmp_path), "--vertices", "60", "--seconds", "0.1"]
    assert command_line.main(chosen) == 0
    result = json.loads((tmp_path / "unreferenced_vertex.json").read_text())
    assert "is in no triangle" in result["refused"]
    assert "unreferenced_vertex: refused by name" in capsys.readouterr().out
    table = (tmp_path / "table.md").read_text()
    assert "1 of 1 cases hold" in table
    assert "| unreferenced_vertex |" in table


def test_a_broken_limit_ends_in_status_one_with_case_frame_and_figure(command_line, tmp_path, capsys, monkeypatch):
    line = "cloth through cloth: 1 (frame 7) against 0, in 1 frames, first 7"
    found = {"failure": "", "broken": [{"line": line}]}
    monkeypatch.setattr(command_line.Tasks, "run", lambda _self, commands, _told: dict.fromkeys(commands, found))
    assert command_line.main(["--scenes", "needle", "--out", str(tmp_path)]) == 1
    assert "failing: needle" in capsys.readouterr().out
    assert line in (tmp_path / "table.md").read_text()


def test_runs_stand_beside_each_other_with_the_worst_of_each_figure(command_line, tmp_path):
    broken = [{"line": "trembling [m/s]: 0.002 against 0.001, over the run"}]
    far = result("at_10km", trembling=0.1, stated=[{"limit": "trembling [m/s]", "line": "", "reason": "so far"}])
    live = [result("needle", trembling=2e-3, stretch_max=1.21, broken=broken), result("corner", trembling=1e-4), far]
    draft = [result("needle", trembling=3e-4), {"name": "knot", "failure": "ended with status 3", "broken": []}]
    folders = []
    for name, results in (("live, CPU", live), ("draft, GPU", draft)):
        folders.append(tmp_path / name.split(",")[0])
        folders[-1].mkdir()
        run = {"name": name, "about": {"commit": f"of {name}"}, "results": results}
        (folders[-1] / command_line.RUN).write_text(json.dumps(run))
    folders[1] = folders[1] / command_line.RUN  # a folder or the file itself
    page = tmp_path / "page.md"
    assert command_line.main(["--document", str(page), "--of", *map(str, folders)]) == 1
    lines = page.read_text().splitlines()
    assert "- **live, CPU**: 2 of 3 cases hold" in lines
    assert "| needle | what needle stresses | **trembling** | held |" in lines
    assert "| corner | what corner stresses | held | – |" in lines
    assert "| knot |  | – | FAILED |" in lines
    assert "| trembling [mm/s] | 2.00 (needle) | 0.30 (needle) |" in lines
    assert "| stretch over limit, max | 1.100 (needle) | – |" in lines
    assert "  - BROKEN: trembling [m/s]: 0.002 against 0.001, over the run" in lines
    assert "  - FAILED: ended with status 3" in lines


def test_a_document_of_no_run_names_the_folder(command_line, tmp_path, capsys):
    assert command_line.main(["--document", str(tmp_path / "page.md"), "--of", str(tmp_path / "none")]) == 2
    assert f"no run has ended: {tmp_path / 'none'} is not there" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        command_line.main(["--document", str(tmp_path / "page.md")])
