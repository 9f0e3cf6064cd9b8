"""The rest shape on the device, shared by every model that works on triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.geometry.garment import Garment


@dataclass(frozen=True)
class RestShape:
    """`faces` (F,) vec3i; `gradients` (F, 3) vec2 1/m, corner gradients in the pattern; `area` (F,) float32 m^2."""

    faces: wp.array
    gradients: wp.array
    area: wp.array
    face_count: int

    @staticmethod
    def build(garment: Garment, device: str) -> RestShape:
        """Copy the garment's rest quantities to the device."""
        return RestShape(
            wp.array(garment.faces.astype(np.int32), dtype=wp.vec3i, device=device),
            wp.array(garment.corner_gradients().astype(np.float32), dtype=wp.vec2, device=device),
            wp.array(garment.signed_areas().astype(np.float32), dtype=wp.float32, device=device),
            len(garment.faces),
        )
