"""From simulated states to frames for the server: only as many, and in the forms, that somebody can take."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from tryon_protocol import BodySurface, EncodedFrame, FrameEncoder, GarmentTopology, Topology, encode
from tryon_server.runtime.drape import Drape, Outfit, Stance
from tryon_server.runtime.sources import Move
from tryon_server.sessions.commands import AllowFrame
from tryon_server.sessions.events import FrameReady, TopologyReady
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.pose import Pose
from tryon_solver.body.tracking import fits


class Publisher:
    """Encodes the states of one session's drapes. Drops states before they are encoded, never frames after it.

    Args:
        keyframe_seconds: longest time between shared frames that stand alone, while some are published [s].
        clock: the server's steady clock [s]; frames say when they were published on it.
    """

    def __init__(self, keyframe_seconds: float, clock: Callable[[], float]) -> None:
        self._keyframe_seconds = keyframe_seconds
        self._clock = clock
        self._allowed = AllowFrame(0, keyframe=False, standalone=False, plain=False, again=False)
        self._handed_over = 0
        self._topology_id = 0
        self._encoder: FrameEncoder | None = None
        self._drape: Drape | None = None
        self._move: Move | None = None
        self._fresh = False

    @property
    def last_seq(self) -> int:
        """Number of the newest frame; 0 before the first."""
        return self._handed_over

    def dress(self, drape: Drape, move: Move) -> TopologyReady:
        """Go on with another garment as it is at this move; the event that announces it."""
        self._topology_id += 1
        topology = topology_of(drape.outfit, self._topology_id)
        if self._encoder is None:
            self._encoder = FrameEncoder(topology, keyframe_interval=self._keyframe_seconds)
        else:
            self._encoder.set_topology(topology)
        self._drape = drape
        self.show(move)
        return TopologyReady(
            topology_id=self._topology_id,
            payload=encode(topology.to_message()),
            plain_payload=encode(topology.to_message(compress=False)),
            joint_names=topology.body.joint_names,
            followable=fits(topology.body.joint_names),
        )

    def allow(self, command: AllowFrame) -> None:
        """The server can take frames up to this number of them."""
        self._allowed = command

    def show(self, move: Move) -> None:
        """The drape has been simulated to this move: the newest state, in place of one that was not published."""
        self._move = move
        self._fresh = True

    def publish(self) -> FrameReady | None:
        """The newest state as a frame, if the server can take one and it or somebody there lacks this state.

        Raises:
            ProtocolError: the state can't be encoded, for example because a position is not a number.
        """
        wanted = self._fresh or self._allowed.again
        if self._encoder is None or self._drape is None or self._move is None:
            return None
        if not wanted or self._handed_over >= self._allowed.total:
            return None
        shared = self._encode(self._encoder, self._drape, self._move)
        self._handed_over += 1
        self._fresh = False
        return FrameReady(
            topology_id=self._topology_id,
            shared=shared,
            standalone=self._encoder.standalone() if self._allowed.standalone else None,
            plain=self._encoder.standalone(compressed=False) if self._allowed.plain else None,
        )

    def _encode(self, encoder: FrameEncoder, drape: Drape, move: Move) -> EncodedFrame:
        if self._allowed.keyframe:
            encoder.request_keyframe()
        self._fresh = False  # a state that can't be encoded is not tried again
        pose = told_pose(move.pose, drape.own_motion)
        return encoder.encode(
            drape.cloth_positions(),
            drape.body_positions(),
            np.asarray(pose.root, dtype=np.float64),
            np.asarray(pose.rotations),
            t_sim=move.t,
            t_published=self._clock(),
            pose_seq=move.pose_seq,
            space_origin=(float(drape.origin[0]), float(drape.origin[1]), float(drape.origin[2])),
        )


def told_pose(stance: Stance, own_motion: MeshSequence | None) -> Pose:
    """How clients are told that the body stands: of one that moves by itself, where it is as a whole."""
    if isinstance(stance, Pose):
        return stance
    assert own_motion is not None
    whole = own_motion.transforms(stance)[0]
    return Pose(root=whole[:3, 3], rotations=Rotation.from_matrix(whole[:3, :3]).as_quat()[None])


def topology_of(outfit: Outfit, topology_id: int) -> Topology:
    """The protocol's description of an outfit. Raises ProtocolError when its arrays don't fit together."""
    body = outfit.body
    surface = BodySurface(
        rest_vertices=np.asarray(body.rest_vertices, dtype=np.float32),
        faces=np.asarray(body.faces, dtype=np.uint32),
        joint_names=tuple(body.joint_names),
        parents=np.asarray(body.parents, dtype=np.int32),
        rest_joints=np.asarray(body.rest_joints, dtype=np.float32),
        skin_joints=np.asarray(body.skin_joints, dtype=np.uint16),
        skin_weights=np.asarray(body.skin_weights, dtype=np.float32),
    )
    return Topology(
        topology_id=topology_id,
        cloth_vertex_count=outfit.vertex_count,
        faces=np.asarray(outfit.faces, dtype=np.uint32),
        body=surface,
        uv=np.asarray(outfit.uv, dtype=np.float32),
        panel_of_face=np.asarray(outfit.panel_of_face, dtype=np.uint16),
        panel_names=outfit.panel_names,
        garments=tuple(
            GarmentTopology(
                name=part.layer.name,
                fabric=part.fabric,
                vertices=span(part.layer.vertices),
                faces=span(part.layer.faces),
                panels=span(part.layer.panels),
            )
            for part in outfit.garments
        ),
    )


def span(places: slice) -> tuple[int, int]:
    """The first of them and how many there are."""
    return places.start, places.stop - places.start
