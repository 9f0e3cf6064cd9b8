"""Two strips with closed forms: one that bends under its own weight, one that wrinkles when it is gathered.

- Bending length c = (B/w)^(1/3) (Peirce 1930), B = k_bend and w the weight of an area: a strip that juts out by L over
  an edge bends as the heavy elastica, B theta'' = w (L - s) cos theta, whose chord's angle tells L/c. The chord of a
  simulated strip is measured, and the c told for which the elastica has that angle. It lies with its middle on a line
  and hangs down on both sides, mirror images: there it is level, and begins to bend in that very line. Were some of its
  vertices held flat instead, it would begin to bend half an edge before the last of them or after, as its triangles
  lie, and B goes with the cube of the length.
- Wavelength of a sheet under tension T along its length L, drawn together across: 2 sqrt(pi) (B/T)^(1/4) sqrt(L)
  (Cerda and Mahadevan 2003): bending resists short waves, tension long ones, for they are higher.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from discretisation_rest import AT_60, come_to_rest, live_with, meshed, tailors_row
from scipy.integrate import solve_bvp
from scipy.interpolate import LinearNDInterpolator
from scipy.optimize import brentq

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import AirDrag, FabricDamping, Gravity, Pins, Scene, StrainLimit
from tryon_solver.simulation import build

G = 9.81


@dataclass(frozen=True)
class Strip:
    """`long` along x and `wide` [m], of a fabric; edges of meshes [mm], and `edge` where it is not what is varied."""

    long: float
    wide: float
    fabric: str
    edges: tuple[float, ...]
    edge: float

    def meshed(self, edge: float) -> tuple[Garment, np.ndarray]:
        """Garment and flat places (N, 3) m, x from 0 on and z about 0."""
        outline = np.array([[0, -0.5], [1, -0.5], [1, 0.5], [0, 0.5]]) * [self.long, self.wide]
        garment, uv = meshed(outline, 1e-3 * edge)
        uv = uv - uv.min(0) - [0, 0.5 * self.wide]
        return garment, np.column_stack([uv[:, 0], np.zeros(len(uv)), -uv[:, 1]])

    def with_mirror_image(self, edge: float) -> tuple[Garment, np.ndarray]:
        """The same, and its mirror image at x = 0, one piece."""
        half, x = self.meshed(edge)
        middle = x[:, 0] < 1e-9
        twin = np.where(middle, np.arange(len(x)), len(x) + np.cumsum(~middle) - 1)
        faces = np.vstack([half.faces, twin[half.faces][:, ::-1]]).astype(np.int32)
        corners = np.concatenate([half.uv_corners, (half.uv_corners * [-1, 1])[:, ::-1]])
        places = np.vstack([x, x[~middle] * [-1, 1, 1]])
        return Garment(faces, corners, np.zeros(len(faces), np.int32), len(places)), places


BENT = Strip(0.06, 0.10, "wool_twill", (8.0, 5.0, 3.5, 2.5), 3.5)
WRINKLED = Strip(0.25, 0.30, "cotton_poplin", (16.0, 12.0, 8.0, 6.0), 6.0)
STRETCHED, GATHERED = 0.04, 0.004  # by which the sheet is longer than its pattern, and narrower in the end
GATHERING = 0.001  # 1/s: so slowly that the first wave to grow is the one that needs least
NOISE = 3e-4  # m, of a sheet that does not know yet how it will wrinkle
HARMONICS = 40  # half waves across the sheet that are looked for


def bending_length(edge: float | None = None, rate: float | None = None) -> dict[str, Any]:
    """The bending length [mm] of a cantilever, with edges of `edge` mm or so many steps a second."""
    garment, x = BENT.with_mirror_image(edge or BENT.edge)
    fabric = FABRICS[BENT.fabric]
    effects = (Gravity(), AirDrag(), FabricDamping(), StrainLimit(), Pins(np.flatnonzero(np.abs(x[:, 0]) < 1e-9)))
    sim = build(Scene(garment, x, None, fabric, effects), live_with(rate or AT_60), "cpu")
    cloth, speed = come_to_rest(sim, None)
    tip = cloth[x[:, 0] > BENT.long - 1e-6].mean(0)
    found = BENT.long / ratio_of_angle(np.arctan2(-tip[1], tip[0])) ** (1 / 3)
    exact = (fabric.k_bend / (fabric.areal_density * G)) ** (1 / 3)
    varied = {"edge [mm]": edge} if edge else {"steps [1/s]": rate}
    return tailors_row("bending length", "mm", 1e3 * found, varied, len(x), 1e3 * exact, speed=speed)


def ratio_of_angle(angle: float) -> float:
    """w L^3/B of the heavy elastica whose chord falls by that angle from the horizontal."""
    return float(brentq(lambda ratio: chord_angle(ratio) - angle, 0.05, 200.0, xtol=1e-6))


def chord_angle(ratio: float) -> float:
    """By how much [radians] the chord of the heavy elastica falls: theta(0) = 0, theta'(1) = 0."""

    def slopes(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], ratio * (1 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0, 1, 101)
    guess = np.vstack([-0.5 * s, -0.5 + 0 * s, s, -0.2 * s])
    found = solve_bvp(slopes, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, guess, tol=1e-8)
    assert found.success
    return float(np.arctan2(-found.y[3, -1], found.y[2, -1]))


def wrinkle_wavelength(edge: float | None = None, rate: float | None = None) -> dict[str, Any]:
    """The mean wavelength [mm] across the middle of a stretched sheet whose border is drawn together."""
    garment, x = WRINKLED.meshed(edge or WRINKLED.edge)
    fabric = FABRICS[WRINKLED.fabric]
    x = x * [1 + STRETCHED, 1, 1]
    long, half = x[:, 0].max(), 0.5 * WRINKLED.wide
    border = (x[:, 0] < 1e-6) | (x[:, 0] > long - 1e-6) | (np.abs(x[:, 2]) > half - 1e-6)
    x[~border, 1] = NOISE * np.random.default_rng(3).uniform(-1, 1, int((~border).sum()))
    effects = (AirDrag(), FabricDamping(), Pins(np.flatnonzero(border)))
    sim = build(Scene(garment, x, None, fabric, effects), live_with(rate or AT_60), "cpu")
    (places,) = (c.values["places"] for c in sim.plan.contributions if c.name == "pins")
    dt = sim.settings.largest_step
    for k in range(1, round(GATHERED / GATHERING / dt) + 1):
        places.assign((x[border] * [1, 1, 1 - k * dt * GATHERING]).astype(np.float32))
        sim.advance(None, k * dt)
    cloth, speed = come_to_rest(sim, None)
    half *= 1 - GATHERED
    tension = fabric.k_warp * STRETCHED
    exact = 2 * np.sqrt(np.pi) * (fabric.k_bend / tension) ** 0.25 * np.sqrt(long)
    across = np.linspace(-half, half, 401)
    height = LinearNDInterpolator(cloth[:, [0, 2]], cloth[:, 1], fill_value=0.0)(0.5 * long, across)
    number = np.arange(1, HARMONICS + 1)
    power = (np.sin(np.pi * number[:, None] * (across + half) / (2 * half)) @ height) ** 2
    found = 4 * half / ((power * number).sum() / power.sum())
    varied = {"edge [mm]": edge} if edge else {"steps [1/s]": rate}
    more = {"speed": speed, "height": 1e3 * float(np.abs(height).max())}
    return tailors_row("wrinkle wavelength", "mm", 1e3 * found, varied, len(x), 1e3 * exact, **more)
