"""What a session shows as a .glb file, and how it finishes its fabric."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import numpy as np
from fastapi import APIRouter, Request, Response

from tryon_protocol import DecodedFrame, GarmentTopology, Topology
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.looks import fabric_named
from tryon_server.api.models import FinishChoice
from tryon_server.looks.dye import read_dye
from tryon_server.looks.glb import Part, glb
from tryon_server.looks.surface import Finish, Repeat, Surface, surface_of
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
    """The newest frame of a live session: each garment in its fabric, the edited one as it is finished, and the body.

    In m, in the session's space. Texture coordinates are the pattern's in metres; the fabrics' maps are inside.
    """
    await services.sessions.record(session_id)
    live = services.sessions.get(session_id)
    if live is None:
        remedy = "Open a new one with POST /api/sessions"
        raise problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
    live.machine.asked_for(live.now)
    finish = await asyncio.to_thread(_finish, services, session_id)
    topology, frame = await snapshot(live)
    fabrics = [live.machine.fabric]
    finishes = [finish]
    if len(topology.garments) > 1:
        fabrics = [one.fabric for one in topology.garments]
        finishes = [finish if one.name == live.machine.edited else Finish() for one in topology.garments]
    entries = [fabric_named(services.runtime.catalogue, name) for name in fabrics]
    content = await asyncio.to_thread(_scene, topology, frame, list(zip(entries, finishes)))
    return Response(content, media_type=GLB, headers={"Cache-Control": "no-store"})


def _finish(services: Services, session_id: str) -> Finish:
    """What a session chose. Raises ProblemError 404 or 410 for a print that has been removed."""
    chosen = services.finishes.get(session_id)
    if chosen.print is None:
        return Finish(dye=read_dye(chosen.dye))
    found = services.prints.get(chosen.print)
    return Finish(printed=Repeat(services.prints.path(found).read_bytes(), found.facts.size, found.facts.kind))


def _scene(topology: Topology, frame: DecodedFrame, worn: Sequence[tuple[FabricEntry, Finish]]) -> bytes:
    """A part for each garment, of its fabric and in its finish, from the innermost outwards, and the body."""
    surfaces = [surface_of(fabric.name, fabric.look, finish) for fabric, finish in worn]
    if len(surfaces) == 1:
        cloth = [Part("garment", frame.cloth, topology.faces, topology.uv, topology.panel_of_face, surfaces[0])]
    else:
        cloth = [_garment(topology, frame, one, surface) for one, surface in zip(topology.garments, surfaces)]
    return glb([*cloth, Part("body", frame.body, topology.body.faces)])


def _garment(topology: Topology, frame: DecodedFrame, one: GarmentTopology, surface: Surface) -> Part:
    """One of several garments, its vertices numbered from 0."""
    (vertex, vertices), (face, faces) = one.vertices, one.faces
    own = slice(face, face + faces)
    uv = None if topology.uv is None else topology.uv[own]
    panels = None if topology.panel_of_face is None else topology.panel_of_face[own]
    corners = topology.faces[own].astype(np.int64) - vertex
    return Part(one.name, frame.cloth[vertex : vertex + vertices], corners, uv, panels, surface)
