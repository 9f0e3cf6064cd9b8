"""A drag at the rate of a screen: whether frames go on coming while edits do, sixty a second, and none piles up.

The session is one of the server's, in its processes and with its mailbox; edits are held as a page does while a pointer
moves, and the last one is kept. Times are figures of the machine they were taken on; nothing is asserted of them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import pi, sin
from pathlib import Path
from typing import Any

import numpy as np
from edit_case import DEMO, mean_edge
from edit_table import row
from edited_session import ALL, FRAMES_PER_SECOND, KEYFRAME_SECONDS
from frame_judge import FrameJudge

from tryon_protocol import DecodedFrame, FrameDecoder, Topology, TopologyMessage, decode_server
from tryon_server.runtime.local_processes import LocalProcess, LocalProcesses
from tryon_server.runtime.memory import own_bytes
from tryon_server.runtime.order import DrapeOrder, WorkOrder, Workshop
from tryon_server.sessions.commands import AllowFrame, ChangePattern, Run
from tryon_server.sessions.events import EditMade, Event, FrameReady, PhaseChanged, TopologyReady
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices

EDITS_PER_SECOND = 60.0
FARTHEST = 0.03  # m that the hem is dragged, down and up
PERIOD = 2.0  # s of a drag to and fro
KEPT = 1  # ticket of the edit that ends the drag
SOON = 60.0  # s in which it has to be answered
DRESSED = 600.0  # s in which the garment has to be dressed
EVERY = 10  # of the frames during the drag, one in so many is judged
MEMORY = 32 * 2**30  # bytes that the session may take
FIGURES = (
    ("frames a second before", "before", "{:.1f}"),
    ("in the drag", "during", "{:.1f}"),
    ("longest wait before [s]", "wait_before", "{:.3f}"),
    ("in the drag", "wait_during", "{:.3f}"),
    ("edits held", "held", "{}"),
    ("seconds until the last is kept", "kept", "{:.3f}"),
    ("crossing of judged", "crossing", "{}"),
    ("memory before, after [MB]", "memory", "{}"),
)


@dataclass
class _Heard:
    """What the session tells, with the times at which it does [s]."""

    came: list[float] = field(default_factory=list)
    frames: list[FrameReady] = field(default_factory=list)
    topology: Topology | None = None
    failed: str = ""
    dressed: threading.Event = field(default_factory=threading.Event)
    kept: threading.Event = field(default_factory=threading.Event)

    def take(self, event: Event) -> None:
        match event:
            case FrameReady():
                self.came.append(time.perf_counter())
                self.frames.append(event)
            case TopologyReady() if self.topology is None:
                message = decode_server(event.payload)
                assert isinstance(message, TopologyMessage)
                self.topology = Topology.from_message(message)
            case EditMade():
                self.kept.set()
            case PhaseChanged(phase="ready" | "failed"):
                self.failed = event.detail if event.phase == "failed" else ""
                self.dressed.set()


def drag_rate(
    vertices: int, preset: str, device: str, seconds: float, wardrobe: Path, fps: float = FRAMES_PER_SECOND
) -> dict[str, Any]:
    """Frames a second and the longest wait for one [s] before and in a drag of a walking T-shirt's hem, both so long.

    Raises RuntimeError when the garment can't be dressed or the drag's end is not answered.
    """
    path = DEMO / "patterns" / "tshirt.json"
    edge = mean_edge(mesh_with_vertices(load_pattern(path), vertices))
    order = DrapeOrder(path, "cotton_jersey", preset, device, edge_length=edge, wardrobe=wardrobe)
    heard = _Heard()
    placement = LocalProcesses(Workshop(), MEMORY)
    session = placement.place(WorkOrder(order, "walk", fps, KEYFRAME_SECONDS), heard.take)
    try:
        session.order(AllowFrame(ALL, keyframe=False, standalone=False, plain=False, again=False))
        session.order(Run(running=True))
        if not heard.dressed.wait(DRESSED) or heard.failed:
            raise RuntimeError(f"the garment is not dressed: {heard.failed or 'it takes too long'}")
        time.sleep(seconds)  # the way to the motion's first pose, and its first steps
        begun = time.perf_counter()
        time.sleep(seconds)
        before, memory = time.perf_counter(), [_memory(session)]
        held = _drag(session, seconds)
        after = time.perf_counter()
        session.order(ChangePattern("edit", KEPT, _hem(FARTHEST)))
        if not heard.kept.wait(SOON):
            raise RuntimeError("the edit that ends the drag is not answered")
        kept = time.perf_counter() - after
        memory.append(_memory(session))
    finally:
        placement.close()
    found = {
        "vertices": 0 if heard.topology is None else heard.topology.cloth_vertex_count,
        "seconds": seconds,
        "fps": fps,
        "held": held,
        "kept": kept,
        "memory": [round(taken / 1e6) for taken in memory],
    }
    for name, span in (("before", (begun, before)), ("during", (before, after))):
        found[name], found[f"wait_{name}"] = _paced(heard.came, *span)
    crossing, asked = _judged(heard, before)
    return {**found, "crossing": f"{crossing} of {asked}"}


def _drag(session: LocalProcess, seconds: float) -> int:
    """Hold edit after edit; how many."""
    begun = time.perf_counter()
    count = round(EDITS_PER_SECOND * seconds)
    for k in range(count):
        time.sleep(max(0.0, begun + k / EDITS_PER_SECOND - time.perf_counter()))
        by = FARTHEST * sin(2 * pi * k / (EDITS_PER_SECOND * PERIOD))
        session.order(ChangePattern("edit", 0, _hem(by), hold=True))
    return count


def _hem(by: float) -> dict[str, Any]:
    return {"kind": "lengthen", "panel": "front", "edge": 0, "by": by}


def _memory(session: LocalProcess) -> int:
    assert session.pid is not None
    return own_bytes(session.pid)


def _paced(came: list[float], begin: float, end: float) -> tuple[float, float]:
    """Frames a second, and the longest wait for one [s]."""
    times = [t for t in came if begin <= t < end]
    return len(times) / (end - begin), float(np.diff([begin, *times, end]).max())


def _judged(heard: _Heard, since: float) -> tuple[int, int]:
    """How many of the judged frames of the drag cross, and how many were."""
    assert heard.topology is not None
    decoder = FrameDecoder()
    decoder.set_topology(heard.topology)
    judge: FrameJudge | None = None
    crossing = asked = 0
    for k, (event, came) in enumerate(zip(heard.frames, heard.came)):
        if event.topology_id != heard.topology.topology_id:
            break
        frame: DecodedFrame = decoder.decode(event.shared.data)
        if judge is None:
            body = heard.topology.body.faces.astype(np.int32)
            judge = FrameJudge(heard.topology.faces, body, frame.cloth, frame.body)
        if came >= since and k % EVERY == 0:
            asked += 1
            crossing += not judge.judge(frame.cloth, frame.body).clean
    return crossing, asked


def table(runs: Sequence[Mapping[str, Any]]) -> str:
    """The section of the page."""
    lines = ["", "## A drag of sixty edits a second", ""]
    for made in runs:
        about = made["about"]
        rates = " and ".join(dict.fromkeys(f"{r['fps']:g}" for r in made["rows"]))
        said = f"preset {about['preset']}; at most {rates} frames a second."
        lines += [f"Commit {about['commit']}; {about['machine']}; {said}", ""]
        lines += [row(["vertices", "seconds", *(name for name, *_ in FIGURES)]), row(["---"] * (2 + len(FIGURES)))]
        for r in made["rows"]:
            told = [form.format(r[key]) for _, key, form in FIGURES]
            lines.append(row([str(r["vertices"]), f"{r['seconds']:g}", *told]))
        lines.append("")
    return "\n".join(lines)
