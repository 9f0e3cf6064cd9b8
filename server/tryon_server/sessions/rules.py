"""What holds for every session of a server."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tryon_protocol import CREDIT, ProtocolError, WelcomeMessage
from tryon_server.sessions.smoothing import DEFAULT_SMOOTHING, Smoothing
from tryon_server.sessions.status import OWN_MOTION

SUBJECT = "wearer"


@dataclass(frozen=True)
class Rules:
    """What holds for every session of a server.

    Attributes:
        epoch: word that changes when the server restarts.
        server: name and version of the server, for the clients' logs.
        motions: names of the motions that the server can play.
        fabrics: names of the fabrics.
        effects: names of the effects.
        presets: names of the presets.
        credit: most frames that travel unacknowledged to one client.
        max_viewers: most connections of one session.
        messages_per_second: most messages of one client that are carried out per second, on average; others wait.
        grace_seconds: how long a session lives on without a connection, and without being asked for [s].
        smoothing: settings of the filter between a tracker and the physics.
    """

    epoch: str
    server: str
    motions: tuple[str, ...]
    fabrics: tuple[str, ...]
    effects: tuple[str, ...]
    presets: tuple[str, ...]
    credit: int = CREDIT
    max_viewers: int = 16
    messages_per_second: float = 240.0
    grace_seconds: float = 60.0
    smoothing: Smoothing = DEFAULT_SMOOTHING


    def welcome(
        self, version: int, session: str, now: float, topology_id: int, motions: Sequence[str], token: str
    ) -> WelcomeMessage:
        """The answer to a client's hello: its session's body has these ``motions``."""
        return WelcomeMessage(
            version=version,
            session=session,
            epoch=self.epoch,
            server=self.server,
            clock=now,
            credit=self.credit,
            topology_id=topology_id,
            subjects=(SUBJECT,),
            motions=tuple(motions),
            fabrics=self.fabrics,
            resume_token=token,
        )


def check_motion(motion: str | None, motions: Sequence[str]) -> None:
    """Raises ProtocolError for a motion that is none of those of the session, of which `OWN_MOTION` may be the only
    one. None is no motion, but poses that are streamed."""
    if tuple(motions) == (OWN_MOTION,) and motion != OWN_MOTION:
        what, remedy = "This body moves by itself and as it does.", "Open a session with the default body."
        raise ProtocolError("unknown_motion", "$.motion", what, remedy)
    if motion is not None and motion not in motions:
        raise unknown("unknown_motion", "motion", motion, motions)


def check_pose(dressed: bool, motion: str | None) -> None:
    """Raises ProtocolError when a pose is of no use: while the garment is being dressed, or a motion is played."""
    if not dressed:
        what = "The garment is still being dressed, so no pose can be used yet."
        raise ProtocolError("unexpected_message", "$", what, "Wait for `topology`.")
    if motion is not None:
        what = f"The server plays the motion {motion!r}."
        raise ProtocolError("unexpected_message", "$", what, "Send set_motion with null first.")


def check_fabric(edit: Mapping[str, Any] | None, fabrics: Sequence[str]) -> None:
    """Raises ProtocolError when the edit, plain JSON, is one to a fabric that there is not. All else is the solver's to
    refuse."""
    if edit is None or edit.get("kind") != "change_fabric":
        return
    name = edit.get("fabric")
    if isinstance(name, str) and name not in fabrics:
        raise unknown("unknown_fabric", "edit.fabric", name, fabrics)


def unknown(code: str, kind: str, name: str, known: Sequence[str]) -> ProtocolError:
    """The fault of a name that is none of those known."""
    what = f"There is no {kind.rpartition('.')[2]} {name!r:.80}."
    return ProtocolError(code, f"$.{kind}", what, f"Choose one of: {', '.join(known)}.")
