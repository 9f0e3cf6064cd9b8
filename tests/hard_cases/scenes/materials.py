"""Fabrics far from any shop's: bending, stretch and weight by powers of ten."""

from __future__ import annotations

from harness.kit import JERSEY, laid, on_body, rippled, square, turned
from harness.obstacles import corner
from harness.scene import Ask, HardScene, Run
from small_scenes import fabric, rigid_body


def draped(ask: Ask, **values: float) -> Run:
    """A square of cotton jersey with some values changed, dropped over a corner."""
    garment, x = square(ask.vertices, 0.3)
    x = turned(rippled(x, 2e-3), 0.3) + [0.004, 0.014, 0.003]
    return laid(on_body(ask, garment, x, rigid_body(*corner(0.2, 4)), fabric(**values)), stops=1.5)


def bent(times: float) -> HardScene:
    """Bending stiffness so many times that of jersey."""
    return HardScene(
        f"bending_{times:g}",
        f"bending stiffness {times:g} times that of {JERSEY.name}",
        lambda ask: draped(ask, k_bend=times * JERSEY.k_bend),
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
    """Weight per area so many times that of jersey."""
    return HardScene(
        f"weight_{times:g}",
        f"{times * JERSEY.areal_density:g} kg/m^2, {times:g} times {JERSEY.name}",
        lambda ask: draped(ask, areal_density=times * JERSEY.areal_density),
    )


SCENES = (
    *(bent(times) for times in (0.0, 1e2, 1e4)),
    *(stretched(times) for times in (1e-2, 1e3)),
    *(weighing(times) for times in (1e-2, 1e2)),
)
