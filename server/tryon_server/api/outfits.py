"""What a session wears: listed, put on, taken off, in another order."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from fastapi import APIRouter, Request

from tryon_protocol import ProtocolError
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import OutfitRequest, WearRequest, WornReply
from tryon_server.persistence import OutfitRecord
from tryon_server.problems import problem_error
from tryon_server.services import Services

router = APIRouter(prefix="/api/sessions", tags=["outfits"], responses=ERROR_REPLIES)

REFUSED = ("edit_refused", "outfit_refused")  # what is asked for is to blame; all else is the moment's


@router.get("/{session_id}/garments")
async def list_worn(session_id: str, services: ServicesDep) -> list[WornReply]:
    """What a session wears, live or ended, from the innermost outwards."""
    record = await services.sessions.record(session_id)
    return _replies(await services.sessions.outfit(record))


@router.post("/{session_id}/garments", status_code=201, openapi_extra=json_body(WearRequest))
async def put_on(session_id: str, request: Request, services: ServicesDep) -> list[WornReply]:
    """Put a garment on over what is worn, or at another place in the order; answered once it is worn. One that can't be
    put on changes nothing. Asked for while another is put on, the first one among them, it waits for its turn."""
    wish = read_json(await request.body(), WearRequest)
    await asyncio.to_thread(services.garments.get, wish.garment)
    fabric = await services.sessions.fabric_for(wish.garment, wish.fabric)
    wardrobes = services.sessions.wardrobes

    def with_it(outfit: OutfitRecord) -> OutfitRecord:
        return wardrobes.with_one(outfit, wish.garment, fabric, wish.size, wish.position, wish.replaces)

    return await _change(session_id, services, with_it)


@router.delete("/{session_id}/garments/{name}")
async def take_off(session_id: str, name: str, services: ServicesDep) -> list[WornReply]:
    """Take a garment off; the others stay as they are."""
    wardrobes = services.sessions.wardrobes
    return await _change(session_id, services, lambda outfit: wardrobes.without(outfit, name))


@router.put("/{session_id}/garments", openapi_extra=json_body(OutfitRequest))
async def rearrange(session_id: str, request: Request, services: ServicesDep) -> list[WornReply]:
    """Wear the same garments in another order, or edit another one of them. Cloth can't pass through cloth: `again`
    tells which were taken off for that and put on again, the fewest that had to, while the others stayed on."""
    wish = read_json(await request.body(), OutfitRequest)
    wardrobes = services.sessions.wardrobes
    return await _change(session_id, services, lambda outfit: wardrobes.in_order(outfit, wish.order, wish.edited))


async def _change(
    session_id: str, services: Services, change: Callable[[OutfitRecord], OutfitRecord]
) -> list[WornReply]:
    try:
        changed = await services.sessions.change_outfit(session_id, change)
        return _replies(changed.outfit, changed.again)
    except ProtocolError as error:
        status = 422 if error.code in REFUSED else 409
        code = f"outfit.{error.code.removeprefix('edit_').removeprefix('outfit_')}"
        place = error.place.removeprefix("$.")
        raise problem_error(code, error.message, error.remedy, place=place, status=status) from error


def _replies(outfit: OutfitRecord, again: tuple[str, ...] = ()) -> list[WornReply]:
    return [
        WornReply(
            name=one.name,
            garment=one.garment,
            fabric=one.fabric,
            size=one.size,
            edited=one.name == outfit.edited,
            again=one.name in again,
        )
        for one in outfit.worn
    ]
