"""Garments of the server: upload, look-up, and those that are there from the start."""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec

from tryon_server.garments.check import CheckReply, PatternFacts, check_garment
from tryon_server.garments.limited import Limits, Work, run_limited
from tryon_server.persistence import GarmentRecord, GarmentStore, KeptFiles
from tryon_server.problems import ProblemError, problem_error

logger = logging.getLogger(__name__)

MAX_NAME_LENGTH = 200
WORK = Work(
    "checking the file",
    "pattern.too_complex",
    "Give panels the size of a garment (check units_in_meter) and fewer edges, a mesh fewer vertices",
)
FIRST = "tshirt"  # of the built-in garments, listed before the others: what a demo opens with


class GarmentService:
    """Checks and stores patterns. Blocking: call it from a worker thread. Safe to call from several threads."""

    def __init__(self, garments: GarmentStore, files: KeptFiles, limits: Limits) -> None:
        self._garments = garments
        self._files = files
        self._limits = limits
        self._built_in: set[str] = set()

    def add(
        self,
        content: bytes,
        name: str,
        units: str | None = None,
        up: str | None = None,
        rest_shape: str | None = None,
    ) -> GarmentRecord:
        """Check a garment's file and store it; the same file twice is the same garment.

        Args:
            content: a sewing pattern, or a mesh that lies on the default body or on one that was uploaded.
            name: what to call it.
            units: unit of a mesh; None to find it out.
            up: axis that is up in it; None to find it out.
            rest_shape: ``pattern`` or ``shape``, what it rests in; None to find it out.

        Raises:
            ProblemError: 400 not JSON, 422 not a garment that can be sewn or worn, or the name is unfit.
        """
        name = name.strip()
        if not name or len(name) > MAX_NAME_LENGTH or not name.isprintable():
            raise problem_error(
                "garment.name",
                f"a garment's name has 1 to {MAX_NAME_LENGTH} printable characters",
                "Choose another name",
                place="name",
                status=422,
            )
        told = f"{units or ''} {up or ''} {rest_shape or ''}".strip().encode()
        digest = hashlib.sha256(content + told).hexdigest()
        check = partial(self._check, content, units, up, rest_shape)
        return self._store(f"p{digest[:32]}", name, content, check, units, up, rest_shape)

    def add_built_in(self, folder: Path) -> None:
        """Have every pattern of ``folder`` as a garment named by its file; unchanged files are not checked again.

        They are the server's own, and so checked here: a process that has to be bounded takes a second to begin.
        """
        for path in sorted(folder.glob("*.json"), key=lambda path: (path.stem != FIRST, path.stem)):
            content = path.read_bytes()
            self._built_in.add(path.stem)
            self._store(path.stem, path.stem.replace("_", " "), content, partial(check_garment, content, None, None))

    def is_built_in(self, garment_id: str) -> bool:
        """Whether the garment came with the server."""
        return garment_id in self._built_in

    def remove(self, garment_id: str) -> None:
        """Forget an uploaded garment. A session that has it keeps its file until it ends.

        Raises:
            ProblemError: 404 there is none, 409 it came with the server.
        """
        garment = self.get(garment_id)
        if self.is_built_in(garment_id):
            raise problem_error(
                "garment.built_in",
                f"the garment {garment_id!r} came with the server",
                "Remove only garments that were uploaded",
                place="garment",
                status=409,
            )
        with self._files.storing:
            self._garments.remove(garment_id)
            self._files.forget(garment.digest)

    def get(self, garment_id: str) -> GarmentRecord:
        """The garment with this id. Raises ProblemError 404."""
        garment = self._garments.get(garment_id)
        if garment is None:
            raise problem_error(
                "garment.unknown",
                f"there is no garment {garment_id!r}",
                "GET /api/garments lists those there are",
                place="garment",
                status=404,
            )
        return garment

    def pattern_path(self, garment: GarmentRecord) -> Path:
        """The file with the garment's pattern. Raises ProblemError 410 when it was removed from the data folder."""
        try:
            return self._files.path(garment.digest)
        except KeyError as error:
            raise problem_error(
                "garment.lost",
                f"the pattern file of {garment.id!r} is no longer in the data folder",
                "Upload it again",
                place="garment",
                status=410,
            ) from error

    def all(self) -> list[GarmentRecord]:
        """Every garment, oldest first."""
        return self._garments.all()

    def _store(
        self,
        garment_id: str,
        name: str,
        content: bytes,
        check: Callable[[], CheckReply],
        units: str | None = None,
        up: str | None = None,
        rest_shape: str | None = None,
    ) -> GarmentRecord:
        digest = hashlib.sha256(content).hexdigest()
        with self._files.storing:
            known = self._garments.get(garment_id)
            if known is not None and known.digest == digest:
                self._files.put(content)
                return known
        logger.info("checking the garment %r", name)
        facts = passed(check())
        record = GarmentRecord(
            id=garment_id,
            name=name,
            digest=digest,
            created=time.time(),
            units=units,
            up=up,
            rest_shape=rest_shape,
            **msgspec.structs.asdict(facts),
        )
        with self._files.storing:
            self._files.put(content)
            self._garments.add(record)
        return record

    def _check(self, content: bytes, *told: str | None) -> CheckReply:
        limits = str(self._limits.seconds), str(self._limits.address_space)
        arguments = [*limits, *(what or "" for what in told)]
        reply_json = run_limited("tryon_server.garments.check", arguments, content, self._limits, WORK)
        return msgspec.json.decode(reply_json, type=CheckReply)


def passed(reply: CheckReply) -> PatternFacts:
    """The facts of a garment that has passed; raises ProblemError for one that has not."""
    if reply.trace:
        logger.error("a garment could not be checked; this is a fault of ours\n%s", reply.trace)
    if reply.facts is None:
        assert reply.problem is not None
        raise ProblemError(reply.problem, reply.status)
    return reply.facts
