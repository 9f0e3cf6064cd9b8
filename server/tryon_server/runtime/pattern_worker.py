"""The part of a session's worker that changes the pattern that is worn: by a value edit at once, or by a garment that
is made while the one before is worn on."""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Literal

from tryon_server.runtime.drape import Drape, Stance
from tryon_server.runtime.held_edits import Outcome
from tryon_server.runtime.outfit_worker import ASK_AGAIN, GIVEN_UP, OutfitWorker
from tryon_server.runtime.redesign import Wanted, of_pattern, wanted
from tryon_server.runtime.remaking import Remade
from tryon_server.runtime.sources import PoseSource, StillSource
from tryon_server.runtime.telling import PROGRESS_SECONDS, Teller
from tryon_server.runtime.tightness import UnfitError, with_cause
from tryon_server.runtime.waiting import WaitingChanges, refusal
from tryon_server.sessions.commands import UNASKED, ChangePattern
from tryon_server.sessions.events import ChangesTold, ChangeUnderWay, EditRefused, TakenOn
from tryon_solver.linalg.freed import give_back_freed
from tryon_solver.redesign.edit_error import EditError

logger = logging.getLogger(__name__)

REMAKING_SHARE = 0.5  # of the time that a frame took, after which no further part of another garment is begun
REST_SECONDS = 0.5  # simulated after a change that nobody watches: as long as cloth that is pulled at takes to follow
LATER = "shown once it is let go"
ANOTHER = "Make it smaller, place it elsewhere or leave it out, or have TRYON_SERVER_EDIT_SECONDS higher"


