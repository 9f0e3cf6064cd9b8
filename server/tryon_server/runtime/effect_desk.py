"""The effects of a session: what is asked for, and how the garment comes to be worn with it.

What is asked for is kept as wishes over what the garment has of itself, so that it holds for whatever garment is worn
next. An effect goes from absent to armed, its kernels compiled by another process, to active: bound to the scene beside
the one that goes on, and taken up between two frames.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from tryon_protocol import AUTO, EffectsMessage, EffectState
from tryon_server.runtime.arming import Armoury
from tryon_server.runtime.drape import Character, DrapeEffects, EffectTimes
from tryon_server.runtime.effect_choice import at_most, called_for, not_called_for
from tryon_server.sessions.commands import ChangeEffect, MeasureEffects
from tryon_server.sessions.events import EffectRefused, EffectsTold, Event
from tryon_solver.effect_words.fields import EffectError, Rows
from tryon_solver.effect_words.rules import Parameters, gusty, left_out, rows_of_garments, same_but_values
from tryon_solver.effect_words.table import WORDS, live, word_of

logger = logging.getLogger(__name__)

SHARE = 0.5  # of the time that a frame took, after which no further part of another scene is begun
LOOK_SECONDS = 0.02  # between looks at what is being compiled
CHOICE_SECONDS = 1.0  # between looks at what garment and motion may call for
STILL_SECONDS = 1.0  # for which what is to go gently waits for a body and a garment that do not go on
CHOSEN = "chosen by itself: "
LOOKED = "looked for by itself: "
ASKED = "asked for"
TAKEN_OFF = "taken off"
LEFT_OFF = "taken off by who asked for that; asked for again it acts, by itself it is not armed"
USUAL = "every garment is worn with it"
OWN = "the pattern has it"
WITHOUT = "without "  # and what, since what it was on was taken off
NOT_WORN = "not worn: "  # and why: it can't be, with what is worn


@dataclass(frozen=True)
class Wish:
    """What an effect is to be, whatever the garment has of itself."""

    state: Literal["absent", "armed", "active"]
    parameters: Parameters
    why: str = ASKED


class EffectDesk:
    """Takes what is asked of effects, and has the garment come to be worn with it.

    Args:
        tell: tells an event.
        armoury: has effects compiled.
        clock: the server's steady clock [s].
        wishes: what was asked for before, as `wishes` gives it.
    """

    def __init__(
        self, tell: Callable[[Event], None], armoury: Armoury, clock: Callable[[], float], wishes: Mapping[str, Any]
    ) -> None:
        self._tell = tell
        self._armoury = armoury
        self._clock = clock
        self._auto = bool(wishes.get(AUTO))
        self._wishes = {name: _restored(name, wish) for name, wish in wishes.get("effects", {}).items()}
        self._held = dict(self._wishes)  # those with which a garment was worn last
        self._worn: DrapeEffects | None = None
        self._parts: Iterator[None] | None = None
        self._binding: Mapping[str, Parameters] = {}
        self._waiting: dict[int, str] = {}  # tickets of changes: of which effect, or AUTO
        self._measurers: list[int] = []
        self._measuring: Iterator[tuple[str, EffectTimes]] | None = None
        self._times: dict[str, EffectTimes] = {}
        self._told: tuple[EffectsMessage, Mapping[str, Any]] | None = None
        self._chosen_at = -CHOICE_SECONDS
        self._seen: Character | None = None  # what the worn garment and its motion have been like at most, as looked
        self._not_called: Mapping[str, str] = {}  # why nothing of these is armed by itself
        self._fading: tuple[float, float] | None = None  # s that some effect needs to go, and when that was new
        self._caveats: Mapping[str, str] = {}  # as they were told
        self._quiet = False  # there was nothing to do when it was last looked
        self._acted: Mapping[str, Parameters] | None = None  # what acted when it was asked for what stirs
        self._lost: dict[str, str] = {}  # what of effects nobody asks for any more was on garments that were taken off

    @property
    def wishes(self) -> dict[str, Any]:
        """What is asked for, plain JSON, to be kept."""
        wishes = {
            name: {"state": wish.state, "parameters": dict(wish.parameters), "why": wish.why}
            for name, wish in self._wishes.items()
        }
        return {AUTO: self._auto, "effects": wishes} if wishes or self._auto else {}

    @property
    def binding(self) -> bool:
        """Is another simulation of what is worn being built?"""
        return self._parts is not None

    def forget_times(self) -> None:
        """What was measured is of another simulation of what is worn."""
        self._times.clear()
        self._measuring, self._quiet = None, False

    # What is asked ------------------------------------------------------------------------------------------------

    def take(self, command: ChangeEffect | MeasureEffects) -> None:
        """Somebody asks; answered at once where it is refused."""
        self._quiet = False
        try:
            if self._worn is None:
                raise EffectError("the garment is not worn", "name", "Ask once it is dressed")
            if isinstance(command, MeasureEffects):
                self._measurers.append(command.ticket)
            else:
                self._change(command, self._worn)
        except EffectError as error:
            self._refuse(command.ticket, error)

    def _change(self, command: ChangeEffect, worn: DrapeEffects) -> None:
        if command.name == AUTO:
            self._auto = command.state != "absent"
            self._chosen_at = self._clock() - CHOICE_SECONDS
            if self._auto:
                self._choose(worn)
            else:
                self._wishes = {name: wish for name, wish in self._wishes.items() if not wish.why.startswith(CHOSEN)}
                self._seen = None
            self._waiting[command.ticket] = command.name
            return
        word = word_of(command.name)
        if word.kept and command.state != "active":
            fault = f"{word.title.lower()} can't be taken off, since it is what keeps the garment from penetrating"
            raise EffectError(fault, "name", "Leave it active")
        parameters = self._stands(command.name, worn)
        if command.parameters is not None or (parameters is None and command.state == "active"):
            parameters = word.parameters(command.parameters)
        wishes = {**self._wishes, command.name: Wish(command.state, parameters or {})}
        worn.check(self._wanted(wishes, worn))
        self._wishes = wishes
        self._lost.pop(command.name, None)
        self._waiting[command.ticket] = command.name

    def _stands(self, name: str, worn: DrapeEffects) -> Parameters | None:
        """The effect's parameters as they are, or were when it was worn last; None of what never was."""
        if name in self._wishes and self._wishes[name].parameters:
            return self._wishes[name].parameters
        return {**live(), **worn.own}.get(name)

    def _refuse(self, ticket: int, error: EffectError) -> None:
        self._tell(EffectRefused(ticket, error.place, error.message, error.remedy))

    # What is worn -------------------------------------------------------------------------------------------------

    def go_on(self, worn: DrapeEffects | None, cost: float, busy: bool) -> float | None:
        """Do what is next for what is ``worn``, between two frames, each of which takes ``cost`` [s]; not beside other
        work that makes a scene, where there is some (``busy``). How long to wait before the next look [s]; None: there
        is nothing to do.
        """
        if worn is not self._worn:
            self._name_pieces(worn)
            self._take_up_again(worn)
            self._seen, self._not_called = None, {}
            self._worn, self._parts, self._measuring, self._quiet = worn, None, None, False
            self._fading = None
            self._times.clear()
        if worn is None or (self._quiet and worn.caveats == self._caveats and not self._choose(worn)):
            return None
        self._arm(worn)
        pause: float | None = LOOK_SECONDS if self._armoury.compiling else None
        wanted = self._wanted(self._wishes, worn)
        if self._parts is not None and (busy or self._binding != wanted):  # what is worn may give way to another scene
            self._parts = None
        if self._parts is None and all(self._armoury.is_ready(name) for name in wanted):
            if self._fades(wanted, worn):
                pause = LOOK_SECONDS
            elif worn.asked != wanted:
                pause = self._begin(wanted, worn, busy)
        if self._parts is not None:
            pause = 0.0
            self._bind(cost)
        if self._measurers:
            pause = 0.0
            self._measure(worn)
        self._tell_news(worn)
        self._quiet = pause is None
        return pause

    def stirs(self, worn: DrapeEffects) -> bool:
        """Does cloth that hangs still begin to move on a body that stands, by what has come to act since this was asked
        last, or is to come or go, or by gusts, which never end?"""
        new = worn.asked != self._acted
        self._acted = worn.asked
        return new or gusty(worn.asked) or worn.asked != self._wanted(self._wishes, worn)

    def _name_pieces(self, worn: DrapeEffects | None) -> None:
        """Where other garments come to be worn, have the wishes name pieces with the garments that they are of, and
        what they list by garment be of those that are worn: what was on one that was taken off is forgotten, of which
        `why` tells, and what the pattern of one that was put on calls for is added."""
        before = self._worn
        if before is None or worn is None or worn.garments == before.garments:
            return

        def named(wishes: Mapping[str, Wish]) -> dict[str, Wish]:
            after = {}
            for name, wish in wishes.items():
                parameters = _in_other_garments(name, wish.parameters, before, worn) if wish.parameters else {}
                lost = _lost_with(name, wish.parameters, before, worn) if wish.parameters else ""
                if parameters is None:
                    self._lost[name] = lost
                    continue
                why = "; ".join(filter(None, (wish.why.partition(f"; {WITHOUT}")[0], lost)))
                after[name] = replace(wish, parameters=parameters, why=why)
            return after

        self._lost.clear()
        self._wishes, self._held = named(self._wishes), named(self._held)

    def _take_up_again(self, worn: DrapeEffects | None) -> None:
        """Where something else comes to be worn, have act again what the garment before could not be worn with, and
        this one can be."""
        if worn is None:
            return
        for name, wish in self._wishes.items():
            if wish.state != "armed" or not wish.why.startswith(NOT_WORN):
                continue
            wishes = {**self._wishes, name: Wish("active", wish.parameters)}
            try:
                worn.check(self._wanted(wishes, worn))
            except EffectError as error:
                wishes[name] = replace(wish, why=f"{NOT_WORN}{error.message}")
            self._wishes = wishes

    def _wanted(self, wishes: Mapping[str, Wish], worn: DrapeEffects) -> dict[str, Parameters]:
        """The effects that are to act, and all their parameters."""
        wanted: dict[str, Parameters] = {**live(), **worn.own}
        for name, wish in wishes.items():
            if wish.state == "active":
                wanted[name] = wish.parameters
            else:
                wanted.pop(name, None)
        return wanted

    def _choose(self, worn: DrapeEffects) -> bool:
        """Arm what garment and motion may call for, if that is wished, and nobody has said otherwise of it; whether
        there is something new, also of why nothing is armed."""
        now = self._clock()
        if not self._auto or now - self._chosen_at < CHOICE_SECONDS:
            return False
        self._chosen_at = now
        character = worn.character()
        self._seen = at_most(self._seen, character)
        before, self._not_called = self._not_called, not_called_for(self._seen)
        new = {
            name: Wish("armed", {}, f"{CHOSEN}{why}")
            for name, why in called_for(character).items()
            if name not in self._wishes and name not in worn.asked
        }
        self._wishes.update(new)
        return bool(new) or before != self._not_called

    def _arm(self, worn: DrapeEffects) -> None:
        self._armoury.hold(worn.asked)
        fault = self._armoury.look()
        if fault is not None:
            logger.warning("kernels of effects could not be compiled: %s", fault.problem.message)
        armed = [name for name, wish in self._wishes.items() if wish.state == "armed"]
        self._armoury.want([*self._wanted(self._wishes, worn), *armed])

    def _fades(self, wanted: dict[str, Parameters], worn: DrapeEffects) -> bool:
        """Is something still going gently, before the scene without it is made? Not where the garment stands still."""
        if _by_values(worn.asked, wanted) and worn.asked != wanted:
            return False
        left, now = worn.fade(wanted), self._clock()
        if left == 0.0 or worn.asked == wanted:
            self._fading = None
            return False
        if self._fading is None or self._fading[0] != left:
            self._fading = left, now
        return now - self._fading[1] < STILL_SECONDS

    def _begin(self, wanted: dict[str, Parameters], worn: DrapeEffects, busy: bool) -> float | None:
        if _by_values(worn.asked, wanted):
            worn.write(wanted)
            return None
        if not busy:
            self._binding, self._parts = wanted, worn.rebind(wanted)
        return 0.0 if not busy else LOOK_SECONDS

    def _bind(self, cost: float) -> None:
        """Go on making the scene with other effects, for part of a frame's time; wear it once it is there."""
        assert self._parts is not None
        end = self._clock() + SHARE * cost
        try:
            next(self._parts)
            while self._clock() < end:
                next(self._parts)
        except StopIteration:
            self._parts = None
            self._times.clear()
        except EffectError as error:
            self._not_bound(error)
        except Exception as error:
            logger.exception("effects could not be bound")
            self._not_bound(EffectError(f"it failed: {error!r:.200}", "name", "Ask for something else"))

    def _not_bound(self, error: EffectError) -> None:
        """Go on with what there was."""
        worn, self._parts = self._worn, None
        assert worn is not None
        unfit = self._unfit(worn)
        if unfit:
            self._held = {**self._held, **unfit}
            self._wishes = dict(self._held)
        else:
            self._wishes = {name: self._possible(name, wish, worn, error) for name, wish in self._held.items()}
        waiting, self._waiting = self._waiting, {}
        for ticket in waiting:
            self._refuse(ticket, error)

    def _unfit(self, worn: DrapeEffects) -> dict[str, Wish]:
        """Of what held before, each that can't be worn with this, though nothing else be asked for, armed."""
        unfit = {}
        for name, wish in self._held.items():
            try:
                worn.check(self._wanted({name: wish}, worn))
            except EffectError as error:
                unfit[name] = self._possible(name, wish, worn, error)
        return {name: wish for name, wish in unfit.items() if wish.state == "armed"}

    def _possible(self, name: str, wish: Wish, worn: DrapeEffects, error: EffectError) -> Wish:
        """The wish, but armed where this garment can't be worn with it, as where an edit took its lines."""
        if wish.state != "active" or worn.asked.get(name) == wish.parameters:
            return wish
        return Wish("armed", wish.parameters, f"{NOT_WORN}{error.message}")

    @property
    def _stages(self) -> Mapping[str, Mapping[str, float]]:
        return {name: times.stages for name, times in self._times.items()}

    def _measure(self, worn: DrapeEffects) -> None:
        if self._measuring is None:
            self._measuring = iter(worn.times())
        part = next(self._measuring, None)
        if part is not None:
            self._times[part[0]] = part[1]
            return
        self._measuring = None

    # Telling ------------------------------------------------------------------------------------------------------

    def _tell_news(self, worn: DrapeEffects) -> None:
        """Tell the effects if anything of them is new, or somebody waits for it and has not to wait longer."""
        answers = self._answered(worn)
        if self._measurers and self._measuring is None:
            answers += self._measurers
            self._measurers = []
        if self._measuring is not None:
            return
        self._caveats = worn.caveats
        news = EffectsMessage(effects=self._states(worn), auto=self._auto, plan=worn.plan(self._stages)), self.wishes
        if news != self._told or answers:
            self._told = news
            self._tell(EffectsTold(*news, tuple(answers)))

    def _answered(self, worn: DrapeEffects) -> list[int]:
        """Tickets whose effect is as it was asked for, whatever is under way for others, as compiling takes seconds;
        none of them waits any more, and should the others fail this stays."""
        pending = self._pending_names(worn)
        if not pending:
            self._held = dict(self._wishes)
        answered = [
            ticket for ticket, name in self._waiting.items() if not pending or (name != AUTO and name not in pending)
        ]
        for name in {self._waiting.pop(ticket) for ticket in answered} & set(self._wishes):
            self._held[name] = self._wishes[name]
        return answered

    def _pending_names(self, worn: DrapeEffects) -> dict[str, Literal["compiling", "binding"]]:
        """What is under way for which effects."""
        wanted = self._wanted(self._wishes, worn)
        pending: dict[str, Literal["compiling", "binding"]] = {}
        for name in {*wanted, *worn.asked}:
            if wanted.get(name) != worn.asked.get(name):
                pending[name] = "binding"
        for name in (*wanted, *(name for name, wish in self._wishes.items() if wish.state == "armed")):
            if not self._armoury.is_ready(name):
                pending[name] = "compiling"
        return pending

    def _states(self, worn: DrapeEffects) -> tuple[EffectState, ...]:
        pending, out = self._pending_names(worn), left_out(worn.asked)
        return tuple(self._state(word.name, worn, pending.get(word.name, ""), out) for word in WORDS)

    def _state(
        self,
        name: str,
        worn: DrapeEffects,
        pending: Literal["", "compiling", "binding"],
        out: Mapping[str, str],
    ) -> EffectState:
        wish = self._wishes.get(name)
        state: Literal["absent", "armed", "active"] = "absent"
        if name in worn.asked:
            state = "armed" if name in out else "active"
        elif wish is not None and wish.state != "absent" and self._armoury.is_ready(name):
            state = "armed"
        times = self._times.get(name)
        return EffectState(
            name=name,
            state=state,
            pending=pending,
            parameters=dict(worn.asked.get(name) or (wish.parameters if wish else {}) or _by_default(name)),
            why=out.get(name, "") or self._with_caveat(name, state, worn),
            ms=None if times is None else round(times.frame, 4),
            stages={} if times is None else {stage: round(ms, 4) for stage, ms in times.stages.items()},
        )

    def _with_caveat(self, name: str, state: str, worn: DrapeEffects) -> str:
        why, caveat = self._why(name, worn), worn.caveats.get(name, "")
        return f"{why}; {caveat}" if caveat and state == "active" else why

    def _why(self, name: str, worn: DrapeEffects) -> str:
        wish = self._wishes.get(name)
        if wish is not None and wish.state != "absent":
            return wish.why
        if wish is not None:
            if name in {**live(), **worn.own}:
                return TAKEN_OFF
            return LEFT_OFF if self._auto else ""
        lost = self._lost.get(name, "")
        if name in worn.own:
            return "; ".join(filter(None, (OWN, lost)))
        if name in worn.asked:
            return USUAL
        looked = f"{LOOKED}{self._not_called[name]}" if self._auto and name in self._not_called else ""
        return "; ".join(filter(None, (lost, looked)))


