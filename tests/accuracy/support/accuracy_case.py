"""In which scenes the solver's error is measured, and at which settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from tryon_solver.settings import PRESETS, Settings


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
        said = f"{self.garment.replace('_', ' ')}, {self.motion.replace('_', ' ')}"
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
    """A tight T-shirt, a layered skirt, a walking dress and more, in steps of `dt` s; eight of them held out."""
    return [
        AccuracyCase("tshirt", "walk", dt, **more),
        AccuracyCase("tshirt", "squat", dt, size=0.93, **more),
        AccuracyCase("skirt", "walk", dt, **more),
        AccuracyCase("layered_skirt", "walk", dt, **more),
        AccuracyCase("dress", "walk", dt, **more),
        AccuracyCase("tshirt", "turn", dt, fabric="denim", held_out=True, **more),
        AccuracyCase("skirt", "jumping_jack", dt, held_out=True, **more),
        AccuracyCase("dress", "squat", dt, fabric="silk_charmeuse", held_out=True, **more),
        AccuracyCase("dress", "turn", dt, fabric="linen", held_out=True, **more),
        AccuracyCase("tshirt", "jumping_jack", dt, fabric="viscose_jersey", held_out=True, **more),
        AccuracyCase("trousers", "jumping_jack", dt, held_out=True, **more),
        AccuracyCase("overshirt", "squat", dt, fabric="cotton_poplin", held_out=True, **more),
        AccuracyCase("skirt", "squat", dt, fabric="wool_twill", held_out=True, **more),
    ]


def presets(dt: float) -> Mapping[str, Settings]:
    """All by name, in steps of `dt` s, also those whose own are shorter."""
    return {name: replace(preset, largest_step=max(preset.largest_step, dt)) for name, preset in PRESETS.items()}


def takes_such_steps(preset: str, dt: float) -> bool:
    """Are the preset's own steps as long as `dt` s, or longer?"""
    return PRESETS[preset].largest_step >= dt * (1 - 1e-9)