class PatternWorker(OutfitWorker):
    """What a worker does with the pattern that is edited; the worker has these."""

    _teller: Teller
    _clock: Callable[[], float]
    _source: PoseSource | None
    _dress_due: bool
    _held: bool
    _waiting: WaitingChanges
    _later: list[ChangePattern]  # that can't be begun before something else is worn, in the order in which they came
    _told: tuple[tuple[ChangeUnderWay, ...], float]  # what was told of the changes last, and when [s]
    _remade_pattern: Mapping[str, Any]
    _cost: float
    _running: bool
    _settles: bool  # while it does not run
    _standing: StillSource | None  # what moves the body then, until what is kept is taken on
    _on_the_way: set[str]  # garments that have not taken on what is kept of their patterns
    _told_at: float | None
    _kept_shown: bool  # and nothing that is only held

    def _trouble(self, code: str, place: str, message: str, remedy: str) -> None:
        """Tell that something went wrong."""
        raise NotImplementedError

    def _change(self, command: ChangePattern, worked_out: Outcome | None = None) -> None:
        """Change the pattern as asked, after all that was asked before."""
        if not command.hold and (self._later or self._must_wait(command)):
            self._later.append(replace(command, garment=command.garment or self._edited))
        else:
            self._change_now(command, worked_out)

    def _must_wait(self, command: ChangePattern) -> bool:
        """Is something being put on that this change has nothing to do with?"""
        if self._drape is None or self._outfitting.under_way:
            return self._outfitting.under_way
        other = command.garment not in ("", self._edited) and command.garment in self._histories
        return other and (self._remaking.under_way or self._held_edits.under_way)

    def _change_later(self) -> None:
        """Go on with the changes that had to wait."""
        while self._later and not self._must_wait(self._later[0]):
            self._change_now(self._later.pop(0))

    def _change_now(self, command: ChangePattern, worked_out: Outcome | None = None) -> None:
        """Change the pattern as asked; where that can't be, nothing is changed and the answer says why."""
        try:
            if self._drape is None or self._history is None:
                what = "has no sewing pattern" if self._drape is not None else "is not dressed"
                raise EditError(f"the garment {what}", "edit", "Edit a garment that was made of one, once it is worn")
            if self._outfitting.under_way:
                raise EditError("other garments are being put on", "edit", "Edit it once they are worn")
            self._edit_garment(command.garment)
            command = replace(command, garment=self._edited)
            if worked_out is None and self._held_edits.take(command, self._history, self._drape):
                return
            newest = None if command.hold else self._waiting.newest
            history = self._history if newest is None else newest.history
            asked = wanted(history, command) if worked_out is None else worked_out.wanted(history)
            self._show(command, asked, self._drape)
        except EditError as error:
            self._refuse(command, error)
        except Exception as error:
            logger.exception("an edit failed")
            self._refuse(command, EditError(f"the edit failed: {error!r}", "edit", "Edit something else"))

    def _refuse(self, command: ChangePattern, error: EditError) -> None:
        """Answer that it can't be made, after those that wait."""
        if command.hold:
            self._tell(refusal(command, error))
        else:
            self._waiting.add(command, refusal(command, error), self._clock())
            self._tell_refused()

    def _show(self, command: ChangePattern, asked: Wanted, drape: Drape) -> None:
        """Wear the pattern that is asked for, at once or as soon as it is made. Raises EditError when the garment can't
        be made so, and it is as before."""
        why = asked.mesh_of_its_own(drape.specification) or drape.reshape(asked.specification, asked.shape)
        if command.hold:
            self._show_held(command, asked, why)
            return
        self._held_last, self._stuck = None, ""
        now = self._clock()
        if why:
            made = self._remaking.under_way and self._remade_pattern is asked.specification
            if not made and not (self._remaking.soon and self._waiting.long_since(now)):  # else all of them would wait
                self._begin_remaking(asked, drape)
            self._waiting.add(command, asked, now)
            return
        self._remaking.give_up()
        self._waiting.add(command, asked, now)
        self._keep("value", asked.specification)

    def _show_held(self, command: ChangePattern, asked: Wanted, why: str) -> None:
        """Tell what the garment takes on, or why it does not. With no edit that is what is kept: nothing is held."""
        if self._source is not None:
            self._source.settle_anew()
        self._held = command.edit is not None
        self._kept_shown = not self._held
        self._held_last = command if self._remaking.under_way else None
        notes = (*asked.notes, f"{LATER}: {why}") if why else asked.notes
        self._tell_design(asked.specification, asked.history, held=self._held, notes=notes, drawn=asked.drawn)

    def _keep(self, change: Literal["value", "topology"], worn: Mapping[str, Any]) -> None:
        """This pattern is worn: answer all that it was waited for, each once it was told; show what is held."""
        if self._source is not None:
            self._source.settle_anew()
        self._held, self._kept_shown = False, True
        for command, outcome in self._waiting.take_up_to(worn, self._clock()):
            if isinstance(outcome, EditRefused):
                self._tell(outcome)
                continue
            self._histories[self._edited] = outcome.history
            self._tell_design(outcome.specification, outcome.history, notes=outcome.notes)
            self._teller.owe(partial(outcome.made, command, change))  # whoever is answered has seen the pattern
            self._on_the_way.add(self._edited)
        self._settle()
        self._tell_taken_on()
        held, self._held_last = self._held_last, None
        if held is not None:
            self._change_now(held)
        if self._drape is not None:
            self._make_next(self._drape)

    def _settle(self) -> None:
        """Take on what is kept, on the body as it stands, if nobody watches it move."""
        if not self._running and self._settles and self._pose is not None and self._on_the_way:
            self._stand_still(self._pose)

    def _stand_still(self, pose: Stance) -> None:
        """Simulate for a while on the body as it is held, while its clock stands."""
        self._standing = StillSource(pose, REST_SECONDS, self._told_at, held=True)

    def _keep_moving(self) -> None:
        source = self._source if self._running else self._standing
        if source is not None:
            source.settle_anew()
        else:
            self._stand_still(self._stance_now())

    def _tell_taken_on(self) -> None:
        """Tell of what is kept that it is taken on, once it is."""
        drape = self._drape
        if drape is None or drape.on_the_way:
            if self._standing is not None:
                self._standing.settle_anew()
        elif self._kept_shown and not drape.outgrown:
            for garment in sorted(self._on_the_way):
                self._teller.owe(partial(TakenOn, garment))
            self._on_the_way.clear()

    def _tell_refused(self) -> None:
        for refused in self._waiting.take_refused():
            self._tell(refused)

    def _give_up_change(self, ticket: int) -> None:
        """Refuse the change with this ticket, if it waits, and make the others without it."""
        given_up = EditError(GIVEN_UP, "edit", ASK_AGAIN)
        later = [command for command in self._later if command.ticket == ticket]
        for command in later:
            self._later.remove(command)
            self._tell(refusal(command, given_up))
        if self._drape is None or self._history is None or later:
            return
        if self._waiting.refuse(ticket, given_up, self._history, self._clock()):
            if self._waiting.place_of(self._remade_pattern) is None:
                self._remaking.give_up()
                self._make_next(self._drape)
            if not self._remaking.under_way:
                self._held_last = None
            self._tell_refused()

    # Another garment for the pattern ------------------------------------------------------------------------------

    def _change_fabric(self, fabric: str) -> None:
        """Have the garment dressed anew of this fabric; one that is worn by its pattern, or was, by an edit of that."""
        if self._history is None and self._drape is not None:
            self._dress_of(fabric)
            return
        if self._history is None:
            self._fabric, self._dress_due = fabric, True
            return
        command = ChangePattern("edit", UNASKED, {"kind": "change_fabric", "fabric": fabric})
        if self._drape is not None:
            self._change_now(command)
            return
        self._dress_due = True
        with suppress(EditError):  # it is of that fabric already
            asked = wanted(self._history, command)
            self._histories[self._edited] = asked.history
            self._tell(asked.made(command, "topology"))

    def _make_next(self, drape: Drape) -> None:
        """Wear what the newest change makes, if one waits: at once, or as soon as it is made."""
        newest = self._waiting.newest
        if newest is None:
            return
        if newest.mesh_of_its_own(drape.specification) or drape.reshape(newest.specification):
            self._begin_remaking(newest, drape)
        else:
            self._keep("value", newest.specification)

    def _begin_remaking(self, asked: Wanted, drape: Drape) -> None:
        """Have a garment of this pattern made while this one is worn, in place of one that is being made."""
        gc.collect()  # the mesh before the one that is worn: its parts refer to each other
        give_back_freed()
        self._remade_pattern = asked.specification
        order = of_pattern(self._ordered(), asked.specification, asked.worn_by_way_of)
        self._remaking.begin(drape, order, asked.edit)

    def _remake(self, drape: Drape) -> None:
        """Go on making the garment that is to be worn next, for part of a frame's time; wear it once it is there."""
        now = self._clock()
        if self._waiting.late(now, self._order.edit_seconds):
            longest = f"{self._order.edit_seconds:g} s, the most that an edit may take"
            what = f"it is not worn after {longest}{self._remaking.so_far}"
            first = self._waiting.first
            assert first is not None
            remedy = f"{ASK_AGAIN}, or have TRYON_SERVER_EDIT_SECONDS higher" if first.edit is None else ANOTHER
            self._go_on_without(UnfitError(what, "edit", remedy), drape)
            return
        end = now + REMAKING_SHARE * self._cost
        try:
            remade = self._remaking.go_on(drape, self._stance_now)
            while remade is None and self._remaking.has_parts and not drape.waiting and self._clock() < end:
                remade = self._remaking.go_on(drape, self._stance_now)
            if remade is not None:
                self._wear(remade, drape)
        except EditError as error:
            self._not_remade(error, drape)
        except Exception as error:
            logger.exception("a garment could not be made")
            fault = EditError(f"the garment could not be made: {error!r}", "edit", "Edit something else")
            self._not_remade(fault, drape)

    def _wear(self, remade: Remade, before: Drape) -> None:
        if self._history is not None:
            self._remaking.keep(before, self._history.specification)
        self._go_on_with(remade)
        self._keep("topology", self._remade_pattern)

    def _not_remade(self, error: EditError, drape: Drape) -> None:
        """Refuse the change that can't be worn, and go on with the others; the old garment is worn on. Where several
        were made at once, which of them it is shows as the first is made alone."""
        place, first = self._waiting.place_of(self._remade_pattern), self._waiting.first
        if place == 0:
            self._go_on_without(error, drape)
            return
        self._remaking.give_up()
        if place is not None and first is not None:
            self._begin_remaking(first, drape)
            return
        if first is None:
            self._stuck = why = drape.outgrown
            what = f"{why or 'The shape needs another mesh'}, and made anew, {error.message}."
            self._trouble("simulation_failed", "$", what, error.remedy)
            self._held_last = None
        self._make_next(drape)

    def _go_on_without(self, error: EditError, drape: Drape) -> None:
        """Refuse the first of the changes that wait, and make those behind it."""
        assert self._history is not None
        self._remaking.give_up()
        first = self._waiting.first
        why = error if first is None else with_cause(error, self._history, first.edit, first.specification)
        self._waiting.refuse_first(why, self._history, self._clock())
        self._make_next(drape)
        if not self._remaking.under_way:
            self._held_last = None
        self._tell_refused()

    def _outgrow(self, drape: Drape) -> None:
        """Make another mesh where a shape turned out, on the way to it, to need one; let go of one only held."""
        assert self._history is not None
        if self._held:
            notes = (f"{LATER}: {drape.outgrown}",)
            drape.reshape(self._history.specification)
            self._tell_design(self._history.specification, self._history, held=True, notes=notes)
        elif not self._remaking.under_way and drape.outgrown != self._stuck:
            self._begin_remaking(Wanted(self._history, self._history.specification), drape)

    # Telling ------------------------------------------------------------------------------------------------------

    def _tell_changes(self) -> None:
        """Tell what is being done for the changes that are not worn yet, where that is another thing than before."""
        before, when = self._told
        if not self._waiting and not before:
            return
        changes = self._waiting.under_way(self._remade_pattern, self._remaking.doing)
        if changes == before:
            return
        now = self._clock()
        same = [(one.ticket, one.doing, one.detail) for one in changes]
        if same == [(one.ticket, one.doing, one.detail) for one in before] and now - when < PROGRESS_SECONDS:
            return
        self._told = changes, now
        self._tell(ChangesTold(changes))
