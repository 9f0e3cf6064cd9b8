"""Scenes with contact in which the solver is held to the reference: garment, body and the body's motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from small_scenes import STILL, fabric, grid_faces, icosphere, layers, rigid_body, sheet, slab, turn

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import AirDrag, BodyContact, FabricDamping, Friction, Gravity, Scene, SelfContact, StrainLimit

DT = 1 / 60
# stiff enough that cloth on the way to rest has few ways to buckle: slack jersey has many balances a step (METHOD.md)
CANVAS = {"areal_density": 0.35, "k_warp": 600.0, "k_weft": 500.0, "k_shear": 120.0, "k_bend": 3e-4}
EFFECTS = (Gravity(), BodyContact(), SelfContact(), Friction(), StrainLimit(), AirDrag(2.0))


@dataclass(frozen=True)
class ContactScene:
    """`pose_at(k)` is the body's pose at the end of step k, `pose_at(0)` the one to start in."""

    name: str
    scene: Scene
    pose_at: Callable[[int], Pose]


def still(_: int) -> Pose:
    """A body that stands."""
    return STILL


def ripples(x: np.ndarray, height: float) -> np.ndarray:
    """Flat cloth with waves of `height` m, so that which way it buckles is not left to rounding."""
    wave = np.cos(31 * x[:, 0] + 0.4) * np.cos(23 * x[:, 2] - 0.7)
    return x + np.column_stack([0 * wave, height * wave, 0 * wave])


def square_on_sphere() -> ContactScene:
    """529 vertices, askew over a ball of 17 cm."""
    garment, x = sheet(23, 23, 0.5, 0.5)
    x = ripples(x, 0.004) @ turn((4, 20, 3)).T + [0.01, 0.190, 0.004]
    ball, faces = icosphere(0.17, 3)
    scene = Scene(garment, x, rigid_body(ball @ turn((10, 25, 40)).T, faces), fabric(**CANVAS), EFFECTS)
    return ContactScene("square on a sphere", scene, still)


def damped_square_on_sphere() -> ContactScene:
    """The same of a fabric that buckles readily, and is damped: fifty times less stiff in bending."""
    case = square_on_sphere()
    cloth = replace(case.scene.fabric, k_bend=CANVAS["k_bend"] / 50)
    damped = replace(case.scene, fabric=cloth, effects=(*EFFECTS, FabricDamping()))
    return replace(case, name="damped square on a sphere", scene=damped)


def strip_on_slope(mu: float) -> ContactScene:
    """527 vertices along a slope of 20 degrees, tan = 0.36."""
    tilt = turn((0, 0, -20))
    garment, x = sheet(31, 17, 0.30, 0.16)
    body, faces = slab(0.9, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.2, 0.0035, 0.003])) @ tilt.T
    cloth = fabric(**CANVAS, mu_body=mu, mu_self=mu)
    return ContactScene(
        f"strip on a slope, mu {mu}", Scene(garment, x, rigid_body(body @ tilt.T, faces), cloth, EFFECTS), still
    )


def two_sheets() -> ContactScene:
    """Two squares of 289 vertices, the upper turned, one upon the other on a table over whose edges both hang."""
    garment, x = layers(2, 17, 17, 0.3, 0.0)
    n = len(x) // 2
    upper = x[n:] @ turn((0, 17, 0)).T + [0.02, 0.0072, 0.01]
    x = np.vstack([x[:n] + np.array([0, 0.0035, 0]), upper])
    body, faces = slab(0.2, 0.2, 0.02, 0.05)
    scene = Scene(garment, x, rigid_body(body, faces), fabric(**CANVAS), EFFECTS)
    return ContactScene("two stacked sheets", scene, still)


def tube(around: int, along: int, radius: float, length: float) -> tuple[Garment, np.ndarray]:
    """A sewn tube about the x axis, its pattern a rectangle, and its positions (around along, 3) m."""
    grid = grid_faces(around + 1, along)
    width = 2 * around * radius * np.sin(np.pi / around)
    u, v = np.meshgrid(np.linspace(0, width, around + 1), np.linspace(-length / 2, length / 2, along))
    uv = np.column_stack([u.ravel(), v.ravel()])
    column, row = np.arange(len(uv)) % (around + 1), np.arange(len(uv)) // (around + 1)
    welded = column % around + around * row
    angle = 2 * np.pi * np.arange(around) / around
    ring = np.column_stack([0 * angle, radius * np.cos(angle), radius * np.sin(angle)])
    x = np.concatenate([ring + np.array([place, 0, 0]) for place in np.linspace(-length / 2, length / 2, along)])
    return Garment(welded[grid].astype(np.int32), uv[grid], np.zeros(len(grid), np.int32), around * along), x


def limb(radius: float, length: float, around: int, along: int) -> BodyModel:
    """A rod about the x axis with a joint at the origin; its second half follows the joint, smoothly over 10 cm."""
    angle = 2 * np.pi * (np.arange(around) + 0.3) / around
    ring = np.column_stack([0 * angle, radius * np.cos(angle), radius * np.sin(angle)])
    places = np.linspace(-length / 2, length / 2, along)
    x = np.concatenate([*(ring + np.array([p, 0, 0]) for p in places), [[-length / 2, 0, 0], [length / 2, 0, 0]]])
    faces = []
    for j in range(along - 1):
        for i in range(around):
            a, b = i + around * j, (i + 1) % around + around * j
            faces += [[a, b + around, b], [a, a + around, b + around]]
    last = around * (along - 1)
    for i in range(around):
        k = (i + 1) % around
        faces += [[around * along, i, k], [around * along + 1, last + k, last + i]]
    share = np.clip(0.5 + x[:, 0] / 0.10, 0, 1)
    share = share * share * (3 - 2 * share)
    return BodyModel(
        x,
        np.array(faces, np.int32)[:, ::-1].copy(),
        ("upper", "lower"),
        np.array([-1, 0], np.int32),
        np.zeros((2, 3)),
        np.tile(np.array([0, 1], np.int32), (len(x), 1)),
        np.column_stack([1 - share, share]).astype(np.float32),
    )


def sleeve_on_limb() -> ContactScene:
    """528 vertices around a rod that bends by 1.5 degrees a step, 40 degrees at most."""
    garment, x = tube(24, 22, 0.052, 0.3)
    body = limb(0.045, 0.42, 18, 27)

    def bent(k: int) -> Pose:
        turned = Rotation.from_euler("y", min(1.5 * k, 40.0), degrees=True).as_quat()
        return Pose(np.zeros(3), np.array([[0.0, 0, 0, 1], turned]))

    scene = Scene(garment, x, body, fabric(**CANVAS), EFFECTS)
    return ContactScene("sleeve on a bending limb", scene, bent)


SCENES: dict[str, Callable[[], ContactScene]] = {
    "square": square_on_sphere,
    "damped square": damped_square_on_sphere,
    "strip below mu": lambda: strip_on_slope(0.6),
    "strip above mu": lambda: strip_on_slope(0.15),
    "sleeve": sleeve_on_limb,
    "sheets": two_sheets,
}
