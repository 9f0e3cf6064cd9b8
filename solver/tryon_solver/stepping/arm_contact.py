"""What a scene that touches something has of contact: its surfaces, the region that is searched, and the lists."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.contact import (
    candidates,
    coasting,
    deflect,
    filtering,
    hold,
    nearest,
    packets,
    pairs,
    region,
    surfaces,
)
from tryon_solver.offsets import contact_sizes

if TYPE_CHECKING:
    from tryon_solver.geometry.garment import Garment
    from tryon_solver.plan import StepPlan
    from tryon_solver.simulation import Simulation

FLY = "tryon_solver.stepping.fly"  # which a scene in which nothing flies does not import
LEAD = "tryon_solver.stepping.lead"  # nor that one in which nobody is led
PARALLEL = 1e-3  # of |ea|^2 |eb|^2: edges whose cross product is shorter, squared, count as nearly parallel


def arm_contact(sim: Simulation) -> None:
    """Allocate all that the steps call contact with, for what the plan lets the cloth touch."""
    scene, settings, device = sim.scene, sim.settings, sim.device
    garment = scene.garment
    sizes = contact_sizes(scene, settings, sim.body_count, device)
    owned = garment.connectivity.owned
    sim.cloth = surfaces.Surface.build(garment.faces, owned, sizes.xi_self + settings.d_hat, device)
    sim.cloth.reach.own, sim.cloth.reach.garment = sim.rest.reach, sizes.garment
    if wp.get_device(device).is_cuda:
        of_triangles = packets.packets_of(garment.uv_corners.mean(axis=1), garment.panel_of_face)
        sim.cloth.packets = wp.array(of_triangles, dtype=wp.int32, device=device)
    known = {"cloth": sim.cloth}
    all_faces = garment.faces
    body_edge = 0.0
    if scene.body is not None:
        faces, owned = scene.body.faces + sim.cloth_count, surfaces.ownership(scene.body.faces)
        known["body"] = surfaces.Surface.build(faces, owned, sizes.xi_body + settings.d_hat, device)
        all_faces = np.vstack([garment.faces, faces])
        v, f = scene.body.rest_vertices, scene.body.faces
        body_edge = float(np.linalg.norm(v[f] - v[f[:, [1, 2, 0]]], axis=2).mean())
    sim.touching = tuple(known[name] for name in sim.plan.touches)
    edge = sim.mean_edge
    model = pairs.ContactModel()
    model.pressure_stiffness = settings.pressure_stiffness
    model.eps_body = PARALLEL * edge**2 * body_edge**2
    model.eps_self = PARALLEL * edge**4
    fans = nearest.Fans.of(all_faces, sim.all_count, device)
    sim.contact = pairs.ContactParameters(sim.cloth_count, sizes, model, sim.rest.spread, sim.rest.reach, fans)
    own = np.arange(sim.all_count, dtype=np.int32)
    if garment.group is not None:
        own[: sim.cloth_count] = garment.group
    sim.group = wp.array(own, dtype=wp.int32, device=device)
    sim.region = region.Region.allocate(sim.all_count, device)
    sim.x_listed, sim.solved = wp.clone(sim.state.x), wp.zeros_like(sim.state.x)
    sim.expected = sim.solved
    sim.boxes = wp.zeros(5, dtype=wp.vec3, device=device)  # m, of all vertices, as in contact/region.py
    sim.coasting = coasting.Coasting(device)
    sim.deflection = deflect.DeflectionScratch.allocate(sim.all_count, device)
    sim.filtering = filtering.Filtering.allocate(sim.all_count, device, settings.deterministic)
    sim.holding = hold.Holding.over(sim.work.held)
    sim.candidates = candidates.Candidates.allocate(1 << 14, device)
    sim.pairs = pairs.ContactPairs.allocate(1 << 12, device)
    sim.sums.make_room()
    if may_lead(sim.plan):
        k_warp, k_weft, density = sim.scene.of_fabrics("k_warp", "k_weft", "areal_density").T
        stiffness = float((np.maximum(k_warp, k_weft) / density).max()) / sim.mean_edge**2
        sim.lead = import_module(LEAD).Lead(sim.all_count, stiffness, device)
        sim.expected = sim.lead.expected
    if may_fly(sim.plan, sim.scene.garment):
        beside = "body" in sim.plan.touches
        flight = import_module(FLY).Flight(sim.matrices.total.pattern, sim.plan.contributions, beside, device)
        sim.flight = flight if beside or flight.pieces > 1 else None


def may_fly(plan: StepPlan, garment: Garment) -> bool:
    """May a piece of the cloth come to go by itself, beside a body or another piece, and meet it? One alone coasts."""
    return "body" in plan.touches or (bool(plan.touches) and not garment.connectivity.of_one_piece)


def may_lead(plan: StepPlan) -> bool:
    """May the cloth touch itself, and a body that takes it along?"""
    return {"body", "cloth"} <= set(plan.touches)
