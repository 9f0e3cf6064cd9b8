"""A tube of cloth around a ball with three joints, sent over the wire: what the measures are tested on."""

from __future__ import annotations

import numpy as np
from frame_figures import FrameFigures, FrameMeter
from small_scenes import icosphere, sheet

from tryon_protocol import BodySurface, DecodedFrame, FrameDecoder, FrameEncoder, Topology
from tryon_solver.geometry.garment import Garment

NAMES = ("pelvis", "head", "left_toes")
JOINTS = np.array([[0, 0, 0], [0, 0.5, 0], [0, -0.5, 0]])


def tube(columns: int = 24, rows: int = 9, radius: float = 0.12, height: float = 0.2) -> tuple[Garment, np.ndarray]:
    """A tube around the vertical axis from a sheet that closes on itself, and its vertices (N, 3) m."""
    flat, _ = sheet(columns + 1, rows, 2 * np.pi * radius, height)
    uv = np.empty((flat.vertex_count, 2))
    uv[flat.faces.ravel()] = flat.uv_corners.reshape(-1, 2)
    angle, y = uv[:, 0] / radius, uv[:, 1] - uv[:, 1].mean()
    x = np.column_stack([radius * np.cos(angle), y, radius * np.sin(angle)])
    number = np.arange(flat.vertex_count)
    number = number // (columns + 1) * columns + number % (columns + 1) % columns
    faces = number[flat.faces].astype(np.int32)
    places = np.empty((columns * rows, 3))
    places[number] = x
    return Garment(faces, flat.uv_corners, flat.panel_of_face, len(places)), places


class Dressed:
    """A tube of 12 cm radius around a ball of 10 cm: `shown` sends a state over the wire and measures what arrives."""

    def __init__(self) -> None:
        self.garment, self.cloth = tube()
        self.body, faces = icosphere(0.1, 3)
        surface = BodySurface(
            rest_vertices=self.body.astype(np.float32),
            faces=faces,
            joint_names=NAMES,
            parents=np.array([-1, 0, 0]),
            rest_joints=JOINTS.astype(np.float32),
            skin_joints=np.zeros((len(self.body), 1), np.uint16),
            skin_weights=np.ones((len(self.body), 1), np.float32),
        )
        uv = self.garment.uv_corners.astype(np.float32)
        self.topology = Topology(1, self.garment.vertex_count, self.garment.faces.astype(np.uint32), surface, uv)
        self.encoder, self.decoder, self.time = FrameEncoder(self.topology), FrameDecoder(), 0.0
        self.decoder.set_topology(self.topology)
        self.still = np.tile([0.0, 0, 0, 1], (len(NAMES), 1))
        self.meter = FrameMeter(self.topology, self.frame(self.cloth, self.body), 9.4e-3)

    def frame(
        self,
        cloth: np.ndarray,
        body: np.ndarray,
        root: tuple[float, float, float] | np.ndarray = (0.0, 0.0, 0.0),
        rotations: np.ndarray | None = None,
    ) -> DecodedFrame:
        """A state as decoded, 1/60 s after the one before."""
        self.time += 1 / 60
        turned = self.still if rotations is None else rotations
        sent = self.encoder.encode(cloth, body, np.array(root), turned, t_sim=self.time, t_published=self.time)
        return self.decoder.decode(sent.data)

    def shown(self, cloth: np.ndarray, body: np.ndarray, **pose: np.ndarray | tuple[float, ...]) -> FrameFigures:
        """The figures of a state."""
        return self.meter.measure(self.frame(cloth, body, **pose), intersections=True)
