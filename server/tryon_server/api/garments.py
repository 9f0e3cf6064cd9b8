"""Garments: list, look up, upload."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from tryon_server.api.access import ServicesDep
from tryon_server.api.body import read_capped
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import GarmentReply

router = APIRouter(prefix="/api/garments", tags=["garments"], responses=ERROR_REPLIES)

PATTERN_BODY = {
    "requestBody": {
        "required": True,
        "description": "pattern specification JSON as GarmentCode writes it",
        "content": {"application/json": {"schema": {"type": "object"}}},
    }
}


@router.get("")
def list_garments(services: ServicesDep) -> list[GarmentReply]:
    """Every garment, those that came with the server first."""
    return [GarmentReply.model_validate(garment) for garment in services.garments.all()]


@router.get("/{garment_id}")
def get_garment(garment_id: str, services: ServicesDep) -> GarmentReply:
    """One garment."""
    return GarmentReply.model_validate(services.garments.get(garment_id))


@router.post("", status_code=201, openapi_extra=PATTERN_BODY)
async def upload_garment(
    request: Request,
    response: Response,
    services: ServicesDep,
    name: Annotated[str, Query(description="what to call it")] = "uploaded pattern",
) -> GarmentReply:
    """Check a sewing pattern and keep it. The same file twice is the same garment."""
    content = await read_capped(request, services.settings.max_pattern_bytes, "a pattern file")
    loop = asyncio.get_running_loop()
    garment = await loop.run_in_executor(services.checkers, services.garments.add, content, name)
    response.headers["Location"] = f"/api/garments/{garment.id}"
    return GarmentReply.model_validate(garment)
