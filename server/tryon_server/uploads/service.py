"""Motions, bodies and prints of the server: upload, look-up, removal."""

from __future__ import annotations

import hashlib
import logging
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Generic

import msgspec

from tryon_server.garments.limited import Limits, Work, run_limited
from tryon_server.persistence import BodyRecord, KeptFiles, MotionRecord, PrintRecord, UploadStore
from tryon_server.persistence.uploads import Record
from tryon_server.problems import ProblemError, problem_error
from tryon_server.sessions.commands import MotionReading
from tryon_server.uploads.check import Telling, UploadReply

logger = logging.getLogger(__name__)

MAX_NAME_LENGTH = 200
ID_WORDS = 40  # letters of a name that are in the id
ID_DIGITS = 10  # of its key
REMEDIES = {
    "motion": "Cut it into shorter motions",
    "body": "Export fewer frames, or a coarser mesh",
    "print": "Make the picture smaller",
}


class Uploads(Generic[Record]):
    """Stores one kind of file by content. Blocking: call it from a worker thread. Safe to call from several threads.

    Args:
        kind: ``motion``, ``body`` or ``print``.
        records: where what is known of them is kept.
        files: where the files are kept.
        limits: what checking one may use.
    """

    def __init__(
        self,
        kind: str,
        records: UploadStore[Record],
        files: KeptFiles,
        limits: Limits,
    ) -> None:
        self._kind = kind
        self._records: UploadStore[Record] = records
        self._files = files
        self._limits = limits

    def get(self, upload_id: str) -> Record:
        """The one with this id. Raises ProblemError 404."""
        found = self._records.get(upload_id)
        if found is None:
            raise problem_error(
                f"{self._kind}.unknown",
                f"there is no {self._kind} {upload_id!r}",
                f"GET /api/{_plural(self._kind)} lists those there are",
                place=self._kind,
                status=404,
            )
        return found

    def all(self) -> list[Record]:
        """Every one, oldest first."""
        return self._records.all()

    def path(self, record: Record) -> Path:
        """Its file. Raises ProblemError 410 when it was removed from the data folder."""
        try:
            return self._files.path(record.digest)
        except KeyError as error:
            raise problem_error(
                f"{self._kind}.lost",
                f"the file of the {self._kind} {record.id!r} is no longer in the data folder",
                "Upload it again",
                place=self._kind,
                status=410,
            ) from error

    def remove(self, upload_id: str) -> None:
        """Forget one. A session that has it keeps its file until it ends. Raises ProblemError 404."""
        record = self.get(upload_id)
        with self._files.storing:
            self._records.remove(upload_id)
            self._files.forget(record.digest)

    def _known(self, key: str, content: bytes) -> Record | None:
        """The one that was stored from the same file with the same told about it."""
        with self._files.storing:
            known = self._records.by_key(key)
            if known is not None:
                self._files.put(content)
        return known

    def _added(self, content: bytes, told: Telling, record: Callable[[str, str, UploadReply], Record]) -> Record:
        """The file as it is known, or checked and stored as the `record` of its key, its digest and what was found."""
        key, digest = _key(content, told)
        return self._known(key, content) or self._keep(record(key, digest, self._check(content, told)), content)

    def _check(self, content: bytes, told: Telling) -> UploadReply:
        logger.info("checking the %s %r", self._kind, told.name)
        arguments = [str(self._limits.seconds), str(self._limits.address_space), msgspec.json.encode(told).decode()]
        work = Work(f"checking the {self._kind}", f"{self._kind}.too_complex", REMEDIES[self._kind])
        reply_json = run_limited("tryon_server.uploads.check", arguments, content, self._limits, work)
        reply = msgspec.json.decode(reply_json, type=UploadReply)
        if reply.trace:
            logger.error("a %s could not be checked; this is a fault of ours\n%s", self._kind, reply.trace)
        if reply.problem is not None:
            raise ProblemError(reply.problem, reply.status)
        return reply

    def _keep(self, record: Record, content: bytes) -> Record:
        with self._files.storing:
            self._files.put(content)
            return self._records.add(record)


