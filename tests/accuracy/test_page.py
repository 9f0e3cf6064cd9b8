"""The page tells what was measured."""

import json
from xml.etree import ElementTree

import pytest
from accuracy_case import AccuracyCase, scenes
from accuracy_data import front, read_results
from accuracy_estimate import asked_table, estimate_table
from accuracy_gaps import not_measured
from accuracy_limits import beyond_ours, within
from accuracy_page import write_page
from accuracy_plots import chain
from accuracy_verdicts import estimate_chapter, order_chapter
from made_up_runs import ABOUT, about, put, put_presets, put_timed, rows, timed_case
from provenance import commit_of, machine_of
from recorded import TwiceError, Writer, read


def test_estimates_are_counted():
    four = rows("draft", (1.0, 1.9), (1.0, 0.4), (0.01, 0.04), (2.0, 2.0))
    assert within(four, 2.0) == 0.75
    assert within(four, 2.0, 0.0) == 0.5
    assert within(four, 4.0) == within(four, 4.0, 0.0) == 1.0


def test_a_front_is_what_nothing_beats():
    points = {"a": (1.0, 9.0), "b": (2.0, 3.0), "slow": (3.0, 3.0), "c": (4.0, 1.0), "blown": (0.5, float("inf"))}
    assert front(points) == ["a", "b", "c"]


def test_the_page_tells_errors_and_that_all_holds(tmp_path, capsys):
    put_presets(tmp_path, ((1.0, 1.2), (0.8, 0.5)), ((0.1, 0.1), (0.2, 0.3)))
    put(
        tmp_path,
        "newton",
        {
            f"Newton {n} x 60": (
                about(newton=n, gradients=60),
                rows(f"Newton {n} x 60", *[(1 / n, 1 / n)] * 2, ms=3.0 * n),
            )
            for n in (1, 2, 4)
        },
    )
    put(
        tmp_path,
        "trial",
        {
            f"PD alone, {n} cycles": (
                about("trial", cycles=n),
                rows(f"PD alone, {n} cycles", (2.0, 0), (2.0, 0), crossed=n),
            )
            for n in (4, 32)
        },
    )
    put(
        tmp_path,
        "baselines",
        {"XPBD, 5 iterations": (about("xpbd", iterations=5), rows("XPBD, 5 iterations", (4.0, 0), (4.0, 0), ms=80.0))},
    )
    timed = {
        "cloth_vertices": 2500,
        "ms": [40.0, 50.0],
        "ms_correction": 30.0,
        "ms_check": 1.0,
        "ms_estimate": 2.0,
        "pairs": 9,
    }
    large = AccuracyCase("skirt", "walk", 1 / 60, vertices=2500, held_out=True)
    put(
        tmp_path,
        "times",
        {
            "draft": (about(), [{"method": "draft", **timed}]),
            "live": (about(), [{"method": "live", **{**timed, "ms": [120.0, 140.0]}}]),
        },
        case=large,
    )
    put(tmp_path, "trajectory", {"draft": (about(), [{"state": 6, "method": "draft", "error": 7.5, "crossed": 0}])})
    for at, value in ((10.0, 52.0), (5.0, 50.0)):
        figures = {"measure": "drape coefficient", "unit": "%", "varied": "edge [mm]", "exact": None, "vertices": 9}
        Writer(tmp_path / f"tailor-{at:g}.jsonl", {"about": ABOUT, "tailor": f"{at:g}"}).add(
            [{**figures, "at": at, "value": value}]
        )
    page = tmp_path / "page.md"
    assert write_page(page, tmp_path) == 0
    assert capsys.readouterr().out == "What was measured holds.\n"
    said = page.read_text()
    for line in (
        "| skirt, walk, 1/60 s (held out) | draft | 2 of 20 | 0.9 / 0.98 / 1 |",
        "| draft | live | 1 | x2 | x2.9 | /6 | 0 | - | - | - |",
        "| Newton 1 x 60 | Newton 2 x 60 | 1 | x2 | - | /2 | 0 | - | - | - |",
        "| skirt, walk, 1/60 s | 60 % | 5 % | 10 | 0.15 | 0 of 2 | 5 | 2 | 2 of 2 |",
        "| skirt, walk, 1/60 s | XPBD: XPBD, 5 iterations | 2 | 80 | 4 | 0 of 2 | 0.001 | 3 | yes |",
        "| skirt, walk, 1/60 s | draft | 7.5 | - |",
        "| 10 | 9 | 52 | - | +4.0 % |",
    ):
        assert line in said, line
    plots = [line for line in said.splitlines() if line.startswith(("![", "## "))]
    convergence = plots.index("## Convergence, drawn")
    assert [line.partition(":")[0] for line in plots[convergence - 2 : convergence + 3]] == [
        "![Error of a step against its time",
        "![Error of a step at 600 vertices against its time at a garment's scale",
        "## Convergence, drawn",
        "![Convergence by iterations",
        "![Convergence by time",
    ]
    drawn = sorted(path.name.split("-skirt")[0] for path in (tmp_path / "page").glob("*.svg"))
    assert drawn == ["by-iterations", "by-time", "pareto", "scale-cpu.svg"]
    for path in (tmp_path / "page").glob("*.svg"):
        assert ElementTree.fromstring(path.read_text()).tag.endswith("svg")
        assert f"page/{path.name}" in said
    (measured,) = read_results(tmp_path).errors
    assert chain(measured, "ours", "newton", {"gradients": 60}) == [f"Newton {n} x 60" for n in (1, 2, 4)]


