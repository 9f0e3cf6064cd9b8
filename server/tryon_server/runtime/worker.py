"""The process of one session's simulation: dress, then move the body, simulate and publish until the server lets go.

Nothing that a client can send ends this process: a garment that can't be dressed, a step that fails and a motion that
can't be read are reported and the loop goes on, to wait for a better order if need be.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from tryon_protocol import MOST_PRICES, FramePrice, ProtocolError
from tryon_server.problems import ProblemError
from tryon_server.runtime.arming import Armoury
from tryon_server.runtime.beside import Beside
from tryon_server.runtime.caught import CaughtWatch
from tryon_server.runtime.design import design_of
from tryon_server.runtime.drape import BuildDrape, Drape, LoadMotion, Stance, StepFacts
from tryon_server.runtime.effect_desk import EffectDesk
from tryon_server.runtime.held_edits import HeldEdits
from tryon_server.runtime.meter import Meter
from tryon_server.runtime.order import WorkOrder
from tryon_server.runtime.outfitting import Outfitting, as_edited
from tryon_server.runtime.pattern_worker import PatternWorker
from tryon_server.runtime.pose_taking import PoseTaking
from tryon_server.runtime.preset_desk import PresetDesk
from tryon_server.runtime.publishing import Publisher
from tryon_server.runtime.redesign import history_of
from tryon_server.runtime.remaking import Remaking
from tryon_server.runtime.reporting import price_of, report_of
from tryon_server.runtime.source_choice import chosen_source
from tryon_server.runtime.sources import Move, PoseSource, StillSource
from tryon_server.runtime.telling import NowAndThen, Teller
from tryon_server.runtime.waiting import HeldBack, WaitingChanges, sooner
from tryon_server.sessions.commands import (
    AllowFrame,
    BuyAccuracy,
    ChangeEffect,
    ChangeOutfit,
    ChangePattern,
    Command,
    FollowMotion,
    GiveUp,
    MeasureEffects,
    Run,
    UsePose,
    UseTrackedPose,
    WearFabric,
)
from tryon_server.sessions.events import (
    Designed,
    PhaseChanged,
    Reported,
    Troubled,
)
from tryon_server.wording import in_parameters
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.fabrics import named_fabric
from tryon_solver.redesign.history import History

logger = logging.getLogger(__name__)

REPORT_SECONDS = 0.25  # between reports
IDLE_SECONDS = 0.05  # between looks at a source that had nothing to do
FAILURES_IN_A_ROW = 30  # steps that may fail one after another before the session is given up
COARSER = "Choose another fabric, a coarser preset or a simpler pattern."


class Worker(PatternWorker):
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
        self._move: Move | None = None  # the last one
        self._told_at: float | None = None  # the time of the newest frame [s], on the poses' clock
        self._histories = {name: history_of(kept) for name, kept in order.histories.items()}
        self._held, self._kept_shown = False, True
        self._settles, self._standing, self._on_the_way = True, None, set()
        self._beside = beside
        self._remaking = Remaking(beside, build)
        self._effects = EffectDesk(self._tell, armoury, clock, order.effects)
        self._presets = PresetDesk(self._tell, clock, self._solved_otherwise)
        self._outfitting = Outfitting(beside, build)
        self._caught = CaughtWatch()
        self._waiting, self._later = WaitingChanges(), []
        self._told = (), 0.0
        self._remade_pattern: Mapping[str, Any] = {}  # the pattern of what is being made, or was last
        self._held_back = HeldBack()
        self._held_edits = HeldEdits(beside)
        self._held_last: ChangePattern | None = None  # to be shown again once the garment is there that is being made
        self._drawn_since: float | None = None  # s, when what is worn set out to where the new garment has it
        self._stuck = ""  # why the worn shape needs another mesh, where none can be put on
        self._worn: tuple[str, float | None, tuple[str, ...], float | None] = ("", None, (), None)
        self._simulated = 0.0
        self._cost = 0.0  # [s] of wall time that the last move took
        self._solved: tuple[StepFacts, Move, float] | None = None
        self._failures = 0
        self._last_look = clock()
        self._last_report = -math.inf
        self._prices: deque[FramePrice] = deque(maxlen=MOST_PRICES)  # of frames solved since then

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
            self._change_later()
            self._tell_changes()
            if not self._outfitting.bared:  # what is asked of effects is of all that is worn again in a moment
                pause = sooner(pause, self._go_on_with_effects())

    def _go_on_with_effects(self) -> float | None:
        worn = None if self._drape is None else self._drape.effects
        pause = self._effects.go_on(worn, self._cost, self._making or self._presets.building)
        if worn is not None and self._source is not None and self._effects.stirs(worn):
            self._source.settle_anew()
        return sooner(pause, self._presets.go_on(self._drape, self._cost, self._making or self._effects.binding))

    def _solved_otherwise(self) -> None:
        """What is worn is solved by another preset from now on."""
        self._effects.forget_times()
        if self._source is not None:
            self._source.settle_anew()

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
            self._change_now(*worked_out)

    def _take(self, command: Command) -> None:
        match command:
            case AllowFrame():
                self._publisher.allow(command)
            case UsePose():
                self._poses.take(command, self._source)
            case UseTrackedPose():
                self._poses.track(command, self._source)
            case Run():
                self._running, self._settles = command.running, command.settle
                self._standing = None
                self._settle()
                self._last_look = self._clock()
            case FollowMotion():
                self._motion, self._motion_file = command.motion, command.file
                self._follow()
            case WearFabric():
                self._change_fabric(command.fabric)
            case BuyAccuracy():
                self._bought = command
                self._presets.ask(command.preset)
            case ChangePattern():
                self._change(command)
            case ChangeEffect() | MeasureEffects():
                self._effects.take(command)
            case ChangeOutfit():
                self._change_outfit(command)
            case GiveUp(ticket):
                self._give_up_outfit(ticket)
                self._give_up_change(ticket)

    def _follow(self) -> None:
        """Have the body follow the chosen motion, or a stream, from the pose in which it stands."""
        if self._drape is None or self._pose is None:
            return
        name, file = self._motion, self._motion_file
        play = None if name is None else lambda body: self._load_motion(name, body, file)
        try:
            self._source = chosen_source(self._drape, self._pose, self._source, play, self._told_at)
        except Exception as error:
            logger.exception("the motion %r can't be played", self._motion)
            self._source = StillSource(self._pose, since=self._told_at)
            why = error.problem.message if isinstance(error, ProblemError) else repr(error)
            self._trouble("unknown_motion", "$.motion", f"The motion can't be played: {why}.", "Choose another motion.")

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
        self._drape, self._pose = drape, drape.pose
        self._presets.dressed(drape)
        self._poses.begin(drape.outfit.body)
        self._standing = None
        self._tell_taken_on()
        self._simulated, self._failures, self._cost = 0.0, 0, 0.0
        self._follow()
        assert self._source is not None
        self._move = Move(drape.pose, 0.0, self._source.t, 0)  # it stands where the way to the first pose begins
        self._tell(self._publisher.dress(drape, self._move))
        self._told_at = self._move.t
        self._go_on_with_effects()  # whoever is told that it is worn may ask for them at once
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
        source = self._source if self._running else self._standing
        if self._drape is None or source is None:
            return None
        now = self._clock()
        elapsed = now - self._last_look
        interval = 1.0 / self._order.frames_per_second
        if elapsed < interval:
            return interval - elapsed
        self._last_look = now
        move = source.next(elapsed, self._cost)
        if move is None:
            self._standing = None
            return IDLE_SECONDS
        drape = self._drape
        if self._simulate(drape, move):
            self._meter.moved(now, elapsed, move.dt)
            self._publish()
            self._tell_taken_on()
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
        self._pose, self._move, self._told_at = move.pose, move, move.t
        self._publisher.show(move)
        self._cost = self._clock() - begun
        solver_ms = 1e3 * self._cost
        self._solved = (facts, move, solver_ms)
        if not facts.asleep:
            self._prices.append(price_of(facts, solver_ms))
        self._see_caught(facts, move.dt)
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
        report = report_of(facts, move, solver_ms, self._publisher.last_seq, self._meter, now, self._prices)
        self._prices.clear()
        self._tell(Reported(report))

    def _trouble(self, code: str, place: str, message: str, remedy: str) -> None:
        self._tell(Troubled(code, place, message, remedy))

    def _tell_design(self, specification: Mapping[str, Any], history: History, **more: Any) -> None:
        fabric = named_fabric(specification) or self._order.drape.of_edited.fabric
        garment = self._edited
        self._teller.owe(lambda: Designed(design_of(specification, history, garment=garment, **more), fabric))
