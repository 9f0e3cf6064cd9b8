"""Which scene of the peers is played by which solver, and whether that can be."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Any

PEER_SCENES = ("sphere-drop", "limb-tube")
FPS = 60.0  # of the scenes
PRESETS = ("draft", "live", "fit")
NEWTON = ("vbd", "style3d", "style3d-4", "xpbd")
OTHERS = (*NEWTON, "uipc")
TITLES = {
    "vbd": "Newton's VBD",
    "style3d": "Newton's Style3D",
    "style3d-4": "Newton's Style3D, 4 iterations",
    "xpbd": "Newton's XPBD",
    "uipc": "libuipc",
}
NEEDS = {
    "newton": "Newton is not installed: pip install '.[peers]'",
    "uipc": "libuipc is not installed: pip install '.[peers-gpu]' (pyuipc, wheels for an NVIDIA GPU)",
}


@dataclass(frozen=True)
class PeerCase:
    """A scene by name, about how many vertices, by which solver, ours by its preset, on which device, how long [s]."""

    scene: str
    vertices: int
    solver: str
    device: str
    seconds: float

    @property
    def name(self) -> str:
        """For file names and tables."""
        return f"{self.scene}-{self.vertices}-{self.solver}-{self.device.replace(':', '')}"

    @property
    def title(self) -> str:
        """Of the solver."""
        return TITLES.get(self.solver, f"ours, {self.solver}")

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {**vars(self), "title": self.title}

    def missing(self) -> str:
        """What it needs that is not installed, and how to get it; "" when it can be played."""
        module = "newton" if self.solver in NEWTON else "uipc" if self.solver == "uipc" else ""
        if module and importlib.util.find_spec(module) is None:
            return NEEDS[module]
        if module == "uipc" and "cuda" not in self.device:
            return f"libuipc simulates on an NVIDIA GPU only, not on {self.device}: --device cuda:0"
        return ""
