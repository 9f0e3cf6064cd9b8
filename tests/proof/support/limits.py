"""The limits that every frame and every run has to keep, and what breaks them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass

from tryon_protocol import GRID

LAG_P95 = 3e-3  # m, unpinched skin to surface
LAG_MAX = 10e-3  # m
PINCHED_LAG_MAX = 50e-3  # m
LATE_SHARE = {  # of a motion's frames in which unpinched skin may be further than LAG_MAX from the surface
    "walk": 0.0,
    "squat": 0.0,
    "jumping_jack": 0.0,
    "twist": 0.0,
    "toe_touch": 0.0,
    "run": 0.02,
    "cartwheel": 0.02,
}
STRETCH_MOST = 1.02  # of the fabric's limit, for 99.9 % of the triangles
STRETCH_ANY = 1.10  # of the fabric's limit, for every triangle
SLID = 0.1  # m along the bones: an opening that has slid further than this no longer sits where it was put on
# Share of the garment's weight by which the contact force on the body, as a mean over its time at rest, may differ from
# it: the mean of what bears a garment is its weight, whatever the momentary force; that is told.
WEIGHT = 0.01
HEM_TRAVEL = 10e-3  # m relative to the pelvis, in the walk
TREMBLING = 1e-3  # m/s
WIRE = 0.501 * GRID  # m along each axis: rounding to the grid, and float64 of positions of some metres
POSE = 1e-6  # decoded against asked pose: m of the root, 1 of a quaternion in float32


def late_share(motion: str) -> float | None:
    """The allowed share of frames over LAG_MAX in a motion of that name, also one with more after an underscore.

    With none allowed the other limits of the lag hold in every frame, too. None: no limit, it is told only.
    """
    for name, share in LATE_SHARE.items():
        if motion == name or motion.startswith(f"{name}_"):
            return share
    return None


@dataclass(frozen=True)
class Broken:
    """A limit that was not kept: in which frame first, in which one worst, by how many, and by how much."""

    limit: str
    first: int | None  # frame; None for a figure of the whole run
    worst: int | None
    frames: int
    value: float
    bound: float

    def line(self) -> str:
        """For people."""
        where = "over the run" if self.first is None else f"in {self.frames} frames, first {self.first}"
        worst = "" if self.worst is None else f" (frame {self.worst})"
        return f"{self.limit}: {self.value:.4g}{worst} against {self.bound:.4g}, {where}"

    def plain(self) -> dict[str, object]:
        """For JSON."""
        return {**asdict(self), "line": self.line()}


def over(limit: str, frames: Sequence[int], values: Sequence[float], bound: float) -> Iterable[Broken]:
    """Broken where a frame's value is above `bound`, or not a number."""
    bad = [(k, v) for k, v in zip(frames, values) if not v <= bound]
    if bad:
        worst, value = max(bad, key=lambda kv: (kv[1] != kv[1], kv[1]))
        yield Broken(limit, bad[0][0], worst, len(bad), value, bound)


def run_over(limit: str, value: float | None, bound: float) -> Iterable[Broken]:
    """Broken when the run's value is above `bound`, or not a number; None was not measured and breaks nothing."""
    if value is not None and not value <= bound:
        yield Broken(limit, None, None, 0, value, bound)


def run_under(limit: str, value: float | None, bound: float) -> Iterable[Broken]:
    """Broken when the run's value is not above `bound`; None was not measured and breaks nothing."""
    if value is not None and not value > bound:
        yield Broken(limit, None, None, 0, value, bound)
