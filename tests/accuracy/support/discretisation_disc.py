"""Cusick's drape test: a disc of 300 mm on a pedestal of 180 mm, and how much of the overhang its shadow still shows.

Drape coefficient = (shadow - pedestal)/(disc - pedestal), areas seen from above (Cusick 1968; BS 5058). The plate that
holds the disc down is left out: friction does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from against_reference import KEPT_IN, rms
from discretisation_rest import AT_60, come_to_rest, live_with, meshed, tailors_row
from small_scenes import STILL, rigid_body

from tryon_solver.baselines.newton_ipc import Reference
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import build

SECTIONS = 72  # corners of either circle
TALL = 0.2  # m, the pedestal
RIPPLE = 1e-3  # m, so that where it folds is not left to rounding
FOLDS = 5  # of the ripple
HANGING = 1.5  # s, for which the disc is held to the reference's


@dataclass(frozen=True)
class Disc:
    """Radii [m], edges of meshes [mm]; `edge` where it is not what is varied, `coarse` beside the reference."""

    radius: float = 0.15
    pedestal: float = 0.09
    edges: tuple[float, ...] = (20.0, 14.0, 10.0, 7.0, 5.0)
    edge: float = 10.0
    coarse: float = 20.0
    fabric: str = "wool_twill"


DISC = Disc()


def drape(
    edge: float | None = None, rate: float | None = None, d_hat: float | None = None, thickness: float | None = None
) -> dict[str, Any]:
    """The drape coefficient [%] and how many folds, with one size changed: edge [mm], steps a second, d_hat [mm] or
    thickness [mm]."""
    settings = live_with(rate or AT_60, **({} if d_hat is None else {"d_hat": 1e-3 * d_hat}))
    scene = disc_scene(edge or DISC.edge, settings, None if thickness is None else 1e-3 * thickness)
    sim = build(scene, settings, "cpu", STILL)
    cloth, speed = come_to_rest(sim, STILL)
    asked = {"edge [mm]": edge, "steps [1/s]": rate, "d_hat [mm]": d_hat, "thickness [mm]": thickness}
    varied = {name: value for name, value in asked.items() if value is not None}
    coefficient, folds = of_shadow(scene, cloth)
    more = {"folds": folds, "speed": speed}
    return tailors_row("drape coefficient", "%", 100 * coefficient, varied, len(cloth), **more)


def drape_against_reference(preset: str) -> dict[str, Any]:
    """The drape coefficient [%] after HANGING s at a preset in its own steps, and `off`, how far RMS [mm] the cloth is
    from where the float64 reference is after as long in the same steps."""
    settings = PRESETS[preset]
    scene = disc_scene(DISC.coarse, settings)
    sim, reference = build(scene, settings, "cpu", STILL), Reference(scene, kept_in=KEPT_IN)
    motion, dt = reference.start(STILL), settings.largest_step
    for k in range(1, round(HANGING / dt) + 1):
        sim.advance(STILL, k * dt)
        motion = reference.step(motion, STILL, dt)
    cloth, exact = sim.cloth_positions().astype(np.float64), motion.x[: sim.cloth_count]
    coefficient, folds = of_shadow(scene, cloth)
    more = {"preset": preset, "off": 1e3 * rms(cloth - exact), "folds": folds}
    truth = 100 * of_shadow(scene, exact)[0]
    return tailors_row("settled drape", "%", 100 * coefficient, {"steps [1/s]": 1 / dt}, len(cloth), truth, **more)


@dataclass(frozen=True)
class Start:
    """How a disc is laid on: its mesh turned by `turned` degrees against the warp, and the ripple it falls from, of
    `folds` waves, `ahead` rad. One cloth has several ways to fold."""

    turned: float = 0.0
    folds: int = FOLDS
    ahead: float = 0.3


def disc_scene(
    edge: float,
    settings: Settings,
    thickness: float | None = None,
    fabric: Fabric = FABRICS[DISC.fabric],
    start: Start = Start(),
) -> Scene:
    """The disc, meshed by edges of `edge` mm, just out of reach above the pedestal."""
    garment, uv = meshed(circle(DISC.radius), 1e-3 * edge)
    turn = np.deg2rad(start.turned)
    to_grain = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    garment = replace(garment, uv_corners=garment.uv_corners @ to_grain)
    fabric = fabric if thickness is None else replace(fabric, thickness=thickness)
    top = settings.body_offset + 0.5 * fabric.thickness + settings.d_hat
    angle, radius = np.arctan2(uv[:, 1], uv[:, 0]), np.linalg.norm(uv, axis=1)
    wave = RIPPLE * (1 + np.cos(start.folds * angle + start.ahead)) * (radius / DISC.radius) ** 2
    x = np.column_stack([uv[:, 0], top + wave, -uv[:, 1]])
    stand = trimesh.creation.cylinder(radius=DISC.pedestal, height=TALL, sections=SECTIONS).subdivide()
    lying = np.asarray(stand.vertices)
    places = np.column_stack([lying[:, 0], lying[:, 2] - 0.5 * TALL, -lying[:, 1]])
    return Scene(garment, x, rigid_body(places, np.asarray(stand.faces, np.int32)), fabric, WORN)


def circle(radius: float) -> np.ndarray:
    """(SECTIONS, 2) m, a polygon of the circle's area."""
    angle = 2 * np.pi * np.arange(SECTIONS) / SECTIONS
    fair = np.sqrt(2 * np.pi / SECTIONS / np.sin(2 * np.pi / SECTIONS))
    return fair * radius * np.column_stack([np.cos(angle), np.sin(angle)])


def of_shadow(scene: Scene, cloth: np.ndarray) -> tuple[float, int]:
    """Drape coefficient of cloth (N, 3) m, and how often its outline goes out and in again."""
    outline = shadow(scene, cloth)
    area = np.pi * (outline**2).mean()
    inner, outer = np.pi * DISC.pedestal**2, np.pi * DISC.radius**2
    waves = np.abs(np.fft.rfft(outline))[1:21]
    return float((area - inner) / (outer - inner)), int(1 + np.argmax(waves))


def shadow(scene: Scene, cloth: np.ndarray, directions: int = 720) -> np.ndarray:
    """(directions,) m, from the pedestal's middle to the edge of the shadow of cloth (N, 3) m."""
    faces = scene.garment.faces
    sides = np.unique(np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    share = np.linspace(0, 1, 20)[:, None, None]
    points = ((1 - share) * cloth[sides[:, 0]] + share * cloth[sides[:, 1]]).reshape(-1, 3)[:, [0, 2]]
    which = ((np.arctan2(points[:, 1], points[:, 0]) / (2 * np.pi) % 1) * directions).astype(int) % directions
    outline = np.zeros(directions)
    np.maximum.at(outline, which, np.linalg.norm(points, axis=1))
    return outline
