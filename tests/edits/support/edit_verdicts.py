"""What was promised of edits, what was measured, and whether it holds: the head of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from edit_case import GARMENTS, MIXED
from speeds import SPEED_LIMIT
from undone import HEM_LIMIT

from tryon_solver.redesign.edits import KINDS

EDITS, EACH = 500, 50  # that were promised of each garment, and of each kind
FULL, SMALL = 20_000, 2500  # vertices that times were promised at, about
ALIKE = 0.95  # of so many a mesh has at least
VALUE, CARRIED, INVERSE = 0.050, 0.300, 0.150  # s, on a GPU: to the first frame that shows it, and for the factor
VALUE_ON_CPU, CARRIED_ON_CPU = 0.250, 1.5  # s
DRAGGED = 60.0  # s of sixty edits a second, in which the rate of frames holds
KEEPS, LATE = 0.95, 2.0  # share of that rate, and times that frames may be apart: one of them is missed
Result = Mapping[str, Any]


@dataclass(frozen=True)
class Promise:
    """A line; `holds` of nothing that was measured is None. What holds as it is judged (edit_table.py says how) may
    not hold to the `letter`."""

    said: str
    measured: str
    holds: bool | None
    letter: bool = True

    @property
    def cells(self) -> tuple[str, str, str]:
        """Of the table."""
        yes = "yes" if self.letter else "as judged"
        return self.said, self.measured, {True: yes, False: "no", None: "not measured"}[self.holds]


def promises(
    results: Mapping[str, Result], rebuilt: Result | None, dragged: Sequence[Result], levels: Result | None
) -> list[Promise]:
    """All, of the cases that were played and of what was timed apart."""
    played = [result for result in results.values() if "failure" not in result]
    return [
        *(mixed(garment, played) for garment in GARMENTS),
        each_kind(played),
        *(first_shown(*of, played) for of in TIMES),
        new_factor(rebuilt),
        drag(dragged),
        memory(levels),
    ]


def on_gpu(result: Result) -> bool:
    return str(result["case"]["device"]) != "cpu"


def mixed(garment: str, played: Sequence[Result]) -> Promise:
    """Of a garment in its own size in a walk."""
    parts, held, most, letter = [], [], 0, True
    for gpu, where in ((True, "on a GPU"), (False, "on a CPU")):
        cases = [r for r in played if of_walk(r, garment, MIXED) and on_gpu(r) == gpu]
        edits = sum(edits_made(r) for r in cases)
        good = sum(not r["broken"] for r in cases)
        if cases:
            frames = sum(r["faults"]["asked"] for r in cases)
            crossing = sum(len(r["faults"]["crossing"]) for r in cases)
            slow = sum(r["faults"]["fastest"] <= SPEED_LIMIT for r in cases)
            near = sum(abs(np.subtract(*r["undone"]["hem"])) <= HEM_LIMIT for r in cases if r["undone"]["hem"])
            said = f"{where} {good} of {len(cases)} runs, of {edits} edits, hold in all, and {crossing} of {frames} "
            said += "judged frames cross; by the promise's letter, with no allowance for falling, limbs that pass and "
            said += f"what goes so by itself, {slow} stay under {SPEED_LIMIT:g} m/s, and the hems of {near} within "
            parts.append(f"{said}{1e3 * HEM_LIMIT:g} mm of one that was never edited")
            held.append(good == len(cases))
            letter &= slow == near == len(cases)
            most = max(most, edits)
    said = f"{EDITS} mixed edits of a walking {garment}: nothing crosses or is thrown, and all can be taken back"
    return Promise(said, "; ".join(parts), all(held) and most >= EDITS if parts else None, letter)


def edits_made(result: Result) -> int:
    """Without those taken back and made again; fewer than its case has where its time was up."""
    return sum(count for what, count in result["made"].items() if not what.startswith(("undo", "redo")))


def each_kind(played: Sequence[Result]) -> Promise:
    """Of the T-shirt."""
    runs = {kind: [r for r in played if of_walk(r, "tshirt", kind) and edits_made(r) >= EACH] for kind in KINDS}
    there = {kind: of for kind, of in runs.items() if of}
    good = sum(not any(r["broken"] for r in of) for of in there.values())
    gone = [kind for kind in runs if kind not in there]
    lacking = f"; not {', '.join(gone)}" * bool(gone)
    measured = f"{good} of {len(there)} kinds that so many edits were made of hold{lacking}"
    return Promise(f"{EACH} edits of each kind of the T-shirt", measured, good == len(KINDS) if there else None)


def of_walk(result: Result, garment: str, kind: str) -> bool:
    case = result["case"]
    same = (case["garment"], case["motion"], case["kind"], case["size"]) == (garment, "walk", kind, 1.0)
    return same and not case["at_once"]


TIMES = (
    ("an edit in the same mesh is shown", "value", True, FULL, VALUE),
    ("an edit that takes another mesh is shown", "carried", True, FULL, CARRIED),
    ("an edit in the same mesh is shown", "value", False, SMALL, VALUE_ON_CPU),
    ("an edit that takes another mesh is shown", "carried", False, SMALL, CARRIED_ON_CPU),
)


def first_shown(said: str, how: str, gpu: bool, vertices: int, limit: float, played: Sequence[Result]) -> Promise:
    """Half of them in no more, in all cases; what is dressed anew instead is told beside."""
    least, most = ALIKE * vertices, 2 * vertices
    cases = [r for r in played if on_gpu(r) == gpu and least <= r["vertices"] < most]
    found = [r["seconds"][how]["p50"] for r in cases if r["seconds"][how]["count"]]
    count = sum(r["seconds"][how]["count"] for r in cases)
    anew = [r["seconds"]["anew"]["p50"] for r in cases if r["seconds"]["anew"]["count"]]
    place = "a GPU" if gpu else "a CPU"
    promise = f"{said} within {1e3 * limit:g} ms (half of them), {vertices:,} vertices on {place}"
    times = f"{1e3 * min(found):.0f} to {1e3 * max(found):.0f} ms" if found else ""
    parts = [f"{times} in {len(found)} runs, of {count} changes"] if found else []
    if how == "carried" and anew:
        parts.append(f"dressed anew instead: {min(anew):.1f} to {max(anew):.1f} s in {len(anew)} runs")
    return Promise(promise, "; ".join(parts), max(found) <= limit if found else None)


def new_factor(rebuilt: Result | None) -> Promise:
    """The inverse of the reduced matrix at the preset's basis."""
    rows = [r for r in (rebuilt or {"rows": []})["rows"] if r["vertices"] >= ALIKE * FULL]
    times = [r["value"]["reduced matrix"] + r["value"]["inverse"] for r in rows]
    since = "with nothing beside it, from when the shape stands, a ramp after the edit"
    measured = f"{1e3 * max(times):.0f} ms {since}" if times else ""
    said = f"the new factor is there within {1e3 * INVERSE:g} ms, {FULL:,} vertices on a GPU"
    return Promise(said, measured, max(times) <= INVERSE if times else None, letter=False)


