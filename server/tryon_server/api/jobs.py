"""What takes longer than who asks may wait: 202 and a `Location` to ask again, which answers 202 until it is done, and
then what the route itself would have answered."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from typing import Any

from fastapi import APIRouter, Response
from fastapi.encoders import jsonable_encoder
from fastapi.responses import JSONResponse

from tryon_server.api.access import ServicesDep
from tryon_server.api.faults import ERROR_REPLIES
from tryon_server.api.models import JobReply
from tryon_server.api.prefer import Wait, WaitDep
from tryon_server.problems import problem_error
from tryon_server.services import Services
from tryon_server.streaming.jobs import Job

RETRY_SECONDS = 1  # after which to ask again how a job stands

LOCATION = {"description": "path of the job: ask again there", "schema": {"type": "string"}}
RETRY = {"description": "s after which to ask again", "schema": {"type": "integer"}}
ACCEPTED: dict[int | str, dict[str, Any]] = {
    202: {
        "model": JobReply,
        "description": "It takes longer: its job, which goes on, and is kept if the server is killed",
        "headers": {"Location": LOCATION, "Retry-After": RETRY},
    }
}

Kept = Callable[[], Awaitable[None]]

router = APIRouter(prefix="/api/sessions", tags=["jobs"], responses=ERROR_REPLIES)


@router.get("/{session_id}/jobs")
async def list_jobs(session_id: str, services: ServicesDep) -> list[JobReply]:
    """The jobs of a session, live or ended, oldest first: those that go on, and those that have ended lately and were
    not answered at once."""
    await services.sessions.record(session_id)
    services.sessions.asked_for(session_id)
    return [_reply(job) for job in services.jobs.of(session_id)]


@router.get("/{session_id}/jobs/{job_id}", responses=ACCEPTED)
async def get_job(session_id: str, job_id: str, services: ServicesDep, wait: WaitDep) -> Response:
    """202 and how far it is, at once or after the wait that `Prefer` asks for; once it is done, what the route that was
    asked would have answered, be it a refusal: for a while, as TRYON_SERVER_JOB_KEPT_SECONDS and
    TRYON_SERVER_MOST_JOBS_KEPT say."""
    job = services.jobs.get(session_id, job_id)
    services.sessions.asked_for(session_id)
    return _answer(job, wait) if await job.wait(wait.seconds or 0.0) else _accepted(job, wait)


@router.delete("/{session_id}/jobs/{job_id}", status_code=204, responses=ACCEPTED)
async def cancel_job(session_id: str, job_id: str, services: ServicesDep, wait: WaitDep) -> Response:
    """Cancel it: what is worn stays as it is. 409 where it is worn already, or can't be stopped any more; 202 where
    that is not known within the wait. One that has ended is forgotten."""
    job = services.jobs.get(session_id, job_id)
    if job.state != "running":
        services.jobs.forget(job)
        return Response(status_code=204)
    job.give_up()
    seconds = services.settings.answer_seconds if wait.seconds is None else wait.seconds
    if not await job.wait(seconds):
        return _accepted(job, wait)
    if job.state != "done":
        return Response(status_code=204)
    remedy = "Change it back: undo an edit, take off what was put on, take an effect away"
    raise problem_error("job.done", "it was worn before it could be cancelled", remedy, place="job", status=409)


async def answer(
    job: Job, services: Services, wait: Wait, *, otherwise: float | None = None, kept: Kept | None = None
) -> Response:
    """The route's answer, if the job is done within the wait that is preferred, or `otherwise` [s], or as long as the
    server waits; else that it goes on, once that is `kept`, if it is not yet. Raises what the job raises."""
    seconds = services.settings.answer_seconds if otherwise is None else otherwise
    if await job.wait(seconds if wait.seconds is None else wait.seconds):
        services.jobs.forget(job)
        return _answer(job, wait)
    if kept is not None:
        await kept()
    return _accepted(job, wait)


def _answer(job: Job, wait: Wait) -> JSONResponse:
    return JSONResponse(jsonable_encoder(job.outcome()), job.status, _applied(wait))


def _accepted(job: Job, wait: Wait) -> JSONResponse:
    told = _reply(job)
    headers = {"Location": told.location, "Retry-After": str(RETRY_SECONDS), "Cache-Control": "no-store"}
    return JSONResponse(jsonable_encoder(told), 202, {**headers, **_applied(wait)})


def _applied(wait: Wait) -> dict[str, str]:
    return {"Preference-Applied": wait.applied} if wait.applied else {}


def _reply(job: Job) -> JobReply:
    progress = job.progress
    return JobReply(
        job=job.id,
        step=job.step,
        garment=job.garment,
        state=job.state,
        doing=progress.doing,
        detail=progress.detail,
        progress=progress.share,
        seconds=round((job.ended or time.monotonic()) - job.begun, 1),
        cancelling=job.given_up and job.state == "running",
        location=f"/api/sessions/{job.session}/jobs/{job.id}",
    )
