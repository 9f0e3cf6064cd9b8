"""Record a running session: `python -m tryon_client URL --frames 300 --out frames.npz`."""

from __future__ import annotations

import argparse
import asyncio
import sys

import websockets

from tryon_protocol import DecodedFrame, PlayMessage, ProtocolError, SetMotionMessage

from .recording import record
from .stream import as_exception, connect


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tryon_client",
        description="Record the frames of a running session as decoded from the wire, to an .npz file with the arrays "
        "cloth, cloth_faces, body, body_faces and t (metres, seconds).",
    )
    parser.add_argument("url", help="address of the stream, such as ws://localhost:8000/api/sessions/ID/stream")
    parser.add_argument("--frames", type=_positive, metavar="COUNT", default=300, help="frames to record (300)")
    parser.add_argument("--motion", metavar="NAME", help="let the session play this motion first")
    parser.add_argument("--out", required=True, metavar="FILE", help="file to write, ending in .npz")
    options = parser.parse_args(arguments)
    try:
        asyncio.run(_record(options.url, options.frames, options.motion, options.out))
    except (ProtocolError, ValueError, OSError, websockets.WebSocketException) as exc:
        print(f"error: {exc}", file=sys.stderr)
        return 1
    return 0


async def _record(url: str, frames: int, motion: str | None, out: str) -> None:
    async with connect(url) as stream:
        if motion is not None:
            await stream.send(SetMotionMessage(motion=motion))
            await stream.send(PlayMessage())

        def stop_on_error(_frame: DecodedFrame) -> None:
            if stream.errors:
                raise as_exception(stream.errors[0])

        recording = await record(stream, frame_count=frames, progress=stop_on_error)
        recording.save(out)
        print(f"{len(recording.frames)} frames of topology {recording.topology.topology_id} written to {out}")


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("give at least 1")
    return value


if __name__ == "__main__":
    sys.exit(main())
