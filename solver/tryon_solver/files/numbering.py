"""The order of frames that come a file each: by the one number in their names that differs between them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tryon_solver.files.raw_mesh import MeshFileError

DIGITS = re.compile(r"(\d+)")
GAPS_LISTED = 4
REMEDY = "Name the frames so that one number differs, such as frame_0.obj, frame_1.obj, and so on"


def frame_numbers(names: Sequence[str], place: str) -> list[int]:
    """The number of each frame among files that are called so, wherever in its name it is: frame_2 comes before
    frame_10, and scan-2-v3 before scan-10-v3. `place` is what holds them, a folder or an archive.

    Raises MeshFileError when the names do not tell their order: when they differ in more than one number, in none, or
    in what is not a number, or when two have the same. One file alone is frame 0.
    """
    if len(names) == 1:
        return [0]
    split = [DIGITS.split(name.rpartition(".")[0]) for name in names]
    for name, parts in zip(names, split, strict=True):
        if parts[::2] != split[0][::2]:
            raise MeshFileError(
                f"the order of its frames can't be told: {names[0]} and {name} differ in more than a number",
                place,
                REMEDY,
            )
    numbers = [[int(digits) for digits in parts[1::2]] for parts in split]
    varying = [k for k in range(len(numbers[0])) if len({row[k] for row in numbers}) > 1]
    if len(varying) > 1:
        other = max(range(len(names)), key=lambda k: sum(numbers[k][v] != numbers[0][v] for v in varying))
        raise MeshFileError(
            f"the order of its frames can't be told: {len(varying)} numbers differ between names such as {names[0]} "
            f"and {names[other]}",
            place,
            REMEDY,
        )
    chosen = [row[varying[0]] if varying else 0 for row in numbers]
    seen: dict[int, str] = {}
    for name, number in zip(names, chosen, strict=True):
        if number in seen:
            raise MeshFileError(
                f"the order of its frames can't be told: {seen[number]} and {name} have the same number", place, REMEDY
            )
        seen[number] = name
    return chosen


def gaps(numbers: Sequence[int]) -> list[str]:
    """A note when the sorted numbers of the frames do not go on by the same step."""
    if len(numbers) < 3:
        return []
    steps = np.diff(np.array(numbers, dtype=object))
    wide = np.flatnonzero(steps > min(steps))
    if not len(wide):
        return []
    listed = ", ".join(f"{numbers[k + 1]} follows {numbers[k]}" for k in wide[:GAPS_LISTED])
    more = f" and {len(wide) - GAPS_LISTED} more" if len(wide) > GAPS_LISTED else ""
    return [f"its numbering has gaps ({listed}{more}): the frames are taken as evenly spaced, gaps are left out"]
