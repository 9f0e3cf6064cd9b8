"""The process of one session's simulation: dress, then move the body, simulate and publish until the server lets go.

Nothing that a client can send ends this process: a garment that can't be dressed, a step that fails and a motion that
can't be read are reported and the loop goes on, to wait for a better order if need be.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, Literal

import numpy as np

from tryon_protocol import ProtocolError
from tryon_server.problems import ProblemError
from tryon_server.runtime.arming import Armoury
from tryon_server.runtime.beside import Beside
from tryon_server.runtime.design import design_of
from tryon_server.runtime.drape import BuildDrape, Drape, LoadMotion, Stance, StepFacts
from tryon_server.runtime.effect_desk import EffectDesk
from tryon_server.runtime.held_edits import HeldEdits, Outcome
from tryon_server.runtime.meter import Meter
from tryon_server.runtime.order import WorkOrder
from tryon_server.runtime.outfit_worker import OutfitWorker
from tryon_server.runtime.outfitting import Outfitting, as_edited
from tryon_server.runtime.pose_taking import PoseTaking
from tryon_server.runtime.publishing import Publisher
from tryon_server.runtime.redesign import Wanted, history_of, of_pattern, wanted
from tryon_server.runtime.remaking import Remade, Remaking
from tryon_server.runtime.reporting import report_of
from tryon_server.runtime.source_choice import chosen_source
from tryon_server.runtime.sources import Move, PoseSource, StillSource
from tryon_server.runtime.telling import NowAndThen, Teller
from tryon_server.runtime.waiting import HeldBack, WaitingChanges, refusal, sooner
from tryon_server.sessions.commands import (
    UNASKED,
    AllowFrame,
    BuyAccuracy,
    ChangeEffect,
    ChangeOutfit,
    ChangePattern,
    Command,
    FollowMotion,
    MeasureEffects,
    Run,
    UsePose,
    UseTrackedPose,
    WearFabric,
)
from tryon_server.sessions.events import (
    Designed,
    EditRefused,
    PhaseChanged,
    Reported,
    Troubled,
)
from tryon_server.wording import in_parameters
from tryon_solver.linalg.freed import give_back_freed
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.fabrics import named_fabric
from tryon_solver.redesign.history import History

logger = logging.getLogger(__name__)

REPORT_SECONDS = 0.25  # between reports
IDLE_SECONDS = 0.05  # between looks at a source that had nothing to do
REMAKING_SHARE = 0.5  # of the time that a frame took, after which no further part of another garment is begun
FAILURES_IN_A_ROW = 30  # steps that may fail one after another before the session is given up
LATER = "shown once it is let go"
COARSER = "Choose another fabric, a coarser preset or a simpler pattern."


class Worker(OutfitWorker):
    """One session's simulation. ``clock`` is the server's steady clock [s]; ``beside`` makes what is worn next, and
    ``armoury`` has its effects compiled."""

    def __init__(
        self,
        connection: Connection,
        order: WorkOrder,
        build: BuildDrape,
        load_motion: LoadMotion,
        clock: Callable[[], float],
        beside: Beside,
        armoury: Armoury,
    ) -> None:
        self._connection = connection
        self._teller = Teller(connection)
        self._tell = self._teller.tell
        self._progress = NowAndThen(lambda stage, share: self._tell(PhaseChanged("dressing", stage, share)), clock)
        self._order = order
        self._build = build
        self._load_motion = load_motion
        self._clock = clock
        self._publisher = Publisher(order.keyframe_seconds, clock)
        self._meter = Meter()
        self._running = False
        self._motion = order.motion
        self._motion_file = order.motion_file
        self._fabric = order.drape.fabric
        self._dress_due = True
        self._drape: Drape | None = None
        self._source: PoseSource | None = None
        self._poses = PoseTaking(clock, self._trouble)
        self._bought = BuyAccuracy()
        self._pose: Stance | None = None
        self._move: Move | None = None  # the last one; None of a garment that has not moved since it was dressed
        self._histories = {name: history_of(kept) for name, kept in order.histories.items()}
        self._held = False
        self._beside = beside
        self._remaking = Remaking(beside, build)
        self._effects = EffectDesk(self._tell, armoury, clock, order.effects)
        self._outfitting = Outfitting(beside, build)
        self._waiting = WaitingChanges()
        self._remade_pattern: Mapping[str, Any] = {}  # the pattern of what is being made, or was last
        self._held_back = HeldBack()
        self._held_edits = HeldEdits(beside)
        self._held_last: ChangePattern | None = None  # to be shown again once the garment is there that is being made
        self._stuck = ""  # why the worn shape needs another mesh, where none can be put on
        self._worn: tuple[str, float | None, tuple[str, ...], float | None] = ("", None, (), None)
        self._simulated = 0.0
        self._cost = 0.0  # [s] of wall time that the last move took
        self._solved: tuple[StepFacts, Move, float] | None = None
        self._failures = 0
        self._last_look = clock()
        self._last_report = -math.inf

    def run(self) -> None:
        """Until the connection closes, which raises EOFError or a kind of OSError."""
        self._tell(PhaseChanged("preparing", "Starting the solver"))
        pause: float | None = 0.0
        while True:
            if self._dress_due:
                self._dress()
                pause = 0.0
            self._obey(pause)
            pause = self._work()
            self._teller.catch_up()
            pause = sooner(pause, self._go_on_making())
            worn = None if self._drape is None else self._drape.effects
            pause = sooner(pause, self._effects.go_on(worn, self._cost, self._making))

    # Commands -----------------------------------------------------------------------------------------------------

    def _obey(self, wait: float | None) -> None:
        """Take the commands that have come; wait up to this long [s] for some, None for ever."""
        commands: list[Command] = []
        busy = self._held_edits.under_way
        wait = self._held_back.wait(wait, self._clock(), busy)
        while self._connection.poll(wait):
            commands += self._connection.recv()
            wait = 0.0
        self._held_back.take(commands, self._take, self._clock, busy)
        worked_out = self._held_edits.outcome(self._drape)
        if worked_out is not None:
            self._change(*worked_out)

    def _take(self, command: Command) -> None:
        match command:
            case AllowFrame():
                self._publisher.allow(command)
            case UsePose():
                self._poses.take(command, self._source)
            case UseTrackedPose():
                self._poses.track(command, self._source)
            case Run():
                self._running = command.running
                self._last_look = self._clock()
            case FollowMotion():
                self._motion, self._motion_file = command.motion, command.file
                self._follow()
            case WearFabric():
                self._change_fabric(command.fabric)
            case BuyAccuracy():
                self._bought = command
            case ChangePattern():
                self._change(command)
            case ChangeEffect() | MeasureEffects():
                self._effects.take(command)
            case ChangeOutfit():
                self._change_outfit(command)

    def _follow(self) -> None:
        """Have the body follow the chosen motion, or a stream, from the pose in which it stands."""
        if self._drape is None or self._pose is None:
            return
        name, file = self._motion, self._motion_file
        play = None if name is None else lambda body: self._load_motion(name, body, file)
        try:
            self._source = chosen_source(self._drape, self._pose, self._source, play)
        except Exception as error:
            logger.exception("the motion %r can't be played", self._motion)
            self._source = StillSource(self._pose)
            why = error.problem.message if isinstance(error, ProblemError) else repr(error)
            self._trouble("unknown_motion", "$.motion", f"The motion can't be played: {why}.", "Choose another motion.")

    # The pattern --------------------------------------------------------------------------------------------------

    def _change(self, command: ChangePattern, worked_out: Outcome | None = None) -> None:
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
            if not (self._remaking.soon and self._waiting.long_since(now)):  # else changes in turn would all wait
                self._begin_remaking(asked, drape)
            self._waiting.add(command, asked, now)
            return
        self._remaking.give_up()
        self._waiting.add(command, asked, now)
        self._keep("value", asked.specification)

    def _show_held(self, command: ChangePattern, asked: Wanted, why: str) -> None:
        """Tell what the garment takes on, or why it does not."""
        if self._source is not None:
            self._source.settle_anew()
        self._held = True
        self._held_last = command if self._remaking.under_way else None
        notes = (*asked.notes, f"{LATER}: {why}") if why else asked.notes
        self._tell_design(asked.specification, asked.history, held=True, notes=notes, drawn=asked.drawn)

    def _keep(self, change: Literal["value", "topology"], worn: Mapping[str, Any]) -> None:
        """This pattern is worn: answer all that it was waited for, each once it was told; show what is held."""
        if self._source is not None:
            self._source.settle_anew()
        self._held = False
        for command, outcome in self._waiting.take_up_to(worn):
            if isinstance(outcome, EditRefused):
                self._tell(outcome)
                continue
            self._histories[self._edited] = outcome.history
            self._tell_design(outcome.specification, outcome.history, notes=outcome.notes)
            self._teller.owe(partial(outcome.made, command, change))  # whoever is answered has seen the pattern
        held, self._held_last = self._held_last, None
        if held is not None:
            self._change(held)
        if self._drape is not None:
            self._make_next(self._drape)

    def _tell_refused(self) -> None:
        for refused in self._waiting.take_refused():
            self._tell(refused)

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
            self._change(command)
            return
        self._dress_due = True
        with suppress(EditError):  # it is of that fabric already
            asked = wanted(self._history, command)
            self._histories[self._edited] = asked.history
            self._tell(asked.made(command, "topology"))

    def _make_next(self, drape: Drape) -> None:
        """Have the garment of the newest change made, if one waits."""
        newest = self._waiting.newest
        if newest is not None:
            self._begin_remaking(newest, drape)

    def _begin_remaking(self, asked: Wanted, drape: Drape) -> None:
        """Have a garment of this pattern made while this one is worn, in place of one that is being made."""
        give_back_freed()  # of the mesh before the one that is worn
        self._remade_pattern = asked.specification
        self._remaking.begin(drape, of_pattern(self._ordered(), asked.specification, asked.worn_by_way_of))

    def _remake(self, drape: Drape) -> None:
        """Go on making the garment that is to be worn next, for part of a frame's time; wear it once it is there."""
        end = self._clock() + REMAKING_SHARE * self._cost
        try:
            remade = self._remaking.go_on(drape, self._stance_now)
            while remade is None and self._remaking.has_parts and self._clock() < end:
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
        """Refuse the newest change, and go on with what was asked before it; the old garment is worn on."""
        newest = self._waiting.newest
        self._remaking.give_up()
        outdated = newest is not None and newest.specification is not self._remade_pattern
        if not outdated and not self._waiting.refuse_newest(error):
            self._stuck = why = drape.outgrown
            what = f"{why or 'The shape needs another mesh'}, and made anew, {error.message}."
            self._trouble("simulation_failed", "$", what, error.remedy)
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

    # Dressing -----------------------------------------------------------------------------------------------------

    def _dress(self) -> None:
        self._remaking.give_up()
        self._drop_outfit("the garment is dressed anew", "Try again once it is worn")
        self._dress_due = False
        self._drape = self._source = None
        order = as_edited(replace(self._order.drape, fabric=self._fabric), self._histories)
        try:
            self._put_on(self._build(order, self._progress))
        except (ProblemError, ProtocolError) as error:
            fault = in_parameters(error.problem) if isinstance(error, ProblemError) else error
            what = f"{fault.message.rstrip('.')}."
            self._fail(f"{fault.place}: {what}" if fault.place else what, fault.remedy)
        except Exception as error:
            logger.exception("dressing failed")
            self._fail(f"Dressing failed: {error!r}.", COARSER)
        else:
            if self._history is not None:
                self._tell_design(self._history.specification, self._history)
            newest = self._waiting.newest
            if newest is not None and self._drape is not None:
                self._begin_remaking(newest, self._drape)

    def _put_on(self, drape: Drape) -> None:
        """Go on with a newly dressed garment. Raises ProtocolError when it can't be told."""
        announcement = self._publisher.dress(drape)
        self._drape, self._pose = drape, drape.pose
        self._poses.begin(drape.outfit.body)
        self._simulated, self._failures, self._cost, self._move = 0.0, 0, 0.0, None
        self._follow()
        self._tell(announcement)
        self._tell_worn()
        self._last_look = self._clock()

    def say(self, what: str) -> None:
        """Tell what is being done, if the garment is still being dressed."""
        if self._drape is None:
            self._tell(PhaseChanged("preparing", what))

    def _fail(self, message: str, remedy: str) -> None:
        self._drape = self._source = None
        self._remaking.give_up()
        self._drop_outfit(f"the garment is not worn any more: {message}", remedy)
        self._waiting.refuse_all(EditError(f"the garment is not worn any more: {message}", "edit", remedy))
        self._tell_refused()
        self._trouble("simulation_failed", "$", message, remedy)
        self._tell(PhaseChanged("failed", f"{message} {remedy}"))

    # The loop -----------------------------------------------------------------------------------------------------

    def _work(self) -> float | None:
        """Simulate and publish what is due; how long to wait for commands after that [s], None for ever."""
        self._publish()
        if self._drape is None or self._source is None or not self._running:
            return None
        now = self._clock()
        elapsed = now - self._last_look
        interval = 1.0 / self._order.frames_per_second
        if elapsed < interval:
            return interval - elapsed
        self._last_look = now
        move = self._source.next(elapsed, self._cost)
        if move is None:
            return IDLE_SECONDS
        drape = self._drape
        if self._simulate(drape, move):
            self._meter.moved(now, elapsed, move.dt)
            self._publish()
        if drape.outgrown:
            self._outgrow(drape)
        return 0.0

    def _simulate(self, drape: Drape, move: Move) -> bool:
        """Advance the drape by a move; whether there is a new state to show."""
        begun = self._clock()
        try:
            drape.leap(move.leap)
            drape.buy(self._bought.accuracy, self._bought.deadline)
            facts = drape.advance(move.pose, self._simulated + move.dt, move.longest_step)
            sound = bool(np.isfinite(drape.cloth_positions()).all() and np.isfinite(drape.body_positions()).all())
        except Exception as error:
            logger.exception("a step failed")
            return self._count_failure(repr(error))
        if not sound:
            return self._count_failure("a position is not a number")
        self._failures = 0
        self._simulated += move.dt
        self._pose, self._move = move.pose, move
        self._publisher.show(move)
        self._cost = self._clock() - begun
        self._solved = (facts, move, 1e3 * self._cost)
        return True

    def _count_failure(self, what: str) -> bool:
        self._failures += 1
        if self._failures >= FAILURES_IN_A_ROW:
            self._fail(f"{self._failures} steps in a row failed, the last one because {what}.", COARSER)
        elif self._failures == 1:
            self._trouble(
                "simulation_failed", "$", f"A step failed: {what}.", "Nothing is to be done; it is tried again."
            )
        return False

    def _publish(self) -> None:
        try:
            frame = self._publisher.publish()
        except ProtocolError as error:
            self._trouble(error.code, error.place, error.message, error.remedy)
            return
        if frame is not None:
            self._teller.show(frame)
            self._meter.published(self._clock())
            self._report()

    # Telling ------------------------------------------------------------------------------------------------------

    def _report(self) -> None:
        """Say what the solver did for the frame that was just published, if the last report is a while ago."""
        now = self._clock()
        if self._solved is None or now - self._last_report < REPORT_SECONDS:
            return
        facts, move, solver_ms = self._solved
        self._solved, self._last_report = None, now
        report = report_of(facts, move, solver_ms, self._publisher.last_seq, self._meter, now)
        self._tell(Reported(report))

    def _trouble(self, code: str, place: str, message: str, remedy: str) -> None:
        self._tell(Troubled(code, place, message, remedy))

    def _tell_design(self, specification: Mapping[str, Any], history: History, **more: Any) -> None:
        fabric = named_fabric(specification) or self._order.drape.of_edited.fabric
        garment = self._edited
        self._teller.owe(lambda: Designed(design_of(specification, history, garment=garment, **more), fabric))
