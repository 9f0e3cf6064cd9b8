"""The preset of a drape without a solver: it says how many iterations a frame takes, and nothing else. `reference`
breaks once it is half built."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from typing import Self

PARTS = 5  # in which another one is built
ITERATIONS = {"draft": 3, "live": 4, "fit": 8, "reference": 50}


class PretendedPreset:
    preset = "draft"

    @property
    def iterations(self) -> int:
        return ITERATIONS[self.preset]

    def ordered(self, preset: str) -> Self:
        """It is solved so, if that is not for the device to choose."""
        self.preset = "draft" if preset == "auto" else preset
        return self

    def solve_as(self, preset: str) -> Iterator[None]:
        for k in range(PARTS):
            if k == PARTS // 2 and preset == "reference":
                raise RuntimeError("no room is left")
            yield None
        self.preset = preset

    def solved_as(self, preset: str) -> Self:
        other = copy(self)
        other.preset = preset
        return other
