"""Settings of the server: read once from the environment, frozen from then on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec

from tryon_server.problems import ProblemError, problem_error
from tryon_server.sessions.smoothing import DEFAULT_SMOOTHING, Smoothing

PREFIX = "TRYON_SERVER_"

Positive = Annotated[float, msgspec.Meta(gt=0)]
Count = Annotated[int, msgspec.Meta(ge=1)]


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Everything an operator may set. Each field is read from ``TRYON_SERVER_<FIELD>``.

    Attributes:
        host: address to listen on. The default is reachable from this machine only.
        port: TCP port.
        tls: whether to serve https, with a certificate for development that is made in ``data_dir``.
        data_dir: folder of the embedded database and of the uploaded patterns.
        database_url: SQLAlchemy URL; empty means an SQLite file in ``data_dir``.
        device: where garments are simulated: ``auto``, ``cpu``, ``cuda:0``, ...
        preset: accuracy of a session that names none: ``draft``, ``live``, ``fit`` or ``auto``: by the device.
        allowed_origins: web origins, comma separated, besides the server's own, whose pages may open a stream.
        max_pattern_bytes: largest pattern file accepted [bytes].
        max_motion_bytes: largest motion file accepted [bytes].
        max_body_bytes: largest file of a body accepted [bytes].
        max_print_bytes: largest picture accepted [bytes].
        pattern_check_seconds: longest time that checking an uploaded pattern may take [s].
        pattern_check_bytes: most address space that checking may use [bytes].
        upload_check_seconds: longest time that checking an uploaded motion or body may take [s].
        upload_check_bytes: most address space that checking one may use [bytes].
        max_sessions: sessions that may live at once; each is a process, and one that makes what it wears next.
        session_memory_bytes: most memory of their own that these may take; beyond it the session is ended, so that the
            others live on [bytes]. Looked after on Linux only.
        session_grace_seconds: how long a session lives on with nobody watching or asking for it [s].
        max_viewers: most clients of one session.
        frames_per_second: most frames published per second of wall time [1/s].
        keyframe_seconds: of the frames that are published, one at least this often needs no other [s]. Where nothing
            moves none is, but to who has not seen what there is.
        messages_per_second: most messages of one client carried out per second, on average [1/s]. Those beyond it wait
            for their turn; of those that set a value only the newest does, and of others so many.
        edit_seconds: longest time that an edit of a pattern may take until it is worn, counted from when none before it
            is to be made any more; then it is refused, and those behind it are made [s].
        answer_seconds: longest time that a change of an edit or of what is worn is waited for before it is answered
            that it goes on (202), unless the client says for how long [s].
        longest_wait_seconds: longest that a client may have it waited for: proxies give up after 30 to 60 s [s].
        job_kept_seconds: how long what became of one is told after its end, where it was answered so [s].
        most_jobs_kept: of these at most so many, those that ended last.
        smoothing_place_unrest: speed that the filter of trackers' poses (sessions/smoothing.py) leaves of noise in the
            place of a joint at rest [m/s].
        smoothing_place_gain: cutoff that a joint's speed adds [Hz per m/s].
        smoothing_turn_unrest: speed that it leaves of noise in the turn of a joint at rest [rad/s].
        smoothing_turn_gain: cutoff that the speed of turning adds [Hz per rad/s].
        smoothing_speed_cutoff: of the speeds themselves [Hz].
        smoothing_place_speed_max: no joint is so quick: a sample that asks for more is held back until two more agree
            with it [m/s].
        smoothing_turn_speed_max: the same for turns [rad/s].
        smoothing_place_lag: noise keeps a joint of somebody who walks no farther behind than this [m].
        smoothing_turn_lag: and its turn no farther than this [rad].
        warm: whether the server compiles the solver's kernels at start rather than for the first session.
    """

    host: str = "127.0.0.1"
    port: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 8000
    tls: bool = False
    data_dir: Path = Path("var")
    database_url: str = ""
    device: str = "auto"
    preset: str = "auto"
    allowed_origins: tuple[str, ...] = ()
    max_pattern_bytes: Count = 16 * 2**20
    max_motion_bytes: Count = 64 * 2**20
    max_body_bytes: Count = 128 * 2**20
    max_print_bytes: Count = 16 * 2**20
    pattern_check_seconds: Positive = 20.0
    pattern_check_bytes: Count = 4 * 2**30
    upload_check_seconds: Positive = 120.0
    upload_check_bytes: Count = 8 * 2**30
    max_sessions: Count = 8
    session_memory_bytes: Count = 6 * 2**30
    session_grace_seconds: Positive = 60.0
    max_viewers: Count = 16
    frames_per_second: Positive = 60.0
    keyframe_seconds: Positive = 1.0
    messages_per_second: Positive = 240.0
    edit_seconds: Positive = 120.0
    answer_seconds: Positive = 5.0
    longest_wait_seconds: Positive = 25.0
    job_kept_seconds: Positive = 600.0
    most_jobs_kept: Count = 200
    smoothing_place_unrest: Positive = DEFAULT_SMOOTHING.place_unrest
    smoothing_place_gain: Positive = DEFAULT_SMOOTHING.place_gain
    smoothing_turn_unrest: Positive = DEFAULT_SMOOTHING.turn_unrest
    smoothing_turn_gain: Positive = DEFAULT_SMOOTHING.turn_gain
    smoothing_speed_cutoff: Positive = DEFAULT_SMOOTHING.speed_cutoff
    smoothing_place_speed_max: Positive = DEFAULT_SMOOTHING.place_speed_max
    smoothing_turn_speed_max: Positive = DEFAULT_SMOOTHING.turn_speed_max
    smoothing_place_lag: Positive = DEFAULT_SMOOTHING.place_lag
    smoothing_turn_lag: Positive = DEFAULT_SMOOTHING.turn_lag
    warm: bool = True

    def smoothing(self) -> Smoothing:
        """The filter of trackers' poses."""
        return Smoothing(
            place_unrest=self.smoothing_place_unrest,
            place_gain=self.smoothing_place_gain,
            turn_unrest=self.smoothing_turn_unrest,
            turn_gain=self.smoothing_turn_gain,
            speed_cutoff=self.smoothing_speed_cutoff,
            place_speed_max=self.smoothing_place_speed_max,
            turn_speed_max=self.smoothing_turn_speed_max,
            place_lag=self.smoothing_place_lag,
            turn_lag=self.smoothing_turn_lag,
        )

    def effective_database_url(self) -> str:
        """The database URL, with the embedded default filled in."""
        return self.database_url or f"sqlite:///{(self.data_dir / 'tryon.sqlite3').absolute()}"


