"""What a case looks like frame by frame, kept in a file beside its figures, for pictures."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.subject import Subject


@dataclass
class Frames:
    """Entry k is frame k, at k dt [s]; positions in m. A surface that stands still is kept once."""

    faces: np.ndarray  # (F, 3) of the cloth
    body_faces: np.ndarray  # (G, 3) of the surface, in its own numbering
    dt: float
    cloth: list[np.ndarray] = field(default_factory=list)  # (N, 3) float32
    surface: list[np.ndarray] = field(default_factory=list)  # (B, 3) float32

    @staticmethod
    def of(subject: Subject, dt: float) -> Frames:
        """None yet of this subject."""
        return Frames(subject.faces, subject.body_faces, dt)

    def note(self, cloth: np.ndarray, surface: np.ndarray) -> None:
        """One more frame."""
        self.cloth.append(cloth.astype(np.float32))
        same = bool(self.surface) and np.array_equal(self.surface[-1], surface)
        self.surface.append(self.surface[-1] if same else surface.astype(np.float32))

    def save(self, path: Path) -> None:
        stands = all(surface is self.surface[0] for surface in self.surface)
        surface = np.array(self.surface[:1] if stands else self.surface)
        kept = {"faces": self.faces, "body_faces": self.body_faces, "dt": np.array(self.dt)}
        np.savez_compressed(path, cloth=np.array(self.cloth), surface=surface, **kept)

    @staticmethod
    def load(path: Path) -> Frames:
        with np.load(path) as kept:
            cloth, surface = list(kept["cloth"]), list(kept["surface"])
            surface = surface * len(cloth) if len(surface) == 1 else surface
            return Frames(kept["faces"], kept["body_faces"], float(kept["dt"]), cloth, surface)
