"""The one exception of the protocol: what is wrong, where, and what to do about it."""

from __future__ import annotations

ERROR_CODES = frozenset(
    {
        "caught",
        "contorted",
        "edit_not_kept",
        "outfit_refused",
        "edit_refused",
        "effect_refused",
        "effects_not_kept",
        "invalid_ack",
        "invalid_field",
        "invalid_pose",
        "invalid_skeleton",
        "lying",
        "malformed_message",
        "no_frame",
        "off_floor",
        "pose_source_taken",
        "rate_limited",
        "session_full",
        "simulation_failed",
        "too_long",
        "unencodable_pose",
        "unencodable_position",
        "unexpected_message",
        "unknown_fabric",
        "unknown_motion",
        "unknown_session",
        "unknown_subject",
        "unknown_type",
        "unsupported_clock",
        "unsupported_convention",
        "unsupported_frame",
        "unsupported_version",
        "upside_down",
        "cloth_too_large",
        "wrong_shape",
    }
)
"""What an `error` of the server may have for a code: the table in PROTOCOL.md section 6. Later servers may add some."""

READING_CODES = frozenset(
    {
        "invalid_array",
        "malformed_compression",
        "malformed_frame",
        "missing_base",
        "stale_frame",
        "unknown_codec",
        "unknown_topology",
    }
)
"""What a reader of topologies and frames raises besides, on the client's side."""

BUILDING_CODES = frozenset({"grid_too_coarse"})
"""What keeps a server from publishing a garment at all; its clients hear of it as "simulation_failed"."""


class ProtocolError(Exception):
    """Something on the wire, or on its way there, breaks the rules of PROTOCOL.md.

    Attributes:
        code: machine-readable name of the fault, one of the codes above.
        place: where the fault lies: a path in a message such as "$.rotations[3]", a field of a binary frame such as
            "frame.cloth_bytes", or an argument of the encoder such as "cloth[17]".
        message: one sentence that says what is wrong.
        remedy: one sentence that says what the sender has to change.
    """

    def __init__(self, code: str, place: str, message: str, remedy: str) -> None:
        super().__init__(f"{place}: {message} {remedy}")
        self.code = code
        self.place = place
        self.message = message
        self.remedy = remedy
