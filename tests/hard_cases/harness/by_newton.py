"""Hard cases by NVIDIA's Newton (github.com/newton-physics/newton, Apache-2.0): its VBD and its Style3D.

What of the scene is given, and how. k_u, k_v, k_s, k_b are the fabric's stiffnesses in warp, weft, shear and bending
(METHOD.md section 3), A the areas of triangles, L the length of an edge, all of them of the pattern.

- VBD (vertex block descent; Chen et al. 2024). Its membrane is a stable Neo-Hookean one of two Lamé parameters: mu =
  (k_u + k_v)/4, lambda = 0, so that a strip stretches as ours does on the mean of warp and weft, and does not narrow;
  its shear is then stiffer, 2 mu where ours has k_s. Bending is by dihedral angles, 1/2 k L theta^2: k = k_b L/(A0 +
  A1) is our energy for small angles. Fabric damping of beta s: on the metric kd = beta k/4, on angles beta k.
- Style3D (projective dynamics). Its membrane k_u (|f_u| - 1)^2 + k_v (|f_v| - 1)^2 + k (f_u . f_v)^2 of unit f_u, f_v
  is ours for small strains with k = k_s/2. Its bending is Bergou's quadratic one with 3 k/(A0 + A1): k = k_b/3.
  It knows no fabric damping; 0.2 % of the velocity goes in every sub-step (`update_velocity`).
- Neither has a strain limit. Masses are ours. Air drag is given as a force, of the velocity at a sub-step's start.
- The body is a mesh, whose vertices are led along straight lines from frame to frame, with their velocities. Where it
  stands still, VBD is given what it has against crossings: contact of whole surfaces (edges and faces, not vertices
  alone), and divide-and-truncate against the body, which bounds every move by planes between cloth and body. Both take
  their normals from the mesh as it was at first, so a body that moves is met by vertices only; that is all that
  Style3D has for any body. Of a closed mesh it is asked how often a ray leaves it whether a point is inside, which is
  wrong where arms cross the trunk, and takes sleeves off; so a body that moves lacks the topmost triangle of its head:
  of an open mesh the nearest triangle's side is asked.

Settings are those of Newton's examples in metres (cloth_twist, cloth_style3d, cloth_hanging): 10 sub-steps of a
1/60 s frame, 10 iterations (both solvers' default), particles of 3 mm about which the body is felt, cloth kept 2 mm
from cloth by VBD and 6 mm by Style3D (a radius of 3 mm, its default), contacts found anew in every sub-step. VBD looks
for them 10 mm further: it moves no vertex by more than 0.43 of the two together between two looks, here 3 m/s. Contact
stiffness is 1e3 N/m for fabrics of 0.2 kg/m^2, the example's, and in proportion for others.
"""

from __future__ import annotations

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverStyle3D, SolverVBD, style3d

from harness.others import InexpressibleError, Other
from harness.scene import Run
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.bending import hinge_rows
from tryon_solver.scene import AirDrag, FabricDamping, Gravity, Pins, Sewing

SUBSTEP = 1 / 600  # s
ITERATIONS = 10
RADIUS = 3e-3  # m about a vertex
MARGIN, GAP = 2e-3, 10e-3  # m between VBD's cloth and cloth, and how much further contacts are looked for
STIFFNESS = 5e3  # N/m for each kg/m^2
DAMPING = 1e-4  # s, of contacts: a share of their stiffness
AS_IT_IS = {"pos": wp.vec3(), "rot": wp.quat_identity(), "vel": wp.vec3(), "scale": 1.0}


