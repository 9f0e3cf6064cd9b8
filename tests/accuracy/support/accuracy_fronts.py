"""Other solvers' fronts beside ours: where ours is on or below them, and what of theirs lies beyond it, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from itertools import chain

from accuracy_data import Found, Measured, digits, table
from accuracy_limits import AGREEMENT, IN_NUMPY, JUDGED, OTHERS, beyond_ours
from accuracy_promises import Chapter, Verdict
from methods import TITLES

Lost = tuple[Measured, str, float, float, float | None]  # a case, and of it what `beyond_ours` says of a method
APART = "*"  # at times of another run than theirs
HEAD = (
    "scene",
    "theirs",
    "states",
    "settings beyond ours",
    "ends that cross",
    "their fastest [ms: mm]",
    "their nearest [ms: mm]",
    "inertia alone [mm]",
    "ours in no more time than that [mm]",
    "ours at its fastest",
    "[ms: mm]",
    "of it correction and check",
    "PD alone at its fastest [ms: mm]",
)
TRIED = [
    "Tried were the least of what the sweep varies: one cycle, one Newton iteration of ten conjugate gradients,",
    "the dial at 5 mm from `draft`; the table has the fastest of all. In motion, ending at half of `draft`'s",
    "iterations, or coarser than an estimated 0.1 m/s times the step, was tried, too: it saves little: crumpled",
    "cloth makes the steps that follow dearer (METHOD.md, section 14).",
]


def fronts_chapter(found: Found) -> Chapter:
    """No other solver's step is nearer than each of ours that takes no longer, its error being under JUDGED."""
    lost = [(measured, *beyond) for measured in found.errors for beyond in beyond_ours(measured)]
    beaten = {(m.name, solver_of(m, name)) for m, name, *_ in lost}
    fronts: dict[bool, dict[str, list[bool]]] = {False: {}, True: {}}
    for solver in OTHERS:
        for measured in found.errors:
            if measured.of_solver(solver) and measured.of_solver("ours"):
                name = TITLES[solver] + " (as a numpy program)" * (solver in IN_NUMPY)
                fronts[measured.on_gpu].setdefault(name, []).append((measured.name, solver) not in beaten)
    promised = f"ours is on or below every other solver's Pareto front for errors of a step under {JUDGED:g} mm"
    verdicts = [
        Verdict(f"{promised}, on {where}", held_of(fronts[on_gpu]), list(chain(*fronts[on_gpu].values())))
        for on_gpu, where in ((False, "the CPU"), (True, "a GPU"))
        if fronts[on_gpu] or not on_gpu
    ]
    return Chapter("Fronts", verdicts, fronts_told(lost, found) if lost else [])


def held_of(fronts: Mapping[str, Sequence[bool]]) -> str:
    """By solver, in how many scenes ours is."""
    return "; ".join(f"{title} in {sum(held)} of {len(held)} scenes" for title, held in fronts.items())


def solver_of(measured: Measured, method: str) -> str:
    """Its name."""
    return str(measured.about[method]["solver"])


def fronts_told(lost: Sequence[Lost], found: Found) -> list[str]:
    """What lies beyond ours and why; then of each scene and solver the fastest and the nearest of these, beside ours at
    its fastest, projective dynamics without a correction, and no solver."""
    by_solver: dict[tuple[str, str], list[Lost]] = {}
    for of in lost:
        by_solver.setdefault((of[0].name, solver_of(*of[:2])), []).append(of)
    rows = [front_row(beyond, found) for beyond in by_solver.values()]
    apart = f"{APART}: timed in another run than theirs, and times of two runs may not compare."
    told = [*lost_said(lost), "", *inertia_said(lost, found), "", *TRIED, "", *table(HEAD, rows)]
    return told + ["", apart] * any(APART in cell for row in rows for cell in row)


def front_row(beyond: Sequence[Lost], found: Found) -> tuple[str, ...]:
    """Cells of one scene and one other solver."""
    fastest, nearest = min(beyond, key=lambda of: of[2]), min(beyond, key=lambda of: of[3])
    measured, name, _, _, best = nearest
    states = measured.shared & measured.states(name)
    ends = sum(len(of.rows[method]) for of, method, *_ in beyond)
    crossing = sum(crossed(of, method) for of, method, *_ in beyond)
    theirs = [f"{digits(ms)}: {digits(error)}" for _, _, ms, error, _ in (fastest, nearest)]
    own, mark = fastest_of(measured, measured.ours_over(states), name, states)
    trial, mark_of_trial = fastest_of(measured, measured.of_solver("trial"), name, states)
    return (
        *(measured.name, TITLES[solver_of(measured, name)], str(len(states)), str(len(beyond))),
        *(f"{crossing} of {ends}", *theirs, digits(without_solver(found, measured, states)), digits(best)),
        *(own, said(measured, own, states) + mark, f"{100 * corrected(measured, own):.0f} %"),
        said(measured, trial, states) + mark_of_trial,
    )


