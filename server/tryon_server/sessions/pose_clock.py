"""The order of one client's poses: their numbers and times grow, and no stray time can silence those after it.

A tracker's clock may restart: a headset that slept, a runtime that began anew. Poses that go on steadily by another
clock are taken as that; a single one that jumped is only refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from tryon_protocol import ProtocolError

LATEST_POSE = 1e11  # s, three thousand years: no clock shows more
CLOCK_JUMP_MAX = 5.0  # s that the sender's clock may gain on the arrivals from one pose to the next
RESTART_SECONDS = 1.0  # a clock that other poses have followed steadily for so long has restarted
CLIENTS_MAX = 1 << 32  # numbers of clients stay below


@dataclass(frozen=True)
class Stamp:
    """Of a pose: its number, its time [s, the clock named ``clock``], when it arrived [s, server's clock]."""

    seq: int
    t: float
    clock: str
    arrived: float

    def is_soon_after(self, before: Stamp) -> bool:
        """Whether the clock has not gained more than a network's delays on the arrivals."""
        return self.t - before.t <= self.arrived - before.arrived + CLOCK_JUMP_MAX


class PoseClock:
    """Which poses come in order."""

    def __init__(self) -> None:
        self.last: Stamp | None = None
        self.restarts = 0
        self._may_restart = False
        self._other: tuple[Stamp, Stamp] | None = None  # first and last of refused poses that agree with each other

    def expect_restart(self) -> None:
        """A new skeleton was announced: numbers and times may begin anew with its first pose."""
        self._may_restart = True

    def check(self, stamp: Stamp) -> None:
        """Raises ProtocolError for a pose that does not come after the one before it.

        What is refused is remembered: the beginning, perhaps, of another clock.
        """
        if not abs(stamp.t) <= LATEST_POSE:
            raise _unusable("$.t", f"No clock shows {stamp.t} s.", "Send the seconds of a steady clock.")
        fault = self._fault(stamp)
        if fault is None or self._may_restart:
            return
        self._note_other(stamp)
        if not self._has_restarted():
            raise fault

    def take(self, stamp: Stamp) -> float:
        """The checked pose is used. Returns the time since the one before [s]; infinite if the clock has restarted."""
        restarted = self.last is not None and self._fault(stamp) is not None
        dt = math.inf if self.last is None or restarted else stamp.t - self.last.t
        self.restarts += restarted
        self.last, self._other, self._may_restart = stamp, None, False
        return dt

    def _fault(self, stamp: Stamp) -> ProtocolError | None:
        last = self.last
        if last is None:
            return None
        restart = f"After a restart send `skeleton` anew, or go on: it is noticed within {RESTART_SECONDS:g} s."
        if stamp.seq <= last.seq:
            what = f"Pose {stamp.seq} came after pose {last.seq}."
            return _unusable("$.seq", what, f"Number poses upwards. {restart}")
        if stamp.clock != last.clock:
            return None
        if stamp.t <= last.t:
            return _unusable(
                "$.t",
                f"A pose of {stamp.t} s came after one of {last.t} s.",
                f"Send times of a steady clock. {restart}",
            )
        if not stamp.is_soon_after(last):
            return _unusable(
                "$.t",
                f"A pose of {stamp.t} s came {stamp.arrived - last.arrived:.3g} s after one of {last.t} s: the clock "
                f"jumped ahead by more than {CLOCK_JUMP_MAX:g} s.",
                f"Send seconds of a steady clock. {restart}",
            )
        return None

    def _note_other(self, stamp: Stamp) -> None:
        first, before = self._other or (stamp, stamp)
        goes_on = (
            stamp.clock == before.clock
            and stamp.seq > before.seq
            and before.t < stamp.t
            and stamp.is_soon_after(before)
            and stamp.arrived - before.arrived < RESTART_SECONDS
        )
        self._other = (first, stamp) if goes_on else (stamp, stamp)

    def _has_restarted(self) -> bool:
        if self._other is None:
            return False
        first, last = self._other
        return last.arrived - first.arrived >= RESTART_SECONDS


def _unusable(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_pose", place, message, remedy)
