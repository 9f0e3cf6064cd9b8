"""What there is to choose from, and whether the server is up."""

from __future__ import annotations

from fastapi import APIRouter

from tryon_server.api.access import ServicesDep
from tryon_server.api.looks import look_reply
from tryon_server.api.models import DeviceReply, FabricReply, HealthReply

router = APIRouter(prefix="/api", tags=["server"])


@router.get("/health")
async def health(services: ServicesDep) -> HealthReply:
    """That the server is up."""
    return HealthReply(status="ok", version=services.version, sessions=len(services.sessions.all()))


@router.get("/fabrics")
async def list_fabrics(services: ServicesDep) -> list[FabricReply]:
    """The fabrics; the first one is the default."""
    return [
        FabricReply(
            name=fabric.name,
            areal_density=fabric.areal_density,
            thickness=fabric.thickness,
            strain_limit=fabric.strain_limit,
            bending=fabric.bending,
            source=fabric.source,
            drape=fabric.drape,
            look=look_reply(fabric),
        )
        for fabric in services.runtime.catalogue.fabrics
    ]


@router.get("/devices")
def list_devices(services: ServicesDep) -> list[DeviceReply]:
    """What this server can simulate on."""
    return [DeviceReply.model_validate(device) for device in services.runtime.devices()]
