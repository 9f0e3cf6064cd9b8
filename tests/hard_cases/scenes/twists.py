"""Cloth wound up, and a knot pulled tight."""

from __future__ import annotations

import numpy as np
from harness.kit import FREE, JERSEY, Pins, alone, led, ramp, step_of, strip, turned
from harness.scene import Ask, HardScene, Run
from scipy.spatial.transform import Rotation
from small_scenes import garment_of, grid_faces, grid_uv

TURNS = 10
TWISTING = 0.7  # of the time; then it is held
HELD = 2e4  # N/m by which each vertex of the ends is held: a hold that slips keeps fewer turns
SHORTENED = 0.4  # m by which the ends come together while the strip winds up


def twisted(ask: Ask) -> Run:
    """A hanging strip of 3 cm by 1.2 m: its upper end is turned ten times, its lower end rises as a rope's would."""
    garment, x, columns, _ = strip(ask.vertices, 0.03, 1.2)
    row = np.arange(len(x)) // columns
    lower, upper = (np.flatnonzero(row == end) for end in (0, row.max()))
    held = np.concatenate([lower, upper]).astype(np.int32)
    sim = alone(ask, garment, x, effects=(*FREE, Pins(held, HELD)))
    start, stops = x[held], TWISTING * ask.seconds
    is_upper = np.arange(len(held)) >= len(lower)

    def path(t: float) -> np.ndarray:
        share = ramp(t, 0.0, stops)
        wound = turned(start, 2 * np.pi * TURNS * share)
        return np.where(is_upper[:, None], wound, start + [0, SHORTENED * share, 0])

    def lost(cloth: np.ndarray) -> float:
        """Turns; they go where a loop slips over an end."""
        rows = cloth.astype(np.float64).reshape(-1, columns, 3)
        return TURNS - abs(linked(rows[:, 0], rows[:, -1]))

    return Run(sim, dt=step_of(sim), stops=stops, drive=led(sim, path), lost=lost)


def linked(one: np.ndarray, other: np.ndarray) -> float:
    """How often two lines (R, 3) run around each other, if both go on straight up and down: half of their crossings,
    signed, as seen from a side."""
    turn = Rotation.from_euler("y", 0.3).as_matrix().T
    a, b = (extended(line) @ turn for line in (one, other))
    p, r, q, s = a[:-1, None], np.diff(a, axis=0)[:, None], b[None, :-1], np.diff(b, axis=0)[None]
    area, between = flat_cross(r, s), q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t, u = flat_cross(between, s) / area, flat_cross(between, r) / area
        above = np.sign(area) * np.sign((p + t[..., None] * r)[..., 2] - (q + u[..., None] * s)[..., 2])
    return float(above[(t >= 0) & (t < 1) & (u >= 0) & (u < 1)].sum() / 2)


def extended(line: np.ndarray) -> np.ndarray:
    """The line from far below its lower end to far above its upper one."""
    far = 100.0 * np.sign(line[-1, 1] - line[0, 1]) * np.eye(3)[1]
    return np.vstack([line[0] - far, line, line[-1] + far])


def flat_cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Third component of the cross products of (..., 3)."""
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def knotted(ask: Ask) -> Run:
    """A ribbon of 10 mm laid in an open trefoil, its ends drawn apart until the knot is tight."""
    width, columns = 0.01, 4
    rows = max(40, ask.vertices // columns)
    t = np.linspace(-2.15, 2.15, 4001)
    curve = np.column_stack([t**3 - 3 * t, (t**5 - 10 * t) / 7, t**4 - 4 * t**2]) * 0.05  # Shastri's long trefoil
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    along = np.linspace(0, length[-1], rows)
    middle = np.column_stack([np.interp(along, length, curve[:, k]) for k in range(3)])
    tangent = np.gradient(middle, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = across(tangent)
    uv = grid_uv(columns, rows, width, length[-1])
    x = (middle[:, None] + np.linspace(-width / 2, width / 2, columns)[None, :, None] * side[:, None]).reshape(-1, 3)
    ends = np.concatenate([np.arange(columns), np.arange(columns) + columns * (rows - 1)]).astype(np.int32)
    sim = alone(ask, garment_of(uv, grid_faces(columns, rows)), x, effects=(*FREE, Pins(ends, 2.0)))
    outward = (middle[-1] - middle[0]) / np.linalg.norm(middle[-1] - middle[0])
    pulled = np.repeat([-1.0, 1.0], columns)[:, None] * outward
    stops = 0.6 * ask.seconds
    # the springs are soft: once the knot is tight they pull with a force, they do not tear
    drive = led(sim, lambda t: x[ends] + 0.55 * ramp(t, 0.0, stops) * pulled)
    return Run(sim, dt=step_of(sim), stops=stops, drive=drive)


def across(tangent: np.ndarray) -> np.ndarray:
    """(R, 3) unit vectors across a curve's tangents, turned about them as little as can be."""
    side = np.empty_like(tangent)
    now = np.cross(tangent[0], [0.0, 0.0, 1.0])
    for k, t in enumerate(tangent):
        now = now - (now @ t) * t
        now /= np.linalg.norm(now)
        side[k] = now
    return side


SCENES = (
    HardScene("twisted_ten_turns", "a strip wound up ten times: cloth on cloth all along, under tension", twisted),
    HardScene(
        "knot_pulled_tight",
        f"an overhand knot in a ribbon of {JERSEY.name} drawn tight: contact under a force that does not let go",
        knotted,
    ),
)
