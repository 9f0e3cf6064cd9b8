"""Another outfit made while one is worn: without one of its garments from where that is worn; all else dressed anew, in
the order in which it is worn, and brought to where the body is by then."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from tryon_server.runtime.beside import Beside, Made, NotMade, Told
from tryon_server.runtime.catching_up import CatchingUp, taken_off_for
from tryon_server.runtime.drape import BuildDrape, Drape, Stance
from tryon_server.runtime.order import DrapeOrder, GarmentOrder
from tryon_server.runtime.remaking import Dressing, Remade
from tryon_server.sessions.commands import ChangeOutfit
from tryon_server.wording import in_parameters
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.fabrics import named_fabric
from tryon_solver.redesign.history import History

Histories = Mapping[str, History]
"""The edits of each garment that is made of a pattern, by the name under which it is worn."""


def as_edited(order: DrapeOrder, histories: Histories) -> DrapeOrder:
    """The order with all garments in the patterns that their edits have made."""

    def edited(one: GarmentOrder) -> GarmentOrder:
        history = histories.get(one.worn_as)
        if history is None:
            return one
        pattern = history.specification
        fabric = named_fabric(pattern) or one.fabric
        return replace(one, specification=pattern, fabric=fabric, edited_from=history.before)

    return order.wearing(tuple(edited(one) for one in order.garments), order.edited)


class Outfitting:
    """At most one outfit on its way, for the command that asked for it.

    Attributes:
        again: names of what is taken off for it, and put on again with it.
        bared: is something of that off?
        relieves: is it what is worn already, put on anew since it is caught? Nobody asked for that.
    """

    def __init__(self, beside: Beside, build: BuildDrape) -> None:
        self._beside = beside
        self._build = build
        self._parts: Iterator[Drape | None] | None = None
        self._anew = False
        self._catching_up: CatchingUp | None = None
        self.order: DrapeOrder | None = None
        self.ticket: int | None = None
        self.again: tuple[str, ...] = ()
        self.bared = self.relieves = False

    @property
    def under_way(self) -> bool:
        """Is something being made?"""
        return self.order is not None

    @property
    def has_parts(self) -> bool:
        """Is there something left to be done here, and nothing to wait for?"""
        return self._parts is not None

    def begin(self, drape: Drape, worn: DrapeOrder, command: ChangeOutfit, histories: Histories) -> None:
        """Make what the command asks for, while the drape is worn, which was ordered as `worn`."""
        sized = {one.worn_as: drape.size_of(one.worn_as) for one in worn.garments}
        garments = tuple(replace(one, size=sized.get(one.worn_as) or one.size) for one in command.order)
        self.order = as_edited(worn.wearing(garments, command.edited), histories)
        self.ticket, self.relieves = command.ticket, False
        left = tuple(one.name for one in command.items)
        gone = [name for name in drape.names if name not in left]
        self.again, self.bared = taken_off_for(drape.names, left), False
        self._anew = len(gone) != 1 or left != tuple(name for name in drape.names if name not in gone)
        if self._anew:
            self._beside.begin(Dressing(self._build, self.order))
        else:
            self._parts = drape.take_off(gone[0])

    def begin_of(self, worn: DrapeOrder, fabric: str) -> None:
        """Dress what is worn, which was ordered as `worn`, anew while it is worn, the garment that is edited, a mesh,
        of this fabric. No ticket waits for it."""
        own = worn.of_edited
        garments = tuple(replace(one, fabric=fabric) if one == own else one for one in worn.garments)
        self._begin_anew(worn.wearing(garments, worn.edited))

    def begin_again(self, drape: Drape, worn: DrapeOrder) -> None:
        """Dress the drape, which was ordered as `worn`, anew while it is worn, all of it in its size: it is caught. No
        ticket waits for it."""
        garments = tuple(replace(one, size=drape.size_of(one.worn_as) or one.size) for one in worn.garments)
        self._begin_anew(worn.wearing(garments, worn.edited))
        self.relieves = True

    def _begin_anew(self, order: DrapeOrder) -> None:
        self.order, self.ticket, self._anew, self.relieves = order, None, True, False
        self.again, self.bared = (), False
        self._beside.begin(Dressing(self._build, order))

    def give_up(self) -> None:
        """Nobody waits for it any more."""
        if self.under_way and self._anew:
            self._beside.give_up()
        self.order = self._parts = self._catching_up = None
        self.bared = self.relieves = False

    def news(self) -> Told | None:
        """What is being done for it, where that has changed."""
        return self._beside.news() if self.under_way and self._anew else None

    @property
    def drawing(self) -> bool:
        """Is what is worn about to be drawn to where it hangs in the new outfit? Then it has to be advanced."""
        return self._catching_up is not None

    def go_on(self, drape: Drape, stance: Callable[[], Stance]) -> Remade | None:
        """Do the next part, between two frames of this drape, which is worn; what is to be worn in its place, once that
        is there: the new outfit, or what is worn until then. ``stance`` tells where the body is.

        Raises EditError when it can't be put on.
        """
        if self._parts is None:
            outcome = self._beside.outcome()
            if isinstance(outcome, NotMade):
                fault = in_parameters(outcome.problem)
                raise EditError(fault.message, fault.place, fault.remedy)
            if isinstance(outcome, Made):
                unpacking = outcome.value.solved_as(drape.preset).unpacking()
                self._catching_up = CatchingUp(unpacking, stance, drape, self.again)
                self._parts = self._catching_up.parts()
            return None
        made = next(self._parts)
        if made is None:
            return None
        if self._catching_up is not None and not self._catching_up.is_there:
            self.bared = True
            return Remade(made, meanwhile=True)
        self._parts = None
        return Remade(made, seconds=None if self._catching_up is None else made.seconds)
