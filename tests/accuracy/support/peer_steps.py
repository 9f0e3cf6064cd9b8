"""Steps by NVIDIA's Newton (Apache-2.0), its VBD and its Style3D, from a given state.

`tests/support/newton_cloth.py` says how the garment is given and with which settings; contacts are soft springs there,
and the surface does not yield. The body is a mesh whose vertices are led along straight lines, without the topmost
triangle of its head: asked how often a ray leaves a closed one whether a point is inside, Newton is wrong where arms
cross the trunk. Air drag is given as a force, of the velocity at each sub-step's start. What is sewn onto other cloth
is held by nothing: it has no springs that end within a triangle. On a GPU a step is one captured graph, as in Newton's
examples, and as ours is; where the surface is at the step's ends is brought to the device before the time begins.
"""

from __future__ import annotations

import newton
import numpy as np
import warp as wp
from contact_scenes import ContactScene
from methods import Method
from newton_cloth import GAP, add_cloth, chosen, touched, with_contact
from steppers import Contacts, Ended
from stopwatch import clock_of

from tryon_solver.baselines.newton_ipc import Motion, Reference
from tryon_solver.body.pose import Pose
from tryon_solver.scene import AirDrag, Attached, Gravity


@wp.kernel
def lead_kernel(
    before: wp.array(dtype=wp.vec3),
    after: wp.array(dtype=wp.vec3),
    share: float,
    rate: float,
    place_out: wp.array(dtype=wp.vec3),
    velocity_out: wp.array(dtype=wp.vec3),
):
    """The surface, that share of the way on; `rate` is the whole way's, in 1/s."""
    i = wp.tid()
    way = after[i] - before[i]
    place_out[i] = before[i] + share * way
    velocity_out[i] = rate * way


@wp.kernel
def drag_kernel(v: wp.array(dtype=wp.vec3), drag: wp.array(dtype=wp.float32), force_out: wp.array(dtype=wp.vec3)):
    """Drag [N s/m] of vertices' velocities."""
    i = wp.tid()
    force_out[i] = -drag[i] * v[i]


class UnsaidError(ValueError):
    """A scene that Newton can't be told."""


class ByNewton:
    """`at` has iterations, sub-steps where a step is to be cut, and VBD's gap [m] where it is not newton_cloth's."""

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
        self.drag = wp.array(drag.coefficient * of.garment.vertex_areas(), dtype=wp.float32, device=device)
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
        asked = {"iterations": int(method.at["iterations"]), "gap": method.at.get("gap", GAP)}
        self.solver = chosen(self.model, method.solver, self.pipeline, False, **asked)
        self.states = self.model.state(), self.model.state()
        self.ends: tuple[wp.array, wp.array] = tuple(wp.array(at, dtype=wp.vec3, device=device) for _ in range(2))
        self.graph: wp.Graph | None = None

    def begin(self, motion: Motion, _contacts: Contacts | None) -> None:
        n = len(motion.v)
        self.surface = motion.x[n:]
        self.states[0].particle_q.assign(motion.x[:n].astype(np.float32))
        self.states[0].particle_qd.assign(motion.v.astype(np.float32))

    def step(self, pose: Pose, dt: float) -> Ended:
        """By dt [s]; a graph that has been captured goes by the first one's."""
        before, after = self.surface, self.data.skin(pose)
        self._bring(before, after)
        begun = self.clock()
        self.solver.rebuild_bvh(self.states[0])
        if self.graph is not None:
            wp.capture_launch(self.graph)
        else:
            self._substeps(dt)
            if wp.get_device(self.device).is_cuda:  # what was launched once is compiled and has its memory
                with wp.ScopedCapture(self.device) as captured:
                    self._substeps(dt)
                self.graph = captured.graph
        ms = 1e3 * (self.clock() - begun)
        self.surface = after
        ended = self.states[self.substeps % 2].particle_q.numpy()
        return Ended(np.vstack([ended.astype(np.float64), after]), ms)

    def _bring(self, before: np.ndarray, after: np.ndarray) -> None:
        """The surface (B, 3) m at a step's ends, and the box about all of its way."""
        way = np.vstack([before, after])
        for end, x in zip(self.ends, (before, after)):
            end.assign(x.astype(np.float32))
        self.model.shape_collision_aabb_lower.assign(np.array([way.min(0)], np.float32))
        self.model.shape_collision_aabb_upper.assign(np.array([way.max(0)], np.float32))

    def _substeps(self, dt: float) -> None:
        """From the first state on, in turns with the second."""
        mesh, (now, following) = self.mesh.mesh, self.states
        for k in range(1, self.substeps + 1):
            told = [*self.ends, k / self.substeps, 1 / dt]
            wp.launch(lead_kernel, len(mesh.points), told, [mesh.points, mesh.velocities], device=self.device)
            mesh.refit()
            now.clear_forces()
            drag = [now.particle_qd, self.drag]
            wp.launch(drag_kernel, len(self.drag), drag, [now.particle_f], device=self.device)
            self.pipeline.collide(now, self.contacts)
            self.solver.step(now, following, None, self.contacts, dt / self.substeps)
            now, following = following, now