def drag(dragged: Sequence[Result]) -> Promise:
    """Sixty edits a second."""
    parts, held = [], []
    for made in dragged:
        for r in made["rows"]:
            if r["vertices"] >= ALIKE * FULL:
                rate = f"{r['during']:.1f} of {r['before']:.1f} frames a second over {r['seconds']:g} s"
                parts.append(f"{rate}, at most {r['wait_during']:.3f} s apart ({made['about']['commit']})")
                enough = r["during"] >= KEEPS * r["before"] and r["wait_during"] <= LATE / r["fps"]
                held.append(enough and r["seconds"] >= DRAGGED)
    said = f"sixty edits a second for {DRAGGED:g} s hold the rate, and no more than one frame is missed"
    return Promise(f"{said}, {FULL:,} vertices on a GPU", "; ".join(parts), any(held) if parts else None)


def memory(levels: Result | None) -> Promise:
    """After a thousand edits: the middle of what is taken in the last tenth against the second; the first dresses."""
    said = "memory returns to its level after 1,000 edits"
    if levels is None:
        return Promise(said, "", None)
    taken = levels["row"]["taken"]
    size = max(1, len(taken) // 10)
    begun, ended = median(taken[size : 2 * size]), median(taken[-size:])
    least = min(taken[-size:])
    measured = f"{begun / 1e6:.0f} MB in the second tenth of {len(taken)} changes, {ended / 1e6:.0f} in the last"
    return Promise(said, f"{measured} (medians), in which it is down to {least / 1e6:.0f}", ended <= 1.05 * begun)
