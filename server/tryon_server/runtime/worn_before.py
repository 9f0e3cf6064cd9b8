"""Garments that were worn in a session before the one that is, as they hung when that took their place.

Where an edit is taken back and the cloth that it took away lies nowhere any more, the garment can't be put on from what
is worn; but it has been worn, and need not be sewn on again, which takes seconds and may fail where an edit was put on
in a way that nobody dresses.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from typing import Any

from tryon_server.runtime.drape import Drape, Packed

MOST = 12  # kept, the last ones: each is some MB of 20,000 vertices


class WornBefore:
    """By their patterns, which name their fabrics, too."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, Packed] = OrderedDict()

    def keep(self, drape: Drape, specification: Mapping[str, Any]) -> None:
        """Keep what is worn now of this pattern, and of that nothing else. Not one that could not take on its shape."""
        if drape.outgrown:
            return
        name = name_of(specification)
        self._kept.pop(name, None)
        self._kept[name] = drape.packed()
        if len(self._kept) > MOST:
            self._kept.popitem(last=False)

    def recall(self, specification: Mapping[str, Any]) -> Iterator[Drape | None] | None:
        """What was worn of that pattern last, at rest, in parts, if it is kept."""
        kept = self._kept.get(name_of(specification))
        return None if kept is None else kept.unpacking(specification)


def name_of(specification: Mapping[str, Any]) -> str:
    """The same of equal patterns."""
    return json.dumps(specification, sort_keys=True)
