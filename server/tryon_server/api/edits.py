"""Edits of the pattern that a session wears, made, taken back, made again, listed; and the pattern itself."""

from __future__ import annotations

import json
from collections.abc import Awaitable
from functools import partial

from fastapi import APIRouter, Request, Response

from tryon_protocol import ProtocolError
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.jobs import ACCEPTED, answer
from tryon_server.api.models import EditedReply, EditReply, EditRequest
from tryon_server.api.prefer import Wait, WaitDep
from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.order import undoable
from tryon_server.services import Services
from tryon_server.sessions.commands import ChangePattern
from tryon_server.sessions.events import EditMade
from tryon_server.streaming.jobs import BEING_KEPT, Progress
from tryon_server.streaming.live_session import LiveSession

router = APIRouter(prefix="/api/sessions", tags=["edits"], responses=ERROR_REPLIES)

AT_ONCE = 0.0  # s, for which is waited before it is answered that a change waits for a garment that is not worn yet
REFUSED = ("edit_refused", "invalid_field", "unknown_fabric")  # what the edit is to blame for; all else is the moment's


@router.get("/{session_id}/edits")
async def list_edits(session_id: str, services: ServicesDep, garment: str = "") -> list[EditReply]:
    """The edits of the pattern of a session's garment, the edited one unless it is named, live or ended, oldest first,
    with those that were taken back and can be made again, until a new edit takes their place; and whether each can be
    taken back, and is worn yet."""
    kept = await services.sessions.edits(session_id, garment)
    services.sessions.asked_for(session_id)
    live = services.sessions.get(session_id)
    can_be_undone = undoable([one.id for one in kept if not one.undone])
    on_the_way = set() if live is None else live.machine.on_the_way(garment or live.machine.edited)
    return [
        EditReply(
            id=one.id,
            edit=dict(one.edit),
            mirror=one.mirror,
            made=one.made,
            undone=one.undone,
            can_be_undone=one.id in can_be_undone,
            worn=None if live is None else one.id not in on_the_way,
        )
        for one in kept
    ]


@router.post(
    "/{session_id}/edits",
    status_code=201,
    response_model=EditedReply,
    responses=ACCEPTED,
    openapi_extra=json_body(EditRequest),
)
async def make_edit(session_id: str, request: Request, services: ServicesDep, wait: WaitDep) -> Response:
    """Edit the pattern while it is worn; answered when the edit is kept, or by 202 where that takes longer than
    `Prefer` says, and at once where nothing is worn yet. One that is refused changes nothing.

    Its shape is taken on in the moments that follow, also while nobody watches: on the body as it stands then. In a
    session that a client holds it waits until that plays; the list of edits says which are `worn`."""
    wish = read_json(await request.body(), EditRequest)
    command = ChangePattern("edit", edit=wish.edit, mirror=wish.mirror, garment=wish.garment)
    return await _change(session_id, services, wait, command)


@router.post("/{session_id}/edits/undo", response_model=EditedReply, responses=ACCEPTED)
async def undo_edit(session_id: str, services: ServicesDep, wait: WaitDep, garment: str = "") -> Response:
    """Take the last edit back, of the garment of this name or the edited one. One that is not worn yet is cancelled:
    whoever waits for it is answered, too, and it can be made again. Where what is left can't be worn, the edit that
    made that is taken back with it, and `notes` say so."""
    return await _change(session_id, services, wait, ChangePattern("undo", garment=garment))


@router.post("/{session_id}/edits/redo", response_model=EditedReply, responses=ACCEPTED)
async def redo_edit(session_id: str, services: ServicesDep, wait: WaitDep, garment: str = "") -> Response:
    """Make the edit again that was taken back last, of the garment of this name or the edited one."""
    return await _change(session_id, services, wait, ChangePattern("redo", garment=garment))


@router.get("/{session_id}/pattern")
async def pattern(session_id: str, services: ServicesDep, garment: str = "") -> Response:
    """The pattern of a garment, the edited one unless it is named, as it stands after the session's edits, live or
    ended: JSON that POST /api/garments takes."""
    specification = await services.sessions.specification(session_id, garment)
    services.sessions.asked_for(session_id)
    return Response(json.dumps(specification), media_type="application/json")


async def _change(session_id: str, services: Services, wait: Wait, command: ChangePattern) -> Response:
    live = await services.sessions.living(session_id)
    dressed = live.machine.dressed
    try:
        ticket, asked = live.change_pattern(command)
    except ProtocolError as error:
        raise _refusal(error) from error
    job = services.jobs.begin(
        session_id,
        command.step,
        command.garment,
        _made(asked),
        status=201 if command.step == "edit" else 200,
        progress=partial(_progress, live, ticket),
        give_up=partial(live.give_up, ticket),
    )
    try:
        return await answer(job, services, wait, otherwise=None if dressed else AT_ONCE, kept=live.stored)
    except ProtocolError as error:
        raise _refusal(error) from error


async def _made(asked: Awaitable[EditMade]) -> EditedReply:
    try:
        made = await asked
    except ProtocolError as error:
        raise _refusal(error) from error
    return EditedReply(id=made.id, last=made.last, change=made.change, notes=list(made.notes))


def _progress(live: LiveSession, ticket: int) -> Progress:
    status = live.machine.status_of_change(ticket)
    if status is None:
        return Progress("keeping", BEING_KEPT)
    return Progress(status.doing, status.detail, status.progress)


def _refusal(error: ProtocolError) -> ProblemError:
    status = 422 if error.code in REFUSED else 409
    code = f"edit.{error.code.removeprefix('edit_')}"
    return problem_error(code, error.message, error.remedy, place=error.place.removeprefix("$."), status=status)
