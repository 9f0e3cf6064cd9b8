"""What the routes work with, made once per application and handed to them; there are no module-level instances."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from tryon_server.garments.service import GarmentService
from tryon_server.persistence import FinishStore
from tryon_server.runtime.interface import Runtime
from tryon_server.settings import Settings
from tryon_server.streaming.jobs import Jobs
from tryon_server.streaming.live_sessions import LiveSessions
from tryon_server.uploads.service import BodyUploads, MotionUploads, PrintUploads


@dataclass(frozen=True)
class Services:
    """The parts of a running server. ``checkers`` are the threads that wait for uploads to be checked."""

    settings: Settings
    garments: GarmentService
    motions: MotionUploads
    bodies: BodyUploads
    prints: PrintUploads
    finishes: FinishStore
    runtime: Runtime
    sessions: LiveSessions
    jobs: Jobs
    version: str
    checkers: ThreadPoolExecutor
