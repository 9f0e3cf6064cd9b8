"""In which scenes the solver's error is measured, and at which settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from tryon_solver.settings import PRESETS, Settings

LIVE = PRESETS["live"]


@dataclass(frozen=True)
class AccuracyCase:
    """A garment of the demo in `size` times its own, worn in a motion of the demo, in steps of `dt` s.

    Attributes:
        states: of the reference, one after the other, from each of which one step is taken.
        held_out: nothing was fitted to it (`SCALE` of stepping/estimate.py).
    """

    garment: str
    motion: str
    dt: float
    size: float = 1.0
    fabric: str = "cotton_jersey"
    vertices: int = 600
    states: int = 20
    held_out: bool = False

    @property
    def scene(self) -> str:
        """In words, without the step."""
        said = f"{self.garment}, {self.motion.replace('_', ' ')}"
        said += f", {self.size:g} times its size" * (self.size != 1.0)
        return said + f", {self.fabric.replace('_', ' ')}" * (self.fabric != "cotton_jersey")

    @property
    def name(self) -> str:
        """Of its file."""
        said = [self.garment, self.motion, f"{self.size:g}", self.fabric, f"{self.vertices}x{self.states}"]
        return "-".join([*said, f"{round(1 / self.dt)}"])

    def plain(self) -> dict[str, Any]:
        """Ready for JSON."""
        return asdict(self)


def scenes(dt: float, **more: Any) -> list[AccuracyCase]:
    """A tight T-shirt, a skirt, a dress and more, in steps of `dt` s; three of them held out."""
    return [
        AccuracyCase("tshirt", "walk", dt, **more),
        AccuracyCase("tshirt", "squat", dt, size=0.93, **more),
        AccuracyCase("skirt", "walk", dt, **more),
        AccuracyCase("dress", "walk", dt, **more),
        AccuracyCase("tshirt", "turn", dt, fabric="denim", held_out=True, **more),
        AccuracyCase("skirt", "jumping_jack", dt, held_out=True, **more),
        AccuracyCase("dress", "squat", dt, fabric="silk_charmeuse", held_out=True, **more),
    ]


def presets(dt: float) -> Mapping[str, Settings]:
    """Those that take steps of `dt` s, whose largest step is as long or longer, by name."""
    return {name: preset for name, preset in PRESETS.items() if preset.largest_step >= dt * (1 - 1e-9)}


def sweep() -> Mapping[str, Settings]:
    """`live` with one thing changed at a time: what each buys, by what was changed."""
    changes: list[tuple[str, dict[str, Any]]] = [
        *((f"Newton {n} x {pcg}", newton(n, pcg)) for n in (1, 2, 4, 8, 16) for pcg in (10, 30, 60, 120)),
        *((f"cycles {n}", {"outer_iterations": n}) for n in (1, 2, 8)),
        *((f"reduced {n}", {"reduced_iterations": n}) for n in (0, 4)),
        *((f"smoothing {n}", {"smoothing_sweeps": n}) for n in (0, 10)),
        *((f"splines {s:g} edges", {"subspace_spacing": s}) for s in (2.0, 8.0, 16.0)),
        ("two levels", {"scheme": "contact_coarse"}),
        *((f"passes {n}", {"contact_passes": n}) for n in (2, 4)),
    ]
    return {name: replace(LIVE, **change) for name, change in changes}


def newton(iterations: int, pcg: int) -> dict[str, Any]:
    """A budget of the correction, the second one twice that."""
    return {
        "correction_iterations": iterations,
        "correction_pcg_iterations": pcg,
        "second_iterations": 2 * iterations,
        "second_pcg_iterations": 2 * pcg,
    }
