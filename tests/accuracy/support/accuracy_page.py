"""The page: what accuracy costs in time. Everything in it is made of the files of lines."""

from __future__ import annotations

from pathlib import Path

from accuracy_data import Found, Measured, read_results, table
from accuracy_deadlines import HELD, STRETCHED, Timed, deadline_chapter, deadline_table, read_timed
from accuracy_estimate import asked_table, estimate_lines, estimate_table
from accuracy_gaps import not_measured
from accuracy_limits import AGREEMENT, JUDGED, NEGLIGIBLE
from accuracy_plots import plots
from accuracy_promises import Chapter, broken_lines, missed, promise_table
from accuracy_tables import (
    BY_BUDGET,
    front_table,
    guarantee_table,
    left_out_lines,
    others_table,
    preset_table,
    price_table,
    scale_table,
    sweep_table,
    tailor_tables,
    trajectory_table,
)
from accuracy_verdicts import error_chapters

PARETO = ("pareto", "scale")  # with what the names of such plots' files begin; the others are of convergence


def write_page(page: Path, folder: Path) -> int:
    """Write the page of a folder of files of lines, and its plots into a folder named as the page; 1 where something
    does not hold."""
    found, timed = read_results(folder), read_timed(folder)
    drawn = plots(found)
    beside = page.parent / page.stem
    beside.mkdir(parents=True, exist_ok=True)
    for old in beside.glob("*.svg"):
        old.unlink()
    for name, (_, svg) in drawn.items():
        (beside / name).write_text(svg)
    chapters = error_chapters(found)
    if timed:
        chapters.insert(-1, deadline_chapter(timed))
    titles = {name: title for name, (title, _) in drawn.items()}
    page.write_text(markdown(found, timed, chapters, titles, page.stem))
    (beside / "settings.md").write_text(every_setting(found, page.name))
    broken = missed(chapters)
    print("\n".join(broken or ["What was measured holds."]))
    return 1 if broken else 0


def markdown(found: Found, timed: list[Timed], chapters: list[Chapter], drawn: dict[str, str], beside: str) -> str:
    """The page: what is promised in `chapters`, and of what it is made; `drawn` are the plots' files in the folder
    `beside`, with their titles."""
    lines = ["# What accuracy costs in time", "", *promise_table(chapters), "", *PROMISES_SAID, "", *PREFACE]
    lines += section("What does not hold", [], broken_lines(chapters))
    lines += section("Not measured", [], [f"- {said}" for said in not_measured(found, timed)])
    for title, kinds in (("Error against time, drawn", True), ("Convergence, drawn", False)):
        shown = {name: said for name, said in drawn.items() if name.startswith(PARETO) == kinds}
        if shown:
            lines += ["", f"## {title}"]
            lines += [line for name, said in shown.items() for line in ("", f"![{said}]({beside}/{name})")]
    left_out = left_out_lines(found)
    lines += section("Single steps at the presets", PRESETS_SAID, preset_table(found))
    lines += ["", *LEFT_OUT_SAID, "", *left_out] if left_out else []
    lines += section("The estimate", ESTIMATE_SAID, [*estimate_table(found), "", *estimate_lines(found)])
    asked = asked_table(found)
    if len(asked) > 2:
        lines += section("What was asked for, and what was had", ASKED_SAID, asked)
    swept = swept_cases(found)
    lines += section("What a step up in accuracy costs", PRICE_SAID, price_table(found))
    if timed:
        lines += section("Deadlines", DEADLINES_SAID, deadline_table(timed))
    if found.times:
        lines += section("Times at a garment's scale", SCALE_SAID, scale_table(found))
    if any(measured.of_solver("trial") for measured in found.errors):
        lines += section("What the guarantee costs", GUARANTEE_SAID, guarantee_table(found))
    if swept:
        lines += section("Error against time", FRONT_SAID, front_table(found))
    lines += section("Other solvers", OTHERS_SAID, others_table(found))
    if found.trajectories:
        lines += section("Ways that begin together", TRAJECTORY_SAID, trajectory_table(found))
    if found.tailor:
        lines += section("Discretisation, by a tailor's measures", TAILOR_SAID, tailor_tables(found.tailor))
    lines += section("Runs", RUNS_SAID, run_table(found, timed))
    if swept:
        lines += ["", f"Every settings of every case: [settings.md]({beside}/settings.md)."]
    return "\n".join(lines).rstrip() + "\n"


