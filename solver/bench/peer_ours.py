"""A scene of the peers by our solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import warp as wp
from peer_case import FPS
from peer_scenes import PeerScene

from tryon_solver import PRESETS
from tryon_solver.simulation import build

HARD = {"skin_stiffness": 1e5, "skin_hold": 1e3}  # N/m, N: the parts are no skin that yields


class ByOurs:
    """Frame by frame, at a preset."""

    def __init__(self, scene: PeerScene, preset: str, device: str) -> None:
        self.scene, self.device = scene, device
        self.sim = build(scene.scene, replace(PRESETS[preset], **HARD), device, scene.pose(0.0))

    def go(self, frame: int) -> None:
        """To the frame's end, and until the device is done."""
        t = frame / FPS
        self.sim.advance(self.scene.pose(t), t)
        wp.synchronize_device(self.device)

    def cloth(self) -> np.ndarray:
        """(N, 3) m."""
        return self.sim.cloth_positions()

    def surface(self, _frame: int) -> np.ndarray:
        """(B, 3) m, as simulated."""
        return self.sim.body_positions()
