"""All live sessions of a server: opened, found, ended."""

from __future__ import annotations

import asyncio
import json
import logging
import secrets
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from tryon_protocol import OutfitWish, ProtocolError
from tryon_server.garments.service import GarmentService
from tryon_server.persistence import (
    FIT,
    BodyRecord,
    EditRecord,
    EditStore,
    GarmentRecord,
    KeptFiles,
    MotionRecord,
    OutfitRecord,
    OutfitStore,
    SessionRecord,
    SessionStore,
    Size,
    Waiting,
)
from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.interface import AUTOMATIC, Catalogue, Placement
from tryon_server.runtime.order import DrapeOrder, MeshReading, WorkOrder
from tryon_server.sessions import OWN_MOTION, Rules, WardrobeSession
from tryon_server.sessions.commands import BuyAccuracy, Command, FollowMotion
from tryon_server.sessions.events import EditMade
from tryon_server.settings import Settings
from tryon_server.streaming.histories import BEGINNING, WaitingChanges, carry_on
from tryon_server.streaming.live_session import LiveSession
from tryon_server.streaming.outfit_change import OutfitChange
from tryon_server.streaming.uploaded_motions import all_playable, playable
from tryon_server.streaming.wardrobes import Wardrobes, as_protocol_errors, history_key
from tryon_server.uploads.service import BodyUploads, MotionUploads

logger = logging.getLogger(__name__)

RESTART_RETRY_SECONDS = (
    2.0  # after a restart of the server clients come back no sooner than this, spread over twice that
)
UNWATCHED_SECONDS = 10.0  # a session that nobody has watched for this long may make room for a new one


@dataclass(frozen=True)
class Opening:
    """What somebody asks a new session to be; None leaves the choice to the server, a motion of None means a stream.

    ``size`` is that of a sewing pattern over its own, or ``fit`` for the one that fits; a ``body`` that was uploaded
    moves by itself. ``continues``: with the pattern of that session, as it was edited.
    """

    garment: str
    motion: str | None
    fabric: str | None
    preset: str | None
    size: Size = 1.0
    body: str | None = None
    continues: str | None = None


