"""What is asked of the frames of a garment under change: IPC Toolkit's word, numbers, and its speed on the body."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from edited_session import Shown
from frame_judge import FrameJudge
from scipy.spatial import cKDTree

from tryon_protocol import DecodedFrame

ASKED_AFTER = 5  # frames after a change of which IPC Toolkit is asked about every one
EVERY = 10  # of the others, one in so many
RAMP = 0.1  # s in which a worn shape goes to what is wanted: its own motion, which the limit of speed leaves out
SPEED_LIMIT = 1.5  # m/s of a vertex on the body, but for what it has fallen since the change; or, where the motion
# takes the garment faster than this before it was edited, as around the shins of who walks, so fast
AROUND = 0.15  # m: cloth between two limbs that pass each other goes with either, whichever is nearer
GRAVITY = 9.81  # m/s^2: cloth that has lost what held it falls, and is at that speed after 0.15 s


@dataclass
class Faults:
    """Of what was judged; each fault says its frame, and what was done before."""

    frames: int = 0
    asked: int = 0
    crossing: list[str] = field(default_factory=list)
    not_numbers: list[str] = field(default_factory=list)
    too_fast: list[str] = field(default_factory=list)
    fastest: float = 0.0  # m/s, of a vertex on the body after an edit and its ramp
    fastest_of_itself: float = 0.0  # m/s: the same but for what it has fallen
    fastest_on_ramp: float = 0.0  # m/s
    fastest_unedited: float = 0.0  # m/s, before the first edit: what the motion does by itself

    def plain(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "frames": self.frames,
            "asked": self.asked,
            "crossing": self.crossing,
            "not_numbers": self.not_numbers,
            "too_fast": self.too_fast,
            "around": AROUND,
            "fastest": self.fastest,
            "fastest_of_itself": self.fastest_of_itself,
            "fastest_on_ramp": self.fastest_on_ramp,
            "fastest_unedited": self.fastest_unedited,
        }


class FrameWatch:
    """Judges frames in their order."""

    def __init__(self) -> None:
        self.faults = Faults()
        self._judge: FrameJudge | None = None
        self._last: DecodedFrame | None = None
        self._after = ""  # what was done last
        self._frames_since = 0
        self._seconds_since = 0.0
        self._highest: np.ndarray | None = None  # (N,) m over the root, where each vertex has been since the change

    def changed(self, what: str) -> None:
        """The frames that follow come after this."""
        self._after, self._frames_since, self._seconds_since = what, 0, 0.0
        self._highest = None

    def see(self, shown: Shown) -> None:
        """The next frame."""
        frame, topology = shown.frame, shown.topology
        self.faults.frames += 1
        self._frames_since += 1
        said = f"frame {self.faults.frames}, {self._frames_since} after {self._after or 'dressing'}"
        fresh = self._last is None or self._last.topology_id != frame.topology_id
        if not (np.isfinite(frame.cloth).all() and np.isfinite(frame.body).all()):
            self.faults.not_numbers.append(said)
            self._last = None
            return
        if fresh:
            self._judge = FrameJudge(topology.faces, topology.body.faces.astype(np.int32), frame.cloth, frame.body)
        if self._frames_since <= ASKED_AFTER or self.faults.frames % EVERY == 0:
            assert self._judge is not None
            self.faults.asked += 1
            verdict = self._judge.judge(frame.cloth, frame.body)
            if not verdict.clean:
                self.faults.crossing.append(f"{said}: {verdict}")
        height = frame.cloth[:, 1] - frame.root[1]
        self._highest = height if fresh or self._highest is None else np.maximum(self._highest, height)
        if not fresh and self._last is not None and frame.t_sim > self._last.t_sim:
            self._take_speed(self._last, frame, said)
        self._last = frame

    def _take_speed(self, before: DecodedFrame, after: DecodedFrame, said: str) -> None:
        dt = after.t_sim - before.t_sim
        on_ramp = self._seconds_since < RAMP - 1e-9
        self._seconds_since += dt
        speeds = speed_on_body(before, after, dt)
        speed, faults = float(speeds.max()), self.faults
        if not self._after:
            faults.fastest_unedited = max(faults.fastest_unedited, speed)
        elif on_ramp:
            faults.fastest_on_ramp = max(faults.fastest_on_ramp, speed)
        else:
            assert self._highest is not None
            fallen = self._highest - (after.cloth[:, 1] - after.root[1])
            each = np.sqrt(np.maximum(speeds**2 - 2 * GRAVITY * fallen, 0.0))
            worst = int(np.argmax(each))
            of_itself = float(each[worst])
            faults.fastest = max(faults.fastest, speed)
            faults.fastest_of_itself = max(faults.fastest_of_itself, of_itself)
            if of_itself > max(SPEED_LIMIT, faults.fastest_unedited):
                way = (after.cloth[worst] - before.cloth[worst]) - (after.root - before.root)
                pelvis = f"it goes at {np.linalg.norm(way) / dt:.2f} against the pelvis"  # slow: a limb swings past it
                faults.too_fast.append(f"{said}: {of_itself:.2f} m/s beyond what it has fallen; {pelvis}")


def speed_on_body(before: DecodedFrame, after: DecodedFrame, dt: float) -> np.ndarray:
    """(N,) m/s of the cloth's vertices, each against the point of the body that was nearest; of those faster than half
    of SPEED_LIMIT the least against any point within AROUND."""
    points = cKDTree(before.body)
    _, nearest = points.query(before.cloth)
    way, of_body = after.cloth - before.cloth, after.body - before.body
    result: np.ndarray = np.linalg.norm(way - of_body[nearest], axis=1) / dt
    for k in np.flatnonzero(result > SPEED_LIMIT / 2):
        around = points.query_ball_point(before.cloth[k], AROUND)
        if around:
            result[k] = np.linalg.norm(way[k] - of_body[around], axis=1).min() / dt
    return result
