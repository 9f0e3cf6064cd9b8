"""Cloth wound up, and a knot pulled tight."""

from __future__ import annotations

import numpy as np
from harness.kit import FREE, JERSEY, Pins, alone, led, ramp, step_of, strip, turned
from harness.scene import Ask, HardScene, Run
from small_scenes import garment_of, grid_faces, grid_uv

TURNS = 10
TWISTING = 0.7  # of the time; then it is held
SHORTENED = 0.5  # m by which the ends come together while the strip winds up


def twisted(ask: Ask) -> Run:
    """A hanging strip of 4 cm by 1.2 m: its upper end is turned ten times, its lower end rises as a rope's would."""
    garment, x, columns, _ = strip(ask.vertices, 0.04, 1.2)
    row = np.arange(len(x)) // columns
    middle = np.abs(x[:, 0]) < 0.0101
    lower, upper = (np.flatnonzero((row == end) & middle) for end in (0, row.max()))
    held = np.concatenate([lower, upper]).astype(np.int32)
    sim = alone(ask, garment, x, effects=(*FREE, Pins(held, 2e3)))
    start, stops = x[held], TWISTING * ask.seconds
    is_upper = np.arange(len(held)) >= len(lower)

    def path(t: float) -> np.ndarray:
        share = ramp(t, 0.0, stops)
        wound = turned(start, 2 * np.pi * TURNS * share)
        return np.where(is_upper[:, None], wound, start + [0, SHORTENED * share, 0])

    return Run(sim, dt=step_of(sim), stops=stops, drive=led(sim, path))


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