def _listed(name: str) -> list[str]:
    """Of which of the effect's parameters are there as many as it is told."""
    return [field.name for field in word_of(name).fields if isinstance(field, Rows)]


def _lost_with(name: str, parameters: Parameters, before: DrapeEffects, worn: DrapeEffects) -> str:
    """Which of the effect's entries name a garment that was taken off, for people; "" where none does."""
    gone = set(before.garments) - set(worn.garments)
    under = before.under_garments(name, parameters)
    without = rows_of_garments(name, under, lambda garments: not garments & gone)
    lost = [rows for rows in _listed(name) if len(without[rows]) < len(under[rows])]
    return f"{WITHOUT}{', '.join(lost)} of {', '.join(sorted(gone))}, which was taken off" if lost else ""


def _in_other_garments(
    name: str, parameters: Parameters, before: DrapeEffects, worn: DrapeEffects
) -> Parameters | None:
    """The effect's parameters as they are to be in what is worn after what was before; None where all that it listed is
    gone."""
    gone, come = set(before.garments) - set(worn.garments), set(worn.garments) - set(before.garments)
    listed = _listed(name)
    kept = rows_of_garments(name, before.under_garments(name, parameters), lambda garments: not garments & gone)
    if any(parameters[rows] for rows in listed) and not any(kept[rows] for rows in listed):
        return kept if name in live() else None
    if name in worn.own:
        own = rows_of_garments(name, worn.own[name], lambda garments: garments <= come)
        return {**kept, **{rows: [*kept[rows], *own[rows]] for rows in listed}}
    return kept


def _restored(name: str, kept: Mapping[str, Any]) -> Wish:
    """A wish as it was kept, with what its effect has got since by default; armed where its words mean nothing now."""
    parameters = kept["parameters"]
    if not parameters:
        return Wish(kept["state"], {}, kept["why"])
    whole = {**_by_default(name), **parameters}
    try:
        return Wish(kept["state"], word_of(name).parameters(whole), kept["why"])
    except EffectError as error:
        return Wish("armed", _by_default(name), f"not known any more: {error.message}")


def _by_values(before: Mapping[str, Parameters], after: Mapping[str, Parameters]) -> bool:
    """Do these differ by nothing but what may be written to a running scene?"""
    if set(before) != set(after) or set(left_out(before)) != set(left_out(after)):
        return False
    changed = [name for name in after if after[name] != before[name]]
    return all(same_but_values(name, before[name], after[name]) for name in changed)


def _by_default(name: str) -> Parameters:
    try:
        return word_of(name).parameters()
    except EffectError:  # it needs lines of a pattern, which nobody has told
        return {}
