"""Our cloth as NVIDIA's Newton (github.com/newton-physics/newton, Apache-2.0) takes it: its VBD, Style3D and XPBD.

What of a garment is given, and how. k_u, k_v, k_s, k_b are the fabric's stiffnesses in warp, weft, shear and bending
(METHOD.md section 3), A the areas of triangles, L the length of an edge, all of them of the pattern.

- VBD (vertex block descent; Chen et al. 2024). Its membrane is a stable Neo-Hookean one of two Lamé parameters: mu =
  (k_u + k_v)/4, lambda = 0, so that a strip stretches as ours does on the mean of warp and weft, and does not narrow;
  its shear is then stiffer, 2 mu where ours has k_s. Bending is by dihedral angles, 1/2 k L theta^2: k = k_b L/(A0 +
  A1) is our energy for small angles. Fabric damping of beta s: on the metric kd = beta k/4, on angles beta k.
- Style3D (projective dynamics). Its membrane k_u (|f_u| - 1)^2 + k_v (|f_v| - 1)^2 + k (f_u . f_v)^2 of unit f_u, f_v
  is ours for small strains with k = k_s/2. Its bending is Bergou's quadratic one with 3 k/(A0 + A1): k = k_b/3.
  It knows no fabric damping; 0.2 % of the velocity goes in every sub-step (`update_velocity`).
- XPBD. It has springs and no triangles: along edges and between the two vertices opposite of one, at the lengths they
  have at the start. It moves all of them at once and has no relaxation for springs, so that with (k_u + k_v)/2, as much
  as the fabric has, it blows up. So a spring has at most 0.15 m/h^2, m the median of the vertices' masses and h a
  sub-step; 0.25 still held on 100 and 400 vertices of a metre, 0.5 did not. That is a rubber. Bending 1/2 k theta^2
  with k = k_b L^2/(A0 + A1). No damping.
- None has a strain limit. Masses are ours.

Settings are those of Newton's examples in metres (cloth_twist, cloth_style3d, cloth_hanging): 10 sub-steps of a 1/60
s frame, particles of 3 mm about which the body is felt, cloth kept 2 mm from cloth by VBD and 6 mm by Style3D (a
radius of 3 mm, its default); and of cloth_hanging alone 10 iterations (VBD's and Style3D's default) and contacts
found anew in every sub-step: the other two have 4, and find them once a frame. VBD looks for them 10 mm further: it
moves no vertex by more than 0.43 of the two together in a step, here 3 m/s. Contact stiffness is 1e3 N/m for fabrics
of 0.2 kg/m^2, the example's, and in proportion for others.
"""

from __future__ import annotations

import math

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverStyle3D, SolverVBD, SolverXPBD, style3d

from tryon_solver.baselines.hinge_rows import hinge_rows
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import Fabric
from tryon_solver.scene import FabricDamping, Scene

SUBSTEP = 1 / 600  # s
ITERATIONS = 10
RADIUS = 3e-3  # m about a vertex
MARGIN, GAP = 2e-3, 10e-3  # m between VBD's cloth and cloth, and how much further contacts are looked for
STIFFNESS = 5e3  # N/m for each kg/m^2
DAMPING = 1e-4  # s, of contacts: a share of their stiffness
SPRING = 0.15  # of a vertex's mass over a sub-step squared: the most that XPBD's springs may have
AS_IT_IS = {"pos": wp.vec3(), "rot": wp.quat_identity(), "vel": wp.vec3(), "scale": 1.0}
SOLVERS = ("vbd", "style3d", "xpbd")


