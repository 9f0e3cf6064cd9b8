"""What the files of lines say, put together by case: errors, times at scale, ways from one start, tailor's measures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from accuracy_case import AccuracyCase
from recorded import Recorded, read_all

from tryon_solver.stepping.estimate import DIALLED_SCALE, SCALE

Row = Mapping[str, Any]
Run = tuple[str, str]  # commit and machine
PRESETS, TRAJECTORY, TIMES, DEADLINE = "presets", "trajectory", "times", "deadline"
CPU = "cpu"
USUAL_VERTICES = 600  # about, of the meshes that single steps are taken with
OURS = ("ours", "trial")
BOUGHT = {"accuracy": "dialled", "deadline": "under a deadline"}  # what a correction goes on for, and what it is called
FIRST_SCALE = 2.7  # of all estimates, in runs that do not tell it


@dataclass
class Measured:
    """One case on one device: rows by method, and of each method its family, its solver and what was varied, and of
    which commit and machine they are."""

    case: AccuracyCase
    device: str
    rows: dict[str, list[Row]] = field(default_factory=dict)
    family: dict[str, str] = field(default_factory=dict)
    about: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    run: dict[str, Run] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """In words; at a garment's scale the mesh is told beside it."""
        other = self.case.vertices != USUAL_VERTICES and TIMES not in self.family.values()
        return f"{self.case.scene}, " + f"{self.case.vertices} vertices, " * other + self.step

    @property
    def step(self) -> str:
        """Its length, and where it is taken if that is not the CPU."""
        return f"1/{1 / self.case.dt:.0f} s" + ", on a GPU" * self.on_gpu

    @property
    def on_gpu(self) -> bool:
        """Are our steps taken there?"""
        return self.device != CPU

    @property
    def place(self) -> str:
        """For names of files."""
        return f"{self.case.name}-{self.device.replace(':', '')}"

    @property
    def presets(self) -> list[str]:
        """In the order of what they cost."""
        return [name for name, family in self.family.items() if family == PRESETS]

    def of_solver(self, *solvers: str) -> list[str]:
        """Methods of these solvers."""
        return [name for name in self.rows if self.about[name]["solver"] in solvers]

    def states(self, method: str) -> set[int]:
        """Those that it stepped from."""
        return {row["state"] for row in self.rows[method]}

    @property
    def shared(self) -> set[int]:
        """States that all of our settings stepped from; another solver, and what ends by a deadline, may have stepped
        from fewer."""
        ours = [name for name in self.of_solver(*OURS) if self.family[name] != DEADLINE]
        return set.intersection(*map(self.states, ours or self.rows))

    def ours_over(self, states: Set[int]) -> list[str]:
        """Our settings that stepped from all of these."""
        return [name for name in self.of_solver("ours") if states <= self.states(name)]

    def median(self, method: str, figure: str, states: Set[int] | None = None) -> float:
        """Over these states, or the shared ones, as far as the method has them; infinite without any, and where half
        of the ends are not a number."""
        wanted = self.shared if states is None else states
        values = [row[figure] for row in self.rows[method] if row["state"] in wanted]
        return float(np.median([np.inf if value is None else value for value in values] or [np.inf]))

    def point(self, method: str, states: Set[int] | None = None) -> tuple[float, float]:
        """ms and error [mm], medians as of `median`."""
        return self.median(method, "ms", states), self.median(method, "error", states)


@dataclass(frozen=True)
class Found:
    """All that was measured."""

    errors: list[Measured]
    trajectories: list[Measured]
    times: list[Measured]
    tailor: list[Row]
    tailor_runs: dict[str, Run]

    @property
    def presets(self) -> list[Measured]:
        """Of each scene, length of step and device the one with the most steps at presets."""
        return fullest([measured for measured in self.errors if measured.presets])


