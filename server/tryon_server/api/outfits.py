"""What a session wears: listed, put on, taken off, in another order."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from tryon_protocol import OutfitWish, ProtocolError, PutOnMessage, ReorderMessage, TakeOffMessage
from tryon_server.api.access import ServicesDep
from tryon_server.api.body import json_body, read_json
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.jobs import ACCEPTED, answer
from tryon_server.api.models import OutfitRequest, WearRequest, WornReply
from tryon_server.api.prefer import Wait, WaitDep
from tryon_server.persistence import OutfitRecord
from tryon_server.problems import problem_error
from tryon_server.services import Services
from tryon_server.streaming.jobs import Job, Step
from tryon_server.streaming.outfit_change import OutfitChange

router = APIRouter(prefix="/api/sessions", tags=["outfits"], responses=ERROR_REPLIES)

STEPS: dict[type[OutfitWish], Step] = {PutOnMessage: "put_on", TakeOffMessage: "take_off", ReorderMessage: "reorder"}
REFUSED = ("edit_refused", "outfit_refused")  # what is asked for is to blame; all else is the moment's


@router.get("/{session_id}/garments")
async def list_worn(session_id: str, services: ServicesDep) -> list[WornReply]:
    """What a session wears, live or ended, from the innermost outwards."""
    record = await services.sessions.record(session_id)
    return _replies(await services.sessions.outfit(record))


@router.post(
    "/{session_id}/garments",
    status_code=201,
    response_model=list[WornReply],
    responses=ACCEPTED,
    openapi_extra=json_body(WearRequest),
)
async def put_on(session_id: str, request: Request, services: ServicesDep, wait: WaitDep) -> Response:
    """Put a garment on over what is worn, or at another place in the order; answered once it is worn, or by 202 where
    that takes longer than `Prefer` says. One that can't be put on changes nothing. Asked for while another is put on,
    the first one among them, it waits for its turn."""
    wish = read_json(await request.body(), WearRequest)
    await services.sessions.fabric_for(wish.garment, wish.fabric)
    asked = PutOnMessage(
        garment=wish.garment, fabric=wish.fabric, size=wish.size, position=wish.position, replaces=wish.replaces
    )
    return await _change(session_id, services, wait, asked)


@router.delete("/{session_id}/garments/{name}", response_model=list[WornReply], responses=ACCEPTED)
async def take_off(session_id: str, name: str, services: ServicesDep, wait: WaitDep) -> Response:
    """Take a garment off; the others stay as they are. 202 as of what is put on."""
    return await _change(session_id, services, wait, TakeOffMessage(garment=name))


@router.put(
    "/{session_id}/garments",
    response_model=list[WornReply],
    responses=ACCEPTED,
    openapi_extra=json_body(OutfitRequest),
)
async def rearrange(session_id: str, request: Request, services: ServicesDep, wait: WaitDep) -> Response:
    """Wear the same garments in another order, or edit another one of them. Cloth can't pass through cloth: `again`
    tells which were taken off for that and put on again, the fewest that had to, while the others stayed on. 202 as of
    what is put on."""
    wish = read_json(await request.body(), OutfitRequest)
    order = None if wish.order is None else tuple(wish.order)
    return await _change(session_id, services, wait, ReorderMessage(order=order, edited=wish.edited))


async def begin(session_id: str, services: Services, wish: OutfitWish) -> Job:
    """Have a session wear what is wished for, once it is its turn. Raises ProblemError 404, 409."""
    change = await services.sessions.outfit_change(session_id, wish)
    return services.jobs.begin(
        session_id,
        STEPS[type(wish)],
        wish.edited or "" if isinstance(wish, ReorderMessage) else wish.garment,
        _made(change),
        status=201 if isinstance(wish, PutOnMessage) else 200,
        progress=change.progress,
        give_up=change.give_up,
    )


async def _change(session_id: str, services: Services, wait: Wait, wish: OutfitWish) -> Response:
    return await answer(await begin(session_id, services, wish), services, wait)


async def _made(change: OutfitChange) -> list[WornReply]:
    try:
        changed = await change.made_in_turn()
    except ProtocolError as error:
        status = 422 if error.code in REFUSED else 409
        code = f"outfit.{error.code.removeprefix('edit_').removeprefix('outfit_')}"
        place = error.place.removeprefix("$.")
        raise problem_error(code, error.message, error.remedy, place=place, status=status) from error
    return _replies(changed.outfit, changed.again)


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
