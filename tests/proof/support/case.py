"""What a case is, and what came of it: plain values that travel between processes and into JSON files."""

from __future__ import annotations

from dataclasses import asdict, dataclass

GARMENTS = ("tshirt", "skirt", "dress")
MOTIONS = ("walk", "squat", "jumping_jack")


@dataclass(frozen=True)
class Case:
    """One garment in one motion.

    Attributes:
        garment: a pattern of the demo, or a file.
        motion: a motion of the demo, or a BVH file.
        fabric, preset, device: names.
        edge: edge length of the cloth's mesh [m].
        fps: published frames per simulated second.
        lead: time in which the body is led into the motion [s].
        seconds: time of the motion, which repeats when it is shorter [s].
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
    standing: float
    every: int
    settings: tuple[tuple[str, float | str], ...] = ()

    @property
    def name(self) -> str:
        """For file names and tables."""
        return f"{stem(self.garment)}-{stem(self.motion)}-{self.preset}-{1e3 * self.edge:g}mm-{self.device}".replace(
            ":", ""
        )

    @staticmethod
    def from_plain(values: dict[str, object]) -> Case:
        """The inverse of `plain`."""
        known = dict(values)
        known["settings"] = tuple((name, value) for name, value in known["settings"])  # type: ignore[attr-defined]
        return Case(**known)  # type: ignore[arg-type]

    def plain(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def stem(path: str) -> str:
    """A file's name without folder and ending; a name as it is."""
    return path.rpartition("/")[2].partition(".")[0]
