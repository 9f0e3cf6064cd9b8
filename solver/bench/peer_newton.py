"""A scene of the peers by Newton's VBD, Style3D and XPBD (`newton_cloth.py` says with what fabric and settings).

Parts that stand belong to the world; one that moves is a kinematic body, whose places of all sub-steps are on the
device before the first frame. On a GPU the sub-steps of a frame are one captured graph, as in Newton's examples; their
number is even, so that the two states change places back. Where nothing moves VBD is given what it has against
crossings with bodies, as in the hard cases; XPBD feels no cloth by cloth but between particles, by its hash grid.
What is held has no mass, and is not active. Air drag is left out: a force from the host would break the graph.

`style3d-4` is Style3D as Newton's own example of a garment has it (cloth_style3d): 4 iterations in place of its default
of 10, and contacts with bodies are looked for once a frame, in place of once a sub-step.
"""

from __future__ import annotations

import newton
import numpy as np
import warp as wp
from newton_cloth import ITERATIONS, SUBSTEP, add_cloth, chosen, touched, with_contact
from peer_case import FPS
from peer_scenes import PeerScene

from tryon_solver.scene import Gravity

SUBSTEPS = round(1 / FPS / SUBSTEP)
OF_EXAMPLE = 4  # iterations


@wp.kernel
def place_kernel(
    places: wp.array(dtype=wp.transform),
    number: wp.array(dtype=wp.int32),
    ahead: int,
    body_out: wp.array(dtype=wp.transform),
):
    """The one moving body, where it is `ahead` sub-steps from now."""
    body_out[0] = places[wp.min(number[0] + ahead, places.shape[0] - 1)]


@wp.kernel
def count_kernel(number: wp.array(dtype=wp.int32)):
    number[0] = number[0] + 1


class ByNewton:
    """Frame by frame."""

    def __init__(self, scene: PeerScene, solver: str, device: str) -> None:
        as_example = solver == "style3d-4"
        solver = "style3d" if as_example else solver
        self.scene, self.kind, self.device = scene, solver, device
        self.search_every = SUBSTEPS if as_example else 1
        falls = next(e.acceleration for e in scene.scene.effects if isinstance(e, Gravity))
        builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=falls)
        add_cloth(builder, solver, scene.scene, scene.scene.x_start, scene.scene.vertex_masses())
        for vertex in scene.held.tolist():
            builder.particle_mass[vertex] = 0.0
            builder.particle_flags[vertex] &= ~int(newton.ParticleFlags.ACTIVE)
        for k, (v, f) in enumerate(scene.parts):
            body = builder.add_body(is_kinematic=True, mass=1.0, inertia=wp.mat33(np.eye(3))) if k else -1
            mesh = newton.Mesh(v, f.ravel(), compute_inertia=False)
            builder.add_shape_mesh(body, mesh=mesh, cfg=touched(builder, scene.scene.fabric))
        if solver == "vbd":
            builder.color(include_bending=True)
        self.model = with_contact(builder.finalize(device=device), scene.scene.fabric)
        whole = solver == "vbd" and not scene.moves
        self.pipeline = newton.CollisionPipeline(self.model, enable_rigid_soft_full_surface_contact=whole)
        self.contacts = None if whole else self.pipeline.contacts()
        iterations = OF_EXAMPLE if as_example else ITERATIONS
        self.solver = chosen(self.model, solver, self.pipeline, whole, led=scene.moves, iterations=iterations)
        self.now, self.next = self.model.state(), self.model.state()
        self.control = self.model.control()
        self.number: wp.array = wp.zeros(1, dtype=wp.int32, device=device)
        times = np.arange(SUBSTEPS * (scene.frames + 1) + 1) * SUBSTEP
        turns = np.array([scene.turn(t)[-1] for t in times], np.float32)
        places = np.column_stack([np.zeros((len(turns), 3), np.float32), turns])
        self.places: wp.array = wp.array(places, dtype=wp.transform, device=device)
        self.graph: wp.Graph | None = None

    def go(self, _frame: int) -> None:
        """To the frame's end, and until the device is done."""
        if self.kind != "xpbd":
            self.solver.rebuild_bvh(self.now)
        if self.graph is not None:
            wp.capture_launch(self.graph)
        else:
            self._substeps()
            if wp.get_device(self.device).is_cuda:  # what was launched once is compiled and has its memory
                with wp.ScopedCapture(self.device) as captured:
                    self._substeps()
                self.graph = captured.graph
        wp.synchronize_device(self.device)

    def cloth(self) -> np.ndarray:
        """(N, 3) m."""
        return self.now.particle_q.numpy().copy()

    def surface(self, frame: int) -> np.ndarray:
        """(B, 3) m, as led."""
        return self.scene.surface(frame / FPS)

    def _substeps(self) -> None:
        for substep in range(SUBSTEPS):
            self.now.clear_forces()
            if self.scene.moves:
                # VBD takes a body's place before from the first state, and the one after from the second
                before = 0 if self.kind == "vbd" else 1
                for state, ahead in ((self.now, before), (self.next, 1)):
                    wp.launch(place_kernel, 1, [self.places, self.number, ahead], [state.body_q], device=self.device)
            if self.contacts is not None and substep % self.search_every == 0:
                self.pipeline.collide(self.now, self.contacts)
            self.solver.step(self.now, self.next, self.control, self.contacts, SUBSTEP)
            self.now, self.next = self.next, self.now
            wp.launch(count_kernel, 1, [], [self.number], device=self.device)