def test_the_page_opens_with_a_row_for_each_promise_and_plots_are_before_the_tables(tmp_path):
    put_presets(tmp_path, ((1.0, 1.2), (0.8, 0.5)), ((0.1, 0.1), (0.2, 0.9)))
    put(tmp_path, "trial", {"PD alone, 1": (about("trial", cycles=1), rows("PD alone, 1", (2.0, 0), (2.0, 0)))})
    write_page(tmp_path / "page.md", tmp_path)
    title, _, head, _, *lines = (tmp_path / "page.md").read_text().splitlines()
    assert (title, head) == ("# What accuracy costs in time", "| promise | measured | holds |")
    opening = lines[: lines.index("")]
    assert [row.split(" | ")[-1].strip("| ") for row in opening] == ["no", "no", "yes", "yes", "yes", "not measured"]
    assert opening[0].split(" | ")[1] == "75.0 % (75.0) of 4 at `draft` and `live`"
    chapters = [line for line in lines if line.startswith(("## ", "![Error"))]
    assert chapters[:3] == ["## What does not hold", "## Not measured", "## Error against time, drawn"]
    assert chapters[3].startswith("![Error of a step against its time: skirt, walk")
    assert "one exponent of the estimate" in " ".join(lines[len(opening) : lines.index("## What does not hold")])


def test_states_without_a_step_of_the_reference_are_told(tmp_path):
    """Numbered from 1 on."""
    case = AccuracyCase("skirt", "walk", 1 / 60, held_out=True, states=5)
    kept = [row for row in rows("draft", *[(1.0, 1.0)] * 5) if row["state"] in (1, 3)]
    put(tmp_path, "presets", {"draft": (about(), kept)}, case=case)
    write_page(tmp_path / "page.md", tmp_path)
    said = (tmp_path / "page.md").read_text()
    assert "| skirt, walk, 1/60 s (held out) | draft | 2 of 5 |" in said
    assert (
        "- Left out are these states, of 5 in all:\n  - skirt, walk, 1/60 s, 3 of 5: 2, 4 to 5 (at its end)\n" in said
    )


@pytest.mark.parametrize(("error", "named"), [(4.9, True), (5.1, False)])
def test_steps_further_off_than_is_judged_are_not_compared(tmp_path, error, named):
    put_presets(tmp_path, ((6.0, 6.0), (6.0, 6.0)), ((5.5, 5.5), (5.5, 5.5)))
    put(tmp_path, "peers", {"VBD": (about("vbd", iterations=5), rows("VBD", (error, 0), (error, 0), ms=1.0))})
    (measured,) = read_results(tmp_path).errors
    assert bool(beyond_ours(measured)) == named


