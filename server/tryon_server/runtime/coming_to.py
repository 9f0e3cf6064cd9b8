"""What is worn on its way to where another drape has it, which goes along on the same body (tryon_solver/drawn.py)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tryon_solver.drawn import Common, draw, left_after, seconds_for

if TYPE_CHECKING:
    from tryon_server.runtime.solver_drape import SolverDrape


class ComingTo:
    """The way of one drape to another, of what both have; of nothing, the other goes along and no more."""

    def __init__(self, other: SolverDrape, common: Common | None = None) -> None:
        """`common`: what both have."""
        self.other, self._common = other, common
        self.seconds = 0.0  # simulated so far, and
        self._whole = np.inf  # in all, which its first frame tells
        self._fault: Exception | None = None  # why the other could not go along

    @property
    def is_there(self) -> bool:
        """Is it at the end of its way?"""
        return self.seconds >= self._whole

    def be_there(self) -> None:
        """Be at the end of the way now, however far that is."""
        self._whole = self.seconds

    def parts(self) -> Iterator[None]:
        """None until it is there. Raises what advancing the other raised."""
        while not self.is_there:
            yield None
            self.check()

    def check(self) -> None:
        """Raises what advancing the other raised."""
        if self._fault is not None:
            raise self._fault

    def before_frame(self, drape: SolverDrape, pose: Any, dt: float) -> None:
        """The drape is about to be advanced to this pose in dt s: advance the other, and draw to where that comes."""
        if self._fault is not None:
            return
        here = apart = None
        if self._common is not None:
            here = drape.cloth_positions()[self._common.vertices]
            apart = here - self._seen_from(drape, self._common)
            if self.seconds == 0.0:
                self._whole = seconds_for(apart)
        try:
            self.other.advance(pose, self.other.seconds + dt)
        except Exception as error:  # what is worn goes on all the same; who waits for the other is told
            self._fault = error
            return
        if self._common is not None and here is not None and apart is not None and len(here):
            there = self._seen_from(drape, self._common)
            draw(drape.simulation, here, there + left_after(apart, self.seconds, dt, self._whole), dt)
        self.seconds += dt

    def _seen_from(self, drape: SolverDrape, common: Common) -> npt.NDArray[np.float32]:
        """Where the other has what both have [m], from the drape's origin."""
        shift = (self.other.origin - drape.origin).astype(np.float32)
        return common.there(self.other.cloth_positions()) + shift