class ByNewton(Other):
    """A case as such a solver plays it, launch by launch: a GPU would take less time with its launches captured."""

    def __init__(self, run: Run, solver: str) -> None:
        """Raises InexpressibleError."""
        super().__init__(run)
        scene, sim = run.sim.scene, run.sim
        effects = {type(effect): effect for effect in scene.effects}
        if Pins in effects or Sewing in effects:
            raise InexpressibleError("its cloth is held by no springs")
        gravity, drag = effects.get(Gravity), effects.get(AirDrag)
        self.vbd = solver == "vbd"
        self.drag = (drag.coefficient if isinstance(drag, AirDrag) else 0.0) * scene.garment.vertex_areas()
        falls = gravity.acceleration if isinstance(gravity, Gravity) else (0.0, 0.0, 0.0)
        builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=falls)
        self._add_cloth(builder)
        self.at = self._skin(0.0)
        self.stands = all(np.array_equal(self._skin(t), self.at) for t in np.linspace(0, run.stops, 9))
        self.mesh = self._add_body(builder)
        if self.vbd:
            builder.color(include_bending=True)
        self.model = self._with_contact(builder.finalize(device=sim.device))
        self._choose(whole=self.vbd and self.stands)
        self.now, self.next = self.model.state(), self.model.state()

    def go(self, t: float, dt: float) -> None:
        steps = max(1, round(dt / SUBSTEP))
        before, after = self.at, self._skin(t)
        self.solver.rebuild_bvh(self.now)
        for k in range(1, steps + 1):
            if not np.array_equal(before, after):
                self._lead(before + k / steps * (after - before), (after - before) / dt)
            self.now.clear_forces()
            self.now.particle_f.assign((-self.drag[:, None] * self.velocities()).astype(np.float32))
            if self.contacts is not None:
                self.pipeline.collide(self.now, self.contacts)
            self.solver.step(self.now, self.next, None, self.contacts, dt / steps)
            self.now, self.next = self.next, self.now
        self.at = after

    def velocities(self) -> np.ndarray:
        return self.now.particle_qd.numpy().astype(np.float64)

    def cloth(self) -> np.ndarray:
        return self.now.particle_q.numpy().copy()

    def surface(self) -> np.ndarray:
        return self.at.astype(np.float32)

    def _skin(self, t: float) -> np.ndarray:
        """(B, 3) m at a time [s]."""
        body = self.run.sim.scene.body
        return np.zeros((0, 3)) if body is None else body.surface(self.run.stance(t))

    def _add_cloth(self, builder: newton.ModelBuilder) -> None:
        """Where it starts, with the pattern's rest shape, the fabric's stiffnesses and our masses."""
        scene = self.run.sim.scene
        garment, fabric = scene.garment, scene.fabric
        beta = next((e.time for e in scene.effects if isinstance(e, FabricDamping)), 0.0)
        stretch = 0.5 * (fabric.k_warp + fabric.k_weft)
        cloth = {
            **AS_IT_IS,
            "vertices": [wp.vec3(*x) for x in self.run.sim.cloth_positions().tolist()],
            "indices": garment.faces.ravel().tolist(),
            "density": fabric.areal_density,
            "particle_radius": RADIUS,
        }
        if self.vbd:
            builder.add_cloth_mesh(tri_ke=0.5 * stretch, tri_ka=0.0, tri_kd=0.25 * beta * stretch, **cloth)
        else:
            SolverStyle3D.register_custom_attributes(builder)
            pattern = {
                "panel_verts": garment.uv_corners.reshape(-1, 2).tolist(),
                "panel_indices": list(range(3 * len(garment.faces))),
            }
            stretches = wp.vec3(fabric.k_warp, fabric.k_weft, 0.5 * fabric.k_shear)
            style3d.add_cloth_mesh(builder, tri_aniso_ke=stretches, **pattern, **cloth)
        builder.particle_mass[:] = self.mass.tolist()
        builder.tri_poses[:] = garment.corner_gradients()[:, 1:].tolist()  # the inverse of the rest edges as columns
        builder.tri_areas[:] = garment.signed_areas().tolist()
        lengths, areas = hinge_sizes(garment)
        for edge, ends in enumerate(builder.edge_indices):
            key = (min(ends[2:]), max(ends[2:]))
            length = builder.edge_rest_length[edge] = lengths[key]
            area = areas.get(key)
            each = 0.0 if area is None else fabric.k_bend * length / area if self.vbd else fabric.k_bend / 3
            builder.edge_bending_properties[edge] = (each, beta * each)
            builder.edge_rest_angle[edge] = 0.0

    def _add_body(self, builder: newton.ModelBuilder) -> newton.Mesh | None:
        """The body's mesh, which belongs to the world; None without a body."""
        if not len(self.at):
            return None
        faces = self.body_faces
        if not self.stands:
            faces = np.delete(faces, np.argmax(self.at[faces, 1].mean(1)), axis=0)
        mesh = newton.Mesh(self.at, faces.ravel(), compute_inertia=False)
        fabric = self.run.sim.scene.fabric
        hardness = STIFFNESS * fabric.areal_density
        config = builder.ShapeConfig(density=0.0, ke=hardness, kd=DAMPING * hardness, mu=fabric.mu_body)
        builder.add_shape_mesh(-1, mesh=mesh, cfg=config)
        return mesh

    def _with_contact(self, model: newton.Model) -> newton.Model:
        """The cloth's side of contacts; friction with itself is the fabric's, which with the body is the same."""
        fabric = self.run.sim.scene.fabric
        model.soft_contact_ke = STIFFNESS * fabric.areal_density
        model.soft_contact_kd = DAMPING * model.soft_contact_ke
        model.soft_contact_mu = fabric.mu_self
        return model

    def _choose(self, whole: bool) -> None:
        """The solver and what finds its contacts; `whole`: those of edges and faces with the body, and its bounds."""
        self.pipeline = newton.CollisionPipeline(self.model, enable_rigid_soft_full_surface_contact=whole)
        self.contacts = None if whole else self.pipeline.contacts()
        if not self.vbd:
            self.solver = SolverStyle3D(self.model, config=SolverStyle3D.Config(iterations=ITERATIONS))
            self.solver.collision.radius = RADIUS
            return
        own = {"rigid_soft_enable_dat": True, "collision_pipeline": self.pipeline} if whole else {}
        self.solver = SolverVBD(
            self.model,
            iterations=ITERATIONS,
            particle_enable_self_contact=True,
            particle_self_contact_margin=MARGIN,
            particle_self_contact_gap=GAP,
            particle_vertex_contact_buffer_size=64,
            particle_edge_contact_buffer_size=128,
            **own,
        )

    def _lead(self, x: np.ndarray, v: np.ndarray) -> None:
        """The body's mesh at x (B, 3) m with velocities v (B, 3) m/s."""
        assert self.mesh is not None
        mesh = self.mesh.mesh
        mesh.points.assign(x.astype(np.float32))
        mesh.velocities.assign(v.astype(np.float32))
        mesh.refit()
        self.model.shape_collision_aabb_lower.assign(np.array([x.min(0)], np.float32))
        self.model.shape_collision_aabb_upper.assign(np.array([x.max(0)], np.float32))


def hinge_sizes(garment: Garment) -> tuple[dict[tuple[int, int], float], dict[tuple[int, int], float]]:
    """Of each edge (smaller vertex first) its length [m], and of those between two triangles their area [m^2]."""
    lengths: dict[tuple[int, int], float] = {}
    for side in range(3):
        ends = np.sort(garment.faces[:, [side, (side + 1) % 3]], axis=1)
        across = np.linalg.norm(garment.uv_corners[:, side] - garment.uv_corners[:, (side + 1) % 3], axis=1)
        lengths.update(zip(map(tuple, ends.tolist()), across.tolist()))
    ids, _, area = hinge_rows(garment)
    return lengths, dict(zip(map(tuple, np.sort(ids[:, :2], axis=1).tolist()), area.tolist()))
