"""What the golden vectors hold: every message, a short stream with every codec, and messages that must be refused."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import zstandard
from msgspec import Struct

from . import effect_messages as effects
from . import messages as m
from . import outfit_messages as outfits
from . import report_messages as reports
from .control import encode
from .conventions import CONVENTIONS
from .encoder import FrameEncoder
from .frames import HEADER_BYTES
from .skinning import Skinner
from .topology import BodySurface, Topology

CLOTH_SEGMENTS, CLOTH_ROWS = 12, 5
BODY_SEGMENTS, BODY_ROWS = 8, 7
JOINTS = ("pelvis", "spine", "head", "left_thigh", "right_thigh")


def topology(topology_id: int = 1) -> Topology:
    """A tube of cloth about a capped tube of a body with five joints."""
    rest = np.round(_tube(BODY_SEGMENTS, BODY_ROWS, 0.15, 0.2, 1.7), 3)
    rest = np.concatenate([rest, [[0.0, 0.2, 0.0], [0.0, 1.7, 0.0]]])
    bottom, top = len(rest) - 2, len(rest) - 1
    last = (BODY_ROWS - 1) * BODY_SEGMENTS
    ring = [(i, (i + 1) % BODY_SEGMENTS) for i in range(BODY_SEGMENTS)]
    caps = [[bottom, b, a] for a, b in ring] + [[top, last + a, last + b] for a, b in ring]
    height = rest[:, 1]
    upper = np.clip((height - 0.9) / 0.4, 0.0, 1.0)
    lower = np.clip((0.9 - height) / 0.3, 0.0, 1.0)
    leg = np.where(rest[:, 0] >= 0.0, 3, 4)
    head = np.clip((height - 1.4) / 0.2, 0.0, 1.0)
    weights = np.stack([1.0 - upper - lower, upper * (1.0 - head), upper * head, lower], axis=1)
    body = BodySurface(
        rest_vertices=rest.astype(np.float32),
        faces=np.concatenate([_tube_faces(BODY_SEGMENTS, BODY_ROWS), caps]),
        joint_names=JOINTS,
        parents=np.array([-1, 0, 1, 0, 0]),
        rest_joints=np.array([[0, 0.9, 0], [0, 1.1, 0], [0, 1.5, 0], [0.09, 0.85, 0], [-0.09, 0.85, 0]]),
        skin_joints=np.stack([np.zeros(len(rest), int), np.ones(len(rest), int), np.full(len(rest), 2), leg], axis=1),
        skin_weights=weights.astype(np.float32),
    )
    faces = _tube_faces(CLOTH_SEGMENTS, CLOTH_ROWS)
    corners = np.stack([faces % CLOTH_SEGMENTS / 10.0, faces // CLOTH_SEGMENTS / 8.0], axis=2)
    return Topology(
        topology_id=topology_id,
        cloth_vertex_count=CLOTH_SEGMENTS * CLOTH_ROWS,
        faces=faces,
        body=body,
        uv=corners.astype(np.float32),
        panel_of_face=(faces[:, 0] % CLOTH_SEGMENTS >= CLOTH_SEGMENTS // 2).astype(np.uint16),
        panel_names=("front", "dos à pinces"),
        garments=(
            m.GarmentTopology(
                name="tube",
                fabric="cotton",
                vertices=(0, CLOTH_SEGMENTS * CLOTH_ROWS),
                faces=(0, len(faces)),
                panels=(0, 2),
            ),
        ),
    )


def messages() -> dict[str, tuple[bytes, Any]]:
    """Name -> bytes of one control message, and the map it holds. Names begin with the side that sends it."""
    pose = m.PoseMessage(
        subject="wearer",
        convention=m.POSE_CONVENTION,
        frame=m.POSE_FRAME,
        t=12.015625,
        seq=721,
        root=(1234.5678901234, 0.93, -0.25),
        rotations=tuple((0.0, 0.6, 0.0, 0.8) if joint else (0.0, 0.0, 0.0, 1.0) for joint in range(len(JOINTS))),
        ack=640,
    )
    client: list[m.ClientMessage] = [
        m.HelloMessage(versions=(1,), client="golden 1.0", resume="t0ken"),
        pose,
        _skeleton(),
        _tracked_pose(),
        m.AckMessage(seq=4294967295),
        m.KeyframeRequestMessage(reason="missing_base"),
        m.PlayMessage(),
        m.PauseMessage(request=7),
        m.SetMotionMessage(motion="walk", request=8),
        m.SetFabricMessage(fabric="Baumwolle, köperbindig", request=9),
        m.SetAccuracyMessage(accuracy=0.00025, deadline_ms=11, preset="fit", request=13),
        m.SetEffectMessage(name="wind", parameters={"velocity": [0.5, 0, -2.25]}, state="armed", request=14),
        m.RemoveEffectMessage(name="auto", request=15),
        m.MeasureEffectsMessage(request=16),
        m.PutOnMessage(garment="g-2", fabric="cotton", size=1.25, position=0, replaces="tube", request=17),
        m.TakeOffMessage(garment="tube", request=18),
        m.ReorderMessage(order=("skirt", "tube"), edited="tube", request=19),
        m.EditMessage(
            edit={"kind": "move_vertex", "panel": "front", "vertex": 2, "by": [0.0125, -0.03]},
            mirror=True,
            hold=True,
            request=10,
            garment="tube",
        ),
        m.UndoMessage(request=11),
        m.RedoMessage(request=12),
        m.PingMessage(t=99.25),
        m.ByeMessage(reason="done"),
    ]
    server: list[m.ServerMessage] = [
        m.WelcomeMessage(
            version=1,
            session="s-1",
            epoch="e-1",
            server="golden 1.0",
            clock=1000.5,
            credit=2,
            topology_id=1,
            subjects=("wearer",),
            motions=("walk", "squat"),
            fabrics=("cotton",),
        ),
        topology().to_message(compress=False),
        m.StatusMessage(
            state="dressing",
            detail="Sewing the seams",
            motion=None,
            fabric="cotton",
            playing=True,
            progress=0.25,
            preset="fit",
            preset_in_force="draft",
            preset_pending=True,
            changes=(
                m.ChangeStatus(
                    step="edit",
                    kind="dart",
                    panel="front",
                    garment="",
                    since=1000.25,
                    doing="dressing",
                    detail="Sewing the seams",
                    progress=0.5,
                ),
            ),
        ),
        reports.ReportMessage(
            seq=640,
            t_sim=11.9375,
            iterations=6,
            residual=1e-4,
            min_gap=-0.00025,
            gap_offset=0.0018,
            max_stretch=1.03,
            body_lag=0.0021,
            pairs=1834,
            retries=0,
            times_ms={"predict": 0.5, "contact": 12.25},
            solver_ms=61.5,
            frames_per_second=14.5,
            real_time_factor=1.0,
            advice="the fabric is stretched by up to 35 %: try a larger size",
            asleep=True,
            error=0.00075,
            late_ms=0.5,
            solved=(
                reports.FramePrice(solver_ms=40.5, error=None),
                reports.FramePrice(solver_ms=61.5, error=0.00075, late_ms=0.5),
            ),
        ),
        m.EffectsMessage(
            effects=_effects(),
            auto=True,
            kept=(effects.KeptEffect(name="böig", state="active", parameters={}, refused="There is none. Leave it."),),
            plan="add_acceleration: gravity",
        ),
        m.OutfitMessage(
            worn=(
                outfits.WornGarment(name="tube", garment="g-1", fabric="cotton", size=1.25, edited=False),
                outfits.WornGarment(
                    name="skirt", garment="g-2", fabric="Leinen, grün", size="fit", edited=True, again=True
                ),
            ),
            request=17,
        ),
        _design(),
        m.EditedMessage(id=3, change="topology", request=10),
        m.ErrorMessage(
            code="invalid_pose",
            place="$.rotations[3]",
            message="The rotation of joint 'left_thigh' is [0.0, 0.0, 0.0, 0.0], not a unit quaternion.",
            remedy="Send finite x, y, z, w of length 1.",
        ),
        m.PongMessage(t=99.25, clock=1000.75),
        m.GoodbyeMessage(reason="The server restarts.", retry_after=2.0),
    ]
    named = {}
    for side, group in (("client", client), ("server", server)):
        for message in group:
            tag = str(message.__struct_config__.tag)
            if isinstance(message, m.PoseMessage) and message.convention != m.POSE_CONVENTION:
                tag = "pose_of_a_tracker"
            named[f"{side}_{tag}"] = (encode(message), _plain(message))
    return named


def _effects() -> tuple[effects.EffectState, ...]:
    down = {"acceleration": [0.0, -9.81, 0.0]}
    return (
        effects.EffectState(name="gravity", state="active", parameters=down, ms=0.125),
        effects.EffectState(name="wind", state="armed", pending="binding", why="böig", stages={"start_step": 0.5}),
    )


def _design() -> m.DesignMessage:
    triangle = ((0.0, 0.0), (0.5, 0.0), (0.25, 0.75))
    straight = m.DesignEdge(
        ends=(0, 1), shape="line", handles=((0.125, 0.0), (0.375, 0.0)), points=(triangle[0], triangle[1])
    )
    bent = m.DesignEdge(ends=(1, 2), shape="arc", handles=((0.5, 0.5),), points=(triangle[1], (0.5, 0.5), triangle[2]))
    curved = m.DesignEdge(
        ends=(2, 0), shape="quadratic", handles=((0.0, 0.375),), points=(triangle[2], (0.0625, 0.375), triangle[0])
    )
    pieces = [
        m.DesignPanel(name=name, label=label, vertices=triangle, edges=(straight, bent, curved))
        for name, label in (("front", "body"), ("dos à pinces", ""))
    ]
    return m.DesignMessage(
        held=True,
        panels=tuple(pieces),
        seams=(m.DesignSeam(first=(0, 1), second=(1, 2), number=3),),
        done=(m.DesignEdit(id=1, kind="scale_garment", panel=""), m.DesignEdit(id=3, kind="take_in", panel="front")),
        undone=1,
        patches=(m.DesignPatch(panel=1, host=0, points=((0.25, 0.125), (0.375, 0.25), (0.25, 0.25))),),
        notes=("edge 2 of 'dos à pinces' is bent, too: it is sewn to edge 1 of 'front'",),
    )


def _skeleton() -> m.SkeletonMessage:
    names = CONVENTIONS["webxr"].required
    return m.SkeletonMessage(
        subject="wearer",
        convention="webxr",
        joint_names=names,
        parents=(-1, 0, 1, 2, 0, 4, 5),
        rest_positions=tuple((0.125 * k, 1.0 + 0.0625 * k, -0.5) for k in range(len(names))),
        rest_rotations=tuple((0.0, 0.6, 0.0, 0.8) for _ in names),
        request=6,
    )


def _tracked_pose() -> m.PoseMessage:
    names = CONVENTIONS["webxr"].required
    return m.PoseMessage(
        subject="wearer",
        convention="webxr",
        frame=m.POSE_FRAME,
        clock="server",
        t=12.03125,
        seq=722,
        positions=tuple((0.1 * k, 1.25, -0.25) for k in range(len(names))),
        rotations=tuple((0.0, 0.0, 0.6, 0.8) for _ in names),
        confidence=(1.0, 0.875, 0.5, 0.25, 0.0, 1.0, 1.0),
        smoothing="one-euro",
        ack=641,
    )


def stream() -> dict[str, bytes]:
    """Name -> bytes of what one client receives: every codec, a moving origin, a bare frame, a grown header."""
    shape = topology()
    encoder = FrameEncoder(shape)
    received = {"00_topology": encode(shape.to_message())}

    def publish(name: str, step: int, place: float, *, form: str = "shared") -> None:
        cloth, body, root, rotations = _state(shape, step, place)
        frame = encoder.encode(
            cloth, body, root, rotations, t_sim=step / 64.0, t_published=1000.0 + step / 64.0, pose_seq=10 * step
        )
        if form != "shared":
            frame = encoder.standalone(compressed=form == "standalone")
        received[name] = frame.data

    publish("01_key", 1, 0.0)
    publish("02_delta1", 2, 0.01)
    publish("03_delta2", 3, 0.02)
    publish("04_delta2_origin_moves", 4, 1.7)
    publish("05_delta2", 5, 3.0)
    publish("06_key_after_a_jump", 6, -9.0)
    publish("07_delta1", 7, -9.0)
    publish("08_raw_bare", 8, -9.01, form="bare")
    publish("09_key_standalone", 9, -9.03, form="standalone")
    encoder.request_keyframe()
    publish("10_key_on_request", 10, 7000.0)
    grown = bytearray(received["10_key_on_request"])
    struct.pack_into("<H", grown, 54, HEADER_BYTES + 8)
    received["10_key_on_request"] = bytes(grown[:HEADER_BYTES]) + b"later on" + bytes(grown[HEADER_BYTES:])
    publish("11_delta1", 11, 7000.01)
    encoder.set_topology(topology(2))
    received["12_topology"] = encode(topology(2).to_message(compress=False))
    publish("13_key", 12, 0.0)
    return received


def malformed() -> dict[str, tuple[bytes, str]]:
    """Name -> bytes of a frame to be refused by a decoder that knows topology 1 and no frame, and the error's code."""
    shape = topology()
    encoder = FrameEncoder(shape)
    cloth, body, root, rotations = _state(shape, 1, 0.0)
    key = encoder.encode(cloth, body, root, rotations, t_sim=0.0, t_published=0.0).data
    raw = encoder.standalone(compressed=False).data
    delta = encoder.encode(cloth, body, root, rotations, t_sim=0.0, t_published=0.1).data
    pose, cloth_block = HEADER_BYTES, HEADER_BYTES + 24 + 16 * len(JOINTS)
    offsets = cloth_block + struct.unpack_from("<I", raw, 56)[0]
    count = struct.unpack_from("<I", raw, 60)[0]
    size = 6 * shape.cloth_vertex_count

    def patched(data: bytes, form: str, place: int, value: float) -> bytes:
        changed = bytearray(data)
        struct.pack_into(form, changed, place, value)
        return bytes(changed)

    def with_cloth(block: bytes) -> bytes:
        rest = key[cloth_block + struct.unpack_from("<I", key, 56)[0] :]
        return patched(key[:cloth_block] + block + rest, "<I", 56, len(block))

    far = np.full(size, 0xFE, dtype=np.uint8).tobytes()
    swapped = bytearray(raw)
    swapped[offsets + 1] = 0
    zstd = zstandard.ZstdCompressor(level=1)
    return {
        "empty": (b"\xc1", "malformed_frame"),
        "short_header": (key[:40], "malformed_frame"),
        "other_kind": (patched(key, "<B", 1, 2), "malformed_frame"),
        "codec_9": (patched(key, "<B", 2, 9), "unknown_codec"),
        "topology_99": (patched(key, "<I", 4, 99), "unknown_topology"),
        "seq_0": (patched(key, "<I", 8, 0), "malformed_frame"),
        "key_with_base": (patched(patched(key, "<I", 8, 2), "<I", 12, 1), "malformed_frame"),
        "delta_without_base": (delta, "missing_base"),
        "origin_at_the_end": (patched(key, "<i", 24, 2**31 - 1), "malformed_frame"),
        "time_not_finite": (patched(key, "<d", 32, float("nan")), "malformed_frame"),
        "other_vertex_count": (patched(key, "<I", 48, 3), "malformed_frame"),
        "other_joint_count": (patched(key, "<H", 52, 4), "malformed_frame"),
        "small_header_bytes": (patched(key, "<H", 54, 10), "malformed_frame"),
        "cloth_beyond_the_end": (patched(key, "<I", 56, 2**32 - 1), "malformed_frame"),
        "ends_in_the_pose": (patched(key[: pose + 30], "<I", 56, 0), "malformed_frame"),
        "root_not_finite": (patched(key, "<d", pose, float("inf")), "malformed_frame"),
        "zero_quaternion": (patched(key, "<f", pose + 24 + 12, 0.0), "malformed_frame"),
        "no_zstd": (with_cloth(b"\0" * 20), "malformed_compression"),
        "zstd_too_small": (with_cloth(zstd.compress(b"\0" * (size - 6))), "malformed_compression"),
        "zstd_too_large": (with_cloth(zstd.compress(b"\0" * 10_000_000)), "malformed_compression"),
        "zstd_of_unknown_size": (
            with_cloth(_of_unknown_size(size)),
            "malformed_compression",
        ),
        "zstd_cut": (with_cloth(zstd.compress(bytes(range(256)) * 2)[:-40]), "malformed_compression"),
        "out_of_reach": (with_cloth(zstd.compress(far)), "malformed_frame"),
        "raw_cut": (patched(raw, "<I", 56, size - 2), "malformed_frame"),
        "too_many_offsets": (patched(raw, "<I", 60, 10_000), "malformed_frame"),
        "offsets_cut": (raw[:-1], "malformed_frame"),
        "bytes_after_the_end": (raw + b"\0", "malformed_frame"),
        "vertex_twice": (bytes(swapped), "malformed_frame"),
        "vertex_beyond_the_body": (patched(raw, "<B", offsets + count - 1, 255), "malformed_frame"),
    }


