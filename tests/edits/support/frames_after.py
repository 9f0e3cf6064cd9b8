"""What is asked of the frames of a garment under change: IPC Toolkit's word, numbers, and its speed on the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from at_switch import jump_at_switch
from edited_session import Shown
from frame_judge import FrameJudge
from speeds import AROUND, FREE, SPEED_LIMIT, Falling, speed_of_hanging, speed_on_body

from tryon_protocol import DecodedFrame, Topology

ASKED_AFTER = 5  # frames after a change of which IPC Toolkit is asked about every one
EVERY = 10  # of the others, one in so many
RAMP = 0.1  # s in which a worn shape goes to what is wanted: its own motion, which the limit of speed leaves out


@dataclass
class Faults:
    """Of what was judged; each fault says its frame, and what was done before."""

    frames: int = 0
    asked: int = 0
    crossing: list[str] = field(default_factory=list)
    not_numbers: list[str] = field(default_factory=list)
    too_fast: list[str] = field(default_factory=list)
    fast_by_itself: list[str] = field(default_factory=list)  # so is the garment of then where it is worn on
    limb_passes: int = 0  # frames in which cloth is too fast against a limb alone that swings past it where it hangs
    fastest: float = 0.0  # m/s, of a vertex on the body after an edit and its ramp
    fastest_of_itself: float = 0.0  # m/s: the same, what hangs free against the trunk, and but for what it has fallen
    fastest_on_ramp: float = 0.0  # m/s
    farthest_at_switch: float = 0.0  # m: from the last frame of a mesh to the first of one it is carried over to
    fastest_unedited: float = 0.0  # m/s, before the first edit, what hangs free against the trunk: the motion's doing

    def plain(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "frames": self.frames,
            "asked": self.asked,
            "crossing": self.crossing,
            "not_numbers": self.not_numbers,
            "too_fast": self.too_fast,
            "fast_by_itself": self.fast_by_itself,
            "limb_passes": self.limb_passes,
            "around": AROUND,
            "free": FREE,
            "gone_on": True,
            "fastest": self.fastest,
            "fastest_of_itself": self.fastest_of_itself,
            "fastest_on_ramp": self.fastest_on_ramp,
            "farthest_at_switch": self.farthest_at_switch,
            "fastest_unedited": self.fastest_unedited,
        }


class FrameWatch:
    """Judges frames in their order."""

    def __init__(self) -> None:
        self.faults = Faults()
        self._judge: FrameJudge | None = None
        self._last: DecodedFrame | None = None
        self._topology: Topology | None = None  # of the last frame
        self._carried = False  # the last change carried the cloth over to another mesh
        self._after = ""  # what was done last
        self._frames_since = 0
        self._seconds_since = 0.0
        self._falling = Falling()  # since the change
        self._suspects: list[tuple[float, str]] = []  # m/s of frames over the limit, and what is said of them

    def changed(self, what: str, carried: bool = False) -> None:
        """The frames that follow come after this, which `carried` the cloth over to another mesh or left it in its."""
        self._carried = carried
        self._after, self._frames_since, self._seconds_since = what, 0, 0.0
        self._falling = Falling()

    def clear_up(self, *by_itself: tuple[str, Callable[[float], float]]) -> None:
        """Look at the frames that were over the limit since this was done last: where the garment is as fast
        `by_itself`, in one of these ways, given the speed that is asked about [m/s], the motion takes it so. Each way
        is asked about what the ones before left; it comes with what is said of it."""
        left = list(self._suspects)
        for said_of_it, fastest_of in by_itself:
            if not left:
                break
            fastest = fastest_of(max(speed for speed, _ in left))
            told = [(speed, f"{said}; {said_of_it} it goes at {fastest:.2f}") for speed, said in left]
            self.faults.fast_by_itself += [said for speed, said in told if speed <= fastest]
            left = [(speed, said) for speed, said in told if speed > fastest]
        self.faults.too_fast += [said for _, said in left]
        self._suspects.clear()

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
        self._falling = Falling() if fresh else self._falling
        self._falling.see(frame)
        if not fresh and self._last is not None and frame.t_sim > self._last.t_sim:
            self._take_speed(self._last, frame, said)
        if fresh and self._carried and self._last is not None:
            self._take_switch(self._last, shown)
        self._last, self._topology = frame, topology

    def _take_switch(self, before: DecodedFrame, shown: Shown) -> None:
        """How far cloth goes though no mesh has both frames, and the body stands still; told, not judged: it is part of
        the ramp."""
        assert self._topology is not None
        jump = jump_at_switch(before, self._topology, shown.frame, shown.topology)
        self.faults.farthest_at_switch = max(self.faults.farthest_at_switch, float(np.nanmax(jump, initial=0.0)))

    def _take_speed(self, before: DecodedFrame, after: DecodedFrame, said: str) -> None:
        dt = after.t_sim - before.t_sim
        on_ramp = self._seconds_since < RAMP - 1e-9
        self._seconds_since += dt
        faults = self.faults
        hanging = speed_of_hanging(before, after, dt)
        if not self._after:
            faults.fastest_unedited = max(faults.fastest_unedited, float(hanging.max()))
            return
        speeds = speed_on_body(before, after, dt)
        if on_ramp:
            faults.fastest_on_ramp = max(faults.fastest_on_ramp, float(speeds.max()))
            return
        limit = max(SPEED_LIMIT, faults.fastest_unedited)
        each = self._falling.of_itself(hanging, after)
        worst = int(np.argmax(each))
        of_itself = float(each[worst])
        faults.fastest = max(faults.fastest, float(speeds.max()))
        faults.fastest_of_itself = max(faults.fastest_of_itself, of_itself)
        if of_itself > limit:
            way = (after.cloth[worst] - before.cloth[worst]) - (after.root - before.root)
            pelvis = f"it goes at {np.linalg.norm(way) / dt:.2f} against the pelvis"
            self._suspects.append((of_itself, f"{said}: {of_itself:.2f} m/s beyond what it has fallen; {pelvis}"))
        else:
            faults.limb_passes += bool(self._falling.of_itself(speeds, after).max() > limit)
