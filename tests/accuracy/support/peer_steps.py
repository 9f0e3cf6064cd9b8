"""Steps by NVIDIA's Newton (Apache-2.0), its VBD and its Style3D, from a given state.

`tests/support/newton_cloth.py` says how the garment is given and with which settings; contacts are soft springs there,
and the surface does not yield. The body is a mesh whose vertices are led along straight lines, without the topmost
triangle of its head: asked how often a ray leaves a closed one whether a point is inside, Newton is wrong where arms
cross the trunk. Air drag is given as a force, of the velocity at the step's start. What is sewn onto other cloth is
held by nothing: it has no springs that end within a triangle.
"""

from __future__ import annotations

import newton
import numpy as np
from contact_scenes import ContactScene
from methods import Method
from newton_cloth import add_cloth, chosen, touched, with_contact
from steppers import Contacts, Ended
from stopwatch import clock_of

from tryon_solver.baselines.newton_ipc import Motion, Reference
from tryon_solver.body.pose import Pose
from tryon_solver.scene import AirDrag, Attached, Gravity


class UnsaidError(ValueError):
    """A scene that Newton can't be told."""


class ByNewton:
    """`at` has iterations, and sub-steps where a step is to be cut."""

    is_compiled = True

    def __init__(self, scene: ContactScene, method: Method, device: str) -> None:
        """Raises UnsaidError."""
        of = scene.scene
        if any(isinstance(effect, Attached) for effect in of.effects):
            raise UnsaidError("Newton has no springs that end within a triangle, as cloth sewn on asks for")
        self.scene, self.device, self.clock = scene, device, clock_of(device)
        self.substeps = int(method.at.get("substeps", 1))
        self.data = Reference(of)  # its skin, nothing else
        effects = {type(effect): effect for effect in of.effects}
        gravity, drag = effects[Gravity], effects[AirDrag]
        self.drag = drag.coefficient * of.garment.vertex_areas()[:, None]
        builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=gravity.acceleration)
        add_cloth(builder, method.solver, of, of.x_start, of.vertex_masses())
        at = self.data.skin(scene.pose_at(0))
        faces = np.delete(of.body.faces, np.argmax(at[of.body.faces, 1].mean(1)), axis=0)
        self.mesh = newton.Mesh(at, faces.ravel(), compute_inertia=False)
        builder.add_shape_mesh(-1, mesh=self.mesh, cfg=touched(builder, of.fabric))
        if method.solver == "vbd":
            builder.color(include_bending=True)
        self.model = with_contact(builder.finalize(device=device), of.fabric)
        self.pipeline = newton.CollisionPipeline(self.model)
        self.contacts = self.pipeline.contacts()
        self.solver = chosen(self.model, method.solver, self.pipeline, False, iterations=int(method.at["iterations"]))
        self.now, self.next = self.model.state(), self.model.state()

    def begin(self, motion: Motion, _contacts: Contacts | None) -> None:
        n = len(motion.v)
        self.surface = motion.x[n:]
        self.now.particle_q.assign(motion.x[:n].astype(np.float32))
        self.now.particle_qd.assign(motion.v.astype(np.float32))

    def step(self, pose: Pose, dt: float) -> Ended:
        before, after = self.surface, self.data.skin(pose)
        begun = self.clock()
        self.solver.rebuild_bvh(self.now)
        for k in range(1, self.substeps + 1):
            self._lead(before + k / self.substeps * (after - before), (after - before) / dt)
            self.now.clear_forces()
            self.now.particle_f.assign((-self.drag * self.now.particle_qd.numpy()).astype(np.float32))
            self.pipeline.collide(self.now, self.contacts)
            self.solver.step(self.now, self.next, None, self.contacts, dt / self.substeps)
            self.now, self.next = self.next, self.now
        ms = 1e3 * (self.clock() - begun)
        self.surface = after
        return Ended(np.vstack([self.now.particle_q.numpy().astype(np.float64), after]), ms)

    def _lead(self, x: np.ndarray, v: np.ndarray) -> None:
        """The body's mesh at x (B, 3) m with velocities v (B, 3) m/s."""
        mesh = self.mesh.mesh
        mesh.points.assign(x.astype(np.float32))
        mesh.velocities.assign(v.astype(np.float32))
        mesh.refit()
        self.model.shape_collision_aabb_lower.assign(np.array([x.min(0)], np.float32))
        self.model.shape_collision_aabb_upper.assign(np.array([x.max(0)], np.float32))