def run_table(found: Found, timed: list[Timed]) -> list[str]:
    """Of which commit and machine each figure is."""
    rows: dict[tuple[str, str, str], list[str]] = {}
    for measured in (*found.errors, *found.trajectories, *found.times):
        of = measured.case
        case = f"{of.scene}, {measured.step}, {of.vertices} vertices, {of.states} states"
        for name, run in measured.run.items():
            rows.setdefault((case, *run), []).append(measured.family[name])
    for name, run in found.tailor_runs.items():
        rows.setdefault(("a tailor's measures", *run), []).append(name)
    for case in timed:
        run = str(case.about["commit"]), str(case.about["machine"])
        asked = f"{case.deadline} ms" if case.row["deadline_ms"] else "without one"
        rows.setdefault((f"deadlines: {case.place}", *run), []).append(asked)
    shown = [(case, ", ".join(dict.fromkeys(of)), commit, machine) for (case, commit, machine), of in rows.items()]
    return table(("case", "of it", "commit", "machine"), sorted(shown))


def swept_cases(found: Found) -> list[Measured]:
    """Those that have more than the presets."""
    return [measured for measured in found.errors if len(measured.rows) > len(measured.presets)]


def every_setting(found: Found, page: str) -> str:
    """The page beside: all that was measured of single steps, by case."""
    lines = ["# Every settings, by case", "", f"Of [what accuracy costs in time](../{page}); made with it."]
    for measured in swept_cases(found):
        lines += ["", f"## {measured.name}: {len(measured.shared)} states", "", *sweep_table(measured)]
    return "\n".join(lines) + "\n"


def section(title: str, said: list[str], rows: list[str]) -> list[str]:
    """A chapter with a table or a list, and what is said before it."""
    return ["", f"## {title}", "", *said, *([""] if said else []), *rows]


