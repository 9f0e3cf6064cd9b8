"""The page of several runs, and its plots, of made-up results."""

import math
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "solver" / "bench"), str(Path(__file__).parent)]

import svg  # noqa: E402
from made_up import kept, worn  # noqa: E402
from plots import plots  # noqa: E402

SVG = "{http://www.w3.org/2000/svg}"


def words_for(tmp_path, *places):
    """On the command line."""
    return ["--document", str(tmp_path / "bench.md"), "--of", *map(str, places)]


def shapes(chart, tag, kind=""):
    """Attributes of the file's elements of a tag whose class has that word."""
    found = [e.attrib for e in ElementTree.fromstring(chart).iter(SVG + tag)]
    return [a for a in found if kind in a.get("class", "").split() or not kind]


def words_of(chart):
    return [e.text for e in ElementTree.fromstring(chart).iter(SVG + "text")]


def test_runs_stand_side_by_side_with_their_plots(tmp_path):
    small = kept(tmp_path / "cpu" / "results.json", worn(2500, 90.0), worn(2500, 40.0, "draft"))
    large = kept(tmp_path / "h200.json", worn(10000, 3.0), worn(20000, 4.0), worn(10000, 12.0, sessions=8))
    command = [sys.executable, str(ROOT / "solver" / "bench"), *words_for(tmp_path, small.parent, large)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr
    page = (tmp_path / "bench.md").read_text()
    assert page.index("- **cpu**") < page.index("- **h200**")
    assert "## Figures: h200" in page
    assert "| tshirt-walk-20000-live-cuda0 | 20000 | 4.0 / 8.0 / 12.0 |" in page
    assert "| correct_penetration | 54.00 | 108.00 |" in page
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", page)
    names = ["vertices-tshirt-walk.svg", "sessions.svg", "stages-cpu.svg", "stages-h200.svg"]
    assert pictures == [f"bench/{name}" for name in names]
    for picture in pictures:
        ElementTree.parse(tmp_path / picture)


def test_plots_of_an_earlier_page_are_gone(command_line, tmp_path):
    run = kept(tmp_path / "run.json", worn(2500, 90.0))
    old = tmp_path / "bench" / "vertices-crown-walk.svg"
    old.parent.mkdir()
    old.write_text("<svg/>")
    assert command_line.main(words_for(tmp_path, run)) == 0
    assert not old.exists()


def test_a_failed_case_is_told_and_drawn_nowhere(command_line, tmp_path):
    failed = {"name": "crown-walk-150-draft-cpu", "failure": "ended with status 1: no crown"}
    run = kept(tmp_path / "run.json", worn(2500, 90.0), failed)
    assert command_line.main(words_for(tmp_path, run)) == 1
    page = (tmp_path / "bench.md").read_text()
    assert "FAILED: ended with status 1: no crown" in page
    assert "crown" not in (tmp_path / "bench" / "stages-run.svg").read_text()


@pytest.mark.parametrize(("names", "said"), [(("none.json",), "none.json is not there"), (("a/x", "b/x"), "called x")])
def test_runs_that_are_not_there_or_not_told_apart_are_refused(command_line, capsys, tmp_path, names, said):
    for folder in ("a/x", "b/x"):
        kept(tmp_path / folder / "results.json", worn(2500, 90.0))
    assert command_line.main(words_for(tmp_path, *(tmp_path / name for name in names))) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "bench.md").exists()


def test_a_page_of_nothing_is_no_command(command_line, capsys, tmp_path):
    with pytest.raises(SystemExit) as ended:
        command_line.main(["--document", str(tmp_path / "bench.md")])
    assert ended.value.code == 2
    assert "--of PLACE" in capsys.readouterr().err


def test_lines_are_by_preset_and_run_with_the_headset_across():
    fast = [worn(10000, 3.0), worn(20000, 6.0), worn(40000, 12.0), worn(10000, 1.0, "draft")]
    runs = [{"name": "h200", "results": fast}, {"name": "cpu", "results": [worn(2500, 90.0), worn(5000, 200.0)]}]
    _, chart = plots(runs)["vertices-tshirt-walk.svg"]
    words = words_of(chart)
    assert [w for w in words if "p50" in w or "p99" in w] == [
        "live, h200: p50",
        "live, h200: p99",
        "live, cpu: p50",
        "live, cpu: p99",
    ]
    assert "a frame of a headset, 11.1 ms" in words
    (across,) = shapes(chart, "line", "mark")
    medians = [a for a in shapes(chart, "polyline", "line") if "dashed" not in a["class"]]
    places = [tuple(map(float, p.split(","))) for p in medians[0]["points"].split()]
    # twice the time at twice the vertices: equal distances on both axes
    assert places[1][0] - places[0][0] == pytest.approx(places[2][0] - places[1][0], abs=0.2)
    assert places[1][1] - places[0][1] == pytest.approx(places[2][1] - places[1][1], abs=0.2)
    # 12 ms is above the headset's frame, 6 ms below
    assert places[2][1] < float(across["y1"]) < places[1][1]


def test_sessions_make_a_line_where_there_are_several():
    results = [worn(10000, 3.0), worn(10000, 5.0, sessions=8), worn(20000, 9.0)]
    _, chart = plots([{"name": "h200", "results": results}])["sessions.svg"]
    assert len(shapes(chart, "polyline", "line")) == 2
    assert "tshirt walk 10000 live, h200: p50" in words_of(chart)
    assert "sessions.svg" not in plots([{"name": "h200", "results": results[::2]}])


def test_bars_are_the_whole_frame_with_the_body_apart():
    _, chart = plots([{"name": "h200", "results": [worn(10000, 10.0)]}])["stages-h200.svg"]
    parts = shapes(chart, "rect", "part")
    wide = [float(p["width"]) for p in parts]
    correction, rest, body = wide
    assert correction == pytest.approx(6 * body, rel=0.01)
    assert rest == pytest.approx(3 * body, rel=0.01)
    assert parts[2]["y"] != parts[0]["y"] == parts[1]["y"]
    assert parts[2]["x"] == parts[0]["x"]
    assert {"9.0 ms", "1.0 ms"} < set(words_of(chart))


def test_there_are_colours_for_a_light_and_for_a_dark_page():
    chart = svg.line_chart("t", "x", "y", [svg.Line("a", [(1.0, 1.0)], 0)])
    light, dark = (ElementTree.fromstring(chart).find(SVG + "style").text).split("@media(prefers-color-scheme:dark)")
    for coloured in (light, dark):
        ground, words = (re.search(rf"{of}{{fill:(#\w+)}}", coloured)[1] for of in (r"\.ground", "text"))
        assert contrast(ground, words) > 7
        lines = re.findall(r"\.s\d{stroke:(#\w+)}", coloured)
        assert len(lines) == len(svg.LIGHT)
        assert min(contrast(ground, line) for line in lines) > 1.9


def contrast(a, b):
    """Of two colours, from 1 to 21 (WCAG 2.1)."""

    def luminance(colour):
        parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize(
    ("values", "ticks"),
    [
        ([2500, 20000], [2000, 5000, 10000, 20000]),
        ([2400], [2000, 5000]),
        ([5], [5, 10]),
        ([0.03, 0.4], [0.02, 0.05, 0.1, 0.2, 0.5]),
    ],
)
def test_ticks_enclose_what_is_drawn(values, ticks):
    assert svg.log_ticks(values) == pytest.approx(ticks)


@pytest.mark.parametrize("value", [0.0, math.inf])
def test_what_no_logarithmic_axis_can_show_is_refused(value):
    with pytest.raises(ValueError, match="finite values above 0"):
        svg.log_ticks([1.0, value])
