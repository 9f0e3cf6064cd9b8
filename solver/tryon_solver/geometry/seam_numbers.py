"""The numbers by which people know a pattern's seams: edits keep them, whichever seams come and go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SEAM_NUMBER = "seam_number"  # beside a stitch's first edge, an addition to the format


def number_of(side: Mapping[str, Any], at: int) -> Any:
    """That of the stitch `at` this place in its file, from 0, with this first side: what is told, or its place."""
    return side.get(SEAM_NUMBER, at + 1)


def fault_of_numbers(stitches: Sequence[Sequence[Any]]) -> tuple[str, str, str] | None:
    """What is wrong with the numbers of stitches whose sides are sound, where, and what to do; None if nothing is."""
    places: dict[int, int] = {}
    for at, entry in enumerate(stitches):
        number = number_of(entry[0], at)
        sound = isinstance(number, int) and not isinstance(number, bool) and number >= 1
        if not sound or number in places:
            why = f"that of stitches[{places[number]}]" if sound else "no number from 1 on"
            remedy = f"Give each seam a number of its own, or leave {SEAM_NUMBER} out of all"
            return f"the seam has the number {number!r}, {why}", f"stitches[{at}][0].{SEAM_NUMBER}", remedy
        places[number] = at
    return None
