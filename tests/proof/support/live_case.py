"""Record one case from a running server with the client library, and judge what was decoded.

What only the solver's states tell (trembling, contact force, void steps) is not measured here.
"""

from __future__ import annotations

import asyncio
import json
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import limits
import numpy as np
from case import LiveCase
from frame_figures import FrameMeter
from pinched_skin import PinchedSkin
from verdict import broken_by_frames, broken_by_share, figures_of_frames, hem_travel, late

from tryon_client import Recording, connect, record
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

SHORTEST_SWING = 1.0  # s of a motion before its hem is asked to have moved
Tell = Callable[[str], None]


class ServerError(RuntimeError):
    """The server refused; says why."""


def ask(server: str, path: str, body: dict[str, Any] | None = None, method: str | None = None) -> Any:
    """The JSON of a reply of the server's REST side. Raises ServerError with the server's words."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(
        server.rstrip("/") + path, data, {"Content-Type": "application/json"}, method=method
    )
    try:
        with urllib.request.urlopen(request, timeout=60) as reply:
            text = reply.read()
    except urllib.error.HTTPError as error:
        raise ServerError(f"{path}: {error.read().decode(errors='replace')}") from error
    return json.loads(text) if text else None


def run_live_case(case: LiveCase, tell: Tell, keep: Path | None = None) -> dict[str, Any]:
    """The case's figures and the limits it broke, ready for JSON; `keep` is an .npz for the decoded frames.

    Raises ServerError, tryon_protocol.ProtocolError or an OSError when the server refuses or goes away.
    """
    wanted = {"garment": case.garment, "motion": case.motion, "fabric": case.fabric, "preset": case.preset}
    session = ask(case.server, "/api/sessions", wanted)
    try:
        recording = asyncio.run(watch(case, session["stream"], tell))
    finally:
        ask(case.server, f"/api/sessions/{session['id']}", method="DELETE")
    if keep:
        recording.save(keep)
    return judged(case, recording)


async def watch(case: LiveCase, path: str, tell: Tell) -> Recording:
    """The frames of a session from its first one on."""
    address = case.server.rstrip("/").replace("http", "ws", 1) + path
    async with connect(address) as stream:

        def every_hundred(frame: Any) -> None:
            if frame.seq % 100 == 0:
                tell(f"frame {frame.seq}, {frame.t_sim:.2f} s simulated")

        recording = await record(stream, frame_count=case.frames, progress=every_hundred)
        if stream.errors:
            raise ServerError("; ".join(f"{error.message} ({error.code})" for error in stream.errors))
        return recording


def judged(case: LiveCase, recording: Recording) -> dict[str, Any]:
    """Figures, series and broken limits; the first frame, of the garment as dressed, is frame 0."""
    frames = recording.frames
    fabric, settings = FABRICS[case.fabric], PRESETS[case.preset]
    closest = PinchedSkin.reach(settings.body_offset + 0.5 * fabric.thickness, settings.d_hat)
    meter = FrameMeter(recording.topology, frames[0], closest)
    last = len(frames) - 1
    figures = [meter.measure(f, k % case.every == 0 or k == last) for k, f in enumerate(frames)]
    moving = [k for k, frame in enumerate(frames) if frame.t_sim >= 0 and frame.pose_seq == 0]
    hem = hem_travel([figures[k] for k in moving])
    t_sim, t_wall = (np.array([getattr(f, name) for f in frames]) for name in ("t_sim", "t_published"))
    swings = case.motion == "walk" and len(moving) > 1 and np.ptp(t_sim[moving]) >= SHORTEST_SWING
    behind, allowed = late(figures, len(moving)), limits.late_share(case.motion)
    broken = [
        *broken_by_frames(figures, fabric.strain_limit, allowed),
        *broken_by_share(behind["late_share"], allowed),
        *limits.run_under("hem travel [m]", hem["hem_travel_median"] if swings else None, limits.HEM_TRAVEL),
    ]
    return {
        "case": case.plain(),
        "failure": "",
        "cloth_vertices": recording.topology.cloth_vertex_count,
        "triangles": len(meter.state.faces),
        "loops": len(meter.state.loops.loops),
        "strain_limit": fabric.strain_limit,
        **figures_of_frames(figures),
        **hem,
        **behind,
        "late_allowed": allowed,
        "ms_a_frame": float(1e3 * np.median(np.diff(t_wall))),
        "simulated_over_wall": float(np.ptp(t_sim) / np.ptp(t_wall)),
        "broken": [b.plain() for b in broken],
    }
