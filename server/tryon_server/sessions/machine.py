"""The session: answers clients, orders the simulation, decides who gets what. Pure: time and bytes are arguments.

Methods take the present time ``now`` [s, any steady clock] and return the actions that the surroundings must carry out,
in this order. They never raise on account of what a client or the simulation sent.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from msgspec import structs

from tryon_protocol import (
    AckMessage,
    ByeMessage,
    ClientMessage,
    DesignMessage,
    EditMessage,
    GoodbyeMessage,
    HelloMessage,
    KeyframeRequestMessage,
    MeasureEffectsMessage,
    PauseMessage,
    PingMessage,
    PlayMessage,
    PongMessage,
    PoseMessage,
    ProtocolError,
    RedoMessage,
    RemoveEffectMessage,
    ServerMessage,
    SetAccuracyMessage,
    SetEffectMessage,
    SetFabricMessage,
    SetMotionMessage,
    SkeletonMessage,
    StatusMessage,
    UndoMessage,
    decode_client,
    encode,
    error_message,
    negotiate,
    request_of,
)
from tryon_server.sessions.actions import (
    FATAL_ERROR,
    GOING_AWAY,
    NO_HELLO,
    NORMAL,
    TOO_MANY_MESSAGES,
    Action,
    Close,
    End,
    Order,
    Send,
)
from tryon_server.sessions.commands import BuyAccuracy, FollowMotion, Run, WearFabric
from tryon_server.sessions.effect_talk import EffectTalk
from tryon_server.sessions.events import (
    ChangesTold,
    Designed,
    EditMade,
    EditRefused,
    EffectRefused,
    EffectsTold,
    Event,
    FabricWorn,
    FrameReady,
    Gone,
    PhaseChanged,
    PresetInForce,
    PresetRefused,
    Reported,
    TakenOn,
    TopologyReady,
    Troubled,
)
from tryon_server.sessions.flow import FrameFlow
from tryon_server.sessions.pattern_changes import PatternChanges
from tryon_server.sessions.pattern_talk import PatternTalk
from tryon_server.sessions.pose_stream import PoseStream
from tryon_server.sessions.rules import SUBJECT, Rules, check_motion, check_pose, unknown
from tryon_server.sessions.seats import Seats
from tryon_server.sessions.status import OWN_MOTION, status_of
from tryon_server.sessions.viewer import Viewer

HELLO_SECONDS = 10.0  # a connection that has not said hello by then is closed


class Session(PatternTalk):
    """One try-on session: a garment on a body, and the clients that watch it."""

    def __init__(
        self,
        session_id: str,
        rules: Rules,
        motion: str | None,
        fabric: str,
        new_token: Callable[[], str],
        now: float,
        uploaded: Sequence[str] = (),
    ) -> None:
        """``uploaded``: names of motions that are there besides those of the rules. A ``motion`` of `OWN_MOTION` is
        that of a body that moves by itself, and the only one that it has."""
        self.id, self.motion, self.fabric, self.playing = session_id, motion, fabric, True
        self._motions = (OWN_MOTION,) if motion == OWN_MOTION else (*rules.motions, *uploaded)
        self._rules = rules
        self._viewers: dict[int, Viewer] = {}
        self._seats = Seats(new_token)
        self._flow = FrameFlow(rules.credit)
        self._phase = PhaseChanged("preparing", "The simulation is starting")
        self._topology: TopologyReady | None = None
        self._design: DesignMessage | None = None
        self._changes = PatternChanges()
        self.effects = EffectTalk(
            rules.effects, self._changes.new_ticket, lambda effects: self._tell_all(effects, "effects")
        )
        self._bought, self._solved = BuyAccuracy(), PresetInForce()
        self._last_status: StatusMessage | None = None
        self._run = Run(False)
        self._on_the_way = {}
        self._last_pose_used = float("-inf")
        self._watched_until = now
        self._ended = False

    # From the surroundings ----------------------------------------------------------------------------------------

    def connect(self, client: int, now: float) -> list[Action]:
        """A connection was made; ``client`` is a number that was never used before in this session."""
        if self._ended or len(self._viewers) >= self._rules.max_viewers:
            full = f"The session has {self._rules.max_viewers} clients already."
            why = "The session has ended." if self._ended else full
            fault = ProtocolError("session_full", "$", why, "Open a new session.")
            return self._farewell(client, fault, FATAL_ERROR, now)
        poses = PoseStream(client, self._rules.smoothing)
        self._viewers[client] = Viewer(now, self._rules.messages_per_second, poses)
        return []

    def disconnect(self, client: int, now: float, left: bool = False) -> list[Action]:
        """A connection ended; unless the client closed it in good order (``left``) it may come back to its seat."""
        return [*self._finish(client, now), *self._leave(client, now, for_good=left)]

    def receive(self, client: int, data: bytes, now: float) -> list[Action]:
        """A binary message arrived."""
        viewer = self._viewers.get(client)
        if viewer is None:  # it is being closed
            return []
        if viewer.floods(now):
            fault = ProtocolError("rate_limited", "$", "Far too many messages arrive.", "Send a pose per frame.")
            return self._farewell(client, fault, TOO_MANY_MESSAGES, now)
        if not viewer.greeted:
            return self._greet(client, viewer, data, now)
        try:
            message = decode_client(data)
        except ProtocolError as error:
            number = request_of(data) if error.code == "invalid_field" else None
            return self._answer_fault(client, viewer, error, number, now)
        return [*self._line_up(client, viewer, message, now), *self._flow.orders()]

    def receive_text(self, client: int, now: float) -> list[Action]:
        """A text message arrived, which this protocol never uses."""
        viewer = self._viewers.get(client)
        if viewer is None:
            return []
        fault = ProtocolError("malformed_message", "$", "A text message arrived.", "Send binary messages only.")
        return self._answer_fault(client, viewer, fault, None, now)

    def simulated(self, event: Event, now: float) -> list[Action]:
        """The simulation told something."""
        if self._ended:
            return []
        match event:
            case FrameReady():
                return [*self._flow.frame(event), *self._flow.orders()]
            case TopologyReady():
                waited = [] if self.dressed else self._changes.dressed()
                self._topology = event
                self._flow.new_topology(event.topology_id)
                actions: list[Action] = []
                for client in self._greeted():
                    actions += self._send_topology(client)
                return [*actions, *self._flow.orders(), *waited]
            case PhaseChanged():
                self._phase = event
                return self._status_if_changed(now)
            case Reported():
                return self._tell_all(event.report, "report")
            case Troubled():
                fault = ProtocolError(event.code, event.place, event.message, event.remedy)
                return self._tell_all(error_message(fault))
            case Designed():
                self._design, self.fabric = event.design, self.fabric if event.design.held else event.fabric
                return [*self._tell_all(event.design, "design"), *self._status_if_changed(now)]
            case FabricWorn():
                self.fabric = event.fabric
                return self._status_if_changed(now)
            case EditMade():
                return self._made(event)
            case TakenOn():
                self._on_the_way.pop(event.garment, None)
                return []
            case EditRefused():
                fault = ProtocolError("edit_refused", event.place, event.message, event.remedy)
                return self._refuse_edit(event.ticket, fault, now)
            case ChangesTold():
                self._changes.worked_at(event.changes)
                return self._status_if_changed(now)
            case EffectsTold():
                return self.effects.told(event)
            case EffectRefused():
                return self.effects.refused(event)
            case PresetInForce():
                self._solved = event
                return self._status_if_changed(now)
            case PresetRefused():
                return self._preset_refused(event, now)
            case Gone():
                return self._simulation_gone(event, now)
            case _:  # of the wardrobe (wardrobe.py)
                return []

    def buy(self, wanted: BuyAccuracy, now: float) -> list[Action]:
        """Frames are to be solved so from now on. Raises ProtocolError where there is no such preset."""
        if wanted.preset is not None and wanted.preset not in self._rules.presets:
            raise unknown("invalid_field", "preset", wanted.preset, self._rules.presets)
        self._bought = wanted
        return [Order(wanted), *self._status_if_changed(now)]

    def tick(self, now: float) -> list[Action]:
        """Time went by; to be called a few times a second."""
        if self._ended:
            return []
        actions: list[Action] = []
        for client, viewer in list(self._viewers.items()):
            if not viewer.greeted and now - viewer.joined > HELLO_SECONDS:
                what = f"No hello arrived within {HELLO_SECONDS:g} s."
                fault = ProtocolError("unexpected_message", "$", what, "Send hello first.")
                actions += self._farewell(client, fault, NO_HELLO, now)
                continue
            actions += self._go_on(client, viewer, now)
        self._seats.expire(now)
        if self._viewers:
            self._watched_until = now
        elif self.unwatched_seconds(now) > self._rules.grace_seconds:
            return [*actions, *self.end("Nobody was watching any more", None)]
        return [*actions, *self._status_if_changed(now), *self._flow.orders()]

    def asked_for(self, now: float) -> None:
        """Somebody without a connection asked how the session stands: it is waited for, and does not end for now."""
        self._watched_until = now

    def offer_motion(self, name: str) -> None:
        """A motion has been uploaded. Clients that are there already can ask for it, too."""
        if OWN_MOTION not in self._motions and name not in self._motions:
            self._motions = (*self._motions, name)

    def withdraw_motion(self, name: str) -> None:
        """An uploaded motion is there no longer."""
        self._motions = tuple(motion for motion in self._motions if motion != name)

    def end(self, reason: str, retry_after: float | None) -> list[Action]:
        """End the session. ``retry_after`` [s] tells clients when to come back, None that they should not."""
        if self._ended:
            return []
        code = NORMAL if retry_after is None else GOING_AWAY
        actions = self._tell_all(GoodbyeMessage(reason=reason, retry_after=retry_after))
        actions += [Close(client, code, reason) for client in self._viewers]
        self._viewers.clear()
        self._ended = True
        return [*actions, End(reason)]

    # State --------------------------------------------------------------------------------------------------------

    @property
    def ended(self) -> bool:
        """Whether the session is over."""
        return self._ended

    @property
    def dressed(self) -> bool:
        """Is anything worn, or was?"""
        return self._topology is not None

    @property
    def viewer_count(self) -> int:
        """How many clients are connected."""
        return len(self._viewers)

    def unwatched_seconds(self, now: float) -> float:
        """For how long no client has been connected [s]; 0 while one is."""
        return 0.0 if self._viewers else now - self._watched_until

    def status(self, now: float) -> StatusMessage:
        """The session's state in one message."""
        pose_age = now - self._last_pose_used
        asked = self.motion, self.fabric, self.playing, self._ended
        status = status_of(self._phase, *asked, pose_age, self._bought, self._solved)
        return structs.replace(status, changes=() if self._ended else self._changes.statuses)

    # Messages of clients ------------------------------------------------------------------------------------------

    def _greet(self, client: int, viewer: Viewer, data: bytes, now: float) -> list[Action]:
        try:
            message = decode_client(data)
            if not isinstance(message, HelloMessage):
                raise ProtocolError(
                    "unexpected_message", "$.type", "The first message was not hello.", "Send hello first."
                )
            version = negotiate(message)
        except ProtocolError as error:
            return self._farewell(client, error, FATAL_ERROR, now)
        before = self._seats.client_of(message.resume)
        actions = [] if before is None else self._finish(before, now)  # while it still has the seat, and its poses
        token, replaced = self._seats.sit(client, message.resume, now)
        if replaced is not None:
            actions.append(Close(replaced, NORMAL, "Resumed by a newer connection"))
            self._drop(replaced)
        viewer.greeted = True
        viewer.takes_zstd = "zstd" in message.codecs
        self._flow.open(client, viewer.takes_zstd)
        topology_id = self._topology.topology_id if self._topology else 0
        welcome = self._rules.welcome(version, self.id, now, topology_id, self._motions, token)
        actions += [Send(client, encode(welcome)), Send(client, encode(self.status(now)), "status")]
        if self._topology:
            actions += self._send_topology(client)
        if self._design:
            actions.append(Send(client, encode(self._design), "design"))
        if self.effects.newest:
            actions.append(Send(client, encode(self.effects.newest), "effects"))
        return [*actions, *self._steer(), *self._flow.orders()]

    def _obey(self, client: int, viewer: Viewer, message: ClientMessage, now: float) -> list[Action]:
        match message:
            case PoseMessage():
                return self._pose(client, viewer, message, now)
            case SkeletonMessage():
                viewer.poses.announce(message, (SUBJECT,))
                return []
            case AckMessage():
                self._flow.acknowledge(client, message.seq)
                return []
            case KeyframeRequestMessage():
                self._flow.lost_chain(client)
                return []
            case PingMessage():
                return [Send(client, encode(PongMessage(t=message.t, clock=now)))]
            case PlayMessage() | PauseMessage():
                self.playing = isinstance(message, PlayMessage)
                return [*self._steer(), *self._status_if_changed(now)]
            case SetMotionMessage():
                return self._set_motion(client, viewer, message, now)
            case SetFabricMessage():
                return self._set_fabric(client, viewer, message, now)
            case SetAccuracyMessage():
                deadline = None if message.deadline_ms is None else 1e-3 * message.deadline_ms
                return self.buy(BuyAccuracy(message.accuracy, deadline, message.preset), now)
            case EditMessage() | UndoMessage() | RedoMessage():
                return self._edit(client, viewer, message, now)
            case SetEffectMessage() | RemoveEffectMessage() | MeasureEffectsMessage():
                return self.effects.obey(client, message)
            case ByeMessage():
                left = [*self._finish(client, now), *self._leave(client, now, for_good=True)]
                return [*left, Close(client, NORMAL, "Goodbye")]
            case HelloMessage():
                once = "Send hello once per connection."
                raise ProtocolError("unexpected_message", "$.type", "hello came twice.", once)
            case _:  # of the wardrobe (wardrobe.py)
                return []

    def _pose(self, client: int, viewer: Viewer, message: PoseMessage, now: float) -> list[Action]:
        check_pose(self._topology is not None, self.motion)
        assert self._topology is not None
        pose = viewer.poses.check(message, self._topology.joint_names, (SUBJECT,), self._topology.followable, now)
        if not self._seats.may_pose(client, now):
            raise ProtocolError(
                "pose_source_taken",
                "$.subject",
                "Another client's poses move the body.",
                "Wait until that client has left the session.",
            )
        self._last_pose_used = now
        return [Order(viewer.poses.take(message, pose, now)), *self._status_if_changed(now)]

    def _set_motion(self, client: int, viewer: Viewer, message: SetMotionMessage, now: float) -> list[Action]:
        try:
            check_motion(message.motion, self._motions)
        except ProtocolError as fault:
            return self._answer_fault(client, viewer, fault, message.request, now)
        self.motion = message.motion
        self._seats.release_poses()
        self._last_pose_used = float("-inf")
        return [Order(FollowMotion(message.motion)), *self._status_if_changed(now)]

    def _set_fabric(self, client: int, viewer: Viewer, message: SetFabricMessage, now: float) -> list[Action]:
        if message.fabric not in self._rules.fabrics:
            fault = unknown("unknown_fabric", "fabric", message.fabric, self._rules.fabrics)
            return self._answer_fault(client, viewer, fault, message.request, now)
        worn = self._phase.phase != "failed"
        if worn and message.fabric == self.fabric and not self._changes.under_way:
            return []
        if worn and self._design is not None:
            edit = {"kind": "change_fabric", "fabric": message.fabric}
            return self._edit(client, viewer, EditMessage(edit=edit, request=message.request), now)
        self.fabric = message.fabric
        return [Order(WearFabric(message.fabric)), *self._status_if_changed(now)]

    # Answers ------------------------------------------------------------------------------------------------------

    def _farewell(self, client: int, fault: ProtocolError, code: int, now: float) -> list[Action]:
        """A fatal error and the end of the connection; what it sent before counts nevertheless."""
        answer = Send(client, encode(error_message(fault, fatal=True)))
        rest, closed = self._finish(client, now), Close(client, code, fault.message)
        return [*rest, answer, closed, *self._leave(client, now, for_good=True)]

    def _send_topology(self, client: int) -> list[Action]:
        assert self._topology is not None
        self._flow.topology_sent(client)
        viewer = self._viewers[client]
        return [Send(client, self._topology.payload if viewer.takes_zstd else self._topology.plain_payload)]

    def _status_if_changed(self, now: float) -> list[Action]:
        status = self.status(now)
        if status == self._last_status:
            return []
        self._last_status = status
        return self._tell_all(status, "status")

    def _tell_all(self, message: ServerMessage, replaces: str = "") -> list[Action]:
        payload = encode(message)
        return [Send(client, payload, replaces) for client in self._greeted()]

    def _greeted(self) -> Sequence[int]:
        return [client for client, viewer in self._viewers.items() if viewer.greeted]

    # Simulation ---------------------------------------------------------------------------------------------------

    def _steer(self) -> list[Action]:
        """Run only while somebody watches and nobody holds; take on what is edited while nobody holds."""
        run = Run(self.playing and bool(self._greeted()), settle=self.playing)
        if run == self._run:
            return []
        self._run = run
        return [Order(run)]

    def _preset_refused(self, event: PresetRefused, now: float) -> list[Action]:
        if self._bought.preset == event.asked:  # else another one was asked for meanwhile
            self._bought = replace(self._bought, preset=event.kept)
        fault = ProtocolError("simulation_failed", "$.preset", event.message, event.remedy)
        return [*self._tell_all(error_message(fault)), *self._status_if_changed(now)]

    def _simulation_gone(self, event: Gone, now: float) -> list[Action]:
        fault = ProtocolError(
            "simulation_failed",
            "$",
            f"The simulation of this session has ended: {event.detail}.",
            "Open a new session; if it ends again, choose a coarser preset or a simpler pattern.",
        )
        self._phase = PhaseChanged("failed", fault.message)
        told = [*self._tell_all(error_message(fault, fatal=True)), *self._status_if_changed(now)]
        return [*told, *self.end(fault.message, None)]

    # Leaving ------------------------------------------------------------------------------------------------------

    def _leave(self, client: int, now: float, for_good: bool) -> list[Action]:
        if client not in self._viewers:
            return []
        self._drop(client)
        self._seats.leave(client, now, for_good)
        self._watched_until = now
        if self._ended:
            return []
        let_go = self._changes.left(client)
        return [*([] if let_go is None else [Order(let_go)]), *self._steer(), *self._flow.orders()]

    def _drop(self, client: int) -> None:
        del self._viewers[client]
        self._flow.close(client)
