"""Edits of the pattern that a session wears, made, taken back, made again, listed; and the pattern itself."""

from __future__ import annotations

import json
from typing import Any

from fastapi import APIRouter, Request, Response

from tryon_protocol import ProtocolError
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import EditedReply, EditReply, EditRequest
from tryon_server.problems import problem_error
from tryon_server.services import Services
from tryon_server.sessions.commands import ChangePattern

router = APIRouter(prefix="/api/sessions", tags=["edits"], responses=ERROR_REPLIES)

WAITS: dict[int | str, dict[str, Any]] = {
    202: {"model": EditedReply, "description": "The garment is not worn yet: the change is kept and made once it is"}
}
REFUSED = ("edit_refused", "invalid_field", "unknown_fabric")  # what the edit is to blame for; all else is the moment's


@router.get("/{session_id}/edits")
async def list_edits(session_id: str, services: ServicesDep, garment: str = "") -> list[EditReply]:
    """The edits of the pattern of a session's garment, the edited one unless it is named, live or ended, oldest first,
    with those that were taken back, and whether they are worn yet."""
    kept = await services.sessions.edits(session_id, garment)
    live = services.sessions.get(session_id)
    on_the_way = set() if live is None else live.machine.on_the_way(garment or live.machine.edited)
    return [
        EditReply(
            id=one.id,
            edit=dict(one.edit),
            mirror=one.mirror,
            made=one.made,
            undone=one.undone,
            worn=None if live is None else one.id not in on_the_way,
        )
        for one in kept
    ]


@router.post("/{session_id}/edits", status_code=201, responses=WAITS, openapi_extra=json_body(EditRequest))
async def make_edit(session_id: str, request: Request, response: Response, services: ServicesDep) -> EditedReply:
    """Edit the pattern while it is worn; answered when the edit is kept. One that is refused changes nothing.

    Its shape is taken on in the moments that follow, also while nobody watches: on the body as it stands then. In a
    session that a client holds it waits until that plays; the list of edits says which are `worn`."""
    wish = read_json(await request.body(), EditRequest)
    command = ChangePattern("edit", edit=wish.edit, mirror=wish.mirror, garment=wish.garment)
    return await _change(session_id, services, response, command)


@router.post("/{session_id}/edits/undo", responses=WAITS)
async def undo_edit(session_id: str, response: Response, services: ServicesDep, garment: str = "") -> EditedReply:
    """Take the last edit back, of the garment of this name or the edited one. One that is not worn yet is cancelled:
    whoever waits for it is answered, too, and it can be made again."""
    return await _change(session_id, services, response, ChangePattern("undo", garment=garment))


@router.post("/{session_id}/edits/redo", responses=WAITS)
async def redo_edit(session_id: str, response: Response, services: ServicesDep, garment: str = "") -> EditedReply:
    """Make the edit again that was taken back last, of the garment of this name or the edited one."""
    return await _change(session_id, services, response, ChangePattern("redo", garment=garment))


@router.get("/{session_id}/pattern")
async def pattern(session_id: str, services: ServicesDep, garment: str = "") -> Response:
    """The pattern of a garment, the edited one unless it is named, as it stands after the session's edits, live or
    ended: JSON that POST /api/garments takes."""
    specification = await services.sessions.specification(session_id, garment)
    return Response(json.dumps(specification), media_type="application/json")


async def _change(
    session_id: str, services: Services, response: Response, command: ChangePattern
) -> EditedReply:
    await services.sessions.record(session_id)
    live = services.sessions.get(session_id)
    if live is None:
        remedy = "Open a session that continues it: POST /api/sessions with its id as `continues`"
        raise problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
    try:
        made = await live.change_pattern(command)
    except ProtocolError as error:
        status = 422 if error.code in REFUSED else 409
        code = f"edit.{error.code.removeprefix('edit_')}"
        place = error.place.removeprefix("$.")
        raise problem_error(code, error.message, error.remedy, place=place, status=status) from error
    if made is None:
        response.status_code = 202
        return EditedReply(id=None, last=None, change=None)
    return EditedReply(id=made.id, last=made.last, change=made.change)
