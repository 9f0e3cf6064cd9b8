"""Fabrics far from any shop's: bending, stretch and weight by powers of ten."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from harness.kit import JERSEY, hard, laid, on_body, rippled, square, turned
from harness.obstacles import corner
from harness.scene import Ask, HardScene, Run
from small_scenes import STILL, fabric, rigid_body

from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import Scene
from tryon_solver.simulation import build

BOARD = 1e4  # times the bending stiffness of jersey: nothing hangs from a corner any more


def draped(ask: Ask, stops: float = 1.5, parts: bool = False, **values: float) -> Run:
    """A square of cotton jersey with some values changed, dropped over a corner, from which it may slide off."""
    garment, x = square(ask.vertices, 0.3)
    x = turned(rippled(x, 2e-3), 0.3) + [0.004, 0.014, 0.003]
    return laid(on_body(ask, garment, x, rigid_body(*corner(0.2, 4)), fabric(**values)), stops, parts=parts)


def bent(times: float) -> HardScene:
    """Bending stiffness so many times that of jersey. A board whose middle is 5 mm off the corner slides off it."""
    return HardScene(
        f"bending_{times:g}",
        f"bending stiffness {times:g} times that of {JERSEY.name}",
        lambda ask: draped(ask, parts=times >= BOARD, k_bend=times * JERSEY.k_bend),
    )


def stretched(times: float) -> HardScene:
    """Stretch and shear stiffness so many times that of jersey."""
    return HardScene(
        f"stretch_{times:g}",
        f"stretch and shear stiffness {times:g} times that of {JERSEY.name}",
        lambda ask: draped(
            ask, k_warp=times * JERSEY.k_warp, k_weft=times * JERSEY.k_weft, k_shear=times * JERSEY.k_shear
        ),
    )


def weighing(times: float) -> HardScene:
    """Weight per area so many times that of jersey; what is light sinks in the air for seconds."""
    seconds, stops = (5.0, 1.5) if times >= 1 else (12.0, 9.0)
    return HardScene(
        f"weight_{times:g}",
        f"{times * JERSEY.areal_density:g} kg/m^2, {times:g} times {JERSEY.name}",
        lambda ask: draped(ask, stops, areal_density=times * JERSEY.areal_density),
        seconds=seconds,
    )


def unlike(ask: Ask, rim: dict[str, float], middle: dict[str, float]) -> Run:
    """A square over a corner whose rim and middle, 16 cm across, have some of jersey's values so many times."""
    garment, x = square(ask.vertices, 0.3)
    inside = (np.linalg.norm(garment.uv_corners.mean(1), axis=1) < 0.08).astype(np.int32)
    pieces = Garment(garment.faces, garment.uv_corners, inside, garment.vertex_count)
    fabrics = tuple(
        replace(JERSEY, name=name, **{value: t * getattr(JERSEY, value) for value, t in times.items()})
        for name, times in (("rim", rim), ("middle", middle))
    )
    x = turned(rippled(x, 2e-3), 0.3) + [0.004, 0.014, 0.003]
    scene = Scene(pieces, x, rigid_body(*corner(0.2, 4)), JERSEY, panel_fabrics=fabrics)
    return laid(build(scene, hard(ask.settings), ask.device, STILL), stops=1.5)


def stretching(times: float) -> dict[str, float]:
    """Stretch and shear stiffness so many times jersey's."""
    return {"k_warp": times, "k_weft": times, "k_shear": times}


SCENES = (
    HardScene(
        "stretch_ratio_1e6",
        "the middle of a cloth stretches a thousand times less than jersey, its rim a thousand times more",
        lambda ask: unlike(ask, stretching(1e-3), stretching(1e3)),
    ),
    HardScene(
        "weight_ratio_1e6",
        "a cloth of 18 kg/m^2 in the middle and of 18 mg/m^2 at the rim",
        lambda ask: unlike(ask, {"areal_density": 1e-4}, {"areal_density": 1e2}),
    ),
    HardScene(
        "bending_ratio_1e6",
        "the middle of a cloth is a board, its rim a film",
        lambda ask: unlike(ask, {"k_bend": 1e-2}, {"k_bend": 1e4}),
    ),
    *(bent(times) for times in (0.0, 1e2, 1e4)),
    *(stretched(times) for times in (1e-2, 1e3)),
    *(weighing(times) for times in (1e-2, 1e2)),
)
