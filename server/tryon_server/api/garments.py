"""Garments: list, look up, upload, remove."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

import msgspec
from fastapi import APIRouter, Query, Request, Response

from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import GarmentReply, kept_as
from tryon_server.persistence import GarmentRecord
from tryon_server.services import Services

Units = Literal["m", "cm", "mm", "in", "ft"]
Up = Literal["y", "z"]
RestShape = Literal["pattern", "shape"]
BodyUp = Literal["y", "z", "x"]
BodyFacing = Literal["x", "-x", "y", "-y", "z", "-z"]

PATH = "/api/garments"
router = APIRouter(prefix=PATH, tags=["garments"], responses=ERROR_REPLIES)

REST_SHAPE = (
    "what a mesh rests in: its texture coordinates as its pattern, or the shape it comes in; found out, and told, "
    "without it"
)
PATTERN_BODY = {
    "requestBody": {
        "required": True,
        "description": "pattern specification JSON as GarmentCode writes it; or a mesh, .obj or .glb, that lies on the "
        "default body in its rest pose, or on a body of your own as it begins",
        "content": {
            "application/json": {"schema": {"type": "object"}},
            "model/gltf-binary": {"schema": {"type": "string", "format": "binary"}},
            "model/obj": {"schema": {"type": "string"}},
        },
    }
}


@router.get("")
def list_garments(services: ServicesDep) -> list[GarmentReply]:
    """Every garment, those that came with the server first."""
    return [_reply(garment, services) for garment in services.garments.all()]


@router.get("/{garment_id}")
def get_garment(garment_id: str, services: ServicesDep) -> GarmentReply:
    """One garment."""
    return _reply(services.garments.get(garment_id), services)


@router.post("", status_code=201, openapi_extra=PATTERN_BODY)
async def upload_garment(
    request: Request,
    response: Response,
    services: ServicesDep,
    name: Annotated[str, Query(description="what to call it")] = "uploaded garment",
    units: Annotated[Units | None, Query(description="unit of a mesh; found out, and told, without it")] = None,
    up: Annotated[Up | None, Query(description="axis that is up in a mesh; found out, and told, without it")] = None,
    rest_shape: Annotated[RestShape | None, Query(description=REST_SHAPE)] = None,
) -> GarmentReply:
    """Check a sewing pattern or a mesh and keep it. The same file twice is the same garment, of its first name."""
    content = await request.body()
    loop = asyncio.get_running_loop()
    add = services.garments.add
    garment = await loop.run_in_executor(services.checkers, add, content, name, units, up, rest_shape)
    response.headers["Location"] = f"/api/garments/{garment.id}"
    return _reply(garment, services, kept_as(garment.name, name))


@router.delete("/{garment_id}", status_code=204)
async def remove_garment(garment_id: str, services: ServicesDep) -> None:
    """Remove an uploaded garment. A session that has it goes on with it to its end, in other fabrics, too."""
    await asyncio.to_thread(services.garments.remove, garment_id)


def _reply(garment: GarmentRecord, services: Services, known_as: str | None = None) -> GarmentReply:
    known = msgspec.structs.asdict(garment)
    fields = {name: known[name] for name in GarmentReply.model_fields if name in known}
    return GarmentReply(**fields, built_in=services.garments.is_built_in(garment.id), kept_as=known_as)
