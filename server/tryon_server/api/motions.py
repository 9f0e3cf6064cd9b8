"""Motions: those that come with the server and those that were uploaded: list, look up, upload, remove."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from pydantic import StringConstraints

from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.garments import BodyFacing
from tryon_server.api.models import MotionFindings, MotionReply, kept_as
from tryon_server.persistence import MotionRecord
from tryon_server.problems import problem_error
from tryon_server.services import Services
from tryon_server.sessions.commands import MotionReading
from tryon_server.wording import joints_told

BvhUnits = Literal["m", "dm", "asf", "in", "ft", "cm", "mm"]

JointTold = Annotated[str, StringConstraints(min_length=3, max_length=300)]
JOINT_HELP = (
    "PART=NAME: which joint of it is a part of the body, where its names don't tell; pelvis, head, or, with left_ or "
    "right_ before it, upper_arm, forearm, hand, thigh, shin, foot, toes; once for each"
)
PARTS_MAX = 16

PATH = "/api/motions"
router = APIRouter(prefix=PATH, tags=["motions"], responses=ERROR_REPLIES)

BVH_BODY = {
    "requestBody": {
        "required": True,
        "description": "a BVH file of a human: any joint names of the usual conventions, any rest pose",
        "content": {"text/plain": {"schema": {"type": "string"}}},
    }
}


@router.get("")
def list_motions(services: ServicesDep) -> list[MotionReply]:
    """The motions that the server can play, those that came with it first."""
    return [*_built_in(services).values(), *(_reply(motion) for motion in services.motions.all())]


@router.get("/{motion_id}")
def get_motion(motion_id: str, services: ServicesDep) -> MotionReply:
    """One motion."""
    return _built_in(services).get(motion_id) or _reply(services.motions.get(motion_id))


@router.post("", status_code=201, openapi_extra=BVH_BODY)
async def upload_motion(
    request: Request,
    response: Response,
    services: ServicesDep,
    name: Annotated[str, Query(description="what to call it")] = "uploaded motion",
    units: Annotated[BvhUnits | None, Query(description="its unit; found out, and told, without it")] = None,
    up: Annotated[
        BodyFacing | None, Query(description="axis that is up in it; found out by its poses, and told, without it")
    ] = None,
    facing: Annotated[
        BodyFacing | None, Query(description="axis of its file that the person faces along in its first frame")
    ] = None,
    joint: Annotated[
        list[JointTold] | None,
        Query(description=JOINT_HELP, max_length=PARTS_MAX),
    ] = None,
) -> MotionReply:
    """Check a BVH file and keep it: every session can play it from then on.

    The same file twice is the same motion, of its first name.
    """
    reading = MotionReading(units, up, facing, joints_told(joint, "joint"))
    content = await request.body()
    loop = asyncio.get_running_loop()
    motion = await loop.run_in_executor(services.checkers, services.motions.add, content, name, reading)
    services.sessions.offer_motion(motion, services.motions.path(motion))
    response.headers["Location"] = f"{PATH}/{motion.id}"
    return _reply(motion, kept_as(motion.name, name))


@router.delete("/{motion_id}", status_code=204)
async def remove_motion(motion_id: str, services: ServicesDep) -> None:
    """Remove an uploaded motion. A session that plays it goes on, but none can choose it any more."""
    if motion_id in _built_in(services):
        raise problem_error(
            "motion.built_in",
            f"the motion {motion_id!r} came with the server",
            "Remove only motions that were uploaded",
            place="motion",
            status=409,
        )
    await asyncio.to_thread(services.motions.get, motion_id)
    services.sessions.withdraw_motion(motion_id)
    await asyncio.to_thread(services.motions.remove, motion_id)


def _built_in(services: Services) -> dict[str, MotionReply]:
    """The motions that came with the server, by name."""
    return {
        motion.name: MotionReply(name=motion.name, seconds=motion.seconds, title=motion.name, found=None)
        for motion in services.runtime.catalogue.motions
    }


def _reply(motion: MotionRecord, known_as: str | None = None) -> MotionReply:
    found = MotionFindings.model_validate(motion.facts)
    return MotionReply(
        name=motion.id, seconds=motion.facts.seconds, title=motion.name, found=found, kept_as=known_as
    )