PROMISES_SAID = [
    "Yes: all of it holds; in part: of some cases, scenes, settings or deadlines; no: of none. Held out are scenes",
    "that nothing was fitted to, but for one exponent of the estimate, which was chosen by looking at three of them",
    f"(METHOD.md, section 14). An estimate counts as right where it and the error are under {NEGLIGIBLE:g} mm, and in",
    "brackets it does not. Presets whose own steps are shorter than all that were measured are not judged by it.",
    "Dialled are steps that were asked for an accuracy, of whatever size. Estimates of single steps have a scale",
    "that was fitted, and are told with today's, also of runs that had another: nothing else that was measured follows",
    "from it. Those beside deadlines are as the runs told them.",
]
PREFACE = [
    "Written by `python tests/accuracy --document`: every figure, count and verdict is computed from the kept runs,",
    "and what is said around them stands in the program that writes it. Each solver takes one step from each of the",
    "states that a float64 Newton IPC reference goes through in a garment's motion, and is held to where the",
    "reference is after the same step. Scenes with `on a GPU` in their names are of steps taken there; the others,",
    "and the reference, are of the CPU. Times of single steps are of small garments, on a CPU in processor time of",
    "all threads, but by the clock in runs before aa0d95dd, as on a GPU; they compare within a case as far as that is",
    "of one run, which the last chapter tells. Times at a garment's scale are measured apart.",
]
PRESETS_SAID = [
    "All presets take the same steps here, also those whose own are shorter; estimates are judged of the others.",
    "Distance of the cloth's vertices from the reference's, RMS over the cloth and the largest of them; principal",
    "stretches' and normals' difference, RMS over the triangles; the incremental potential above the reference's.",
    "Void: steps that ended where the body's motion had carried the cloth. Spent: steps of a preset of several passes",
    "that made all iterations of all of them and had not converged. Crossed: ends in which IPC Toolkit finds a",
    "crossing.",
    f"An estimate counts as right where it and the error are under {NEGLIGIBLE:g} mm; in brackets without that.",
    f"Where a run is older, `{BY_BUDGET}` is `draft` with corrections of four iterations, however near they come.",
]
LEFT_OUT_SAID = [
    "Where the reference comes to no balance there is nothing to hold a step to: it is left out, and the next begins",
    "where the reference has come to. A run that ended before its time leaves out the last ones, too; the files do not",
    "tell these from those.",
]
ESTIMATE_SAID = [
    "Of all presets, steps as long as the case's. What is judged further below are steps no longer than the preset's",
    "own: of 1/30 s at `draft` alone, of 1/60 s at `draft` and `live`, of 1/120 s at all.",
]
ASKED_SAID = [
    "All scenes together, held out or not, on the CPU. The correction goes on until it is as near as was asked for by",
    "what it measures; the error is against the reference. To ask for a millimetre or more buys little: projective",
    "dynamics alone is often as near, and no step is made worse on purpose.",
]
PRICE_SAID = [
    "Geometric means over the cases that have both, of the ratio of medians. `Newton n x m` is `live` with n Newton",
    "iterations of m conjugate gradients in its correction; passes repeat proxy and correction until they converge.",
    "Small are the garments of single steps, at scale those below.",
]
DEADLINES_SAID = [
    "Frames of `solver/bench`, with a deadline and, where that was measured, without one. A deadline is what a frame",
    "may take: the correction goes on for as long as it allows, and where that is over until it is near enough by a",
    "coarse measure, late as it is. One that is much shorter costs accuracy and gains little, as means tell: what",
    "steps leave undone makes those that follow dearer. A coarser mesh helps. Cycles and iterations are chosen by it;",
    "sub-steps are those of the settings: longer ones gained little, and tore (METHOD.md, section 14).",
    f"More than {100 * HELD:g} % of late frames count as not held, and a stretch over {STRETCHED:g}, unless it is so",
    "without a deadline, too, as broken. IPC Toolkit is asked about some of the frames: crossing are so many of those",
    "asked of all. Simulated over wall: under 1 the motion is slower than it is, in slow motion. A run without a",
    "deadline may be shorter, or of another commit, than those it is set beside, as the last column says.",
]
SCALE_SAID = ["The same motion, played on; what was timed is `advance`, with the device waited for."]
GUARANTEE_SAID = [
    "The correction is where contact is resolved on the full potential and every move is bounded by collision",
    "detection; the check is in float64. PD alone is the same step up to there: the trial that projective dynamics",
    "with the contacts' quadratic proxy ends in after 4 cycles, as in `live`, and after 32. Counted are the ends that",
    "cross.",
]
FRONT_SAID = [
    "Of our settings those than which none is both as fast and as near, by time; time and error are against the one",
    "before. Medians over so many states as the case says, which all of our settings stepped from.",
]
OTHERS_SAID = [
    "Each takes the same step from the same state. XPBD, Chebyshev-Jacobi PD and Newton IPC are in numpy and float64:",
    "their times are those of these programs, and what they could be as compiled ones is not known; how near they come",
    "at all is. A step that is cut into sub-steps is nearer to the motion's own course than one step of implicit Euler",
    "is, which is what all are held to: of these, errors of the order of g dt^2 are no fault. Newton's solvers have",
    "soft contacts and a body that does not yield, so that theirs is another model's error, too. Compared are steps",
    f"with errors under {JUDGED:g} mm; those under {AGREEMENT:g} mm are as good as each other. Ours are over the",
    "states that the other has, which are few where it is slow to be asked.",
]
TRAJECTORY_SAID = [
    "RMS [mm] between a run at a preset and the reference's, which begin in the same state and go on by themselves.",
]
RUNS_SAID = [
    "Each is made anew by `python tests/accuracy --scenes SCENE --rates N --vertices N --states N --families NAME`,",
    "with `--device cuda:0` on a GPU, at a garment's scale `--times` in place of families, a tailor's by `--tailor",
    "NAME`, deadlines by `python solver/bench --motions M --vertices N --fps N --seconds S --longest S --deadlines",
    "MS`. Where the program ran beside no repository, and of what else a machine did meanwhile, who ran it has told.",
]
TAILOR_SAID = [
    "Cloth at rest at preset `live`, with one size changed. Drape coefficient: Cusick's test, a disc of 300 mm of",
    "wool twill on a pedestal of 180 mm. Settled drape: the same disc at each preset, held to the float64 reference",
    "after as many steps; `off` is RMS [mm]. Bending length: of a cantilever, held to the heavy elastica. Wrinkle",
    "wavelength: of a stretched sheet whose width is gathered, held to the scaling law of Cerda and Mahadevan 2003,",
    "which is an approximation. Hem: of a skirt over the floor; `waves` is how much it goes up and down, RMS [mm].",
    "Speed is RMS over the cloth at the end of the time that it was given to come to rest. Where a measure changes",
    "with the number of folds, that is what changed: the length of a step decides which of several balances cloth",
    "falls into. No measure here is of cloth in motion.",
]
