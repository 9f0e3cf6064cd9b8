"""How far surfaces stay apart: half the thickness of each of the two, and the body's own offset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.contact import candidates
from tryon_solver.geometry.altitudes import refuse_flat_triangles
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.outfit import garments_of
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings

if TYPE_CHECKING:
    from tryon_solver.contact.candidates import ContactSizes


def contact_sizes(scene: Scene, settings: Settings, body_count: int, device: str) -> ContactSizes:
    """The offsets of a garment's cloth from itself and from the body, and those of an outfit's surfaces from each
    other: xi = (thickness + thickness) / 2 of cloth and cloth."""
    sizes = candidates.ContactSizes()
    sizes.xi_body, sizes.xi_self = largest_offsets(scene, settings)
    sizes.d_hat = settings.d_hat
    layers = scene.garment.layers
    if layers:
        counts = [layer.vertices.stop - layer.vertices.start for layer in layers]
        halves = [0.5 * fabric.thickness for fabric in scene.fabric_of_garments()]
        half = np.repeat([*halves, settings.body_offset], [*counts, body_count])
        owner = np.repeat([*range(len(layers)), -1], [*counts, body_count])
        sizes.half = wp.array(half, dtype=wp.float32, device=device)
        sizes.garment = wp.array(owner, dtype=wp.int32, device=device)
    return sizes


def largest_offsets(scene: Scene, settings: Settings) -> tuple[float, float]:
    """(body, cloth) m: the largest offset of any surface of the scene from the body and from cloth."""
    thickest = max(fabric.thickness for fabric in scene.fabric_of_garments())
    return settings.body_offset + 0.5 * thickest, thickest


def least_offsets(scene: Scene, settings: Settings) -> tuple[float, float]:
    """(body, cloth) m: the smallest offset of any surface of the scene from the body and from cloth."""
    thinnest = min(fabric.thickness for fabric in scene.fabric_of_garments())
    return settings.body_offset + 0.5 * thinnest, thinnest


def refuse_what_bears_no_contact(scene: Scene, garment: Garment, touches: tuple[str, ...]) -> None:
    """Raises GarmentError for triangles of `garment`, the scene's or another shape of it, that are too flat for their
    fabric where cloth `touches` cloth, or at all. Triangles are numbered as in their own garment."""
    for fabric, own in zip(scene.fabric_of_garments(), garments_of(garment)):
        refuse_flat_triangles(own, fabric.thickness if "cloth" in touches else 0.0)