def test_errors_that_nobody_asks_to_be_smaller_are_alike(tmp_path):
    """Newton in float64 is always nearer to Newton in float64."""
    put_presets(tmp_path, ((0.3, 0.3), (0.3, 0.3)), ((0.04, 0.04), (0.04, 0.04)))
    exact = {"Newton IPC": (about("newton_ipc", tolerance=1e-6), rows("Newton IPC", (1e-6, 0), (1e-6, 0), ms=20.0))}
    put(tmp_path, "baselines", exact)
    (measured,) = read_results(tmp_path).errors
    assert beyond_ours(measured) == []


def test_a_step_in_another_fold_is_told_by_its_own_balance(tmp_path):
    put_presets(tmp_path, ((1.0, 1.0), (1.0, 1.0)), ((0.9, 0.1), (0.2, 0.2)))
    (path,) = tmp_path.glob("*presets-cpu.jsonl")
    path.write_text(path.read_text().replace('"estimate": 0.1,', '"estimate": 0.1, "own_balance": 0.08,'))
    write_page(tmp_path / "page.md", tmp_path)
    said = (tmp_path / "page.md").read_text()
    assert "Held out, of the balance that Newton finds from where the step ended: within x2 for 100.0 %" in said
    assert "| skirt, walk, 1/60 s | live | 0 | 0.9 | 2.7 | 0.08 | 0.1 | 0.111 | 4 |" in said


def test_a_case_with_more_states_speaks_for_its_presets_and_the_settings_of_all_are_on_a_page_beside(tmp_path):
    put_presets(tmp_path, ((1.0, 1.2), (0.8, 0.5)), ((0.1, 0.1), (0.2, 0.3)))
    few = AccuracyCase("skirt", "walk", 1 / 60, held_out=True, states=2)
    put_presets(tmp_path, ((7.0, 7.0), (7.0, 7.0)), ((8.0, 8.0), (8.0, 8.0)), case=few)
    newton = {"Newton 1 x 60": (about(newton=1, gradients=60), rows("Newton 1 x 60", (3.0, 3.0), (3.0, 3.0)))}
    put(tmp_path, "newton", newton, case=few)
    found = read_results(tmp_path)
    assert [measured.case.states for measured in found.presets] == [AccuracyCase("skirt", "walk", 1 / 60).states]
    assert order_chapter(found).verdicts[0].holds == "yes"
    write_page(tmp_path / "page.md", tmp_path)
    assert "Newton 1 x 60" in (tmp_path / "page" / "settings.md").read_text()
    assert "(../page.md)" in (tmp_path / "page" / "settings.md").read_text()
    assert "(page/settings.md)" in (tmp_path / "page.md").read_text()


def test_what_has_no_figure_is_listed_and_what_has_one_is_not(tmp_path):
    put_presets(tmp_path, [(1.0, 1.0)], [(0.5, 0.5)])
    trial = {"PD alone, 1": (about("trial", cycles=1), rows("PD alone, 1", (2.0, 0)))}
    put(tmp_path, "trial", trial)
    said = not_measured(read_results(tmp_path), [])
    assert said[0].startswith("Errors of single steps on a GPU")
    others = "accuracy, deadline, newton, cycles, others, precision, baselines, inertia, peers, trajectory"
    assert said[1] == f"In steps of 1/60 s, as `--families` names it: {others}, of all scenes."
    assert "In steps as short as their own: `reference` (1/120 s); they take the others' here." in said
    put(tmp_path, "peers", {"VBD": (about("vbd", iterations=5), rows("VBD", (1.0, 0)))})
    layered = AccuracyCase("layered_skirt", "walk", 1 / 60)
    put(tmp_path, "trial", trial, case=layered, device="cuda:0")
    said = not_measured(read_results(tmp_path), [])
    assert not any(line.startswith("Errors of single steps") for line in said)
    (lacking,) = [line for line in said if "(presets, trial)" in line]
    assert "; skirt, walk" not in lacking, "it has all that any has"
    assert "; layered skirt, walk (presets, trial); " in lacking, "and no peers"
    assert said[0] == "On a GPU, of single steps: presets, peers: all of these are of the CPU."
    put(tmp_path, "presets", {"draft": (about(), rows("draft", (1.0, 1.0)))}, case=layered, device="cuda:0")
    put(tmp_path, "presets", {"draft": (about(), rows("draft", (1.0, 1.0)))}, case=layered)
    assert not_measured(read_results(tmp_path), [])[:2] == [
        "On a GPU, of single steps: presets in 1 of 2 scenes (as `--families` names them).",
        "On a GPU, of single steps: peers: all of these are of the CPU.",
    ]
    peers = [line for line in said if line.startswith("Newton's")]
    assert [line.partition("layer is sewn")[0] for line in peers] == [
        "Newton's VBD and Style3D of the layered skirt: its ",
        "Newton's VBD and Style3D on a GPU, for which they are made.",
    ]


