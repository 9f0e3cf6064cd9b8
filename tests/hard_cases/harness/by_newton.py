"""Hard cases by NVIDIA's Newton (github.com/newton-physics/newton, Apache-2.0): its VBD and its Style3D.

`newton_cloth.py` says how the garment is given, and with which settings. Of the rest of the scene:

- Air drag is given as a force, of the velocity at a sub-step's start.
- The body is a mesh, whose vertices are led along straight lines from frame to frame, with their velocities. Where it
  stands still, VBD is given what it has against crossings: contact of whole surfaces (edges and faces, not vertices
  alone), and divide-and-truncate against the body, which bounds every move by planes between cloth and body. Both take
  their normals from the mesh as it was at first, so a body that moves is met by vertices only; that is all that
  Style3D has for any body. Of a closed mesh it is asked how often a ray leaves it whether a point is inside, which is
  wrong where arms cross the trunk, and takes sleeves off; so a body that moves lacks the topmost triangle of its head:
  of an open mesh the nearest triangle's side is asked.
"""

from __future__ import annotations

import newton
import numpy as np
from newton_cloth import SUBSTEP, add_cloth, chosen, touched, with_contact

from harness.others import InexpressibleError, Other
from harness.scene import Run
from tryon_solver.scene import AirDrag, Gravity, Pins, Sewing


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
        self.drag = (drag.coefficient if isinstance(drag, AirDrag) else 0.0) * scene.garment.vertex_areas()
        falls = gravity.acceleration if isinstance(gravity, Gravity) else (0.0, 0.0, 0.0)
        builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=falls)
        add_cloth(builder, solver, scene, sim.cloth_positions(), self.mass)
        self.at = self._skin(0.0)
        self.stands = all(np.array_equal(self._skin(t), self.at) for t in np.linspace(0, run.stops, 9))
        self.mesh = self._add_body(builder)
        if solver == "vbd":
            builder.color(include_bending=True)
        self.model = with_contact(builder.finalize(device=sim.device), scene.fabric)
        whole = solver == "vbd" and self.stands
        self.pipeline = newton.CollisionPipeline(self.model, enable_rigid_soft_full_surface_contact=whole)
        self.contacts = None if whole else self.pipeline.contacts()
        self.solver = chosen(self.model, solver, self.pipeline, whole)
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

    def _add_body(self, builder: newton.ModelBuilder) -> newton.Mesh | None:
        """The body's mesh, which belongs to the world; None without a body."""
        if not len(self.at):
            return None
        faces = self.body_faces
        if not self.stands:
            faces = np.delete(faces, np.argmax(self.at[faces, 1].mean(1)), axis=0)
        mesh = newton.Mesh(self.at, faces.ravel(), compute_inertia=False)
        builder.add_shape_mesh(-1, mesh=mesh, cfg=touched(builder, self.run.sim.scene.fabric))
        return mesh

    def _lead(self, x: np.ndarray, v: np.ndarray) -> None:
        """The body's mesh at x (B, 3) m with velocities v (B, 3) m/s."""
        assert self.mesh is not None
        mesh = self.mesh.mesh
        mesh.points.assign(x.astype(np.float32))
        mesh.velocities.assign(v.astype(np.float32))
        mesh.refit()
        self.model.shape_collision_aabb_lower.assign(np.array([x.min(0)], np.float32))
        self.model.shape_collision_aabb_upper.assign(np.array([x.max(0)], np.float32))