class LiveSessions:
    """The sessions that live now. To be used from one event loop."""

    def __init__(
        self,
        settings: Settings,
        catalogue: Catalogue,
        placement: Placement,
        garments: GarmentService,
        motions: MotionUploads,
        bodies: BodyUploads,
        files: KeptFiles,
        store: SessionStore,
        edits: EditStore,
        outfits: OutfitStore,
        server: str,
    ) -> None:
        self._settings = settings
        self._catalogue = catalogue
        self._placement = placement
        self._garments = garments
        self._bodies = bodies
        self._files = files
        self._store = store
        self._edits = edits
        self.waiting = WaitingChanges(edits)
        self.wardrobes = Wardrobes(garments, files, edits, outfits)
        self._motions = all_playable(motions)
        self._live: dict[str, LiveSession] = {}
        self._notes: dict[str, asyncio.Task[None]] = {}
        self._closing = False
        self._rules = Rules(
            epoch=secrets.token_hex(8),
            server=server,
            motions=tuple(motion.name for motion in catalogue.motions),
            fabrics=tuple(fabric.name for fabric in catalogue.fabrics),
            effects=tuple(str(word["name"]) for word in catalogue.effects),
            presets=tuple(preset for preset in catalogue.presets if preset != AUTOMATIC),
            max_viewers=settings.max_viewers,
            messages_per_second=settings.messages_per_second,
            grace_seconds=settings.session_grace_seconds,
            smoothing=settings.smoothing(),
        )

    async def open(self, opening: Opening) -> LiveSession:
        """Open a session and start its simulation.

        Raises:
            ProblemError: 404 unknown garment or body, 422 unknown motion, fabric or preset, or one that does not go
                with the rest, 503 no room.
        """
        garment = await asyncio.to_thread(self._garments.get, opening.garment)
        body = None if opening.body is None else await asyncio.to_thread(self._bodies.get, opening.body)
        motion = opening.motion
        if body is not None:
            motion = _own(motion)
        elif motion is not None:
            _one_of("motion", motion, (*self._rules.motions, *self._motions))
        if opening.size != 1.0 and garment.notes:
            message = f"{garment.id!r} is a mesh, which is worn in the size it comes in"
            raise problem_error("size.of_mesh", message, "Leave the size out", place="size", status=422)
        fabric = opening.fabric or await self._own_fabric(opening.continues, garment)
        _one_of("fabric", fabric, self._rules.fabrics)
        preset = opening.preset or self._settings.preset
        _one_of("preset", preset, self._catalogue.presets)
        record = SessionRecord(
            id=secrets.token_urlsafe(12),
            garment=garment.id,
            motion=motion,
            fabric=fabric,
            preset=preset,
            created=time.time(),
            size=opening.size,
            body=opening.body,
        )
        for kept in (garment, body, self._motions.get(motion or "")):
            if kept is not None:
                self._files.hold(record.id, kept.digest)
        try:
            order = self._work_order(record, garment, body)
            await asyncio.to_thread(self._store.add, record)
            if opening.continues is not None:
                order = await self._go_on_from(opening.continues, record, order)
            worn = await asyncio.to_thread(self.wardrobes.begin, record, opening.continues)
            drape = self.wardrobes.ordered(record.id, worn, order.drape)
            histories = await asyncio.to_thread(self.wardrobes.histories, record.id, worn)
            order = replace(order, drape=drape, histories=histories)
            self._make_room()
        except ProblemError as error:
            await self._note_end(record.id, error.problem.message)
            raise
        waiting = await asyncio.to_thread(self.waiting.of, opening.continues)
        live = self._start(record, order)
        live.begin_with_changes(waiting)
        live.machine.begin_with(self.wardrobes.items(worn), worn.edited)
        with suppress(ProtocolError):  # they are kept where they were
            await live.stored()
        return live

    def _start(self, record: SessionRecord, order: WorkOrder) -> LiveSession:
        new_token = partial(secrets.token_urlsafe, 24)
        now = time.monotonic()
        motions = tuple(self._motions)
        machine = WardrobeSession(record.id, self._rules, record.motion, record.fabric, new_token, now, motions)
        live = LiveSession(
            machine,
            lambda on_event: self._placement.place(order, on_event),
            self._ended,
            partial(self._complete, record.id),
            partial(self._keep, record.id),
            partial(self._store.keep_effects, record.id),
            partial(self.waiting.keep, record.id),
            partial(self._wear, record.id),
        )
        self._live[record.id] = live
        return live

    def warm(self) -> None:
        """Have the first session not wait for what can be done beforehand, such as compiling kernels."""
        garments = self._garments.all()
        if garments and self._catalogue.fabrics:
            record = SessionRecord(
                id="",
                garment=garments[0].id,
                motion=None,
                fabric=self._rules.fabrics[0],
                preset=self._settings.preset,
                created=time.time(),
            )
            self._placement.warm(self._work_order(record, garments[0]))

    def offer_motion(self, motion: MotionRecord, path: Path) -> None:
        """A motion has been uploaded: all sessions can play it."""
        self._motions[motion.id] = playable(motion, path)
        for live in self.all():
            live.machine.offer_motion(motion.id)

    def withdraw_motion(self, motion_id: str) -> None:
        """An uploaded motion is to be removed: none can choose it any more; a session that plays it goes on."""
        self._motions.pop(motion_id, None)
        for live in self.all():
            live.machine.withdraw_motion(motion_id)

    def _complete(self, session_id: str, command: Command) -> Command:
        """The command with where an uploaded motion's file is, which the session keeps to its end."""
        if isinstance(command, FollowMotion) and command.motion in self._motions:
            motion = self._motions[command.motion]
            self._files.hold(session_id, motion.digest)
            return replace(command, file=motion.file)
        return command

    def _keep(self, session_id: str, made: EditMade, number: int | None) -> None:
        """Store a change of the pattern of the garment of this number that a session wore then; blocking."""
        if number is None:
            kept_under = self.wardrobes.history_of(session_id, made.garment)
        else:  # newer than what is kept
            kept_under = history_key(session_id, number)
        if made.edit is None or made.specification is None:
            self._edits.mark(kept_under, made.id, made.step == "undo", Waiting(session_id, made.ticket))
            return
        self._edits.add(
            EditRecord(
                session=kept_under,
                id=made.id,
                edit=made.edit,
                mirror=made.mirror,
                specification=made.specification,
                made=time.time(),
            ),
            Waiting(session_id, made.ticket),
        )

    async def edits(self, session_id: str, garment: str = "") -> list[EditRecord]:
        """The edits of the pattern of a session's garment of this name, the edited one for "", live or ended, oldest
        first. Raises ProblemError 404."""
        await self.record(session_id)
        kept_under = await asyncio.to_thread(self.wardrobes.history_of, session_id, garment)
        return [edit for edit in await asyncio.to_thread(self._edits.all, kept_under) if edit.id != BEGINNING]

    async def specification(self, session_id: str, garment: str = "") -> Mapping[str, Any]:
        """The pattern of a session's garment as it stands after its edits, plain JSON; of this name, or the edited one.

        Raises:
            ProblemError: 404 no such session or garment, 409 its garment is a mesh, 410 the garment's file is gone.
        """
        record = await self.record(session_id)
        worn = await asyncio.to_thread(self.wardrobes.one, record, garment)
        edited = await asyncio.to_thread(self.wardrobes.as_edited, session_id, worn)
        if edited is not None:
            return edited
        return await self._unedited(worn.garment, worn.fabric)

    async def _first_specification(self, session_id: str) -> Mapping[str, Any]:
        """The same of the garment that the session was opened with."""
        record = await self.record(session_id)
        made = [edit for edit in await asyncio.to_thread(self._edits.all, session_id) if not edit.undone]
        return made[-1].specification if made else await self._unedited(record.garment, record.fabric)

    async def _unedited(self, garment: str, fabric: str) -> Mapping[str, Any]:
        uploaded = await asyncio.to_thread(self._as_uploaded, garment)
        return {**uploaded, "properties": {**uploaded["properties"], "fabric": fabric}}

    async def _wear(self, session_id: str, client: int, wish: OutfitWish) -> None:
        """Have a live session wear what a client wants. Raises ProtocolError."""
        with as_protocol_errors():
            await OutfitChange(self, self._live[session_id], wish).made(client)

    async def outfit_change(self, session_id: str, wish: OutfitWish) -> OutfitChange:
        """What has a live session wear another outfit, made of what it wears in its turn: kept from now on.

        Raises ProblemError: 404 no such session, 409 it has ended.
        """
        live = await self.living(session_id)
        change = OutfitChange(self, live, wish)
        await change.keep()
        return change

    async def wishes_of(self, session_id: str | None) -> list[OutfitWish]:
        """What a session was asked to wear and has not worn, nor refused: for that which continues it."""
        return await asyncio.to_thread(self.waiting.wishes, session_id)

    async def outfit(self, record: SessionRecord) -> OutfitRecord:
        """What a session wears, with the fabrics that edits have chosen."""
        outfit, live = await asyncio.to_thread(self.wardrobes.of, record), self._live.get(record.id)
        return outfit if live is None else self.wardrobes.as_worn(outfit, live.machine.items, live.machine.edited)

    async def fabric_for(self, garment_id: str, asked: str | None) -> str:
        """What a garment is to be made of: as asked for, else its pattern's own, else the first fabric.

        Raises ProblemError: 404 no such garment, 422 no such fabric.
        """
        garment = await asyncio.to_thread(self._garments.get, garment_id)
        fabric = asked or await self._own_fabric(None, garment)
        _one_of("fabric", fabric, self._rules.fabrics)
        return fabric

    async def _own_fabric(self, continues: str | None, garment: GarmentRecord) -> str:
        """What the pattern that a session is to begin with says it is made of; the first fabric where it says nothing.
        Raises ProblemError as `specification` does."""
        if garment.notes:  # a mesh
            return self._rules.fabrics[0] if continues is None else (await self.record(continues)).fabric
        if continues is not None:
            specification = await self._first_specification(continues)
        else:
            specification = await asyncio.to_thread(self._as_uploaded, garment.id)
        return specification.get("properties", {}).get("fabric") or self._rules.fabrics[0]

    def _as_uploaded(self, garment_id: str) -> Mapping[str, Any]:
        garment = self._garments.get(garment_id)
        if garment.notes:
            message, remedy = "the garment is a mesh, it has no pattern", "Ask for that of a sewing pattern"
            raise problem_error("pattern.of_mesh", message, remedy, place="session", status=409)
        pattern: Mapping[str, Any] = json.loads(self._garments.pattern_path(garment).read_text("utf-8-sig"))
        return pattern

    async def _go_on_from(self, session_id: str, record: SessionRecord, order: WorkOrder) -> WorkOrder:
        """The order with the effects of an earlier session, and its pattern, whose edits are kept as this one's, too.

        Raises:
            ProblemError: 404 no such session, 422 it has another garment.
        """
        before = await self.record(session_id)
        if before.garment != record.garment:
            message = f"session {session_id!r} wore the garment {before.garment!r}"
            raise problem_error("continues.other", message, "Choose that garment", place="continues", status=422)
        effects = await asyncio.to_thread(self._store.effects, session_id)
        garment = await asyncio.to_thread(self._garments.get, record.garment)
        if garment.notes:  # a mesh
            return replace(order, effects=effects)
        specification = await self._first_specification(session_id)
        unedited = await self._unedited(before.garment, before.fabric)
        await asyncio.to_thread(carry_on, self._edits, session_id, record.id, unedited)
        return replace(order, drape=replace(order.drape, specification=specification), effects=effects)

    async def effects(self, session_id: str) -> Mapping[str, Any]:
        """What is asked of a session's effects, live or ended, plain JSON. Raises ProblemError 404."""
        await self.record(session_id)
        return await asyncio.to_thread(self._store.effects, session_id)

    def get(self, session_id: str) -> LiveSession | None:
        """The live session with this id, or None."""
        return self._live.get(session_id)

    async def living(self, session_id: str) -> LiveSession:
        """The session, to be changed by who then waits for it. Raises ProblemError: 404 no such session, 409 it has
        ended."""
        await self.record(session_id)
        live = self._live.get(session_id)
        if live is None:
            remedy = "Open a session that continues it: POST /api/sessions with its id as `continues`"
            raise problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
        live.machine.asked_for(live.now)
        return live

    def asked_for(self, session_id: str) -> None:
        """Somebody without a connection asked how it stands: it is waited for, if it lives."""
        live = self._live.get(session_id)
        if live is not None:
            live.machine.asked_for(live.now)

    async def buy(self, session_id: str, wanted: BuyAccuracy) -> None:
        """Have a live session's frames solved so from now on.

        Raises ProblemError: 404 no such session, 409 it has ended, 422 unknown preset.
        """
        live = await self.living(session_id)
        if wanted.preset is not None:
            _one_of("preset", wanted.preset, self._rules.presets)
        live.buy(wanted)

    def all(self) -> list[LiveSession]:
        """Every live session, oldest first."""
        return list(self._live.values())

    async def record(self, session_id: str) -> SessionRecord:
        """What is known of a session, live or ended. Raises ProblemError 404."""
        record = await asyncio.to_thread(self._store.get, session_id)
        if record is not None and record.ended is None and session_id not in self._live:
            # It has ended just now: why is told once it is noted.
            if session_id in self._notes:
                await asyncio.wait({self._notes[session_id]})
            record = await asyncio.to_thread(self._store.get, session_id)
        if record is None:
            raise problem_error(
                "session.unknown",
                f"there is no session {session_id!r}",
                "POST /api/sessions opens one",
                place="session",
                status=404,
            )
        return record

    async def close(self) -> None:
        """End every session, because the server stops, and wait until that is noted; clients are told to come back."""
        self._closing = True
        for live in self.all():
            retry_after = RESTART_RETRY_SECONDS * (1.0 + 2.0 * secrets.randbelow(1000) / 1000.0)
            live.end("The server stops", retry_after)
        while self._notes:
            await asyncio.gather(*self._notes.values(), return_exceptions=True)

    def _work_order(self, record: SessionRecord, garment: GarmentRecord, body: BodyRecord | None = None) -> WorkOrder:
        told = MeshReading()
        if body is not None:
            told = MeshReading(body.units, body.up, body.fps, body.animation, body.facing)
        return WorkOrder(
            drape=DrapeOrder(
                pattern=self._garments.pattern_path(garment),
                fabric=record.fabric,
                preset=record.preset,
                device=self._settings.device,
                wardrobe=self._settings.data_dir / "dressed",
                reading=MeshReading(garment.units, garment.up, rest_shape=garment.rest_shape),
                size=None if record.size == FIT else record.size,
                garment_name=garment.name,
                body=None if body is None else self._bodies.path(body),
                body_reading=told,
                body_name=None if body is None else body.name,
            ),
            motion=record.motion,
            frames_per_second=self._settings.frames_per_second,
            keyframe_seconds=self._settings.keyframe_seconds,
            edit_seconds=self._settings.edit_seconds,
            motion_file=self._motions[record.motion].file if record.motion in self._motions else None,
        )

    def _make_room(self) -> None:
        """Have a place for one more session, if need be that of the session unwatched for longest."""
        if self._closing:
            raise problem_error("server.stopping", "the server stops", "Try again in a few seconds", status=503)
        if len(self._live) < self._settings.max_sessions:
            return
        idlest = max(self._live.values(), key=lambda live: live.machine.unwatched_seconds(live.now))
        if idlest.machine.unwatched_seconds(idlest.now) >= UNWATCHED_SECONDS:
            idlest.end("Nobody was watching, and its place was needed")
            return
        raise problem_error(
            "server.full",
            f"{self._settings.max_sessions} sessions are open, as many as this server allows",
            "End one with DELETE /api/sessions/{id}, or raise TRYON_SERVER_MAX_SESSIONS",
            status=503,
        )

    def _ended(self, live: LiveSession, reason: str) -> None:
        session_id = live.machine.id
        self._live.pop(session_id, None)
        note = asyncio.get_running_loop().create_task(self._note_end(session_id, reason))
        self._notes[session_id] = note
        note.add_done_callback(lambda _: self._notes.pop(session_id))

    async def _note_end(self, session_id: str, reason: str) -> None:
        logger.info("session %s has ended: %s", session_id, reason)
        await asyncio.to_thread(self._store.end, session_id, time.time(), reason)
        await asyncio.to_thread(self._files.let_go, session_id)


def _own(motion: str | None) -> str:
    """The motion of a body that moves by itself. Raises ProblemError 422 when another one was asked for."""
    if motion not in (None, OWN_MOTION):
        raise problem_error(
            "motion.two", "the body moves by itself", "Leave the motion out", place="motion", status=422
        )
    return OWN_MOTION


def _one_of(kind: str, name: str, known: tuple[str, ...]) -> None:
    if name not in known:
        raise problem_error(
            f"{kind}.unknown",
            f"there is no {kind} {name!r}",
            f"Choose one of: {', '.join(known)}",
            place=kind,
            status=422,
        )
