"""What deadlines came to: of runs of the bench (`solver/bench --deadlines`), whose results lie among the files of
lines as JSON, each case with a deadline beside the same one without, if there is one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accuracy_data import Row, digits, table
from accuracy_promises import Chapter, Verdict

HELD = 0.01  # share of the frames that may be late
STRETCHED = 1.3  # times its length: cloth that is stretched further, and is not without a deadline, is torn
SAME = ("garment", "motion", "vertices", "preset", "device", "fps", "sessions", "fabric", "accuracy_mm")
MOTIONS = ("jumping_jack", "cartwheel")


@dataclass(frozen=True)
class Promised:
    """Deadlines [ms] on a machine, as the bench calls it, in words; at about so many vertices, over so many s."""

    machine: str
    said: str
    vertices: int
    deadlines: tuple[float, ...]
    seconds: float


PROMISED = (Promised("H200", "an H200", 20_000, (5, 11, 33), 60.0), Promised("CPU", "a CPU", 2_500, (66, 100), 0.0))


@dataclass(frozen=True)
class Timed:
    """A case of the bench, and of which machine and commit it is."""

    row: Row
    about: Row

    @property
    def place(self) -> str:
        """What was simulated, and where."""
        motion = self.motion.replace("_", " ")
        return f"{self.row['garment']}, {motion}, {self.row['cloth_vertices']} vertices, {self.machine}"

    @property
    def machine(self) -> str:
        """The GPU by its name, and every CPU as such: Warp calls each of them otherwise."""
        return "CPU" if self.row["device"] == "cpu" else str(self.row["machine"])

    @property
    def motion(self) -> str:
        """By name."""
        return Path(str(self.row["motion"])).stem

    @property
    def deadline(self) -> str:
        """In ms, or none."""
        deadline = self.row["deadline_ms"]
        return "none" if deadline is None else f"{deadline:g}"

    @property
    def late(self) -> float:
        """Share of the frames."""
        return float(self.row["late"]) / float(self.row["frames"])

    @property
    def mean(self) -> float:
        """What a frame takes [ms]."""
        return 1e3 / (float(self.row["fps"]) * float(self.row["simulated_over_wall"]))

    @property
    def p99(self) -> float:
        """What 99 of 100 frames take at most [ms]."""
        return float(self.row["frame_ms"]["p99"])

    @property
    def seconds(self) -> float:
        """Of the motion."""
        return float(self.row["frames"]) / float(self.row["fps"])

    @property
    def run(self) -> str:
        """How long it is, and of which commit."""
        return f"{digits(self.seconds)} s at {self.about['commit']}"

    def same_as(self, other: Timed) -> bool:
        """Is it the same but for the deadline?"""
        return self.place == other.place and all(self.row[name] == other.row[name] for name in SAME)

    def is_of(self, promised: Promised, motion: str, deadline: float) -> bool:
        """Is it of what was promised?"""
        enough = self.row["cloth_vertices"] >= 0.95 * promised.vertices
        there = promised.machine in self.machine and self.row["deadline_ms"] == deadline
        return bool(there and enough and self.motion.lower().replace("-", "_").startswith(motion))


def read_timed(folder: Path) -> list[Timed]:
    """Cases of the bench's results in a folder, by file and in their order there."""
    found = []
    for path in sorted(folder.glob("*.json")):
        run: dict[str, Any] = json.loads(path.read_text())
        found += [Timed(row, run["about"]) for row in run["results"] if "failure" not in row]
    return found


def hurried(timed: Sequence[Timed]) -> list[Timed]:
    """Those with a deadline, of each place the shortest first."""
    cases = [case for case in timed if case.row["deadline_ms"] is not None]
    places = list(dict.fromkeys(case.place for case in cases))
    return sorted(cases, key=lambda case: (places.index(case.place), case.row["deadline_ms"]))


def without(case: Timed, timed: Sequence[Timed]) -> list[Timed]:
    """The same without a deadline."""
    return [other for other in timed if other.row["deadline_ms"] is None and other.same_as(case)]


def deadline_table(timed: Sequence[Timed]) -> list[str]:
    """Of each case with a deadline, below the same one without."""
    shown: list[Timed] = []
    for case in hurried(timed):
        shown += [other for other in without(case, timed) if other not in shown]
        shown.append(case)
    head = (
        "case",
        "deadline [ms]",
        "p50 / mean / p99 / max [ms]",
        "late",
        "error p50 / p99 [mm]",
        "stretch",
        "void steps",
    )
    return table((*head, "crossing", "simulated over wall", "length and commit"), map(cells, shown))


def cells(case: Timed) -> list[object]:
    """Of that table."""
    r = case.row
    ms, error = r["frame_ms"], r["error_mm"]
    return [
        f"{case.place}, {r['fps']:g}/s",
        case.deadline,
        " / ".join(map(digits, (ms["p50"], case.mean, ms["p99"], ms["max"]))),
        "-" if r["deadline_ms"] is None else f"{r['late']} of {r['frames']}",
        f"{digits(error['p50'])} / {digits(error['p99'])}",
        digits(r["max_stretch"]),
        r["void"],
        f"{r['unclean']} of {r['asked']} of {r['frames']}",
        digits(r["simulated_over_wall"]),
        case.run,
    ]


def deadline_chapter(timed: Sequence[Timed]) -> Chapter:
    """What was promised of deadlines, and all of them that were not held."""
    cases = hurried(timed)
    promises = [(promised, motion) for promised in PROMISED for motion in MOTIONS]
    told = [*never_measured(cases, timed), *broken_by_case(cases, timed)]
    return Chapter("Deadlines", [verdict(*promise, timed) for promise in promises], told)


