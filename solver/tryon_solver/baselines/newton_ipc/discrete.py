"""What the discrete energy of a scene is made of, in float64: rest quantities, stiffness, contact sizes.

Read from the scene and the settings, as the solver does it, but written again: only data is shared.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from tryon_solver.baselines.newton_ipc.shares import Neighbours
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import (
    AirDrag,
    Attached,
    BodyContact,
    FabricDamping,
    Friction,
    Gravity,
    Scene,
    SelfContact,
    StrainLimit,
)
from tryon_solver.settings import Settings


@dataclass(frozen=True)
class ContactSizes:
    """Offsets and reach [m], thresholds of nearly parallel edges [m^4]; per cloth vertex, `area` (N,) m^2 and
    `reach` (N,) m, the distance at which cloth begins to feel cloth there."""

    xi_self: float
    xi_body: float
    d_hat: float
    pressure_stiffness: float  # N/m^3
    eps_self: float
    eps_body: float
    area: np.ndarray
    reach: np.ndarray


@dataclass(frozen=True)
class Discrete:
    """A scene's discrete energy. N cloth vertices, B of the body's surface, A = N + B, F triangles.

    `held` cloth vertices stand still, for closed forms that clamp an end.
    """

    fabric: Fabric
    faces: np.ndarray  # (F, 3) cloth
    body_faces: np.ndarray  # (G, 3), numbered from N on
    cloth_count: int
    body_count: int
    corner_gradients: np.ndarray  # (F, 3, 2) 1/m
    face_area: np.ndarray  # (F,) m^2
    mass: np.ndarray  # (N,) kg
    bending: sp.csr_matrix  # (N, N) N/m
    attached: sp.csr_matrix  # (N, N) N/m, of what is sewn onto other cloth
    acceleration: np.ndarray  # (3,) m/s^2
    limit_stiffness: float  # N/m, 0 without a strain limit
    drag: float  # N s/m^3
    damping_time: float  # s
    mu_body: float
    mu_self: float
    presliding: float  # m
    touches_body: bool
    touches_self: bool
    contact: ContactSizes
    skin_stiffness: float  # N/m
    skin_hold: float  # N
    skin_firmness: float  # N/m
    return_speed: float  # m/s
    held: np.ndarray  # (K,)

    @cached_property
    def neighbours(self) -> Neighbours:
        """Of cloth and body."""
        faces = np.vstack([self.faces, self.body_faces]) if len(self.body_faces) else self.faces
        return Neighbours.of(faces, self.cloth_count + self.body_count)

    @staticmethod
    def build(scene: Scene, settings: Settings, held: np.ndarray | None = None) -> Discrete:
        """Raises ValueError for an effect the reference has no energy for."""
        garment, fabric = scene.garment, scene.fabric
        if garment.group is not None:
            raise ValueError("the reference takes garments whose seams are closed")
        if scene.panel_fabrics:
            raise ValueError("the reference takes garments of one fabric")
        known = (Gravity, BodyContact, SelfContact, Friction, StrainLimit, AirDrag, FabricDamping, Attached)
        effects = {type(effect): effect for effect in scene.effects}
        for kind in effects:
            if kind not in known:
                raise ValueError(f"the reference has no energy for the effect {kind.__name__}")
        gravity, limit, drag = effects.get(Gravity), effects.get(StrainLimit), effects.get(AirDrag)
        damping, friction = effects.get(FabricDamping), effects.get(Friction)
        if isinstance(friction, Friction) and friction.static is not None:
            raise ValueError("the reference has the fabric's coefficients of friction; leave Friction.static out")
        n = garment.vertex_count
        body = scene.body
        return Discrete(
            fabric=fabric,
            faces=garment.faces.astype(np.int64),
            body_faces=np.zeros((0, 3), np.int64) if body is None else body.faces.astype(np.int64) + n,
            cloth_count=n,
            body_count=0 if body is None else len(body.rest_vertices),
            corner_gradients=garment.corner_gradients(),
            face_area=garment.signed_areas(),
            mass=fabric.areal_density * garment.vertex_areas(),
            bending=bending_matrix(scene),
            attached=attached_matrix(scene),
            acceleration=np.array(gravity.acceleration) if isinstance(gravity, Gravity) else np.zeros(3),
            limit_stiffness=limit.stiffness if isinstance(limit, StrainLimit) else 0.0,
            drag=drag.coefficient if isinstance(drag, AirDrag) else 0.0,
            damping_time=damping.time if isinstance(damping, FabricDamping) else 0.0,
            mu_body=fabric.mu_body if friction else 0.0,
            mu_self=fabric.mu_self if friction else 0.0,
            presliding=friction.presliding if isinstance(friction, Friction) else 1.0,
            touches_body=BodyContact in effects,
            touches_self=SelfContact in effects,
            contact=contact_sizes(scene, settings),
            skin_stiffness=settings.skin_stiffness,
            skin_hold=settings.skin_hold,
            skin_firmness=settings.skin_firmness,
            return_speed=settings.return_speed,
            held=np.zeros(0, np.int64) if held is None else np.asarray(held, np.int64),
        )


def bending_matrix(scene: Scene) -> sp.csr_matrix:
    """(N, N) N/m: sum over hinges of k_b/(A0 + A1) L^T L, L the edge's row of the Laplacian.

    The edge's hat function is 1 - 2 lambda_opposite in each triangle, so L is -2 A grad lambda_opposite . grad.
    """
    garment = scene.garment
    g, area, hinges = garment.corner_gradients(), garment.signed_areas(), garment.hinges()
    n, count = garment.vertex_count, len(hinges)
    rows: sp.csr_matrix = sp.csr_matrix((count, n))
    for side in (0, 1):
        face = hinges[:, 4 + side]
        apex = np.argmax(garment.faces[face] == hinges[:, 2 + side, None], axis=1)
        entries = -2 * area[face, None] * np.einsum("hia,ha->hi", g[face], g[face, apex])
        places = (np.repeat(np.arange(count), 3), garment.faces[face].ravel())
        rows = rows + sp.csr_matrix((entries.ravel(), places), shape=(count, n))
    weights = scene.fabric.k_bend / (area[hinges[:, 4]] + area[hinges[:, 5]])
    return sp.csr_matrix(rows.T @ sp.diags(weights) @ rows)


def attached_rows(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is sewn onto other cloth: vertices (K, 4), weights (K, 4) whose sum of places is how far apart the two are,
    and stiffness (K,) N/m."""
    specs = [effect for effect in scene.effects if isinstance(effect, Attached)]
    ids = [np.column_stack([spec.vertices, spec.onto]) for spec in specs]
    weights = [np.column_stack([np.ones(len(spec.vertices)), -spec.weights]) for spec in specs]
    stiffness = [np.full(len(spec.vertices), spec.stiffness) for spec in specs]
    if not specs:
        return np.zeros((0, 4), np.int64), np.zeros((0, 4)), np.zeros(0)
    return np.vstack(ids).astype(np.int64), np.vstack(weights), np.concatenate(stiffness)