def _of_unknown_size(size: int) -> bytes:
    return zstandard.ZstdCompressor(level=1, write_content_size=False).compress(b"\0" * size)


def _state(
    shape: Topology, step: int, place: float
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Cloth, body, root and rotations of one simulated state; `place` [m] is how far the body has walked."""
    angle = 0.1 * step + 0.2 * np.arange(len(JOINTS))
    rotations = np.stack([np.sin(angle / 2), 0 * angle, 0 * angle, np.cos(angle / 2)], axis=1)
    root = np.array([0.05 * step, 0.93, place])
    body = Skinner(shape.body).pose(root, rotations.astype(np.float32))
    yielding = np.arange(10, 40, 3)
    body[yielding] += np.stack([0.0009 * yielding, -0.0004 * yielding, 0.01 * np.cos(yielding + step)], axis=1)
    cloth = _tube(CLOTH_SEGMENTS, CLOTH_ROWS, 0.2 + 0.01 * (step % 4), 0.9, 1.4)
    cloth += root - [0.0, 0.9, 0.0]
    cloth[:, 0] += 0.01 * np.sin(8.0 * cloth[:, 1] + 0.3 * step)
    return cloth, body, root, rotations


def _tube(segments: int, rows: int, radius: float, low: float, high: float) -> np.ndarray[Any, Any]:
    turn = 2.0 * np.pi * np.arange(segments) / segments
    ring = np.stack([radius * np.sin(turn), 0.0 * turn, radius * np.cos(turn)], axis=1)
    heights = np.linspace(low, high, rows)
    return (ring[None] + np.stack([0 * heights, heights, 0 * heights], axis=1)[:, None]).reshape(-1, 3)


def _tube_faces(segments: int, rows: int) -> np.ndarray[Any, Any]:
    faces = []
    for row in range(rows - 1):
        for segment in range(segments):
            a, b = row * segments + segment, row * segments + (segment + 1) % segments
            faces += [[a, b, b + segments], [a, b + segments, a + segments]]
    return np.array(faces)


def _plain(value: Any) -> Any:
    """A message as the map that goes over the wire."""
    if isinstance(value, Struct):
        tag = value.__struct_config__.tag
        fields = {name: _plain(getattr(value, name)) for name in value.__struct_fields__}
        return {"type": tag, **fields} if tag is not None else fields
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value
