"""Errors of discretisation in space and time, by measures that a tailor knows, and not vertex by vertex.

Each measurement is one figure of one scene, at rest, with one size changed: of the mesh, the step, or the contacts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from discretisation_disc import DISC, drape, drape_against_reference
from discretisation_hem import HEM, hem
from discretisation_strip import BENT, WRINKLED, bending_length, wrinkle_wavelength

from tryon_solver.settings import PRESETS

STEPS = (30, 60, 120)  # 1/s
GAPS, OFFSETS = (1.0, 2.0, 4.0), (0.3, 0.6, 1.2)  # mm: of d_hat and of the fabric's thickness


def measurements() -> Iterator[tuple[str, Callable[[], dict[str, Any]]]]:
    """Name and what makes its row."""
    for edge in DISC.edges:
        yield f"drape-edge-{edge:g}", partial(drape, edge=edge)
    for rate in STEPS:
        yield f"drape-steps-{rate}", partial(drape, rate=rate)
    for gap in GAPS:
        yield f"drape-d_hat-{gap:g}", partial(drape, d_hat=gap)
    for thick in OFFSETS:
        yield f"drape-thickness-{thick:g}", partial(drape, thickness=thick)
    for preset in PRESETS:
        yield f"settled-{preset}", partial(drape_against_reference, preset=preset)
    for edge in BENT.edges:
        yield f"bending-edge-{edge:g}", partial(bending_length, edge=edge)
    for rate in STEPS:
        yield f"bending-steps-{rate}", partial(bending_length, rate=rate)
    for edge in WRINKLED.edges:
        yield f"wrinkles-edge-{edge:g}", partial(wrinkle_wavelength, edge=edge)
    for rate in STEPS:
        yield f"wrinkles-steps-{rate}", partial(wrinkle_wavelength, rate=rate)
    for count in HEM.vertices:
        yield f"hem-vertices-{count}", partial(hem, vertices=count)
    for rate in STEPS:
        yield f"hem-steps-{rate}", partial(hem, rate=rate)
    for gap in GAPS:
        yield f"hem-d_hat-{gap:g}", partial(hem, d_hat=gap)


MEASUREMENTS = dict(measurements())