def attached_matrix(scene: Scene) -> sp.csr_matrix:
    """(N, N) N/m: sum over stitches of k w^T w, w the weights that make how far apart the two are."""
    ids, weights, stiffness = attached_rows(scene)
    places = (np.repeat(np.arange(len(ids)), 4), ids.ravel())
    rows = sp.csr_matrix((weights.ravel(), places), shape=(len(ids), scene.garment.vertex_count))
    return sp.csr_matrix(rows.T @ sp.diags(stiffness) @ rows)


def contact_sizes(scene: Scene, settings: Settings) -> ContactSizes:
    """METHOD.md section 5: offsets, the reach of cloth on cloth, thresholds from the meshes' mean edges."""
    garment = scene.garment
    xi_self = scene.fabric.thickness
    sides = np.linalg.norm(garment.uv_corners - garment.uv_corners[:, [1, 2, 0]], axis=2)
    reach = np.full(garment.vertex_count, np.inf)
    np.minimum.at(reach, garment.faces.ravel(), np.repeat(garment.signed_areas() / sides.max(1), 3))
    edge, body_edge = sides.mean(), 0.0
    if scene.body is not None:
        corner = scene.body.rest_vertices[scene.body.faces]
        body_edge = np.linalg.norm(corner - corner[:, [1, 2, 0]], axis=2).mean()
    return ContactSizes(
        xi_self=xi_self,
        xi_body=settings.body_offset + 0.5 * xi_self,
        d_hat=settings.d_hat,
        pressure_stiffness=settings.pressure_stiffness,
        eps_self=1e-3 * edge**4,
        eps_body=1e-3 * edge**2 * body_edge**2,
        area=garment.vertex_areas(),
        reach=reach,
    )
