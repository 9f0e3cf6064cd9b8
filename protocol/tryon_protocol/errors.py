"""The one exception of the protocol: what is wrong, where, and what to do about it."""

from __future__ import annotations


class ProtocolError(Exception):
    """Something on the wire, or on its way there, breaks the rules of PROTOCOL.md.

    Attributes:
        code: machine-readable name of the fault, one of the table in PROTOCOL.md section 6.
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
