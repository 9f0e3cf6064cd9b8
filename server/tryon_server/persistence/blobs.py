"""Files by content: a blob's name is the sha256 of its bytes, so equal files are kept once, none is overwritten."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import Protocol


class BlobStore(Protocol):
    """Where uploaded files are kept."""

    def put(self, content: bytes) -> str:
        """Keep ``content``; its digest (64 hexadecimal digits)."""

    def path(self, digest: str) -> Path:
        """A local file with the content of this digest. Raises KeyError when there is none."""

    def remove(self, digest: str) -> None:
        """Forget the content of this digest, if it is there."""


class FileBlobs:
    """Blobs in a folder, written aside and moved into place: a crash leaves no half-written blob under a digest."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def put(self, content: bytes) -> str:
        digest = hashlib.sha256(content).hexdigest()
        target = self._folder / digest[:2] / digest
        if not target.exists():
            target.parent.mkdir(exist_ok=True)
            handle, aside = tempfile.mkstemp(dir=target.parent, prefix=".incoming-")
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
                os.replace(aside, target)
            except BaseException:
                os.unlink(aside)
                raise
        return digest

    def path(self, digest: str) -> Path:
        target = self._folder / digest[:2] / digest
        if not target.is_file():
            raise KeyError(digest)
        return target

    def remove(self, digest: str) -> None:
        (self._folder / digest[:2] / digest).unlink(missing_ok=True)
