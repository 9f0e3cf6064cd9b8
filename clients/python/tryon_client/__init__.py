"""Python client of tryon: connect to a session's stream, send poses, receive decoded frames, record them; change what
a session wears.

async with connect("ws://localhost:8000/api/sessions/ID/stream") as stream:
    async for frame in stream.frames():
        print(frame.seq, frame.cloth.shape, frame.body.shape)
"""

from .changes import Changes, RefusedError
from .recording import Recording, record
from .stream import Event, Stream, connect

__all__ = ["Changes", "Event", "Recording", "RefusedError", "Stream", "connect", "record"]
