"""For how many frames a garment has been worn since it was dressed: trousers slide down as their wearer walks, edited
or not, and are held to others that were worn for as long."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tryon_server.runtime.worn_before import name_of


class WornFrames:
    """Counted over a session's frames, by their numbers; 0 of the garment as it was dressed first, at frame 0.

    What is put on as it hung when it was worn before has been worn for as long as it had been then: nobody dressed it.
    """

    def __init__(self) -> None:
        self._dressed = 0  # the frame in which what is worn was dressed, or would have been
        self._then: dict[str, int] = {}  # frames for which each pattern had been worn when another took its place

    def at(self, frame: int) -> int:
        """For how many frames what is worn has been, in this one."""
        return frame - self._dressed

    def replaced(self, by: str, before: Mapping[str, Any], after: Mapping[str, Any], frame: int) -> None:
        """In this frame a mesh of the pattern `after` takes the place of one of `before`: put on `by` being "carried"
        over, "as before" or "anew"."""
        self._then[name_of(before)] = self.at(frame)
        if by == "anew":
            self._dressed = frame
        elif by == "as before":
            self._dressed = frame - self._then[name_of(after)]
