"""What a hard case is, and what its set-up hands to the driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from loops_on_limbs import LoopsOnLimbs

from tryon_solver.results import StepReport
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import Simulation

FRAME = 1 / 60  # s


@dataclass(frozen=True)
class Ask:
    """How a case is to be run: about how many cloth vertices, which settings, on which device, for how long [s].

    `dressed`: where cases of the same run leave their garments as they hang once they are dressed, for each other.
    """

    vertices: int
    settings: Settings = field(default_factory=lambda: PRESETS["live"])
    device: str = "cpu"
    seconds: float = 5.0
    dressed: Path | None = None


@dataclass(frozen=True)
class Worn:
    """How to tell that a garment is still worn: its loops on the body's limbs, and the joints (J, 3) m at a time."""

    loops: LoopsOnLimbs
    joints_at: Callable[[float], np.ndarray]
    lowest: int  # loop that may slide


@dataclass(frozen=True)
class Asked:
    """What of a run is judged, as Run has it."""

    stops: float
    rests: bool = True
    squeezed: bool = False
    quiet: float | None = None
    wakes: bool = False
    parts: bool = False
    pinches: bool = False
    lost: Callable[[np.ndarray], float] | None = None


@dataclass
class Run:
    """A case that is set up and ready to go, one solver step a frame.

    Attributes:
        sim: the simulation, at its start.
        stance: the body's stance at a time [s]; None without a body.
        dt: time between frames, which is the solver's step [s].
        stops: from this time on nothing drives the scene, and what fell has landed [s].
        drive: called before every frame with its time [s]: writes pins' places and the like.
        step: takes the place of `sim.advance(stance(t), t)` where something else drives the simulation.
        worn: how to tell that the garment is still worn.
        rests: whether it comes to rest at all, so that trembling can be asked.
        noise: whether the body is to stand still but for what its tracker gets wrong, so that this is measured.
        quiet: from this time on [s] nothing may move any more, by whatever frequency; None where that is not asked.
        wakes: whether it has to fall asleep and to wake again.
        parts: whether what touched may part for good; else cloth that touches nothing at the end has fallen off.
        pinches: whether the body squeezes cloth on the way, so that its surface yields while it does.
        lost: of cloth (N, 3) m at the end, how much it has lost of what the case is about, if that can be told.
        told: where a tracker has told the body to be last, a stance; None where nothing is tracked.
        squeezed: whether the body itself holds the cloth squeezed to the end, so that its surface may stay behind.
    """

    sim: Simulation
    stance: Callable[[float], Any] = lambda _t: None
    dt: float = FRAME
    stops: float = 0.0
    drive: Callable[[float], None] | None = None
    step: Callable[[float], StepReport] | None = None
    worn: Worn | None = None
    rests: bool = True
    quiet: float | None = None
    wakes: bool = False
    parts: bool = False
    squeezed: bool = False
    pinches: bool = False
    noise: bool = False
    told: Callable[[], Any] | None = None
    lost: Callable[[np.ndarray], float] | None = None

    @property
    def asked(self) -> Asked:
        """What of it is judged."""
        return Asked(self.stops, self.rests, self.squeezed, self.quiet, self.wakes, self.parts, self.pinches, self.lost)

    def tracked(self) -> np.ndarray:
        """(B, 3) m: the skin where it has been told to be last."""
        assert self.told is not None
        assert self.sim.scene.body is not None
        return np.asarray(self.sim.scene.body.surface(self.told()))

    def advance(self, t: float) -> StepReport:
        """Everything that happens in the frame that ends at t [s]."""
        if self.drive is not None:
            self.drive(t)
        return self.sim.advance(self.stance(t), t) if self.step is None else self.step(t)


@dataclass(frozen=True)
class HardScene:
    """A named case.

    Attributes:
        name: of the case, as one word.
        stresses: what it stresses, for people.
        set_up: makes it ready to go. May raise an error that names the place: the case is then refused by name.
        vertices: about how many cloth vertices it has unless asked otherwise; some meshes are what they are.
        seconds: how long it lasts unless asked otherwise [s].
        rate: frames a second, about: the cases with most frames are begun first.
        apart: whether it is played only where it is asked for by name: it takes longer than all others.
        refused: what the refusal must say, a regular expression; "" for a case that must run.
        same_as: the case whose figures these have to be; "" for none.
        stated: limits that are measured and listed but not judged, each with the reason.
    """

    name: str
    stresses: str
    set_up: Callable[[Ask], Run]
    vertices: int = 1000
    seconds: float = 5.0
    rate: float = 60.0
    apart: bool = False
    refused: str = ""
    same_as: str = ""
    stated: Mapping[str, str] = field(default_factory=dict)
