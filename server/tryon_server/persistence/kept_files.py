"""Uploaded files as long as they are needed: a record names them, or a running session has them."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

from tryon_server.persistence.blobs import BlobStore


class KeptFiles:
    """Files by content, each removed when the last one who needs it lets go. Safe to call from several threads.

    A session whose garment, body or motion is removed goes on with the file that it holds, and may read it again. Who
    holds what is known as long as the server runs; a file that was held when it was killed stays, of no more use.

    Args:
        blobs: where they are kept.
        recorded: whether a garment, a motion or a body has the file of this digest.
    """

    def __init__(self, blobs: BlobStore, recorded: Callable[[str], bool]) -> None:
        self._blobs = blobs
        self._recorded = recorded
        self._held: dict[str, set[str]] = defaultdict(set)
        self._holding = threading.Lock()  # never kept for long: the event loop may wait for it
        self.storing = threading.RLock()
        """To be had while a file is put and recorded, so that it is not removed in between."""

    def put(self, content: bytes) -> str:
        """Keep ``content``; its digest."""
        with self.storing:
            return self._blobs.put(content)

    def path(self, digest: str) -> Path:
        """A local file with the content of this digest. Raises KeyError when there is none."""
        return self._blobs.path(digest)

    def hold(self, holder: str, digest: str) -> None:
        """Keep the file of this digest until ``holder`` lets go, even if its record is removed."""
        with self._holding:
            self._held[holder].add(digest)

    def let_go(self, holder: str) -> None:
        """What only ``holder`` still needed is removed. Blocking."""
        with self._holding:
            digests = self._held.pop(holder, set())
        for digest in digests:
            self.forget(digest)

    def forget(self, digest: str) -> None:
        """A record of this file is gone: remove the file, unless somebody still needs it. Blocking."""
        with self.storing, self._holding:
            held = any(digest in digests for digests in self._held.values())
            if not held and not self._recorded(digest):
                self._blobs.remove(digest)
