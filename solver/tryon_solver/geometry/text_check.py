"""Names in files must be text that can be written down again: JSON can escape halves of characters, UTF-8 can not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

RENAME_IT = "Rename it: \\ud800 to \\udfff are halves of a character and stand in pairs only"


def find_unencodable(value: Any) -> tuple[str, str] | None:
    """Where in parsed JSON the first text stands that UTF-8 can't hold, like "panels.front.label", and what is wrong.

    Both come with such halves of characters written as escapes. None when there is none.
    """
    pending = [("", value)]
    while pending:
        place, held = pending.pop()
        if isinstance(held, str):
            if _written(held) != held:
                return place, _complaint(held)
        elif isinstance(held, Mapping):
            for key in held:
                if _written(key) != key:
                    return _written(f"{place}.{key}".lstrip(".")), _complaint(key)
            pending += [(f"{place}.{key}".lstrip("."), entry) for key, entry in reversed(list(held.items()))]
        elif isinstance(held, list):
            pending += [(f"{place}[{i}]", entry) for i, entry in reversed(list(enumerate(held)))]
    return None


def _written(text: str) -> str:
    return text.encode("utf-8", "backslashreplace").decode()


def _complaint(text: str) -> str:
    return f"the text '{_written(text):.80}' holds half of a character, which can't be written down"
