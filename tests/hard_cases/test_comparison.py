"""The telling cases by several solvers: the file that is kept, and the page's part that is made of it."""

import json
from pathlib import Path

from harness import comparison
from sample_runs import kept, result

HERE = Path(__file__).resolve().parent

ABOUT = {"settings": "preset live, 2.5 s a case", "machine": "a small one", "commit": "abc"}


def ended(folder, solver, results):
    run = {"name": solver, "solver": solver, "about": ABOUT, "results": results}
    folder.mkdir(exist_ok=True)
    (folder / "run.json").write_text(json.dumps(run))
    return folder


def two_runs(tmp_path):
    mine = kept(tmp_path / "ours", [0.09] * 7)
    theirs = kept(tmp_path / "vbd", [0.0] * 7)
    ended(mine, "ours", [result("needle", trembling=2e-4, cpu_ms=30.0, stretch_max=1.1), result("jump", cpu_ms=3.0)])
    off = result("jump", unclean=5, cpu_ms=1.0, worn=False, broken=[{"line": "no longer worn"}])
    unlike = {"name": "corner", "failure": "not expressible: it has springs", "broken": []}
    ended(theirs, "vbd", [result("needle", unclean=4, trembling=1e-4, cpu_ms=90.0, stretch_max=1.32), off, unlike])
    return mine, theirs


def test_figures_are_kept_and_pictures_drawn(command_line, tmp_path):
    folders = [str(folder) for folder in two_runs(tmp_path)]
    assert command_line.main(["--compare", str(tmp_path / "hard"), "--of", *folders]) == 0
    found = json.loads((tmp_path / "hard" / "peers.json").read_text())
    assert [run["solver"] for run in found["runs"]] == ["ours", "vbd"]
    assert found["runs"][1]["results"][0]["unclean"] == 4
    (shown,) = found["pictures"]
    assert shown["case"] == "needle"
    assert shown["crossed"]["ours"] == 0 < shown["crossed"]["vbd"]
    assert sorted(p.name for p in (tmp_path / "hard").glob("*.png")) == ["needle-ours.png", "needle-vbd.png"]


def test_the_page_shows_them_beside_each_other_and_the_least_bold(command_line, tmp_path):
    mine, theirs = two_runs(tmp_path)
    command_line.main(["--compare", str(tmp_path / "hard"), "--of", str(mine), str(theirs)])
    page = tmp_path / "page.md"
    asked = ["--document", str(page), "--of", str(mine), "--beside", str(tmp_path / "hard" / "peers.json")]
    assert command_line.main(asked) == 0
    lines = page.read_text().splitlines()
    assert "## Beside other solvers" in lines
    assert any(line.startswith("- **Newton's VBD**: ") and line.endswith("; a small one; commit abc") for line in lines)
    assert "| case | ours | Newton's VBD |" in lines
    assert "| jump | **0** | 1 (came off) |" in lines  # limits broken
    assert "| needle | **0** | 80 |" in lines  # of 5 that were asked
    assert "| needle | **1.00** | 1.20 |" in lines
    assert "| needle | 0.20 | **0.10** |" in lines
    assert "| needle | **30** | 90 |" in lines
    assert "| jump | **3** | 1 (came off) |" in lines
    row = next(line for line in lines if "needle-vbd.png" in line)
    assert "](hard/needle-ours.png)" in row
    assert any("nothing crosses" in line and "triangles cross" in line for line in lines)
    assert lines.index("## Beside other solvers") < lines.index("## Figures: ours")


def test_what_is_not_expressible_is_said():
    assert comparison.cell({"failure": "not expressible: x"}, lambda _r: 1.0, "{:.0f}") == "not expressible"
    assert comparison.cell({"failure": "frame 3: not a number"}, lambda _r: 1.0, "{:.0f}") == "FAILED"
    assert comparison.cell({}, lambda _r: None, "{:.0f}") == "–"


def test_each_solver_of_the_command_line_has_a_title_and_says_how_it_plays():
    source = (HERE / "__main__.py").read_text()
    assert '"ours", "xpbd", "chebyshev", "vbd", "style3d"' in source
    assert list(comparison.TITLES) == list(comparison.MEANS) == ["ours", "xpbd", "chebyshev", "vbd", "style3d"]
