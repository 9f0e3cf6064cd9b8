"""How a fabric looks: its colour, its weave and its shine. Nothing of it is simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from tryon_solver.checks import LEAST, MOST, as_float, check_share, told

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
            check_share(f"look: {name}", getattr(self, name))
        for name in ("colour", "weft"):
            colour = getattr(self, name)
            if name == "weft" and colour is None:
                continue
            if not _numbers(colour, 3, 0.0, 1.0):
                three = "a tuple of three numbers from 0 to 1, linear RGB"
                raise ValueError(f"look: {name} must be {three}, not {told(colour)}")
        if not _numbers(self.pitch, 2, LEAST, MOST):
            raise ValueError(f"look: pitch must be a tuple of two lengths above 0 m, not {told(self.pitch)}")


def _numbers(value: object, count: int, least: float, most: float) -> bool:
    """Is it a tuple of that many numbers from `least` to `most`?"""
    return isinstance(value, tuple) and len(value) == count and all(least <= as_float(part) <= most for part in value)

