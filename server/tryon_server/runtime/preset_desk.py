"""The preset of a session: what is asked for, and how the worn garment comes to be solved with it. Another simulation
of it is built beside the one that goes on, in parts between its frames, and takes its place between two of them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator

from tryon_server.runtime.drape import Drape
from tryon_server.sessions.events import Event, PresetInForce, PresetRefused

logger = logging.getLogger(__name__)

SHARE = 0.5  # of the time that a frame took, after which no further part of another simulation is begun
LOOK_SECONDS = 0.02  # between looks whether what is worn still gives way to another scene
REMEDY = "Choose it again, or another one; if it fails again, open a session with it, or with a simpler pattern."


class PresetDesk:
    """Takes the preset that is asked for, and has the garment come to be solved with it.

    Args:
        tell: tells an event.
        clock: the server's steady clock [s].
        taken: called once another preset is in force.
    """

    def __init__(self, tell: Callable[[Event], None], clock: Callable[[], float], taken: Callable[[], None]) -> None:
        self._tell, self._clock, self._taken = tell, clock, taken
        self._asked: str | None = None
        self._opened = ""
        self._worn: Drape | None = None
        self._parts: Iterator[None] | None = None
        self._building = ""
        self._told: PresetInForce | None = None

    @property
    def building(self) -> bool:
        """Is another simulation of what is worn being built?"""
        return self._parts is not None

    def ask(self, preset: str | None) -> None:
        """Solve with this preset; None: with the one that the session was opened with. The newest counts."""
        self._asked = preset

    def dressed(self, drape: Drape) -> None:
        """This drape was dressed as the session was opened."""
        self._opened = drape.preset

    def go_on(self, worn: Drape | None, cost: float, busy: bool) -> float | None:
        """Do what is next for what is ``worn``, between two frames, each of which takes ``cost`` [s]; not beside other
        work that makes a scene, where there is some (``busy``). How long to wait before the next look [s]; None: there
        is nothing to do.
        """
        if worn is not self._worn:
            self._worn, self._parts = worn, None
        if worn is None:
            return None
        wanted = self._asked or self._opened
        if busy or wanted != self._building:  # what is worn may give way to another scene
            self._parts = None
        if self._parts is None and not busy and worn.preset != wanted:
            self._building, self._parts = wanted, worn.solve_as(wanted)
        if self._parts is not None:
            self._build(self._parts, worn, cost)
        self._tell_news(worn)
        if self._parts is not None:
            return 0.0
        return LOOK_SECONDS if worn.preset != (self._asked or self._opened) else None

    def _build(self, parts: Iterator[None], worn: Drape, cost: float) -> None:
        """Go on building, for part of a frame's time; go on in it once it is there."""
        end = self._clock() + SHARE * cost
        try:
            next(parts)
            while self._clock() < end:
                next(parts)
        except StopIteration:
            self._parts = None
            self._taken()
        except Exception as error:
            logger.exception("the preset %s could not be built", self._building)
            asked, self._parts = self._asked, None
            self._asked = self._wish_in_force(worn)
            what = f"The preset {self._building} could not be built: {error!r:.200}; {worn.preset} goes on."
            self._tell(PresetRefused(asked, self._asked, what, REMEDY))

    def _wish_in_force(self, worn: Drape) -> str | None:
        """What was asked for, or might have been, to have the preset that is in force."""
        if worn.preset == (self._asked or self._opened):
            return self._asked
        if self._told is not None and self._told.preset == worn.preset:
            return self._told.asked
        return None if worn.preset == self._opened else worn.preset

    def _tell_news(self, worn: Drape) -> None:
        news = PresetInForce(worn.preset, self._wish_in_force(worn))
        if news != self._told:
            self._told = news
            self._tell(news)
