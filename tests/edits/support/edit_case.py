"""What is edited, how often, and while the body does what: one case, and all that make up the proof."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.redesign.edits import KINDS

DEMO = Path(__file__).resolve().parents[3] / "server" / "tryon_server" / "demo"
GARMENTS = ("tshirt", "dress", "trousers")
MIXED = "mixed"
SMALL = 0.93  # of the T-shirt's size: what that is tight is called


@dataclass(frozen=True)
class EditCase:
    """A garment of the demo in `size` times its own, worn in a motion of the demo, to which `edits` edits are made.

    Attributes:
        kind: of all its edits, each taken back before the next; or `mixed`: any, of them up to `deepest` at a time.
        at_once: the first edit is asked for before the garment is dressed.
        deepest: so many edits are made before any is taken back for certain.
        continued: frames that it goes on for after all is taken back.
        deterministic: asked of the solver, so that what is put on twice on a GPU moves to the same bits.
        minutes: after which no edit is begun any more, and what was made is taken back; 0: all are made.
    """

    garment: str = "tshirt"
    motion: str = "walk"
    edits: int = 500
    kind: str = MIXED
    size: float = 1.0
    at_once: bool = False
    vertices: int = 2500
    fabric: str = "cotton_jersey"
    preset: str = "draft"
    device: str = "cpu"
    seed: int = 1
    deepest: int = 12
    continued: int = 120
    deterministic: bool = False
    minutes: float = 0.0

    @property
    def name(self) -> str:
        """Of its files and its row."""
        said = [self.garment, self.motion, self.kind]
        said += [f"size_{self.size:g}"] * (self.size != 1.0) + ["dressing"] * self.at_once
        said += [f"seed_{self.seed}"] * (self.seed != 1) + ["deterministic"] * self.deterministic
        return "-".join([*said, f"{self.edits}x{self.vertices}", self.preset, self.device.replace(":", "")])

    @property
    def pattern(self) -> Path:
        """The pattern's file."""
        return DEMO / "patterns" / f"{self.garment}.json"

    def plain(self) -> dict[str, Any]:
        """Ready for JSON."""
        return asdict(self)


def whole_proof(edits: int, each: int, **more: Any) -> list[EditCase]:
    """Mixed edits of all garments, `each` of every kind, and those in fast motion, while dressing and of tight ones."""
    return [
        *(EditCase(garment, edits=edits, **more) for garment in GARMENTS),
        EditCase(motion="jumping_jack", edits=each, **more),
        EditCase(size=SMALL, edits=each, **more),
        EditCase(edits=each, at_once=True, **more),
        *(EditCase(kind=kind, edits=each, **more) for kind in KINDS),
    ]


def mean_edge(mesh: PanelMesh) -> float:
    """Mean length [m] of the edges of a mesh in its pattern: of about as long ones another is made."""
    corners = mesh.uv[mesh.faces]
    return float(np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).mean())
