"""The part of a session's worker that has to do with several garments: which is edited, and another outfit put on."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from tryon_server.runtime import caught
from tryon_server.runtime.beside import Beside
from tryon_server.runtime.drape import Drape, Stance, StepFacts
from tryon_server.runtime.held_edits import HeldEdits
from tryon_server.runtime.order import DrapeOrder, WorkOrder
from tryon_server.runtime.outfitting import Outfitting, as_edited
from tryon_server.runtime.publishing import Publisher
from tryon_server.runtime.remaking import Remade, Remaking
from tryon_server.runtime.sources import Move
from tryon_server.sessions.commands import ChangeOutfit, ChangePattern
from tryon_server.sessions.events import Event, FabricWorn, OutfitRefused, OutfitWorn, PhaseChanged, Troubled
from tryon_server.wording import as_parameters
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History

logger = logging.getLogger(__name__)

GIVEN_UP, ASK_AGAIN = "it was given up before it was worn", "Ask for it again"
MAKING_SECONDS = 0.01  # between looks at what is being made
DRAWN_SECONDS = 60.0  # of the machine's, after which what is on its way to where it hangs in the new garment is there
# at once: a heap of cloth that is drawn from the floor can hold up frames for minutes, and who asked waits meanwhile


class OutfitWorker:
    """What a worker does with what is worn as a whole; the worker has these."""

    _order: WorkOrder
    _fabric: str  # of the innermost garment, as it is dressed the next time
    _drape: Drape | None
    _move: Move | None
    _pose: Stance | None
    _simulated: float
    _failures: int
    _worn: tuple[str, float | None, tuple[str, ...], float | None]
    _histories: dict[str, History]
    _publisher: Publisher
    _remaking: Remaking
    _outfitting: Outfitting
    _beside: Beside
    _caught: caught.CaughtWatch
    _held_edits: HeldEdits
    _held: bool
    _held_last: ChangePattern | None
    _stuck: str
    _drawn_since: float | None
    _clock: Callable[[], float]
    _tell: Callable[[Event], None]

    def _tell_design(self, specification: Mapping[str, Any], history: History, **more: Any) -> None:
        """Tell the pattern of the garment that is edited."""
        raise NotImplementedError

    def _remake(self, drape: Drape) -> None:
        """Go on making the next cut of the garment that is edited."""
        raise NotImplementedError

    def _keep_moving(self) -> None:
        """Have what is worn advanced for a while, also on a body that stands, or is held."""
        raise NotImplementedError

    def _go_on_with_effects(self) -> float | None:
        """Do what is next for the effects and the preset of what is worn, and tell of them; how long to wait before the
        next look."""
        raise NotImplementedError

    @property
    def _making(self) -> bool:
        """Is the scene that is worn about to give way to another one?"""
        return self._remaking.under_way or self._outfitting.has_parts

    def _go_on_making(self) -> float | None:
        """Go on making what is to be worn next; how long to wait before the next look [s], None if nothing is."""
        if self._drape is None or not (self._remaking.under_way or self._outfitting.under_way):
            return None
        if self._remaking.drawing or self._outfitting.drawing:
            self._keep_moving()
            self._drawn_since = self._clock() if self._drawn_since is None else self._drawn_since
            if self._clock() - self._drawn_since > DRAWN_SECONDS:
                self._drape.come_at_once()
        else:
            self._drawn_since = None
        if self._outfitting.under_way:
            self._dress_otherwise()
        else:
            self._remake(self._drape)
        return MAKING_SECONDS

    @property
    def _edited(self) -> str:
        """The name of the garment that is edited."""
        return self._order.drape.of_edited.worn_as if self._drape is None else self._drape.edited

    @property
    def _history(self) -> History | None:
        """Its edits; None of one that has no pattern."""
        return self._histories.get(self._edited)

    def _ordered(self) -> DrapeOrder:
        """What is worn, in the patterns that were made by edits."""
        return as_edited(replace(self._order.drape, edited=self._edited), self._histories)

    def _change_outfit(self, command: ChangeOutfit) -> None:
        """Begin to make another outfit, or edit another garment of this one."""
        try:
            if self._outfitting.relieves:
                self._outfitting.give_up()  # nobody asked for that; who is still caught is seen again
                self._caught = caught.CaughtWatch()
            if self._drape is None or self._remaking.under_way or self._outfitting.under_way:
                what = "the garment is not dressed" if self._drape is None else "another change is being made"
                raise EditError(what, "garments", "Try again once it is worn")
            if tuple(item.name for item in command.items) == self._drape.names:
                self._edit_garment(command.edited)
                self._tell(OutfitWorn(command.ticket))
            else:
                self._held_edits.give_up()
                self._outfitting.begin(self._drape, self._ordered(), command, self._histories)
        except EditError as error:
            self._tell(OutfitRefused(command.ticket, error.place, error.message, error.remedy))

    def _edit_garment(self, name: str) -> None:
        """Edits are of this garment from now on. Raises EditError where they can't be."""
        assert self._drape is not None
        if name in ("", self._edited):
            return
        if self._remaking.under_way or self._held_edits.under_way:
            raise EditError("another garment is being made", "garment", "Edit this one once that is worn")
        if name not in self._histories:
            known = ", ".join(self._histories)
            raise EditError(f"no garment {name!r} with a pattern is worn", "garment", f"Choose one of: {known}")
        self._drape.edit_garment(name)
        self._tell_design(self._histories[name].specification, self._histories[name])

    def _dress_otherwise(self) -> None:
        """Go on making the outfit that is to be worn next; wear it once it is there."""
        assert self._drape is not None
        ticket = self._outfitting.ticket
        try:
            remade = self._outfitting.go_on(self._drape, self._stance_now)
            news = self._outfitting.news()
            if news is not None:
                self._tell(PhaseChanged("ready", news.stage, news.share or 0.0, *self._worn))
            if remade is not None and remade.meanwhile:
                self._wear_meanwhile(remade.drape)
            elif remade is not None:
                relieves = self._outfitting.relieves
                self._wear_outfit(remade)
                self._go_on_with_effects()  # whoever is told that it is worn may ask for them at once
                if ticket is not None:
                    self._tell(OutfitWorn(ticket, self._outfitting.again))
                elif not relieves:
                    self._tell(FabricWorn(self._order.drape.of_edited.fabric))
        except EditError as error:
            self._refuse_outfit(ticket, error)
        except Exception as error:
            logger.exception("an outfit could not be made")
            what = f"it could not be made: {error!r}"
            self._refuse_outfit(ticket, EditError(what, "garments", "Wear something else"))

    def _give_up_outfit(self, ticket: int) -> None:
        """Make the outfit of this ticket no more, if it is on its way; where something is off for it already, it is
        gone on with: what is worn then would be neither."""
        if self._outfitting.ticket == ticket and self._outfitting.under_way and not self._outfitting.bared:
            self._refuse_outfit(ticket, EditError(GIVEN_UP, "garments", ASK_AGAIN))

    def _refuse_outfit(self, ticket: int | None, error: EditError) -> None:
        """What is worn is worn on."""
        relieves = self._outfitting.relieves
        self._outfitting.give_up()
        self._tell(PhaseChanged("ready", "Dressed", None, *self._worn))
        if relieves:
            what = f"The garment is worn on as it is: {error.message.rstrip('.')}."
            self._tell(Troubled("caught", "$", what, f"{error.remedy.rstrip('.')}."))
        else:
            self._tell_refusal(ticket, error)

    def _tell_refusal(self, ticket: int | None, error: EditError) -> None:
        """Of another outfit, or of another fabric for a mesh, for which no ticket waits."""
        if ticket is not None:
            self._tell(OutfitRefused(ticket, error.place, error.message, error.remedy))
            return
        what = f"The garment is worn on as it is: {error.message.rstrip('.')}."
        self._tell(Troubled("edit_refused", "$.fabric", what, f"{error.remedy.rstrip('.')}."))
        self._tell(FabricWorn(self._order.drape.of_edited.fabric))

    def _dress_of(self, fabric: str) -> None:
        """Have the garment that is edited, a mesh, dressed anew of this fabric while it is worn on."""
        if self._outfitting.under_way and self._outfitting.ticket is None:
            self._outfitting.give_up()  # nobody wants that fabric any more
        if self._remaking.under_way or self._outfitting.under_way:
            busy = EditError("another change is being made", "fabric", "Choose the fabric again once that is worn")
            self._tell_refusal(None, busy)
            return
        self._outfitting.begin_of(self._ordered(), fabric)

    def _see_caught(self, facts: StepFacts, seconds: float) -> None:
        """Have what is worn put on anew, while it is worn on, where frames say that it is caught for good."""
        if not self._caught.see(facts.max_stretch, facts.body_lag, seconds):
            return
        if self._drape is None or self._remaking.under_way or self._outfitting.under_way or self._held_edits.under_way:
            return  # it is seen in the next frame, too
        self._caught.relieved()
        self._outfitting.begin_again(self._drape, self._ordered())
        what, remedy = caught.told(facts.max_stretch, facts.body_lag)
        self._tell(Troubled("caught", "$", what, remedy))

    def _stance_now(self) -> Stance:
        """Where the body of what is worn is."""
        assert self._pose is not None
        return self._pose

    def _tell_worn(self) -> None:
        """Tell what there is to say of what is newly dressed, and be ready for edits of it."""
        assert self._drape is not None
        for name, specification in self._drape.specifications.items():
            if specification is not None:
                self._histories.setdefault(name, History(specification))
                self._beside.warm()
        outfit = self._drape.outfit
        said = f"Dressed; {outfit.fit}" if outfit.fit else "Dressed"
        notes = tuple(as_parameters(note) for note in outfit.notes)
        self._worn = (outfit.fit, outfit.fitting_size, notes, outfit.size)
        self._tell(PhaseChanged("ready", said, None, *self._worn))

    def _drop_outfit(self, why: str, remedy: str) -> None:
        """What is worn is worn no more: another outfit that is on its way is refused."""
        if self._outfitting.under_way:
            if self._outfitting.ticket is not None:
                self._tell(OutfitRefused(self._outfitting.ticket, "garments", why, remedy))
            self._outfitting.give_up()

    def _go_on_with(self, remade: Remade) -> None:
        """Wear it in place of what was worn, in the stance of that."""
        assert self._move is not None
        self._tell(self._publisher.dress(remade.drape, self._move))
        self._drape = remade.drape
        if remade.seconds is not None:
            self._simulated, self._failures = remade.seconds, 0
            self._tell_worn()

    def _wear_meanwhile(self, drape: Drape) -> None:
        """Wear what is left where something was taken off that is put on again: nothing of what was ordered or asked of
        it is forgotten."""
        assert self._move is not None
        off = " and ".join(name for name in self._outfitting.again if name not in drape.names)
        self._tell(self._publisher.dress(drape, self._move))
        self._drape = drape
        said = f"Taking {off} off, to be put on again in the new order"
        self._tell(PhaseChanged("ready", said, 1.0, *self._worn))  # the new outfit is dressed, and not worn yet

    def _wear_outfit(self, remade: Remade) -> None:
        drape, order = remade.drape, self._outfitting.order
        assert order is not None
        self._outfitting.give_up()
        self._held, self._held_last, self._stuck = False, None, ""
        self._remaking.forget()
        drape.edit_garment(order.of_edited.worn_as)
        self._go_on_with(remade)
        self._order, self._fabric = replace(self._order, drape=order), order.fabric
        self._histories = {name: history for name, history in self._histories.items() if name in drape.names}
        if self._history is not None:
            self._tell_design(self._history.specification, self._history)
