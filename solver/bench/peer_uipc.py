"""A scene of the peers by libuipc (github.com/spiriMirror/libuipc, Apache-2.0): IPC with Newton's method on a GPU.

What of the scene is given. k_u, k_v, k_b are the fabric's stiffnesses in warp, weft and bending (METHOD.md section 3).

- A neo-Hookean shell of radius r, half our fabric's thickness: Young's modulus (k_u + k_v)/2 over 2 r, no Poisson's
  ratio; bending by dihedral angles, kappa L theta^2/h with h a third of the area of both triangles over L: kappa =
  k_b/6. No fabric damping, no strain limit, no air.
- The contact distance is that of our solver's settings, its stiffness 1e8 Pa, an affine body's, too; friction is the
  fabric's. The parts are stiff affine bodies: the first stands, another is drawn to where it is led by a constraint a
  thousand times its mass, so that it lags. Parts overlap at a joint and feel nothing of each other.
- A step a frame, its default. Its start takes a minute or two: it compiles for the GPU.
"""

from __future__ import annotations

import tempfile

import numpy as np
import uipc
from peer_case import FPS
from peer_scenes import PeerScene
from scipy.spatial.transform import Rotation
from uipc import builtin, view
from uipc.constitution import (
    AffineBodyConstitution,
    DiscreteShellBending,
    ElasticModuli2D,
    NeoHookeanShell,
    SoftTransformConstraint,
)
from uipc.geometry import label_surface, trimesh

from tryon_solver.scene import Gravity
from tryon_solver.settings import Settings

HARDNESS = 1e8  # Pa, of contacts and of the parts
PULL = 1e3  # times its mass, by which a part is drawn to its place


class ByUipc:
    """Frame by frame. `backend`: "cuda"; "none" builds the scene and moves nothing."""

    def __init__(self, scene: PeerScene, backend: str = "cuda") -> None:
        """Raises ValueError where libuipc finds the scene not valid."""
        self.scene, self.time = scene, 0.0
        uipc.Logger.set_level(uipc.Logger.Level.Error)
        falls = next(e.acceleration for e in scene.scene.effects if isinstance(e, Gravity))
        config = uipc.Scene.default_config()
        config["dt"] = 1 / FPS
        config["gravity"] = [[g] for g in falls]
        config["contact"]["d_hat"] = Settings().d_hat
        config["contact"]["friction"]["enable"] = 1
        self.folder = tempfile.TemporaryDirectory()
        self.engine = uipc.Engine(backend, self.folder.name)
        self.world = uipc.World(self.engine)
        self.uipc_scene = uipc.Scene(config)
        self._set_contact()
        self.cloth_slot = self._add_cloth()
        self.part_slots = [self._add_part(k) for k in range(len(scene.parts))]
        self.world.init(self.uipc_scene)
        self._look_whether_valid()

    def go(self, frame: int) -> None:
        """To the frame's end; what was simulated is then on the host."""
        self.time = frame / FPS
        self.world.advance()
        self.world.retrieve()
        self._look_whether_valid()

    def cloth(self) -> np.ndarray:
        """(N, 3) m."""
        return np.array(self.cloth_slot.geometry().positions().view()).reshape(-1, 3)

    def surface(self, _frame: int) -> np.ndarray:
        """(B, 3) m, as simulated."""
        places = [np.array(s.geometry().transforms().view()).reshape(4, 4) for s in self.part_slots]
        return np.vstack([v @ m[:3, :3].T + m[:3, 3] for m, (v, _) in zip(places, self.scene.parts)])

    def _look_whether_valid(self) -> None:
        if not self.world.is_valid():
            raise ValueError(f"libuipc finds its world not valid after {self.time:.3f} s")

    def _set_contact(self) -> None:
        mu = self.scene.scene.fabric.mu_body
        table = self.uipc_scene.contact_tabular()
        table.default_model(mu, HARDNESS)
        self.of_cloth, self.of_parts = table.default_element(), table.create("parts")
        table.insert(self.of_parts, self.of_parts, 0.0, 0.0, False)
        table.insert(self.of_parts, self.of_cloth, mu, HARDNESS, True)

    def _add_cloth(self):  # type: ignore[no-untyped-def]
        """The slot of its geometry."""
        scene, fabric = self.scene.scene, self.scene.scene.fabric
        radius = 0.5 * fabric.thickness
        cloth = trimesh(scene.x_start, scene.garment.faces)
        label_surface(cloth)
        young = 0.5 * (fabric.k_warp + fabric.k_weft) / (2 * radius)
        density = fabric.areal_density / (2 * radius)
        NeoHookeanShell().apply_to(cloth, ElasticModuli2D.youngs_poisson(young, 0.0), density, radius)
        DiscreteShellBending().apply_to(cloth, fabric.k_bend / 6)
        self.of_cloth.apply_to(cloth)
        if len(self.scene.held):
            view(cloth.vertices().find(builtin.is_fixed))[self.scene.held] = 1
        return self.uipc_scene.objects().create("cloth").geometries().create(cloth)[0]

    def _add_part(self, k: int):  # type: ignore[no-untyped-def]
        """The slot of its geometry; one that moves is led before every step."""
        part = trimesh(*self.scene.parts[k])
        label_surface(part)
        AffineBodyConstitution().apply_to(part, HARDNESS)
        self.of_parts.apply_to(part)
        part_object = self.uipc_scene.objects().create(f"part {k}")
        if k == 0:
            view(part.instances().find(builtin.is_fixed))[:] = 1
            return part_object.geometries().create(part)[0]
        SoftTransformConstraint().apply_to(part, np.array([PULL, PULL]))
        slot = part_object.geometries().create(part)[0]

        def lead(info) -> None:  # type: ignore[no-untyped-def]
            led = info.geo_slots()[0].geometry()
            place = np.eye(4)
            place[:3, :3] = Rotation.from_quat(self.scene.turn(self.time)[k]).as_matrix()
            view(led.instances().find(builtin.is_constrained))[:] = 1
            view(led.instances().find(builtin.aim_transform))[:] = place

        self.uipc_scene.animator().insert(part_object, lead)
        return slot
