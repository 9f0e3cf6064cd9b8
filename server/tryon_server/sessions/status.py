"""A session's state as its clients are told it."""

from __future__ import annotations

from tryon_protocol import StatusMessage
from tryon_protocol.messages import SessionState
from tryon_server.sessions.commands import BuyAccuracy
from tryon_server.sessions.events import PhaseChanged, PresetInForce

OWN_MOTION = "own"  # name of the motion that a body brings along
POSE_STALE_SECONDS = 2.0  # without a pose for this long the session says that it waits for one


def status_of(
    phase: PhaseChanged,
    motion: str | None,
    fabric: str,
    playing: bool,
    ended: bool,
    pose_age: float,
    bought: BuyAccuracy,
    solved: PresetInForce,
) -> StatusMessage:
    """The state in one message; ``pose_age`` is how long ago the last pose was used [s]."""
    state, detail = _state(phase, motion, playing, ended, pose_age)
    changing = phase.phase == "ready" and phase.progress is not None and not ended
    return StatusMessage(
        state=state,
        detail=phase.detail if changing else detail,
        motion=motion,
        fabric=fabric,
        playing=playing,
        progress=phase.progress if changing or state in ("preparing", "dressing") else None,
        fit=phase.fit,
        fitting_size=phase.fitting_size,
        notes=phase.notes,
        worn_size=phase.worn_size,
        accuracy=bought.accuracy,
        deadline_ms=None if bought.deadline is None else round(1e3 * bought.deadline, 6),
        preset=bought.preset,
        preset_in_force=solved.preset,
        preset_pending=bought.preset != solved.asked,
    )


def _state(
    phase: PhaseChanged, motion: str | None, playing: bool, ended: bool, pose_age: float
) -> tuple[SessionState, str]:
    if ended:
        return "closed", "The session has ended"
    if phase.phase != "ready":
        return phase.phase, phase.detail
    if not playing:
        return "paused", "Held by a client"
    if motion is None and pose_age > POSE_STALE_SECONDS:
        return "waiting", "No pose has arrived lately"
    if motion == OWN_MOTION:
        return "running", "Moving as the body's own frames do"
    return "running", f"Playing {motion}" if motion else "Following the tracked body"
