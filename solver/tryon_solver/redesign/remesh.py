"""Why a garment's mesh can't be kept through an edit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Remesh:
    """The edit needs a new mesh, whatever it is an edit of: why, in words for the designer, and of which piece."""

    message: str
    place: str = ""  # the piece's name; "" where it is of all