def verdict(promised: Promised, motion: str, timed: Sequence[Timed]) -> Verdict:
    """Of a motion on a machine: each deadline holds at each rate of frames, and none stretches the cloth."""
    *less, most = (f"{ms:g}" for ms in promised.deadlines)
    length = f"{promised.seconds:g} s of " * bool(promised.seconds)
    promise = (
        f"deadlines of {', '.join(less)} and {most} ms are held at p99 by {length}a {motion.replace('_', ' ')} of "
        f"{promised.vertices:,} vertices on {promised.said}, and nothing crosses"
    )
    runs = {ms: [c for c in hurried(timed) if c.is_of(promised, motion, ms)] for ms in promised.deadlines}
    cases = [case for of in runs.values() for case in of]
    parts = [*(holds(case, promised) for case in cases), *(False for of in runs.values() if not of)]
    if not cases:
        return Verdict(promise, "not measured", parts)
    measured = [f"{ms:g} ms: {', '.join(map(in_short, of)) or 'not measured'}" for ms, of in runs.items()]
    crossed, asked = (sum(case.row[name] for case in cases) for name in ("unclean", "asked"))
    lengths = " and ".join(dict.fromkeys(f"{digits(case.seconds)} s" for case in cases))
    stretch = digits(max(case.row["max_stretch"] for case in cases))
    said = f"{lengths}; {crossed} of {asked} frames asked cross; cloth is stretched to {stretch} of its length"
    unstretched = [False] * any(stretched(case, timed) for case in cases)
    return Verdict(promise, f"{'; '.join(measured)}; {said}", [*parts, *unstretched])


def in_short(case: Timed) -> str:
    """Of a deadline."""
    row = case.row
    rate = f"{row['fps']:g} frames/s, {digits(row['simulated_over_wall'], 2)} of real time"
    return f"p99 {digits(row['frame_ms']['p99'])} ms, {digits(100 * case.late, 2)} % late ({rate})"


def holds(case: Timed, promised: Promised) -> bool:
    """In time, over the time that was promised, and nothing crosses."""
    long_enough = case.seconds >= promised.seconds * (1 - 1e-9)
    return case.late <= HELD and long_enough and case.row["asked"] > 0 and not case.row["unclean"]


def stretched(case: Timed, timed: Sequence[Timed]) -> bool:
    """Is the cloth torn, and is it not, as far as is known, by the motion alone?"""
    free = [other.row["max_stretch"] > STRETCHED for other in without(case, timed)]
    return bool(case.row["max_stretch"] > STRETCHED and not any(free))


def stretch_said(case: Timed, timed: Sequence[Timed]) -> str:
    """How far the cloth is stretched, and how far without the deadline."""
    said = f"cloth is stretched to {digits(case.row['max_stretch'])} of its length ({case.run})"
    free = [f"to {digits(other.row['max_stretch'])} ({other.run})" for other in without(case, timed)]
    return f"{said}, without a deadline {' or '.join(free)}" if free else said


def gains_nothing(case: Timed, timed: Sequence[Timed]) -> list[str]:
    """Where frames take no less than without the deadline, in the mean or the slowest of a hundred."""
    return [
        f"its frames take {took(case)} ({case.run}), without a deadline {took(free)} ({free.run})"
        for free in without(case, timed)
        if case.late > HELD and (case.mean >= free.mean or case.p99 >= free.p99)
    ]


def took(case: Timed) -> str:
    """What frames take."""
    return f"{digits(case.mean)} ms in the mean and {digits(case.p99)} at p99"


def never_measured(cases: Sequence[Timed], timed: Sequence[Timed]) -> list[str]:
    """Promised motions that have no figure, by machine, or none without a deadline to set beside."""
    lines = []
    for promised in PROMISED:
        for motion in MOTIONS:
            gone = [ms for ms in promised.deadlines if not any(case.is_of(promised, motion, ms) for case in cases)]
            if gone:
                said = ", ".join(f"{ms:g}" for ms in gone)
                lines.append(f"- A {motion.replace('_', ' ')} on {promised.said} was not measured in {said} ms.")
            known = [case for case in cases if any(case.is_of(promised, motion, ms) for ms in promised.deadlines)]
            if known and not any(without(case, timed) for case in known):
                lines.append(
                    f"- A {motion.replace('_', ' ')} on {promised.said} was not measured without a deadline, so that "
                    "what one costs there is not known."
                )
    return lines


def broken_by_case(cases: Sequence[Timed], timed: Sequence[Timed]) -> list[str]:
    """By what was simulated and where, each deadline that was not held or stretched the cloth."""
    places: dict[str, list[str]] = {}
    for case in cases:
        row, said = case.row, []
        if case.late > HELD:
            p99 = digits(row["frame_ms"]["p99"])
            said.append(f"{row['late']} of {row['frames']} frames are late; 99 % take up to {p99} ms")
        if row["unclean"]:
            said.append(f"{row['unclean']} of {row['asked']} frames asked cross")
        if stretched(case, timed):
            said.append(stretch_said(case, timed))
        said += gains_nothing(case, timed)
        if said:
            places.setdefault(case.place, []).append(f"  - in {case.deadline} ms: {'; '.join(said)}")
    return [line for place, said in places.items() for line in (f"- {place}", *said)]
