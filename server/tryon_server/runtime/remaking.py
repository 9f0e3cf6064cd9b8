"""Another garment made while the one before is worn: the pattern's next cut, or, where it can't be put on from where
that is worn, dressed anew."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tryon_server.runtime.beside import Beside, Made, NotMade
from tryon_server.runtime.drape import BuildDrape, Drape, Packed
from tryon_server.runtime.order import DrapeOrder
from tryon_server.wording import in_parameters
from tryon_solver.redesign.edit_error import EditError


@dataclass(frozen=True, eq=False)
class Dressing:
    """Dresses as ordered. Call it in any process."""

    build: BuildDrape
    order: DrapeOrder

    def __call__(self) -> Packed:
        """Raises ProblemError when the garment can't be put on."""
        return self.build(self.order, lambda _stage, _share: None).packed()


@dataclass(frozen=True)
class Remade:
    """The garment that was asked for: dressed `anew`, in the stance in which one dresses, or where the old one was."""

    drape: Drape
    anew: bool


class Remaking:
    """At most one garment on its way. The mesh, and what is dressed, are made `beside`; what needs the solver's device
    is made here, in parts that each take at most about as long as a frame."""

    def __init__(self, beside: Beside, build: BuildDrape) -> None:
        self._beside = beside
        self._build = build
        self._order: DrapeOrder | None = None
        self._anew = False
        self._parts: Iterator[Drape | None] | None = None

    @property
    def under_way(self) -> bool:
        """Is something being made?"""
        return self._order is not None

    @property
    def has_parts(self) -> bool:
        """Is there something left to be done here, and nothing to wait for?"""
        return self._parts is not None

    def begin(self, drape: Drape, order: DrapeOrder) -> None:
        """Make the garment of the order's pattern and fabric while this one is worn; what was being made is dropped."""
        assert order.specification is not None
        self.give_up()
        self._order = order
        self._beside.begin(drape.cutting(order.specification, order.fabric))

    def give_up(self) -> None:
        """Nobody wants any more what is being made."""
        self._beside.give_up()
        self._order, self._parts, self._anew = None, None, False

    def go_on(self, drape: Drape) -> Remade | None:
        """Do the next part, between two frames of this garment, which is worn; the new one once it is there.

        Raises EditError when it can't be put on, and then nothing is under way.
        """
        if self._parts is not None:
            try:
                made = next(self._parts)
            except StopIteration:
                self._parts = None
                self._dress_anew()
                return None
            if made is None:
                return None
            self.give_up()
            return Remade(made, anew=False)
        outcome = self._beside.outcome()
        if isinstance(outcome, NotMade):
            self._not_made(outcome)
        elif isinstance(outcome, Made) and self._anew:
            self.give_up()
            return Remade(outcome.value.unpacked(), anew=True)
        elif isinstance(outcome, Made):
            self._parts = drape.recut(outcome.value)
        return None

    def _not_made(self, outcome: NotMade) -> None:
        """What can't be meshed is refused by dressing in the words of that."""
        if not self._anew:
            self._dress_anew()
            return
        self.give_up()
        fault = in_parameters(outcome.problem)
        raise EditError(f"so it can't be worn: {fault.message}", fault.place, fault.remedy)

    def _dress_anew(self) -> None:
        assert self._order is not None
        self._anew = True
        self._beside.begin(Dressing(self._build, self._order))
