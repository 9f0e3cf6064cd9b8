"""What is wrong with a garment's data, said so that whoever made it can mend it."""

from __future__ import annotations


class LocatedError(ValueError):
    """Base of errors that say what is wrong (`message`), where (`place`) and what to do about it (`remedy`)."""

    def __init__(self, message: str, place: str, remedy: str) -> None:
        super().__init__(f"{place}: {message}. {remedy}")
        self.message = message
        self.place = place
        self.remedy = remedy
