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
        garment: a pattern of the demo, or a file; a mesh where the motion is one.
        motion: a motion of the demo, a BVH file, or a moving mesh, which is played once from its first frame.
        fabric, preset, device: names.
        edge: edge length of the cloth's mesh [m]; 0 for what gives so many `vertices`.
        fps: published frames per simulated second.
        lead: time in which the body is led into the motion [s].
        seconds: time of the motion, which repeats when it is shorter [s]; 0 plays it once, whole.
        stopping: time at the end of that in which it slows down evenly to a stand; 0 stops it dead [s].
        standing: time for which the body then stands still [s].
        every: every so many frames IPC Toolkit is asked.
        settings: solver settings that differ from the preset's, and, as `Friction.presliding`, values of an effect.
        vertices: of the cloth's mesh, about, where no edge length is given.
        size: of the pattern, over its own; 0 for the one that fits, which is looked for.
    """

    garment: str
    motion: str
    fabric: str
    preset: str
    device: str
    edge: float
    fps: float
    lead: float = 0.0
    seconds: float = 0.0
    stopping: float = 0.0
    standing: float = 0.0
    every: int = 2
    settings: tuple[tuple[str, float | str], ...] = ()
    vertices: int = 2000
    size: float = 1.0

    @property
    def name(self) -> str:
        """For file names."""
        device = self.device.replace(":", "")
        fineness = "mesh" if is_of_meshes(self) else f"{1e3 * self.edge:g}mm" if self.edge else str(self.vertices)
        return f"{stem(self.garment)}-{stem(self.motion)}-{self.preset}-{fineness}-{device}"

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


def is_of_meshes(case: Case | LiveCase) -> bool:
    """Whether garment and body are meshes."""
    return case.garment.endswith((".obj", ".glb"))


def stem(path: str) -> str:
    """A file's name without folder and ending; a name as it is."""
    return path.rpartition("/")[2].partition(".")[0]
