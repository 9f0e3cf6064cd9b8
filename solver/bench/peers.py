"""Two scenes by our solver and by others': time, crossings and rest jitter of each, in one run."""

from __future__ import annotations

import time
from typing import Any, Protocol

import numpy as np
import warp as wp
from figures import spread
from frame_judge import FrameJudge, principal_stretches
from over_time import trembling
from peer_case import PRESETS, PeerCase
from peer_scenes import FPS, MOVES, SCENES, PeerScene

LEAD = 10  # frames that are not timed: what is compiled and captured on the way is done, and the cloth has met the body


class Player(Protocol):
    """A scene under way."""

    def go(self, frame: int) -> None:
        """To the end of frame 1, 2, ..., and until the device is done."""

    def cloth(self) -> np.ndarray:
        """(N, 3) m."""

    def surface(self, frame: int) -> np.ndarray:
        """(B, 3) m where the parts are at the frame's end."""


def played(case: PeerCase, every: int) -> dict[str, Any]:
    """Its figures; each `every`-th frame is judged, 0: none. A solver whose cloth is no longer a number ends there."""
    with wp.ScopedDevice(case.device):  # what others' solvers allocate without saying where
        return played_there(case, every)


def played_there(case: PeerCase, every: int) -> dict[str, Any]:
    """The same, Warp's device being the case's."""
    scene = SCENES[case.scene](case.vertices, case.seconds)
    begun = time.perf_counter()
    player = player_of(case, scene)
    dressing = time.perf_counter() - begun
    faces, body = scene.scene.garment.faces, scene.scene.body
    assert body is not None
    judge = FrameJudge(faces, body.faces, scene.scene.x_start, scene.surface(0.0))
    times: list[float] = []
    verdicts = []
    standing = [player.cloth()]
    for frame in range(1, scene.frames + 1):
        begun = time.perf_counter()
        player.go(frame)
        elapsed = 1e3 * (time.perf_counter() - begun)
        if frame > LEAD:
            times.append(elapsed)
        cloth = player.cloth()
        blown = not np.isfinite(cloth).all()
        if blown or (every and frame % every == 0):
            verdicts.append(judge.judge(cloth, player.surface(frame)))
        if frame >= MOVES * scene.frames:
            standing.append(cloth)
        if blown:
            break
    at_rest = np.array(standing[1:])
    finite = not blown
    return {
        **case.plain(),
        "machine": str(wp.get_device(case.device).name),
        "cloth_vertices": len(cloth),
        "body_vertices": len(body.rest_vertices),
        "build_s": dressing,
        "frames": frame,
        "of_frames": scene.frames,
        "frame_ms": spread(times) if times else None,
        "asked": len(verdicts),
        "unclean": sum(not v.clean for v in verdicts),
        "with_itself": sum(v.self_intersecting for v in verdicts),
        "with_body": sum(v.body_intersecting or v.inside > 0 for v in verdicts),
        "jitter": trembling(at_rest, FPS) if finite and len(at_rest) else None,
        "speed_at_end": rms_speed(at_rest) if finite and len(at_rest) > 1 else None,
        "stretch": float(principal_stretches(cloth, faces, scene.scene.garment.uv_corners).max()) if finite else None,
    }


def player_of(case: PeerCase, scene: PeerScene) -> Player:
    """The scene, ready to go."""
    if case.solver in PRESETS:
        from peer_ours import ByOurs

        return ByOurs(scene, case.solver, case.device)
    if case.solver == "uipc":
        from peer_uipc import ByUipc

        return ByUipc(scene)
    from peer_newton import ByNewton

    return ByNewton(scene, case.solver, case.device)


def rms_speed(cloth: np.ndarray) -> float:
    """[m/s] of all vertices of the way to the last of (T, N, 3) m."""
    return float(np.sqrt(((cloth[-1].astype(np.float64) - cloth[-2]) ** 2).sum(1).mean())) * FPS
