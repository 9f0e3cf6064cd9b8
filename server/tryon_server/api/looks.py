"""How fabrics look: pictures of their weave, one tile each."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import LookReply
from tryon_server.looks.dye import read_dye
from tryon_server.looks.maps import SHEEN_ROUGHNESS, face_colour, map_png, sheen_colour, tile_size
from tryon_server.problems import problem_error
from tryon_server.runtime.interface import Catalogue, FabricEntry

router = APIRouter(prefix="/api/fabrics", tags=["fabrics"], responses=ERROR_REPLIES)

KEEP = "public, max-age=3600"  # s; they change with the server's version only
Dye = Annotated[str | None, Query(description="colour of the warp in sRGB, as RRGGBB; the fabric's own without it")]


@router.get("/{fabric}/{kind}.png", response_class=Response)
async def get_map(
    fabric: str, kind: Literal["colour", "normal", "roughness"], services: ServicesDep, dye: Dye = None
) -> Response:
    """A map of the fabric's weave. It repeats every `look.tile` m of the pattern; its top is the larger v."""
    look = fabric_named(services.runtime.catalogue, fabric).look
    content = await asyncio.to_thread(map_png, look, kind, read_dye(dye) if kind == "colour" else None)
    return Response(content, media_type="image/png", headers={"Cache-Control": KEEP})


def fabric_named(catalogue: Catalogue, name: str) -> FabricEntry:
    """The fabric of this name. Raises ProblemError 404."""
    for fabric in catalogue.fabrics:
        if fabric.name == name:
            return fabric
    remedy = f"Choose one of: {', '.join(fabric.name for fabric in catalogue.fabrics)}"
    raise problem_error("fabric.unknown", f"there is no fabric {name!r}", remedy, place="fabric", status=404)


def look_reply(fabric: FabricEntry) -> LookReply:
    """What clients are told of a fabric's look."""
    look, path = fabric.look, f"{router.prefix}/{fabric.name}"
    return LookReply(
        weave=look.weave,
        colour=face_colour(look),
        tile=tile_size(look),
        sheen=sheen_colour(look),
        sheen_roughness=SHEEN_ROUGHNESS,
        colour_map=f"{path}/colour.png",
        normal_map=f"{path}/normal.png",
        roughness_map=f"{path}/roughness.png",
    )
