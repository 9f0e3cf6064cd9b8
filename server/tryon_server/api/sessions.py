"""Sessions: open, look up, end, and the websocket of each."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response, WebSocket
from msgspec import structs

from tryon_protocol import SUBPROTOCOL, ChangeStatus, ProtocolError, StatusMessage, encode, error_message
from tryon_server.api import outfits
from tryon_server.api.access import ServicesDep, same_origin
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES, reply
from tryon_server.api.models import AccuracyRequest, ChangeReply, KeptEffectReply, SessionReply, SessionRequest
from tryon_server.persistence import SessionRecord
from tryon_server.problems import Problem
from tryon_server.services import Services
from tryon_server.sessions.actions import NO_SUCH_SESSION
from tryon_server.sessions.commands import BuyAccuracy
from tryon_server.streaming.live_sessions import Opening
from tryon_server.streaming.websocket import serve_client

UNWATCHED = "Nobody watches: time stands still until somebody does"

router = APIRouter(prefix="/api/sessions", tags=["sessions"], responses=ERROR_REPLIES)
stream_router = APIRouter(prefix="/api/sessions")


@router.post("", status_code=201, openapi_extra=json_body(SessionRequest))
async def open_session(request: Request, response: Response, services: ServicesDep) -> SessionReply:
    """Open a session and begin to dress the garment; its websocket tells how that goes."""
    wish = read_json(await request.body(), SessionRequest)
    opening = Opening(
        garment=wish.garment,
        motion=wish.motion,
        fabric=wish.fabric,
        preset=wish.preset,
        size=wish.size,
        body=wish.body,
        continues=wish.continues,
    )
    live = await services.sessions.open(opening)
    for waiting in await services.sessions.wishes_of(wish.continues):
        await outfits.begin(live.machine.id, services, waiting)
    response.headers["Location"] = f"/api/sessions/{live.machine.id}"
    return _reply(await services.sessions.record(live.machine.id), services)


@router.get("/{session_id}")
async def get_session(session_id: str, services: ServicesDep) -> SessionReply:
    """A session, live or ended. One that is asked for now and then lives on without a connection, too."""
    live = services.sessions.get(session_id)
    if live is not None:
        live.machine.asked_for(live.now)
    return _reply(await services.sessions.record(session_id), services)


@router.put("/{session_id}/accuracy", openapi_extra=json_body(AccuracyRequest))
async def choose_accuracy(session_id: str, request: Request, services: ServicesDep) -> SessionReply:
    """Choose what a live session's frames are worth, from the next one on, or, of another preset, once that is built
    beside; nothing is dressed anew."""
    wish = read_json(await request.body(), AccuracyRequest)
    deadline = None if wish.deadline_ms is None else 1e-3 * wish.deadline_ms
    await services.sessions.buy(session_id, BuyAccuracy(wish.accuracy, deadline, wish.preset))
    return _reply(await services.sessions.record(session_id), services)


@router.delete("/{session_id}", status_code=204)
async def end_session(session_id: str, services: ServicesDep) -> None:
    """End a session; its clients are told. Ending one that has ended changes nothing."""
    await services.sessions.record(session_id)
    live = services.sessions.get(session_id)
    if live is not None:
        live.end("Ended by request")


@stream_router.websocket("/{session_id}/stream")
async def stream(websocket: WebSocket, session_id: str, services: ServicesDep) -> None:
    """The session's stream; subprotocol and messages as in PROTOCOL.md."""
    if not same_origin(websocket.headers, services.settings.allowed_origins):
        origin = websocket.headers["origin"]
        problem = Problem(
            code="origin.refused",
            place="Origin",
            message=f"pages of {origin} may not use this server",
            remedy="Add the origin to TRYON_SERVER_ALLOWED_ORIGINS",
        )
        await websocket.send_denial_response(reply(problem, 403))
        return
    if SUBPROTOCOL not in websocket.scope["subprotocols"]:
        problem = Problem(
            code="subprotocol.missing",
            place="Sec-WebSocket-Protocol",
            message=f"the websocket subprotocol {SUBPROTOCOL!r} was not offered",
            remedy=f"Open the websocket with the subprotocol {SUBPROTOCOL!r}",
        )
        await websocket.send_denial_response(reply(problem, 400))
        return
    live = services.sessions.get(session_id)
    if live is None:
        await _turn_away(websocket, session_id)
        return
    await serve_client(websocket, live)


async def _turn_away(websocket: WebSocket, session_id: str) -> None:
    """Say that there is no such session, over the websocket: a browser's script can't read a refused handshake."""
    fault = ProtocolError(
        "unknown_session", "$", f"There is no live session {session_id!r}.", "Open a new one with POST /api/sessions."
    )
    await websocket.accept(subprotocol=SUBPROTOCOL)
    await websocket.send_bytes(encode(error_message(fault, fatal=True)))
    await websocket.close(NO_SUCH_SESSION, "unknown session")


def _change(change: ChangeStatus, now: float) -> ChangeReply:
    told = structs.asdict(change)
    return ChangeReply(seconds=max(round(now - told.pop("since"), 1), 0.0), **told)


def _reply(record: SessionRecord, services: Services) -> SessionReply:
    live = services.sessions.get(record.id)
    if live is None:
        detail = record.ending or "The session has ended"
        status = StatusMessage(
            state="closed", detail=detail, motion=record.motion, fabric=record.fabric, playing=False
        )
    else:
        status = live.machine.status(live.now)
        if status.state == "running" and not live.machine.viewer_count:
            status = structs.replace(status, detail=UNWATCHED)
    newest = None if live is None else live.machine.effects.newest
    kept = () if newest is None else newest.kept
    return SessionReply(
        id=record.id,
        garment=record.garment,
        motion=status.motion,
        fabric=status.fabric,
        preset=record.preset,
        created=record.created,
        size=record.size,
        body=record.body,
        state=status.state,
        detail=status.detail,
        fit=status.fit,
        fitting_size=status.fitting_size,
        notes=list(status.notes),
        worn_size=status.worn_size,
        accuracy=status.accuracy,
        deadline_ms=status.deadline_ms,
        chosen_preset=status.preset,
        preset_in_force=status.preset_in_force,
        preset_pending=status.preset_pending,
        changes=[_change(one, 0.0 if live is None else live.now) for one in status.changes],
        kept_effects=[KeptEffectReply(**structs.asdict(one)) for one in kept],
        viewers=0 if live is None else live.machine.viewer_count,
        stream=f"/api/sessions/{record.id}/stream",
    )
