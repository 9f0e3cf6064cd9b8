"""What a session shows as a .glb file, and how it finishes its fabric."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request, Response

from tryon_protocol import DecodedFrame, Topology
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.looks import fabric_named
from tryon_server.api.models import FinishChoice
from tryon_server.looks.dye import read_dye
from tryon_server.looks.glb import Part, glb
from tryon_server.looks.surface import Finish, Repeat, surface_of
from tryon_server.persistence import FinishRecord
from tryon_server.problems import problem_error
from tryon_server.runtime.interface import FabricEntry
from tryon_server.services import Services
from tryon_server.streaming.snapshot import snapshot

router = APIRouter(prefix="/api/sessions", tags=["sessions"], responses=ERROR_REPLIES)

GLB = "model/gltf-binary"


@router.get("/{session_id}/finish")
async def get_finish(session_id: str, services: ServicesDep) -> FinishChoice:
    """The dye or the print that a session chose last."""
    await services.sessions.record(session_id)
    chosen = await asyncio.to_thread(services.finishes.get, session_id)
    return FinishChoice(dye=chosen.dye, print=chosen.print)


@router.put("/{session_id}/finish", openapi_extra=json_body(FinishChoice))
async def choose_finish(session_id: str, request: Request, services: ServicesDep) -> FinishChoice:
    """Choose a dye, a print or neither. It is drawn and not simulated: whoever shows the session asks for it."""
    wish = read_json(await request.body(), FinishChoice)
    await services.sessions.record(session_id)
    read_dye(wish.dye)
    if wish.dye is not None and wish.print is not None:
        message = "a print takes the place of the colour: nothing of a dye would be seen"
        raise problem_error("dye.unused", message, "Leave out the dye, or the print", place="dye", status=422)

    def keep() -> None:
        if wish.print is not None:
            services.prints.get(wish.print)
        services.finishes.put(session_id, FinishRecord(dye=wish.dye, print=wish.print))

    await asyncio.to_thread(keep)
    return wish


@router.get("/{session_id}/garment.glb", response_class=Response)
async def get_garment(session_id: str, services: ServicesDep) -> Response:
    """The newest frame of a live session: the garment in its fabric, as it is finished, and the body.

    In m, in the session's space. Texture coordinates are the pattern's in metres; the fabric's maps are inside.
    """
    await services.sessions.record(session_id)
    live = services.sessions.get(session_id)
    if live is None:
        remedy = "Open a new one with POST /api/sessions"
        raise problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
    live.machine.asked_for(live.now)
    fabric = fabric_named(services.runtime.catalogue, live.machine.fabric)
    finish = await asyncio.to_thread(_finish, services, session_id)
    topology, frame = await snapshot(live)
    content = await asyncio.to_thread(_scene, topology, frame, fabric, finish)
    return Response(content, media_type=GLB, headers={"Cache-Control": "no-store"})


def _finish(services: Services, session_id: str) -> Finish:
    """What a session chose. Raises ProblemError 404 or 410 for a print that has been removed."""
    chosen = services.finishes.get(session_id)
    if chosen.print is None:
        return Finish(dye=read_dye(chosen.dye))
    found = services.prints.get(chosen.print)
    return Finish(printed=Repeat(services.prints.path(found).read_bytes(), found.facts.size, found.facts.kind))


def _scene(topology: Topology, frame: DecodedFrame, fabric: FabricEntry, finish: Finish) -> bytes:
    surface = surface_of(fabric.name, fabric.look, finish)
    cloth = Part("garment", frame.cloth, topology.faces, topology.uv, topology.panel_of_face, surface)
    return glb([cloth, Part("body", frame.body, topology.body.faces)])