def fullest(cases: Sequence[Measured]) -> list[Measured]:
    """Of those with one name the one with the most states."""
    most: dict[str, Measured] = {}
    for measured in cases:
        other = most.get(measured.name)
        if other is None or other.case.states < measured.case.states:
            most[measured.name] = measured
    return [measured for measured in cases if measured is most[measured.name]]


def read_results(folder: Path) -> Found:
    """Of a folder of files of lines."""
    files = read_all(folder)
    of = {kind: [f for f in files if is_of(f, kind)] for kind in (TRAJECTORY, TIMES)}
    errors = [f for f in files if "case" in f.head and f.head["family"] not in (TRAJECTORY, TIMES) and f.rows]
    tailor = [f for f in files if "tailor" in f.head]
    rows = [row for f in tailor for row in f.rows]
    runs = {f.head["tailor"]: run_of(f.head["about"]) for f in tailor}
    return Found(together(errors), fullest(together(of[TRAJECTORY])), together(of[TIMES]), rows, runs)


def is_of(recorded: Recorded, family: str) -> bool:
    """Is it of that family, and is there anything in it?"""
    return recorded.head.get("family") == family and bool(recorded.rows)


def together(files: Iterable[Recorded]) -> list[Measured]:
    """By case and device, presets first; what there are no rows of is left out."""
    found: dict[tuple[AccuracyCase, str], Measured] = {}
    for recorded in sorted(files, key=lambda f: f.head["family"] != PRESETS):
        case = AccuracyCase(**recorded.head["case"])
        measured = found.setdefault((case, recorded.head["device"]), Measured(case, recorded.head["device"]))
        for name, about in recorded.head["methods"].items():
            rows = [scaled(row, about) for row in recorded.rows if row["method"] == name]
            if rows:
                measured.rows[name] = rows
                measured.family[name] = recorded.head["family"]
                measured.about[name] = about
                measured.run[name] = run_of(recorded.head["about"])
    return list(found.values())


def scaled(row: Row, about: Mapping[str, Any]) -> Row:
    """With its estimate as it is told now: of a run that had another scale it is that many times as large, and nothing
    else that was measured follows from it."""
    if row.get("estimate") is None:
        return row
    now = DIALLED_SCALE if BOUGHT.keys() & about["at"].keys() else SCALE
    return {**row, "estimate": row["estimate"] * now / about.get("scale", FIRST_SCALE)}


def run_of(about: Mapping[str, str]) -> Run:
    """Commit and machine of a file."""
    return about["commit"], about["machine"]


def front(points: Mapping[str, tuple[float, float]]) -> list[str]:
    """Those of (ms, error) than which no other is both as fast and as near, by time."""
    names = [name for name, point in points.items() if np.isfinite(point).all()]

    def beaten(name: str) -> bool:
        ms, error = points[name]
        return any((m, e) != (ms, error) and m <= ms and e <= error for m, e in (points[n] for n in names))

    return sorted((name for name in names if not beaten(name)), key=lambda name: points[name])


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Lines of Markdown."""
    return [
        f"| {' | '.join(head)} |",
        "|---" * len(head) + "|",
        *(f"| {' | '.join(map(str, row))} |" for row in rows),
    ]


def digits(value: float | None, count: int = 3) -> str:
    """So many digits that count; a dash for none."""
    if value is None or not np.isfinite(value):
        return "-"
    return f"{float(f'{value:.{count}g}'):.10g}"


def geometric_mean(values: Sequence[float]) -> float:
    """Of ratios."""
    return float(np.exp(np.mean(np.log(values))))


def ratios(measured: Sequence[Measured], one: str, other: str, figure: Callable[[Measured, str], float]) -> list[float]:
    """other over one in each case that has both, where both are numbers above 0."""
    pairs = [(figure(m, one), figure(m, other)) for m in measured if one in m.rows and other in m.rows]
    return [b / a for a, b in pairs if np.isfinite((a, b)).all() and a > 0 and b > 0]
