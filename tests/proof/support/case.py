"""What a case is: plain values that travel between processes and into JSON files."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

GARMENTS = ("tshirt", "skirt", "dress")
MOTIONS = ("walk", "squat", "jumping_jack")


@dataclass(frozen=True)
class Case:
    """One garment in one motion, simulated in process.

    Attributes:
        garment: a pattern of the demo, or a file.
        motion: a motion of the demo, or a BVH file.
        fabric, preset, device: names.
        edge: edge length of the cloth's mesh [m].
        fps: published frames per simulated second.
        lead: time in which the body is led into the motion [s].
        seconds: time of the motion, which repeats when it is shorter [s]; 0 plays it once, whole.
        stopping: time at the end of that in which it slows down evenly to a stand; 0 stops it dead [s].
        standing: time for which the body then stands still [s].
        every: every so many frames IPC Toolkit is asked.
        settings: solver settings that differ from the preset's.
    """

    garment: str
    motion: str
    fabric: str
    preset: str
    device: str
    edge: float
    fps: float
    lead: float
    seconds: float
    stopping: float
    standing: float
    every: int
    settings: tuple[tuple[str, float | str], ...] = ()

    @property
    def name(self) -> str:
        """For file names."""
        device = self.device.replace(":", "")
        return f"{stem(self.garment)}-{stem(self.motion)}-{self.preset}-{1e3 * self.edge:g}mm-{device}"

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


@dataclass(frozen=True)
class LiveCase:
    """One garment in one motion, recorded from a server over its websocket.

    Attributes:
        garment, motion, fabric, preset: ids and names that the server knows.
        server: its address.
        frames: how many to record.
        every: every so many frames IPC Toolkit is asked.
    """

    garment: str
    motion: str
    fabric: str
    preset: str
    server: str
    frames: int
    every: int

    @property
    def name(self) -> str:
        """For file names."""
        return f"{self.garment}-{self.motion}-{self.preset}-live"

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def case_of(values: dict[str, Any]) -> Case | LiveCase:
    """The inverse of `plain`."""
    if "server" in values:
        return LiveCase(**values)
    settings = tuple((name, value) for name, value in values["settings"])
    return Case(**{**values, "settings": settings})


def stem(path: str) -> str:
    """A file's name without folder and ending; a name as it is."""
    return path.rpartition("/")[2].partition(".")[0]
