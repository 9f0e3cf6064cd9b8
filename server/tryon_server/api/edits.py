"""Edits of the pattern that a session wears, made, taken back, made again, listed; and the pattern itself."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response

from tryon_protocol import ProtocolError
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import EditedReply, EditReply, EditRequest
from tryon_server.problems import problem_error
from tryon_server.services import Services
from tryon_server.sessions.commands import EditStep

router = APIRouter(prefix="/api/sessions", tags=["edits"], responses=ERROR_REPLIES)

REFUSED = ("edit_refused", "invalid_field", "unknown_fabric")  # what the edit is to blame for; all else is the moment's


@router.get("/{session_id}/edits")
async def list_edits(session_id: str, services: ServicesDep, garment: str = "") -> list[EditReply]:
    """The edits of the pattern of a session's garment, the edited one unless it is named, live or ended, oldest first,
    with those that were taken back."""
    kept = await services.sessions.edits(session_id, garment)
    return [EditReply(id=e.id, edit=dict(e.edit), mirror=e.mirror, made=e.made, undone=e.undone) for e in kept]


@router.post("/{session_id}/edits", status_code=201, openapi_extra=json_body(EditRequest))
async def make_edit(session_id: str, request: Request, services: ServicesDep) -> EditedReply:
    """Edit the pattern while it is worn; answered when the edit is kept. One that is refused changes nothing."""
    wish = read_json(await request.body(), EditRequest)
    return await _change(session_id, services, "edit", wish.edit, wish.mirror, wish.garment)


@router.post("/{session_id}/edits/undo")
async def undo_edit(session_id: str, services: ServicesDep, garment: str = "") -> EditedReply:
    """Take the last edit back, of the garment of this name or the edited one."""
    return await _change(session_id, services, "undo", garment=garment)


@router.post("/{session_id}/edits/redo")
async def redo_edit(session_id: str, services: ServicesDep, garment: str = "") -> EditedReply:
    """Make the edit again that was taken back last, of the garment of this name or the edited one."""
    return await _change(session_id, services, "redo", garment=garment)


@router.get("/{session_id}/pattern")
async def pattern(session_id: str, services: ServicesDep, garment: str = "") -> Response:
    """The pattern of a garment, the edited one unless it is named, as it stands after the session's edits, live or
    ended: JSON that POST /api/garments takes."""
    specification = await services.sessions.specification(session_id, garment)
    return Response(json.dumps(specification), media_type="application/json")


async def _change(
    session_id: str,
    services: Services,
    step: EditStep,
    edit: Mapping[str, Any] | None = None,
    mirror: bool = False,
    garment: str = "",
) -> EditedReply:
    await services.sessions.record(session_id)
    live = services.sessions.get(session_id)
    if live is None:
        remedy = "Open a session that continues it: POST /api/sessions with its id as `continues`"
        raise problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
    try:
        made = await live.change_pattern(step, edit, mirror, garment)
    except ProtocolError as error:
        status = 422 if error.code in REFUSED else 409
        code = f"edit.{error.code.removeprefix('edit_')}"
        place = error.place.removeprefix("$.")
        raise problem_error(code, error.message, error.remedy, place=place, status=status) from error
    return EditedReply(id=made.id, last=made.last, change=made.change)
