"""Bodies that came as meshes: list, look up, upload, remove."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.garments import BodyFacing, BodyUp, Units
from tryon_server.api.models import BodyReply, kept_as
from tryon_server.persistence import BodyRecord

PATH = "/api/bodies"
router = APIRouter(prefix=PATH, tags=["bodies"], responses=ERROR_REPLIES)

MESH_BODY = {
    "requestBody": {
        "required": True,
        "description": "a human as an animated mesh: an .npz of vertices (frames x V x 3), faces (F x 3) and fps or "
        "dt; an animated .glb; or a .zip of .obj frames; or one that stands still: .obj, .glb, .ply or .stl",
        "content": {
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
            "model/gltf-binary": {"schema": {"type": "string", "format": "binary"}},
            "application/zip": {"schema": {"type": "string", "format": "binary"}},
        },
    }
}


@router.get("")
def list_bodies(services: ServicesDep) -> list[BodyReply]:
    """Every uploaded body, oldest first."""
    return [_reply(body) for body in services.bodies.all()]


@router.get("/{body_id}")
def get_body(body_id: str, services: ServicesDep) -> BodyReply:
    """One body."""
    return _reply(services.bodies.get(body_id))


@router.post("", status_code=201, openapi_extra=MESH_BODY)
async def upload_body(
    request: Request,
    response: Response,
    services: ServicesDep,
    name: Annotated[str, Query(description="what to call it")] = "uploaded body",
    units: Annotated[Units | None, Query(description="its unit; found out, and told, without it")] = None,
    up: Annotated[BodyUp | None, Query(description="axis that is up in it; found out, and told, without it")] = None,
    fps: Annotated[
        float | None, Query(gt=0, le=1000, description="frames a second, where the file does not say; 30 without it")
    ] = None,
    animation: Annotated[
        str | None, Query(min_length=1, max_length=200, description="of a .glb with several, by name; the first, told")
    ] = None,
    facing: Annotated[
        BodyFacing | None, Query(description="axis of its file that it faces along; found out, and told, without it")
    ] = None,
) -> BodyReply:
    """Check an animated mesh and keep it, to open sessions with.

    The same file twice is the same body, of its first name.
    """
    content = await request.body()
    loop = asyncio.get_running_loop()
    told = (name, units, up, fps, animation, facing)
    body = await loop.run_in_executor(services.checkers, services.bodies.add, content, *told)
    response.headers["Location"] = f"{PATH}/{body.id}"
    return _reply(body, kept_as(body.name, name))


@router.delete("/{body_id}", status_code=204)
async def remove_body(body_id: str, services: ServicesDep) -> None:
    """Remove a body. A session that has it goes on with it to its end."""
    await asyncio.to_thread(services.bodies.remove, body_id)


def _reply(body: BodyRecord, known_as: str | None = None) -> BodyReply:
    return BodyReply(
        id=body.id,
        name=body.name,
        seconds=body.facts.seconds,
        frame_count=body.facts.frame_count,
        vertex_count=body.facts.vertex_count,
        created=body.created,
        notes=list(body.facts.notes),
        kept_as=known_as,
    )