def fastest_of(measured: Measured, methods: Sequence[str], theirs: str, states: Set[int]) -> tuple[str, str]:
    """The fastest of these over the states, of the run that `theirs` was timed in if any is, and APART if none is; ""
    without any."""
    beside = [own for own in methods if measured.run[own] == measured.run[theirs]]
    chosen = min(beside or methods, key=lambda own: measured.point(own, states), default="")
    return chosen, "" if beside or not methods else APART


def said(measured: Measured, method: str, states: Set[int]) -> str:
    """ms and mm of a method, if there is one."""
    return ": ".join(map(digits, measured.point(method, states))) if method else digits(None)


def without_solver(found: Found, measured: Measured, states: Set[int]) -> float | None:
    """mm that cloth which goes on as it went ends off, in the same scene and states; None where that is not known."""
    for other in found.errors:
        if (other.case.scene, other.case.dt) == (measured.case.scene, measured.case.dt):
            for name in other.of_solver("inertia"):
                if states <= other.states(name):
                    return other.median(name, "error", states)
    return None


def crossed(measured: Measured, name: str) -> int:
    """How many ends cross."""
    return sum(row["crossed"] > 0 for row in measured.rows[name])


def corrected(measured: Measured, name: str) -> float:
    """Share of the time that correction and check take."""
    rows = measured.rows[name]
    return sum(row["ms_correction"] + row["ms_check"] for row in rows) / sum(row["ms"] for row in rows)


def lost_said(lost: Sequence[Lost]) -> list[str]:
    """What those are that are beyond ours, and why."""
    ats = [measured.about[name]["at"] for measured, name, *_ in lost]
    counts = sorted({int(at["iterations"]) for at in ats if "iterations" in at})
    solvers = dict.fromkeys(TITLES[solver_of(measured, name)] for measured, name, *_ in lost)
    did = f", with {' or '.join(map(str, counts))} iterations" * bool(counts)
    ends = sum(len(measured.rows[name]) for measured, name, *_ in lost)
    crossing = sum(crossed(measured, name) for measured, name, *_ in lost)
    alone = []
    for measured, name, ms, *_ in lost:
        states = measured.shared & measured.states(name)
        trial, _ = fastest_of(measured, measured.of_solver("trial"), name, states)
        alone += [(measured.point(trial, states)[0], ms)] if trial else []
    longer = sum(m >= ms for m, ms in alone)
    as_long = f" That takes no less than theirs in {longer} of {len(alone)}" * bool(alone)
    rest = "; in the others what takes longer is correction and check" * (longer < len(alone))
    return [
        f"Beyond ours: {' and '.join(solvers)}{did}, {len(lost)} in all. They guarantee nothing: {crossing} of their "
        f"{ends} ends cross. (The skin does not yield for them, so that an end where the reference's own cloth is "
        "pressed into it counts as well: METHOD.md, section 18.)",
        "",
        "Ours ends a step only by moves that collision detection has bounded. Before these come a search for pairs and",
        f"a cycle of the proxy at least, which is PD alone at its fastest.{as_long}{rest}{'.' * bool(alone)}",
    ]


def inertia_said(lost: Sequence[Lost], found: Found) -> list[str]:
    """How far no solver at all ends off in these cases, and who ends farther."""
    theirs = [(error, without_solver(found, m, m.shared & m.states(name))) for m, name, _, error, _ in lost]
    known = [(error, off) for error, off in theirs if off is not None]
    if not known:
        return []
    cases = {measured.name: measured for measured, *_ in lost}
    farther: dict[str, list[str]] = {}
    asked = 0
    for name, measured in cases.items():
        off = without_solver(found, measured, measured.shared)
        if off is None:
            continue
        for own in measured.ours_over(measured.shared):
            asked += 1
            if measured.point(own, measured.shared)[1] > max(off, AGREEMENT):
                farther.setdefault(name, []).append(own)
    count = sum(map(len, farther.values()))
    ours = "; ".join(f"{name}: {', '.join(owns)}" for name, owns in farther.items())
    least, most = (digits(pick(off for _, off in known)) for pick in (min, max))
    return [
        f"With no solver, going on as it went, cloth ends {least} to {most} mm off in these cases: nearer than "
        f"{sum(error > off for error, off in known)} of {len(known)} of theirs, which come to the balance of another "
        "model the longer they iterate: contact of soft springs, and no limit of strain (METHOD.md, section 18). Of "
        f"ours {count} of {asked} settings end farther than that{': ' * bool(ours)}{ours}.",
    ]
