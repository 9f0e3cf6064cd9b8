"""Writes the golden vectors of protocol/vectors, or checks that the code still produces them.

    python -m tryon_protocol.vectors            write them
    python -m tryon_protocol.vectors --check    exit with status 1 when a vector differs from what the code makes

vectors/messages   one control message each: NAME.bin, and NAME.json with the map it holds; bytes are {"$base64": ...}
vectors/stream     a connection: `stream.json` lists topology and frames in the order received, with decoded numbers
vectors/malformed  `malformed.json` lists messages that must be refused, with the error code; they come after the
                   stream's topology, each to a fresh decoder

Compressed bytes depend on the version of zstd, so the check compares what they decode to.
"""

from __future__ import annotations

import argparse
import base64
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from . import vector_content as content
from .control import decode_client, decode_server
from .decoder import DecodedFrame, FrameDecoder
from .errors import ProtocolError
from .topology import Topology

FOLDER = Path(__file__).resolve().parents[1] / "vectors"
BODY_TOLERANCE = 1e-6
"""m, by which a body vertex may differ between two machines' float64 arithmetic, and from the rounded JSON."""


def make() -> dict[str, bytes]:
    """Every file, by its path below the folder."""
    files: dict[str, bytes] = {}
    for name, (data, plain) in content.messages().items():
        files[f"messages/{name}.bin"] = data
        files[f"messages/{name}.json"] = _json(plain)
    listed = []
    decoder = FrameDecoder()
    for name, data in content.stream().items():
        files[f"stream/{name}.bin"] = data
        listed.append({"file": f"{name}.bin", **_expected(decoder, data)})
    files["stream/stream.json"] = _json(listed)
    refused = []
    for name, (data, code) in content.malformed().items():
        files[f"malformed/{name}.bin"] = data
        refused.append({"file": f"{name}.bin", "code": code})
    files["malformed/malformed.json"] = _json(refused)
    return files


def _expected(decoder: FrameDecoder, data: bytes) -> dict[str, Any]:
    if data[0] != 0xC1:
        topology = Topology.from_message(decode_server(data))  # type: ignore[arg-type]
        decoder.set_topology(topology)
        return {"topology": _arrays(topology)}
    return {"frame": _numbers(decoder.decode(data))}


def _arrays(topology: Topology) -> dict[str, Any]:
    body = topology.body
    return {
        "topology_id": topology.topology_id,
        "grid": topology.grid,
        "cloth_vertex_count": topology.cloth_vertex_count,
        "faces": topology.faces.tolist(),
        "uv": None if topology.uv is None else topology.uv.tolist(),
        "panel_of_face": None if topology.panel_of_face is None else topology.panel_of_face.tolist(),
        "panel_names": list(topology.panel_names),
        "body": {
            "rest_vertices": body.rest_vertices.tolist(),
            "faces": body.faces.tolist(),
            "joint_names": list(body.joint_names),
            "parents": body.parents.tolist(),
            "rest_joints": body.rest_joints.tolist(),
            "skin_joints": body.skin_joints.tolist(),
            "skin_weights": body.skin_weights.tolist(),
        },
    }


def _numbers(frame: DecodedFrame) -> dict[str, Any]:
    return {
        "seq": frame.seq,
        "pose_seq": frame.pose_seq,
        "topology_id": frame.topology_id,
        "t_sim": frame.t_sim,
        "t_published": frame.t_published,
        "stands_alone": frame.stands_alone,
        "offset_count": frame.offset_count,
        "root": frame.root.tolist(),
        "rotations": frame.rotations.tolist(),
        "cloth_units": frame.cloth_units.tolist(),
        "body": np.round(frame.body, 8).tolist(),
    }


def differences(files: dict[str, bytes]) -> list[str]:
    """Names of vectors on disk that say something else than these."""
    present = {path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.is_file()}
    wrong = [f"{name} is missing" for name in sorted(files.keys() - present)]
    wrong += [f"{name} is not made any more" for name in sorted(present - files.keys())]
    streamed = _decoded_stream()
    for name in sorted(files.keys() & present):
        committed = (FOLDER / name).read_bytes()
        if name.endswith(".json"):
            same = _same(json.loads(committed), json.loads(files[name]))
        elif name.startswith("stream/"):
            same = _same(streamed[name], _listed(files, name))
        elif name.startswith("messages/"):
            decode = decode_client if name.startswith("messages/client") else decode_server
            same = decode(committed) == decode(files[name])
        else:
            same = True  # the code each must be refused with is in malformed.json, and tests hold the bytes to it
        if not same:
            wrong.append(f"{name} differs")
    return wrong


def _decoded_stream() -> dict[str, Any]:
    """What the stream on disk decodes to, by file; a file that can't be read has its error instead."""
    decoder, decoded = FrameDecoder(), {}
    for path in sorted((FOLDER / "stream").glob("*.bin")):
        try:
            decoded[f"stream/{path.name}"] = _expected(decoder, path.read_bytes())
        except ProtocolError as exc:
            decoded[f"stream/{path.name}"] = {"error": str(exc)}
    return decoded


def _listed(files: dict[str, bytes], name: str) -> dict[str, Any]:
    entries = {f"stream/{entry.pop('file')}": entry for entry in json.loads(files["stream/stream.json"])}
    return entries[name]


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(_same(a, b) for a, b in zip(one, other))
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= BODY_TOLERANCE
    return type(one) is type(other) and bool(one == other)


def _json(value: Any) -> bytes:
    def plain(item: Any) -> Any:
        if isinstance(item, bytes):
            return {"$base64": base64.b64encode(item).decode("ascii")}
        raise TypeError(f"{item!r} has no place in a vector's JSON")

    return (json.dumps(value, default=plain, ensure_ascii=False, allow_nan=False) + "\n").encode("utf-8")


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tryon_protocol.vectors", description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail when a vector differs")
    check = parser.parse_args(arguments).check
    files = make()
    if not check:
        for name, data in files.items():
            path = FOLDER / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        return 0
    wrong = differences(files)
    for line in wrong:
        print(line)
    if wrong:
        print("If the wire was meant to change, run `python -m tryon_protocol.vectors` and say so in PROTOCOL.md.")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
