"""The page of a run: what was edited, what was refused, what broke."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from edit_verdicts import Promise
from frames_after import ASKED_AFTER, EVERY, RAMP
from speeds import AROUND, FREE, SPEED_LIMIT
from undone import HEM_LIMIT

NEAREST = "*"  # at speeds of runs that were judged before others than the nearest point counted
LIMBS = "+"  # at those judged before what hangs free was held to the trunk
WORN_ALONE = "°"  # at counts of those judged before garments were gone on in without the change
HEAD = (
    "case",
    "edits",
    "taken back, made again",
    "refused",
    "in the same mesh",
    "in another, carried",
    "dressed anew",
    "as worn before",
    "frames",
    "judged",
    "crossing",
    "not numbers",
    "fastest [m/s]",
    "but for its fall",
    "of it unedited",
    "fast by itself",
    "a limb passes",
    "at a switch [mm]",
    "stretch",
    "hem [mm]",
    "memory [MB]",
    "made again from scratch",
)


def markdown(results: Mapping[str, Mapping[str, Any]], promised: Sequence[Promise] = ()) -> str:
    """The page: what was promised, with a row for each case, and what broke below."""
    played = {name: result for name, result in results.items() if "failure" not in result}
    lines = ["# Edits of worn garments", ""]
    if promised:
        lines += [row(("promise", "measured", "holds")), row(["---"] * 3)]
        lines += [*(row(one.cells) for one in promised), ""]
    for what in ("commit", "machine"):
        lines.append(f"- {what}: {'; '.join(sorted({result['about'][what] for result in played.values()}))}")
    minutes = sum(result["about"]["minutes"] for result in played.values())
    lines.append(
        f"- time: {minutes:.0f} min of all cases together; all times are those of the machine as busy as it was"
    )
    lines += [
        "",
        f"IPC Toolkit is asked about the {ASKED_AFTER} frames after each change and every {EVERY}th otherwise.",
        "Speeds are those of the fastest vertex against the nearest point of the body, or, if it is less, against any",
        f"within {100 * AROUND:g} cm, as cloth between two legs goes with either ({NEAREST}: nearest alone),",
        f"in frames after a change and its ramp of {RAMP:g} s. Judged are they of vertices with nothing of the body",
        f"within {100 * FREE:g} cm against the pelvis, if that is less ({LIMBS}: not so), as a hem hangs still while a",
        "shin swings past it; frames that are too fast against such a limb alone are counted beside;",
        f"the limit is {SPEED_LIMIT:g} m/s, or, if that is higher, the speed that the motion",
        "gave the garment before it was edited. Where a frame after a change is faster, what was worn when the",
        f"change was asked for goes on from there without it, velocities and all ({WORN_ALONE}: was not asked), and",
        "the garment that the change made is put where it hung and worn through the motion with no edit: where either",
        "is as fast by itself, as cloth is that an earlier edit let loose and legs kick, it is no fault, and counted",
        "beside. What a vertex has fallen since the change does not count: sqrt(v^2 - 2 g h), as cloth that has lost",
        "what held it falls. The hem's mean height after all was taken back is compared with that of a garment that",
        f"was never edited (–: was not); the limit is {1e3 * HEM_LIMIT:g} mm. Where it is farther, the other one is",
        "put where this one hangs, and has to hang there, too (in brackets).",
        "At a switch cloth goes from where it was in the old mesh's last frame, at the same pattern coordinates, to",
        "where it is in the new one's first, for which the body stands still: part of the ramp, and told.",
        "Memory is what the process has taken, after a tenth of the changes and at the end.",
        "",
        row(HEAD),
        row(["---"] * len(HEAD)),
        *(row(cells(name, result)) for name, result in played.items()),
        "",
        "## Time from a change to the first frame that shows it [s]",
        "",
        row(("case", "in the same mesh: half, 99 of 100", "in another, carried", "dressed anew", "as worn before")),
        row(["---"] * 5),
    ]
    for name, result in played.items():
        lines.append(row([name, *(taken(result["seconds"][how]) for how in ("value", "carried", "anew", "as before"))]))
    lines += ["", "## Kinds", "", row(("kind", "asked", "made", "refused, and why most")), row(["---"] * 4)]
    lines += [row(cells) for cells in kinds(played.values())]
    lines += ["", "## What does not hold", ""]
    for name, result in results.items():
        lines += [f"- `{name}`: {each}" for each in summed(result)]
    if not any(map(broken, results.values())):
        lines.append("All holds.")
    return "\n".join(lines) + "\n"


def broken(result: Mapping[str, Any]) -> list[str]:
    """What does not hold in a case."""
    return [result["failure"]] if "failure" in result else list(result["broken"])


def summed(result: Mapping[str, Any]) -> list[str]:
    """The same, frames that are too fast as one."""
    fast = [] if "failure" in result else ["in " + said for said in result["faults"]["too_fast"]]
    others = [each for each in broken(result) if each not in fast]
    if not fast:
        return others
    faults = result["faults"]
    most = f"at most {faults['fastest_of_itself']:.2f} m/s"
    return [*others, f"{len(fast)} of {faults['frames']} frames are too fast, {most}; the first {fast[0]}"]


def cells(name: str, result: Mapping[str, Any]) -> list[str]:
    """A case's row."""
    made, faults = result["made"], result["faults"]

    def count(*, how: str = "", back: bool = False) -> int:
        return sum(n for what, n in made.items() if how in what and what.startswith(("undo", "redo")) == back)

    hows = (count(how=h) + count(how=h, back=True) for h in ("(value", "(topology", "(put on anew", "(put on as"))
    hem, memory = result["undone"]["hem"], result["memory"]
    alone = "" if "gone_on" in faults else WORN_ALONE
    nearest = NEAREST if "around" not in faults else "" if "free" in faults else LIMBS
    put = result["undone"].get("hem_there")  # not in runs of before it was asked
    there = "" if put is None else f" ({1e3 * (hem[0] - put):+.1f})"
    return [
        name,
        str(count()),
        str(count(back=True)),
        str(sum(result["refused"].values())),
        *map(str, hows),
        str(faults["frames"]),
        str(faults["asked"]),
        str(len(faults["crossing"])),
        str(len(faults["not_numbers"])),
        *(f"{faults[speed]:.2f}{nearest}" for speed in ("fastest", "fastest_of_itself", "fastest_unedited")),
        f"{len(faults['fast_by_itself'])}{alone}" if "fast_by_itself" in faults else "–",
        str(faults.get("limb_passes", "–")),
        f"{1e3 * faults['farthest_at_switch']:.0f}" if "farthest_at_switch" in faults else "–",
        f"{result['stretch']:.2f}",
        "–" if hem is None else f"{1e3 * (hem[0] - hem[1]):+.1f}{there}",
        "–" if not memory else f"{memory[len(memory) // 10] / 1e6:.0f}, {memory[-1] / 1e6:.0f}",
        f"{result['rebuilt']}{left_out(result)}",
    ]