class MotionUploads(Uploads[MotionRecord]):
    """Uploaded motions."""

    def add(self, content: bytes, name: str, reading: MotionReading = MotionReading()) -> MotionRecord:  # noqa: B008
        """Check a BVH file and store it; the same file twice is the same motion.

        Args:
            content: the file.
            name: what to call it.
            reading: what is told about it.

        Raises:
            ProblemError: 422, it is no motion that the default body can follow, or the name is unfit.
        """
        told = Telling(
            kind="motion",
            name=checked_name("motion", name),
            units=reading.units,
            up=reading.up,
            facing=reading.facing,
            joints=dict(reading.joints) if reading.joints else None,
        )

        def record(key: str, digest: str, found: UploadReply) -> MotionRecord:
            assert found.motion is not None
            return MotionRecord(
                id=_id(told.name, key),
                name=told.name,
                key=key,
                digest=digest,
                created=time.time(),
                facts=found.motion,
                units=told.units,
                up=told.up,
                facing=told.facing,
                joints=told.joints,
            )

        return self._added(content, told, record)


class BodyUploads(Uploads[BodyRecord]):
    """Uploaded bodies."""

    def add(
        self,
        content: bytes,
        name: str,
        units: str | None = None,
        up: str | None = None,
        fps: float | None = None,
        animation: str | None = None,
        facing: str | None = None,
    ) -> BodyRecord:
        """Check a body that is a mesh and store it; the same file twice is the same body.

        Args:
            content: an .npz, a .glb, or a .zip of .obj frames.
            name: what to call it.
            units: what its lengths are in; None to find it out.
            up: axis that is up in it; None to find it out.
            fps: frames a second, where the file does not say; None to find it out.
            animation: which one of a .glb, by name; None for the first.
            facing: axis of the file that it faces along; None to find it out.

        Raises:
            ProblemError: 422, it is no body that can be worn on, or the name is unfit.
        """
        told = Telling(
            kind="body",
            name=checked_name("body", name),
            units=units,
            up=up,
            fps=fps,
            animation=animation,
            facing=facing,
        )

        def record(key: str, digest: str, found: UploadReply) -> BodyRecord:
            assert found.body is not None
            return BodyRecord(
                id=_id(told.name, key),
                name=told.name,
                key=key,
                digest=digest,
                created=time.time(),
                facts=found.body,
                units=units,
                up=up,
                fps=fps,
                animation=animation,
                facing=facing,
            )

        return self._added(content, told, record)


class PrintUploads(Uploads[PrintRecord]):
    """Uploaded prints."""

    def add(self, content: bytes, name: str, width: float) -> PrintRecord:
        """Check a picture that is to be `width` m wide on the cloth, and store it; the same in the same width is the
        same print.

        Raises:
            ProblemError: 422, it is no picture that can be shown, or the name is unfit.
        """
        told = Telling(kind="print", name=checked_name("print", name), width=width)

        def record(key: str, digest: str, found: UploadReply) -> PrintRecord:
            assert found.print is not None
            return PrintRecord(
                id=_id(told.name, key), name=told.name, key=key, digest=digest, created=time.time(), facts=found.print
            )

        return self._added(content, told, record)


def checked_name(kind: str, name: str) -> str:
    """The name without blanks around it. Raises ProblemError when it is unfit."""
    name = name.strip()
    if not name or len(name) > MAX_NAME_LENGTH or not name.isprintable():
        message = f"a {kind}'s name has 1 to {MAX_NAME_LENGTH} printable characters"
        raise problem_error(f"{kind}.name", message, "Choose another name", place="name", status=422)
    return name


def _key(content: bytes, told: Telling) -> tuple[str, str]:
    """The hash of a file with what was told about it, and that of the file alone."""
    fields = msgspec.structs.asdict(msgspec.structs.replace(told, name=""))
    for later in ("animation", "facing", "joints", "width"):  # keys of files that are kept already know none
        if fields[later] is None:
            del fields[later]
    said = msgspec.json.encode(fields)
    digest = hashlib.sha256(content)
    alone = digest.hexdigest()
    digest.update(said)
    return digest.hexdigest(), alone


def _id(name: str, key: str) -> str:
    words = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[:ID_WORDS]
    return f"{words or 'upload'}-{key[:ID_DIGITS]}"


def _plural(kind: str) -> str:
    return {"body": "bodies"}.get(kind, f"{kind}s")
