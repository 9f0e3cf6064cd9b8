"""Uploaded motions as sessions play them."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from tryon_server.persistence import MotionRecord
from tryon_server.problems import ProblemError
from tryon_server.sessions.commands import MotionFile, MotionReading
from tryon_server.uploads.service import MotionUploads

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class UploadedMotion:
    """An uploaded motion that sessions can play."""

    digest: str
    file: MotionFile


def playable(motion: MotionRecord, path: Path) -> UploadedMotion:
    """The motion whose file lies there."""
    reading = MotionReading(motion.units, motion.up, motion.facing, motion.joints)
    return UploadedMotion(motion.digest, MotionFile(str(path), reading))


def all_playable(motions: MotionUploads) -> dict[str, UploadedMotion]:
    """By id; one whose file was taken out of the data folder can't be played."""
    found = {}
    for motion in motions.all():
        try:
            path = motions.path(motion)
        except ProblemError as error:
            logger.warning("%s", error)
            continue
        if path.is_file():
            found[motion.id] = playable(motion, path)
    return found
