"""Pieces that many cases are made of: cloths, the way they are led, settings of things that are no skin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp
from small_scenes import STILL, garment_of, grid_faces, grid_uv, layers, rigid_body, sheet, slab

from harness.scene import FRAME, Ask, Run
from tryon_solver.body.model import BodyModel
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.scene import WORN, Effect, Pins, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import Simulation, build

JERSEY = FABRICS["cotton_jersey"]
FREE: tuple[Effect, ...] = tuple(effect for effect in WORN if type(effect).__name__ != "BodyContact")
"""What acts on cloth without a body."""

HARD_STIFFNESS = 1e5  # N/m and
HARD_HOLD = 1e3  # N: what is no skin yields to no cloth


def hard(settings: Settings) -> Settings:
    """For obstacles of wood and metal: their surface does not yield."""
    return replace(settings, skin_stiffness=HARD_STIFFNESS, skin_hold=HARD_HOLD)


def square(vertices: int, size: float) -> tuple[Garment, np.ndarray]:
    """A square of `size` m with about so many vertices, flat in y = 0."""
    n = max(3, round(np.sqrt(vertices)))
    return sheet(n, n, size, size)


def strip(vertices: int, width: float, length: float) -> tuple[Garment, np.ndarray, int, int]:
    """A strip along -y from the origin, its columns across x; also how many columns and rows it has."""
    columns = max(3, round(np.sqrt(vertices * width / length)))
    rows = max(3, round(vertices / columns))
    uv = grid_uv(columns, rows, width, length)
    x = np.column_stack([uv[:, 0], uv[:, 1] - length / 2, np.zeros(len(uv))])
    return garment_of(uv, grid_faces(columns, rows)), x, columns, rows


def rippled(x: np.ndarray, height: float) -> np.ndarray:
    """Flat cloth with waves of `height` m along its normal y, so that which way it buckles is not left to rounding."""
    wave = np.cos(31 * x[:, 0] + 0.4) * np.cos(23 * x[:, 2] - 0.7)
    return x + np.column_stack([0 * wave, height * wave, 0 * wave])


def joined(pieces: Sequence[tuple[Garment, np.ndarray]]) -> tuple[Garment, np.ndarray]:
    """Several pieces as one garment, each a panel of its own."""
    starts = np.cumsum([0, *(g.vertex_count for g, _ in pieces)])
    garment = Garment(
        np.vstack([g.faces + s for (g, _), s in zip(pieces, starts)]).astype(np.int32),
        np.vstack([g.uv_corners for g, _ in pieces]),
        np.repeat(np.arange(len(pieces), dtype=np.int32), [len(g.faces) for g, _ in pieces]),
        int(starts[-1]),
    )
    return garment, np.vstack([x for _, x in pieces])


def table(width: float = 0.6, cell: float = 0.06) -> BodyModel:
    """A slab whose top lies in y = 0."""
    return rigid_body(*slab(width, width, 0.04, cell))


def on_body(
    ask: Ask,
    garment: Garment,
    x: np.ndarray,
    body: Any,
    fabric: Fabric = JERSEY,
    effects: tuple[Effect, ...] = WORN,
    settings: Settings | None = None,
) -> Simulation:
    """The scene built, the body in its first stance."""
    stance = STILL if isinstance(body, BodyModel) else body.start()
    return build(Scene(garment, x, body, fabric, effects), settings or hard(ask.settings), ask.device, stance)


def alone(
    ask: Ask, garment: Garment, x: np.ndarray, fabric: Fabric = JERSEY, effects: tuple[Effect, ...] = FREE
) -> Simulation:
    """The scene built without a body."""
    return build(Scene(garment, x, None, fabric, effects), ask.settings, ask.device)


def laid(sim: Simulation, stops: float, **more: Any) -> Run:
    """Cloth that falls on something that stands still; it has landed at `stops` s."""
    return Run(sim, lambda _t: STILL, step_of(sim), stops, **more)


def step_of(sim: Simulation) -> float:
    """Frames are as long as the settings' solver steps [s], so that a frame is a step."""
    return sim.settings.largest_step


def led(sim: Simulation, path: Callable[[float], np.ndarray]) -> Callable[[float], None]:
    """What writes `path`'s places (K, 3) m of a time into the pins before each frame."""
    places = next(c for c in sim.plan.contributions if c.name == "pins").values["places"]

    def drive(t: float) -> None:
        places.assign(wp.array(path(t).astype(np.float32), dtype=wp.vec3, device=places.device))

    return drive


def ramp(t: float, begin: float, end: float) -> float:
    """From 0 at `begin` to 1 at `end` s, softly."""
    s = float(np.clip((t - begin) / (end - begin), 0, 1))
    return s * s * (3 - 2 * s)


def turned(x: np.ndarray, angle: float) -> np.ndarray:
    """(K, 3) turned about y by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * x[:, 0] + s * x[:, 2], x[:, 1], -s * x[:, 0] + c * x[:, 2]])


__all__ = [
    "FRAME",
    "FREE",
    "JERSEY",
    "Pins",
    "alone",
    "hard",
    "joined",
    "laid",
    "layers",
    "led",
    "on_body",
    "ramp",
    "rippled",
    "sheet",
    "square",
    "step_of",
    "strip",
    "table",
    "turned",
]