def add_cloth(builder: newton.ModelBuilder, solver: str, scene: Scene, x: np.ndarray, mass: np.ndarray) -> None:
    """The scene's garment at x (N, 3) m, with the pattern's rest shape, the fabric's stiffnesses and `mass` (N,) kg."""
    garment, fabric = scene.garment, scene.fabric
    beta = next((e.time for e in scene.effects if isinstance(e, FabricDamping)), 0.0)
    stretch = 0.5 * (fabric.k_warp + fabric.k_weft)
    cloth = {
        **AS_IT_IS,
        "vertices": [wp.vec3(*place) for place in x.tolist()],
        "indices": garment.faces.ravel().tolist(),
        "density": fabric.areal_density,
        "particle_radius": RADIUS,
    }
    if solver == "style3d":
        SolverStyle3D.register_custom_attributes(builder)
        pattern = {
            "panel_verts": garment.uv_corners.reshape(-1, 2).tolist(),
            "panel_indices": list(range(3 * len(garment.faces))),
        }
        stretches = wp.vec3(fabric.k_warp, fabric.k_weft, 0.5 * fabric.k_shear)
        style3d.add_cloth_mesh(builder, tri_aniso_ke=stretches, **pattern, **cloth)
    elif solver == "xpbd":
        held = min(stretch, SPRING * float(np.median(mass)) / SUBSTEP**2)
        builder.add_cloth_mesh(add_springs=True, spring_ke=held, spring_kd=0.0, **cloth)
    else:
        builder.add_cloth_mesh(tri_ke=0.5 * stretch, tri_ka=0.0, tri_kd=0.25 * beta * stretch, **cloth)
    builder.particle_mass[:] = mass.tolist()
    builder.tri_poses[:] = garment.corner_gradients()[:, 1:].tolist()  # the inverse of the rest edges as columns
    builder.tri_areas[:] = garment.signed_areas().tolist()
    lengths, areas = hinge_sizes(garment)
    for edge, ends in enumerate(builder.edge_indices):
        key = (min(ends[2:]), max(ends[2:]))
        length = builder.edge_rest_length[edge] = lengths[key]
        each = bending(solver, fabric, length, areas.get(key))
        builder.edge_bending_properties[edge] = (each, beta * each if solver != "xpbd" else 0.0)
        builder.edge_rest_angle[edge] = 0.0


def bending(solver: str, fabric: Fabric, length: float, area: float | None) -> float:
    """An edge's stiffness in bending in the solver's own unit; 0 for one on the border, which has no area."""
    if area is None:
        return 0.0
    by_angle = fabric.k_bend * length / area
    return {"vbd": by_angle, "style3d": fabric.k_bend / 3, "xpbd": by_angle * length}[solver]


def touched(builder: newton.ModelBuilder, fabric: Fabric) -> newton.ModelBuilder.ShapeConfig:
    """What a body is that this fabric touches."""
    hardness = STIFFNESS * fabric.areal_density
    return builder.ShapeConfig(density=0.0, ke=hardness, kd=DAMPING * hardness, mu=fabric.mu_body)


def with_contact(model: newton.Model, fabric: Fabric) -> newton.Model:
    """The cloth's side of contacts; friction with itself is the fabric's, which with the body is the same."""
    model.soft_contact_ke = STIFFNESS * fabric.areal_density
    model.soft_contact_kd = DAMPING * model.soft_contact_ke
    model.soft_contact_mu = fabric.mu_self
    return model


def chosen(
    model: newton.Model,
    solver: str,
    pipeline: newton.CollisionPipeline,
    whole: bool,
    led: bool = False,
    iterations: int = ITERATIONS,
    gap: float = GAP,
) -> SolverVBD | SolverStyle3D | SolverXPBD:
    """The solver. `whole`, of VBD: the pipeline, which finds contacts of whole surfaces, is its own, and bounds moves
    by them; `led`: rigid bodies are led from outside; `gap` [m]: how much further than MARGIN VBD looks for contacts,
    and the more room it is given for them the further that is."""
    if solver == "xpbd":
        return SolverXPBD(model, iterations=iterations)
    if solver == "style3d":
        made = SolverStyle3D(model, config=SolverStyle3D.Config(iterations=iterations))
        made.collision.radius = RADIUS
        return made
    room = math.ceil(gap / GAP)
    own = {"rigid_soft_enable_dat": True, "collision_pipeline": pipeline} if whole else {}
    return SolverVBD(
        model,
        iterations=iterations,
        integrate_with_external_rigid_solver=led,
        particle_enable_self_contact=True,
        particle_self_contact_margin=MARGIN,
        particle_self_contact_gap=gap,
        particle_vertex_contact_buffer_size=64 * room,
        particle_edge_contact_buffer_size=128 * room,
        **own,
    )


def hinge_sizes(garment: Garment) -> tuple[dict[tuple[int, int], float], dict[tuple[int, int], float]]:
    """Of each edge (smaller vertex first) its length [m], and of those between two triangles their area [m^2]."""
    lengths: dict[tuple[int, int], float] = {}
    for side in range(3):
        ends = np.sort(garment.faces[:, [side, (side + 1) % 3]], axis=1)
        across = np.linalg.norm(garment.uv_corners[:, side] - garment.uv_corners[:, (side + 1) % 3], axis=1)
        lengths.update(zip(map(tuple, ends.tolist()), across.tolist()))
    ids, _, area = hinge_rows(garment)
    return lengths, dict(zip(map(tuple, np.sort(ids[:, :2], axis=1).tolist()), area.tolist()))
