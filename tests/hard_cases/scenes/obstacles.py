"""Sharp, narrow and closing things: needle, knife edge, corner, plates, ring."""

from __future__ import annotations

import numpy as np
from contact_scenes import tube
from harness.kit import FREE, Pins, laid, led, on_body, ramp, rippled, square, step_of, turned
from harness.obstacles import Obstacles, cone, corner, standing, torus, wedge
from harness.scene import Ask, HardScene, Run
from small_scenes import STILL, layers, rigid_body, slab

from tryon_solver.scene import BodyContact

SIZE = 0.3  # m, of the squares
WITH_BODY = (*FREE, BodyContact())


def on_top(ask: Ask, vertices: np.ndarray, faces: np.ndarray) -> Run:
    """A square, askew, dropped from 1 cm onto a thing whose highest point is the origin."""
    garment, x = square(ask.vertices, SIZE)
    x = turned(rippled(x, 2e-3), 0.3) + [0.004, 0.014, 0.003]
    return laid(on_body(ask, garment, x, rigid_body(vertices, faces)), stops=1.5)


def closing_plates(ask: Ask, count: int) -> Run:
    """Layers between two plates, which close to 1.2 times the room that layers need, stay so, and open again.

    What a layer needs is its thickness beside another and, beside a plate, half of it and `body_offset`: of one layer
    0.6 mm thick that is 3.6 mm.
    """
    n = max(5, round(np.sqrt(ask.vertices / count)))
    garment, x = layers(count, n, n, 0.2, 0.003)
    x = rippled(x, 4e-3) + [0, 0.008, 0]
    below, above = (slab(0.26, 0.26, 0.02, 0.03) for _ in range(2))
    offset, own = ask.settings.body_offset + 0.3e-3, 0.6e-3
    room = 1.2 * (2 * offset + (count - 1) * own)
    start = 0.02 + 0.003 * count
    plates = (below, (above[0] + [0, start + 0.02, 0], above[1]))
    shut, opened = 0.3 * ask.seconds, 0.5 * ask.seconds

    def upper(t: float) -> tuple[np.ndarray, np.ndarray]:
        closed = ramp(t, 0.0, shut) - ramp(t, opened, opened + 0.5 * shut)
        return np.zeros(3), np.array([0, -(start - room) * closed, 0])

    body = Obstacles(plates, (standing, upper))
    sim = on_body(ask, garment, x, body)
    return Run(sim, body.at, step_of(sim), stops=opened + 0.5 * shut)


def sleeve_through_ring(ask: Ask) -> Run:
    """A tube of 4 cm radius, led by four points of its end through a ring of 2.5 cm."""
    around = max(12, round(np.sqrt(ask.vertices * 1.1)))
    garment, x = tube(around, max(8, ask.vertices // around), 0.04, 0.25)
    x = np.column_stack([x[:, 1], x[:, 0] - 0.16, x[:, 2]])  # along y, below the ring
    ring = torus(0.030, 0.005, 40, 10)
    last = np.arange(len(x) - around, len(x))
    held = last[:: around // 4][:4].astype(np.int32)
    sim = on_body(ask, garment, x, rigid_body(*ring), effects=(*WITH_BODY, Pins(held, 50.0)))
    gathered, stops = 0.25 * ask.seconds, 0.75 * ask.seconds
    start = x[held]

    def path(t: float) -> np.ndarray:
        inward = 1 - 0.75 * ramp(t, 0.0, gathered)
        return start * [inward, 1, inward] + [0, 0.36 * ramp(t, gathered, stops), 0]

    return Run(sim, lambda _t: STILL, step_of(sim), stops, led(sim, path), parts=True)


def swept_by_plate(ask: Ask) -> Run:
    """A square hung by two corners; a vertical plate sweeps through the place where it hangs at 2 m/s and stops."""
    garment, x = square(ask.vertices, SIZE)
    x = np.column_stack([x[:, 0], -x[:, 2] - SIZE / 2, x[:, 1]])  # upright in z = 0, its upper side at y = 0
    held = np.flatnonzero((x[:, 1] > -1e-6) & (np.abs(x[:, 0]) > SIZE / 2 - 1e-6)).astype(np.int32)
    plate, faces = slab(0.2, 0.02, 0.2, 0.03)
    stops, speed = 0.1, 2.0
    body = Obstacles(
        ((plate + [0, -0.12, -0.05], faces),),
        (lambda t: (np.zeros(3), np.array([0, 0, speed * min(t, stops)])),),
    )
    sim = on_body(ask, garment, x, body, effects=(*WITH_BODY, Pins(held)))
    return Run(sim, body.at, step_of(sim), stops=1.0)


SCENES = (
    HardScene(
        "needle",
        "cloth carried by a sharp point: the tip of a cone of 6 mm over 30 cm",
        lambda ask: on_top(ask, *blunt_needle()),
    ),
    HardScene(
        "knife_edge",
        "cloth over an edge of 8 degrees: two sides of a fold, nothing between but the edge",
        lambda ask: on_top(ask, *wedge(0.36, 0.02, 0.14, 24)),
    ),
    HardScene("corner", "cloth over the corner of a cube", lambda ask: on_top(ask, *corner(0.2, 4))),
    HardScene(
        "plates_one_layer",
        "a rippled sheet squeezed by two plates to 1.2 of the room that contact's offsets need, then released",
        lambda ask: closing_plates(ask, 1),
    ),
    HardScene(
        "plates_three_layers",
        "three rippled sheets squeezed likewise",
        lambda ask: closing_plates(ask, 3),
    ),
    HardScene("sleeve_through_ring", "a sleeve gathered and pulled through a narrow ring", sleeve_through_ring),
    HardScene(
        "swept_by_plate", "a plate at 2 m/s takes hanging cloth along, 33 mm a frame, and stops dead", swept_by_plate
    ),
)


def blunt_needle() -> tuple[np.ndarray, np.ndarray]:
    """A cone of 6 mm over 30 cm whose tip is the origin."""
    return cone(0.006, 0.3, 12)