def read_settings(environment: Mapping[str, str], **overrides: object) -> Settings:
    """Settings from an environment, with ``overrides`` from a command line on top; None overrides nothing.

    Raises:
        ProblemError: a value of the wrong kind or an unknown ``TRYON_SERVER_`` name; names it and what is allowed.
    """
    fields = Settings.__struct_fields__
    values: dict[str, Any] = {}
    for name, text in environment.items():
        if not name.startswith(PREFIX):
            continue
        field = name.removeprefix(PREFIX).lower()
        if field not in fields:
            known = ", ".join(PREFIX + known_field.upper() for known_field in fields)
            raise problem_error("settings.unknown", f"unknown setting {name}", f"Known settings: {known}", place=name)
        values[field] = (
            [part.strip() for part in text.split(",") if part.strip()] if field == "allowed_origins" else text
        )
    values.update({field: value for field, value in overrides.items() if value is not None})
    try:
        return msgspec.convert(values, Settings, strict=False, dec_hook=lambda kind, value: kind(value))
    except msgspec.ValidationError as error:
        raise _invalid(error) from error


def _invalid(error: msgspec.ValidationError) -> ProblemError:
    text, _, path = str(error).partition(" - at `$.")
    name = PREFIX + path.rstrip("`").upper()
    return problem_error("settings.invalid", text, "Correct it or leave it unset", place=name)
