"""Garments that were worn in a session before the one that is, as they hung when that took their place.

Where an edit is taken back, the cloth that it took away lies nowhere any more; but it has hung somewhere, and is put
there among what is worn. Where that can't be, the garment is worn as it hung then, and need not be sewn on again, which
takes seconds and may fail where an edit was put on in a way that nobody dresses.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Mapping
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

    def recall(self, specification: Mapping[str, Any]) -> Packed | None:
        """What was worn of that pattern last, if it is kept."""
        return self._kept.get(name_of(specification))


def name_of(specification: Mapping[str, Any]) -> str:
    """The same of equal patterns."""
    return json.dumps(specification, sort_keys=True)