def test_scenes_that_lack_a_family_are_told_and_those_that_have_all_are_not(tmp_path):
    for case in scenes(1 / 60):
        put_presets(tmp_path, [(1.0, 1.0)], [(0.5, 0.5)], case=case)
        if case.garment != "trousers":
            put(tmp_path, "newton", {"Newton 1 x 60": (about(newton=1), rows("Newton 1 x 60", (1.0, 0)))}, case=case)
    said = [line for line in not_measured(read_results(tmp_path), []) if "as `--families`" in line]
    assert said[1:] == ["In steps of 1/60 s, as `--families` names it: trousers, jumping jack (newton)."]


def test_each_figure_has_its_commit_and_machine(tmp_path):
    put_presets(tmp_path, [(1.0, 1.0)], [(0.5, 0.5)])
    put(tmp_path, "peers", {"VBD": (about("vbd", iterations=5), rows("VBD", (0.4, 0), ms=1.0))})
    (path,) = tmp_path.glob("*peers-cpu.jsonl")
    path.write_text(path.read_text().replace('"machine": "none"', '"machine": "another"'))
    Writer(tmp_path / "tailor-one.jsonl", {"about": ABOUT, "tailor": "hem-one"})
    put_timed(tmp_path, timed_case(11.0, late=3), timed_case(None, late=0), commit="abc")
    write_page(tmp_path / "page.md", tmp_path)
    said = (tmp_path / "page.md").read_text()
    assert (
        "| case | of it | commit | machine |\n|---|---|---|---|\n"
        "| a tailor's measures | hem-one | none | none |\n"
        "| deadlines: tshirt, cart wheel, 20044 vertices, CPU | 11 ms, without one | abc | none |\n"
        "| skirt, walk, 1/60 s, 600 vertices, 20 states | peers | none | another |\n"
        "| skirt, walk, 1/60 s, 600 vertices, 20 states | presets | none | none |\n"
    ) in said
    assert "| draft | 5: 1* | 60 % |" in said
    assert "*: timed in another run than theirs, and times of two runs may not compare.\n" in said


def test_what_was_had_is_told_beside_what_was_asked_for(tmp_path):
    live = rows("to 1 mm", (1.9, 1.0), (0.6, 1.0), (0.1, 1.0), (3.0, 1.0), ms=7.0)
    methods = {"to 1 mm": (about(accuracy=1.0), live)}
    put(tmp_path, "accuracy", methods)
    assert asked_table(read_results(tmp_path))[2:] == ["| live | 1 | 4 | 1.25 | 2.67 | 50 % | 25 % | 7 |"]
    (dial,) = [line for line in estimate_chapter(read_results(tmp_path)).told if "asked for;" in line]
    assert dial.startswith("- At `live` 2 of 4 dialled steps")
    assert dial.endswith("1 are further off, the rest nearer.")


def test_estimates_are_told_of_each_preset_and_length_of_step(tmp_path):
    put_presets(tmp_path, [(1.0, 1.5), (1.0, 3.0), (1.0, 0.1), (1.0, 9.0)], [(0.01, 0.002)] * 4)
    write_page(tmp_path / "page.md", tmp_path)
    lines = (tmp_path / "page.md").read_text().partition("## The estimate")[2].splitlines()
    assert "| held out | 1/60 s | draft | 4 | 25 % (25) | 50 % (50) | 1 |" in lines
    assert "| held out | 1/60 s | live | 4 | 100 % (0) | 100 % (0) | 0 |" in lines


