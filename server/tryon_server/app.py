"""The application: lifespan and routes."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

from fastapi import Depends, FastAPI
from starlette.middleware.trustedhost import TrustedHostMiddleware

from tryon_server.api import (
    bodies,
    catalogue,
    edits,
    effects,
    faults,
    garments,
    glb,
    jobs,
    looks,
    motions,
    outfits,
    page,
    prints,
    sessions,
)
from tryon_server.api.access import refuse_strangers
from tryon_server.api.body import CappedBodies
from tryon_server.garments.limited import Limits
from tryon_server.garments.service import GarmentService
from tryon_server.persistence import (
    BodyRecord,
    EditStore,
    FileBlobs,
    FinishStore,
    KeptFiles,
    MotionRecord,
    OutfitStore,
    PrintRecord,
    SessionStore,
    SqlEdits,
    SqlFinishes,
    SqlGarments,
    SqlOutfits,
    SqlSessions,
    SqlUploads,
    digest_in_use,
    open_database,
)
from tryon_server.runtime.interface import Runtime
from tryon_server.runtime.local import local_runtime
from tryon_server.services import Services
from tryon_server.settings import PREFIX, Settings
from tryon_server.streaming.jobs import Jobs
from tryon_server.streaming.live_sessions import LiveSessions
from tryon_server.uploads.service import BodyUploads, MotionUploads, PrintUploads

BUILT_IN_PATTERNS = Path(__file__).parent / "demo" / "patterns"
CHECKS_AT_ONCE = 2  # each keeps a processor busy
LOOPBACK = ("127.0.0.1", "::1", "localhost")


def create_app(
    settings: Settings,
    make_runtime: Callable[[Settings], Runtime] = local_runtime,
    patterns: Path = BUILT_IN_PATTERNS,
    web: Path = page.WEB_FOLDER,
) -> FastAPI:
    """The server's application.

    Args:
        settings: what the operator chose.
        make_runtime: makes what simulates; called when the application starts.
        patterns: folder of the patterns that are garments from the start.
        web: folder of the built page.
    """
    server = f"tryon {version('tryon')}"

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        app.state.services = services = _start(settings, make_runtime(settings), patterns, server)
        if settings.warm:
            services.sessions.warm()
        try:
            yield
        finally:
            await services.sessions.close()
            await services.jobs.close()
            services.runtime.placement.close()
            services.checkers.shutdown(wait=False, cancel_futures=True)

    app = FastAPI(title="tryon", version=version("tryon"), lifespan=lifespan, docs_url=None, redoc_url=None)
    file_caps = {
        garments.PATH: (settings.max_pattern_bytes, f"{PREFIX}MAX_PATTERN_BYTES"),
        motions.PATH: (settings.max_motion_bytes, f"{PREFIX}MAX_MOTION_BYTES"),
        bodies.PATH: (settings.max_body_bytes, f"{PREFIX}MAX_BODY_BYTES"),
        prints.PATH: (settings.max_print_bytes, f"{PREFIX}MAX_PRINT_BYTES"),
    }
    app.add_middleware(CappedBodies, file_caps=file_caps)
    if settings.host in LOOPBACK:  # a page of another name that resolves to this machine must not pass as our own
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*LOOPBACK, "[::1]"])
    faults.install(app)
    choosing = catalogue, looks, garments, motions, bodies, prints
    for module in (*choosing, sessions, edits, effects, outfits, jobs, glb):
        app.include_router(module.router, dependencies=[Depends(refuse_strangers)])
    app.include_router(sessions.stream_router)
    page.install(app, web)
    return app


@dataclass(frozen=True)
class Prepared:
    """What there is before anything is simulated."""

    garments: GarmentService
    motions: MotionUploads
    bodies: BodyUploads
    prints: PrintUploads
    files: KeptFiles
    sessions: SessionStore
    edits: EditStore
    outfits: OutfitStore
    finishes: FinishStore


def prepare(settings: Settings, patterns: Path = BUILT_IN_PATTERNS) -> Prepared:
    """Open the database and have the built-in garments in it; takes a while the first time, next to nothing afterwards.

    Raises:
        ProblemError: the database can't be opened, or a built-in pattern can't be sewn.
    """
    database = open_database(settings.effective_database_url())
    limits = Limits(seconds=settings.pattern_check_seconds, address_space=settings.pattern_check_bytes)
    files = KeptFiles(FileBlobs(settings.data_dir / "blobs"), partial(digest_in_use, database))
    garment_service = GarmentService(SqlGarments(database), files, limits)
    garment_service.add_built_in(patterns)
    limits = Limits(seconds=settings.upload_check_seconds, address_space=settings.upload_check_bytes)
    motion_uploads = MotionUploads("motion", SqlUploads(database, MotionRecord), files, limits)
    body_uploads = BodyUploads("body", SqlUploads(database, BodyRecord), files, limits)
    return Prepared(
        garments=garment_service,
        motions=motion_uploads,
        bodies=body_uploads,
        prints=PrintUploads("print", SqlUploads(database, PrintRecord), files, limits),
        files=files,
        sessions=SqlSessions(database),
        edits=SqlEdits(database),
        outfits=SqlOutfits(database),
        finishes=SqlFinishes(database),
    )


def _start(settings: Settings, runtime: Runtime, patterns: Path, server: str) -> Services:
    ready = prepare(settings, patterns)
    ready.sessions.end_all_open(time.time(), "The server was restarted")
    live = LiveSessions(
        settings,
        runtime.catalogue,
        runtime.placement,
        ready.garments,
        ready.motions,
        ready.bodies,
        ready.files,
        ready.sessions,
        ready.edits,
        ready.outfits,
        server,
    )
    return Services(
        settings=settings,
        garments=ready.garments,
        motions=ready.motions,
        bodies=ready.bodies,
        prints=ready.prints,
        finishes=ready.finishes,
        runtime=runtime,
        sessions=live,
        jobs=Jobs(settings.job_kept_seconds, settings.most_jobs_kept),
        version=version("tryon"),
        checkers=ThreadPoolExecutor(CHECKS_AT_ONCE, "upload check"),
    )