def left_out(result: Mapping[str, Any]) -> str:
    """What of the comparisons with what is built from scratch could not be made, in brackets; runs of before it was
    told left out every factor."""
    whys = result.get("left_out", {"the factor": result["rebuilt"]} if result["rebuilt"] else {})
    return f" (left out: {', '.join(f'{n} times {why}' for why, n in whys.items())})" if whys else ""


def kinds(results: Any) -> list[list[str]]:
    """Of every kind of change in all cases: how often it was asked for, made and refused."""
    asked: dict[str, int] = defaultdict(int)
    refused: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for result in results:
        for kind, n in result["asked"].items():
            asked[kind] += n
        for what, n in result["refused"].items():
            kind, _, why = what.partition(": ")
            refused[kind][why] += n
    rows = []
    for kind in sorted(asked):
        whys = sorted(refused[kind].items(), key=lambda item: -item[1])
        most = f": {whys[0][1]} times '{whys[0][0]}'" if whys else ""
        no = sum(refused[kind].values())
        rows.append([kind, str(asked[kind]), str(asked[kind] - no), f"{no}{most}"])
    return rows


def taken(spread: Mapping[str, float]) -> str:
    """p50 and p99."""
    return f"{spread['p50']:.3g}, {spread['p99']:.3g} of {spread['count']}" if spread["count"] else "–"


def row(cells: Any) -> str:
    """A line of a table."""
    return f"| {' | '.join(cells)} |"
