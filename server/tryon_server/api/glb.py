"""What a live session shows as a .glb file."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Response

from tryon_protocol import DecodedFrame, Topology
from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.looks import Dye, fabric_named
from tryon_server.looks.dye import read_dye
from tryon_server.looks.glb import Part, glb
from tryon_server.looks.surface import Finish, Repeat, surface_of
from tryon_server.problems import problem_error
from tryon_server.runtime.interface import FabricEntry
from tryon_server.services import Services
from tryon_server.streaming.snapshot import snapshot

router = APIRouter(prefix="/api/sessions", tags=["sessions"], responses=ERROR_REPLIES)

KIND = "model/gltf-binary"
Print = Annotated[str | None, Query(alias="print", description="id of a print in place of the fabric's colour")]


@router.get("/{session_id}/garment.glb", response_class=Response)
async def get_garment(session_id: str, services: ServicesDep, dye: Dye = None, print_id: Print = None) -> Response:
    """The newest frame of a live session: the garment in its fabric and the body, m, in the session's space.

    Texture coordinates are the pattern's in metres; the fabric's maps are inside.
    """
    if dye is not None and print_id is not None:
        message = "a print takes the place of the colour: nothing of a dye would be seen"
        raise problem_error("dye.unused", message, "Leave out the dye, or the print", place="dye", status=422)
    await services.sessions.record(session_id)
    live = services.sessions.get(session_id)
    if live is None:
        remedy = "Open a new one with POST /api/sessions"
        raise problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
    live.machine.asked_for(live.now)
    fabric = fabric_named(services.runtime.catalogue, live.machine.fabric)
    finish = Finish(read_dye(dye), await asyncio.to_thread(_printed, services, print_id))
    topology, frame = await snapshot(live)
    content = await asyncio.to_thread(_scene, topology, frame, fabric, finish)
    return Response(content, media_type=KIND, headers={"Cache-Control": "no-store"})


def _printed(services: Services, print_id: str | None) -> Repeat | None:
    """The print of this id. Raises ProblemError 404 or 410."""
    if print_id is None:
        return None
    found = services.prints.get(print_id)
    return Repeat(services.prints.path(found).read_bytes(), found.facts.size, found.facts.kind)


def _scene(topology: Topology, frame: DecodedFrame, fabric: FabricEntry, finish: Finish) -> bytes:
    surface = surface_of(fabric.name, fabric.look, finish)
    cloth = Part("garment", frame.cloth, topology.faces, topology.uv, topology.panel_of_face, surface)
    return glb([cloth, Part("body", frame.body, topology.body.faces)])
