"""What deadlines came to: of runs of the bench (`solver/bench --deadlines`), whose results lie among the files of
lines as JSON, each case with a deadline beside the same one without, if there is one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accuracy_data import Row, digits, table

HELD = 0.01  # share of the frames that may be late
PROMISED = {  # by device and motion, in ms: at 20,000 vertices on a GPU and at 2,500 on a CPU
    "cuda": {"jumping_jack": (5, 11, 33), "cartwheel": (5, 11, 33)},
    "cpu": {"jumping_jack": (66, 100), "walk": (66, 100)},
}
SAME = ("garment", "motion", "vertices", "preset", "device", "fps", "sessions", "fabric", "accuracy_mm")


@dataclass(frozen=True)
class Timed:
    """A case of the bench, and of which machine and commit it is."""

    row: Row
    about: Row

    @property
    def place(self) -> str:
        """What was simulated, and where."""
        motion = self.motion.replace("_", " ")
        return f"{self.row['garment']}, {motion}, {self.row['cloth_vertices']} vertices, {self.row['machine']}"

    @property
    def motion(self) -> str:
        """By name."""
        return Path(str(self.row["motion"])).stem

    @property
    def late(self) -> float:
        """Share of the frames."""
        return float(self.row["late"]) / float(self.row["frames"])

    def same_as(self, other: Timed) -> bool:
        """Is it the same but for the deadline?"""
        return self.place == other.place and all(self.row[name] == other.row[name] for name in SAME)


def read_timed(folder: Path) -> list[Timed]:
    """Cases of the bench's results in a folder, by file and in their order there."""
    found = []
    for path in sorted(folder.glob("*.json")):
        run: dict[str, Any] = json.loads(path.read_text())
        found += [Timed(row, run["about"]) for row in run["results"] if "failure" not in row]
    return found


def hurried(timed: Sequence[Timed]) -> list[Timed]:
    """Those with a deadline."""
    return [case for case in timed if case.row["deadline_ms"] is not None]


def deadline_table(timed: Sequence[Timed]) -> list[str]:
    """Of each case with a deadline, below the same one without."""
    free = [case for case in timed if case.row["deadline_ms"] is None]
    shown: list[Timed] = []
    for case in hurried(timed):
        shown += [other for other in free if other.same_as(case) and other not in shown]
        shown.append(case)
    head = ("case", "deadline [ms]", "p50 / p99 / max [ms]", "late", "error p50 / p99 [mm]", "stretch", "crossing")
    return table(head, map(cells, shown))


def cells(case: Timed) -> list[object]:
    """Of that table."""
    r = case.row
    ms, error, deadline = r["frame_ms"], r["error_mm"], r["deadline_ms"]
    return [
        f"{case.place}, {r['fps']:g}/s",
        "none" if deadline is None else f"{deadline:g}",
        " / ".join(digits(ms[name]) for name in ("p50", "p99", "max")),
        "-" if deadline is None else f"{r['late']} of {r['frames']}",
        f"{digits(error['p50'])} / {digits(error['p99'])}",
        digits(r["max_stretch"]),
        f"{r['unclean']} of {r['asked']}",
    ]


def deadlines_broken(timed: Sequence[Timed]) -> list[str]:
    """In words, each that was not held, and each that was promised and has no figure beside others that have one."""
    known = {(case.row["device"][:4].rstrip(":"), case.motion, case.row["deadline_ms"]) for case in hurried(timed)}
    unknown = [
        f"a {motion.replace('_', ' ')} on {'a GPU' if device == 'cuda' else 'a CPU'} in {ms:g} ms was not measured"
        for device, motions in PROMISED.items()
        for motion, deadlines in motions.items()
        for ms in deadlines
        if known and not any((device, ms) == (d, m) and stem.startswith(motion) for d, stem, m in known)
    ]
    return unknown + [
        f"{case.place}: of {case.row['frames']} frames in {case.row['deadline_ms']:g} ms {case.row['late']} are late; "
        f"99 % take up to {digits(case.row['frame_ms']['p99'])} ms"
        for case in hurried(timed)
        if case.late > HELD
    ]
