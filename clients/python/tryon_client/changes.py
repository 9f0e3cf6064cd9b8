"""Changes of a session over REST: garments put on, taken off and rearranged, the pattern edited, effects. What takes
longer than a proxy lets anybody wait is asked for again until it is done."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from urllib.error import HTTPError
from urllib.parse import quote, urlencode, urljoin
from urllib.request import Request, urlopen

Told = Callable[[Mapping[str, Any]], None]
"""Is told how a change stands, as long as it is not done: `detail`, `progress` 0 to 1 or None, `location`, and more."""

FIRST_WAIT = 1  # s, for which the answer is waited for before the first telling
TIMEOUT = 60.0  # s, for a single answer; none takes as long
ACCEPTED = 202


class RefusedError(Exception):
    """What the server refused: its status, and the fields of its answer."""

    def __init__(self, status: int, problem: Mapping[str, str]) -> None:
        self.status = status
        self.code, self.place = problem.get("code", ""), problem.get("place", "")
        self.message = problem.get("message", f"the server answered with status {status}")
        self.remedy = problem.get("remedy", "")
        super().__init__(f"{self.message.rstrip('.')}. {self.remedy}")


class Changes:
    """Those of one session. Each returns what the route answers, once it is done, and raises RefusedError; blocks."""

    def __init__(self, server: str, session: str, told: Told = lambda _job: None) -> None:
        """Of a server, such as `http://127.0.0.1:8000/`; `told` may call `cancel`."""
        self._server, self._told = server, told
        self._session = f"/api/sessions/{quote(session, safe='')}"

    def put_on(self, garment: str, **wish: Any) -> list[dict[str, Any]]:
        """Put a garment on: with `fabric`, `size`, `position`, `replaces` as the route has them."""
        worn: list[dict[str, Any]] = self._change("POST", "/garments", {"garment": garment, **wish})
        return worn

    def take_off(self, name: str) -> list[dict[str, Any]]:
        """Take the garment of this name off."""
        worn: list[dict[str, Any]] = self._change("DELETE", f"/garments/{quote(name, safe='')}")
        return worn

    def rearrange(self, order: Sequence[str] | None = None, edited: str | None = None) -> list[dict[str, Any]]:
        """Wear the same in this order, from the innermost outwards, and edit this one; None: as it is."""
        wish = {"order": None if order is None else list(order), "edited": edited}
        worn: list[dict[str, Any]] = self._change("PUT", "/garments", wish)
        return worn

    def edit(self, edit: Mapping[str, Any], mirror: bool = False, garment: str = "") -> dict[str, Any]:
        """Edit the pattern of the garment of this name, the edited one for ""."""
        made: dict[str, Any] = self._change("POST", "/edits", {"edit": edit, "mirror": mirror, "garment": garment})
        return made

    def undo(self, garment: str = "") -> dict[str, Any]:
        """Take its last edit back."""
        made: dict[str, Any] = self._change("POST", f"/edits/undo?{urlencode({'garment': garment})}")
        return made

    def redo(self, garment: str = "") -> dict[str, Any]:
        """Make its edit again that was taken back last."""
        made: dict[str, Any] = self._change("POST", f"/edits/redo?{urlencode({'garment': garment})}")
        return made

    def effect(self, name: str, **wish: Any) -> dict[str, Any]:
        """Have the effect of this name act: with `parameters` and `state` as the route has them. Returns all effects of
        the session; those that are `kept` where nothing is worn yet."""
        told: dict[str, Any] = self._change("PUT", f"/effects/{quote(name, safe='')}", wish)
        return told

    def no_effect(self, name: str) -> dict[str, Any]:
        """Have it act no longer."""
        told: dict[str, Any] = self._change("DELETE", f"/effects/{quote(name, safe='')}")
        return told

    def cancel(self, job: Mapping[str, Any]) -> None:
        """Ask a change to stop; who waits for it hears whether that came in time."""
        self._ask("DELETE", job["location"], prefer="respond-async")

    def _change(self, method: str, path: str, wish: Mapping[str, Any] | None = None) -> Any:
        status, answer, pause = self._ask(method, self._session + path, wish, f"wait={FIRST_WAIT}")
        while status == ACCEPTED and "location" in answer:
            self._told(answer)
            time.sleep(pause)
            status, answer, pause = self._ask("GET", answer["location"])
        return answer

    def _ask(
        self, method: str, path: str, wish: Mapping[str, Any] | None = None, prefer: str = ""
    ) -> tuple[int, Any, float]:
        """Status, answer, and after how long to ask again [s]."""
        body = None if wish is None else json.dumps(wish).encode()
        headers = {"Content-Type": "application/json", **({"Prefer": prefer} if prefer else {})}
        request = Request(urljoin(self._server, path), data=body, headers=headers, method=method)
        try:
            with urlopen(request, timeout=TIMEOUT) as reply:
                content = reply.read()
                return reply.status, json.loads(content) if content else None, float(reply.headers["Retry-After"] or 1)
        except HTTPError as error:
            raise RefusedError(error.code, _problem(error.read())) from error


def _problem(content: bytes) -> Mapping[str, str]:
    """The fields of a refusal; none of the answer of something in between, such as a proxy."""
    try:
        problem = json.loads(content)
    except ValueError:
        return {}
    return problem if isinstance(problem, dict) else {}
