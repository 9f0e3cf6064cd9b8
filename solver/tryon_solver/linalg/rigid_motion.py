"""Rigid motions on the device, held less the identity: A - 1 is small, where A x - x would lose digits."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})

mat34 = wp.types.matrix(shape=(3, 4), dtype=wp.float32)  # the upper rows of A - 1: takes (x, 1) to A x - x


@wp.func
def displaced(motion: mat34, here: wp.vec3) -> wp.vec3:
    """How far a rigid motion takes what is here."""
    return motion * wp.vec4(here[0], here[1], here[2], 1.0)