def test_a_solver_that_stepped_from_few_states_is_compared_with_ours_from_these_and_leaves_ours_all(tmp_path):
    put(
        tmp_path,
        "newton",
        {"Newton 2 x 60": (about(newton=2), rows("Newton 2 x 60", (9.0, 1.0), (1.0, 1.0), (0.5, 1.0), ms=10.0))},
    )
    slow = [row for row in rows("slow", (0.0, 1.0), (2.0, 1.0), ms=20.0) if row["state"] == 1]
    put(tmp_path, "peers", {"slow": (about("vbd", iterations=9), slow)})
    (measured,) = read_results(tmp_path).errors
    assert measured.point("Newton 2 x 60") == (10.0, 1.0)
    assert measured.point("slow", measured.states("slow")) == (20.0, 2.0)
    assert not beyond_ours(measured)


def test_dialled_steps_are_judged_apart_by_the_preset_that_they_began_with(tmp_path):
    """Within x2 is a step that counts as negligible, too, and in brackets it is not."""
    live = rows("to 1 mm", (1.0, 1.0), (1.0, 1.9), (1.0, 3.0), (0.04, 0.009))
    draft = rows("draft to 1 mm", *[(1.0, 1.0)] * 4)
    methods = {
        "to 1 mm": (about(accuracy=1.0), live),
        "draft to 1 mm": (about(accuracy=1.0, from_draft=1), draft),
    }
    put(tmp_path, "accuracy", methods)
    told = estimate_table(read_results(tmp_path))
    assert [line.split(" | ")[2:6] for line in told if "dialled at" in line] == [
        ["dialled at `live`", "4", "75 % (50)", "100 % (75)"],
        ["dialled at `draft`", "4", "100 % (100)", "100 % (100)"],
    ]
    put(tmp_path, "deadline", {"in 30 ms": (about(deadline=30.0), rows("in 30 ms", (1.0, 1.35)))})
    told = estimate_table(read_results(tmp_path))
    assert [line.split(" | ")[2:5] for line in told if "deadline" in line] == [
        ["under a deadline at `live`", "1", "100 % (100)"]
    ]


def test_ways_of_one_scene_are_told_once_by_the_case_with_more_states(tmp_path):
    for states, error in ((20, 7.5), (50, 2.5), (30, 9.5)):
        case = AccuracyCase("skirt", "walk", 1 / 60, states=states)
        put(tmp_path, "trajectory", {"draft": (about(), rows("draft", *[(error, error)] * 7))}, case=case)
    (measured,) = read_results(tmp_path).trajectories
    assert measured.rows["draft"][6]["error"] == 2.5


def test_where_no_repository_is_who_runs_it_tells_the_commit_and_what_else_the_machine_did(tmp_path, monkeypatch):
    assert commit_of(tmp_path) == "unknown"
    assert machine_of("cpu").endswith(" processors, device cpu")
    monkeypatch.setenv("MEASURED_COMMIT", "abc")
    monkeypatch.setenv("MEASURED_BESIDE", "two others")
    assert commit_of(tmp_path) == "abc"
    assert machine_of("cpu").endswith(" processors, device cpu, two others")


def test_a_file_has_one_writer_and_each_row_once(tmp_path):
    path = tmp_path / "rows.jsonl"
    writer = Writer(path, {"about": ABOUT})
    with pytest.raises(TwiceError, match="is being written by another process"):
        Writer(path, {"about": ABOUT})
    writer.add(rows("draft", (1.0, 1.0), (2.0, 2.0)))
    del writer
    assert len(Writer(path, {"about": ABOUT}).rows) == 2
    with path.open("a") as out:  # as another process would have
        out.write(json.dumps(rows("draft", (1.5, 1.5))[0]) + "\n")
    with pytest.raises(TwiceError, match="has 1 rows twice, the first 'draft' of state 0: measure it anew"):
        read(path)
