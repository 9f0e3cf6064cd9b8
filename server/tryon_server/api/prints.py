"""Prints: pictures that repeat over a garment in place of its fabric's colour."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import PrintReply, kept_as
from tryon_server.persistence import PrintRecord

PATH = "/api/prints"
router = APIRouter(prefix=PATH, tags=["prints"], responses=ERROR_REPLIES)

KEEP_FOR_EVER = "public, max-age=31536000, immutable"  # an id stands for one file
PICTURE = {
    "requestBody": {
        "required": True,
        "description": "a picture whose edges fit together, 8 to 4096 pixels along each",
        "content": {kind: {"schema": {"type": "string", "format": "binary"}} for kind in ("image/png", "image/jpeg")},
    }
}
Width = Annotated[
    float, Query(ge=0.005, le=5.0, description="how wide the picture is on the cloth, m; its height follows")
]


@router.get("")
def list_prints(services: ServicesDep) -> list[PrintReply]:
    """Every print, oldest first."""
    return [_reply(found) for found in services.prints.all()]


@router.get("/{print_id}")
def get_print(print_id: str, services: ServicesDep) -> PrintReply:
    """One print."""
    return _reply(services.prints.get(print_id))


@router.get("/{print_id}/image", response_class=Response)
def get_image(print_id: str, services: ServicesDep) -> Response:
    """Its file, as it was uploaded."""
    found = services.prints.get(print_id)
    headers = {"Cache-Control": KEEP_FOR_EVER, "X-Content-Type-Options": "nosniff"}
    return Response(services.prints.path(found).read_bytes(), media_type=found.facts.kind, headers=headers)


@router.post("", status_code=201, openapi_extra=PICTURE)
async def upload_print(
    request: Request,
    response: Response,
    services: ServicesDep,
    width: Width,
    name: Annotated[str, Query(description="what to call it")] = "uploaded print",
) -> PrintReply:
    """Check a picture, PNG or JPEG, and keep it. The same file in the same width twice is the same print."""
    content = await request.body()
    loop = asyncio.get_running_loop()
    found = await loop.run_in_executor(services.checkers, services.prints.add, content, name, width)
    response.headers["Location"] = f"{PATH}/{found.id}"
    return _reply(found, kept_as(found.name, name))


@router.delete("/{print_id}", status_code=204)
async def remove_print(print_id: str, services: ServicesDep) -> None:
    """Remove a print. Who shows it goes on with the picture that it was handed."""
    await asyncio.to_thread(services.prints.remove, print_id)


def _reply(found: PrintRecord, known_as: str | None = None) -> PrintReply:
    return PrintReply(
        id=found.id,
        name=found.name,
        kind=found.facts.kind,
        pixels=found.facts.pixels,
        size=found.facts.size,
        image=f"{PATH}/{found.id}/image",
        created=found.created,
        kept_as=known_as,
    )
