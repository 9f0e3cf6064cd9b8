"""How a fabric looks: its colour, its weave and its shine. Nothing of it is simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

Weave = Literal["plain", "twill", "satin", "knit"]
WEAVES: tuple[str, ...] = get_args(Weave)
SHARES = ("relief", "roughness", "lustre", "sheen", "unevenness", "nap", "mottle")

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Look:
    """A fabric's surface close by.

    `plain` crosses over and under, `twill` runs diagonally, `satin` floats its warp over four wefts and the right side
    of a `knit` shows columns of V-shaped stitches. What has no unit is a share from 0 to 1.
    """

    weave: Weave = "plain"
    colour: Colour = (0.8, 0.8, 0.8)  # linear RGB of the warp, or of the only yarn
    weft: Colour | None = None  # linear RGB of the weft; None: as the warp
    pitch: tuple[float, float] = (1e-3, 1e-3)  # m, from thread to thread along u and v; of a knit, its stitches
    relief: float = 0.5  # - depth of the weave over the pitch
    roughness: float = 0.9  # - of the fibres, as glTF has it: its square is the width of a highlight
    lustre: float = 0.0  # - of the light, how much long floats of filament throw back in their own colour
    sheen: float = 0.3  # - soft shine at grazing angles, which fibres that stand off give
    unevenness: float = 0.1  # - how much a yarn's thickness changes along it, over its mean
    nap: float = 0.0  # - how far raised fibres hide the weave
    mottle: float = 0.0  # - how much neighbouring yarns differ in lightness

    def __post_init__(self) -> None:
        if self.weave not in WEAVES:
            raise ValueError(f"look: weave must be one of {', '.join(WEAVES)}, not {self.weave!r}")
        for name in SHARES:
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise ValueError(f"look: {name} must be from 0 to 1, not {value!r}")
        for name in ("colour", "weft"):
            colour = getattr(self, name)
            if colour is not None and not (len(colour) == 3 and all(0 <= part <= 1 for part in colour)):
                raise ValueError(f"look: {name} must be three numbers from 0 to 1, linear RGB, not {colour!r}")
        if not all(0 < pitch < math.inf for pitch in self.pitch):
            raise ValueError(f"look: pitch must be two lengths above 0 m, not {self.pitch!r}")

