"""A client that watches a session in a thread of its own, and what IPC Toolkit says of the frames that it saw."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from frame_judge import FrameJudge

from tryon_client import connect
from tryon_protocol import DecodedFrame

EVERY = 5  # frames, of which one is judged
LONGEST = 240.0  # s, that frames may be waited for


class Viewer:
    """A client in a thread of its own; `seen` (topology, frame) of every frame that is judged."""

    def __init__(self, url: str) -> None:
        self.seen: list[tuple[Any, DecodedFrame]] = []
        self.errors: list[Any] = []
        self.frames = 0
        self.stop = threading.Event()
        self.thread = threading.Thread(target=lambda: asyncio.run(self._watch(url)), daemon=True)
        self.thread.start()

    async def _watch(self, url: str) -> None:
        async with connect(url) as stream:
            async for event in stream:
                if isinstance(event, DecodedFrame):
                    if self.frames % EVERY == 0:
                        self.seen.append((stream.topology, event))
                    self.frames += 1
                self.errors = list(stream.errors)
                if self.stop.is_set():
                    return

    def wait(self, more: int) -> None:
        """Until so many more frames have come."""
        wanted, end = self.frames + more, time.monotonic() + LONGEST
        while self.frames < wanted:
            assert time.monotonic() < end
            time.sleep(0.05)

    def close(self) -> None:
        self.stop.set()
        self.thread.join(20.0)


def crossing(seen: Sequence[tuple[Any, DecodedFrame]]) -> int:
    """How many of the frames cross, of garments with each other and with the body."""
    judges: dict[int, FrameJudge] = {}
    bad = 0
    for topology, frame in seen:
        if id(topology) not in judges:
            body = topology.body.faces.astype(np.int32)
            judges[id(topology)] = FrameJudge(topology.faces, body, frame.cloth, frame.body)
        bad += not judges[id(topology)].judge(frame.cloth, frame.body).clean
    return bad
