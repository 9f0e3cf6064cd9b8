"""How often one client is told of the same fault. None is passed over: those that come in a stream are summed up."""

from __future__ import annotations

from dataclasses import dataclass

from tryon_protocol import ProtocolError

APART_SECONDS = 0.3  # the same fault that comes again after this long is answered at once: no stream is as slow
REPEAT_SECONDS = 1.0  # one that keeps coming, as with every pose of a tracker, is answered once in this time
MOST_KINDS = 64


@dataclass
class _Kind:
    """Faults of one code and field: when the last came, when the last was answered [s], and those since then."""

    newest: ProtocolError
    came: float = float("-inf")
    told: float = float("-inf")
    untold: int = 0

    def is_due(self, now: float) -> bool:
        return now - self.came >= APART_SECONDS or now - self.told >= REPEAT_SECONDS

    def tell(self, now: float) -> ProtocolError:
        """The newest, which stands for all that were not answered."""
        times, self.untold, self.told = self.untold, 0, now
        if times == 1:
            return self.newest
        what = f"{self.newest.message} That came {times} times since it was answered last."
        return ProtocolError(self.newest.code, self.newest.place, what, self.newest.remedy)


class Complaints:
    """The faults of one client that have no number by which each would be answered."""

    def __init__(self) -> None:
        self._kinds: dict[str, _Kind] = {}

    def came(self, fault: ProtocolError, now: float, about: str = "") -> list[ProtocolError]:
        """A fault came; what is to be told now, itself or others. What is not is told later by `due`.

        Those ``about`` different things are not summed up with each other.
        """
        field = fault.place.partition("[")[0]  # a pose that is wrong at another joint each time has one fault
        word = f"{fault.code} {field} {about}"
        told = []
        if len(self._kinds) >= MOST_KINDS and word not in self._kinds:
            longest_ago = self._kinds.pop(min(self._kinds, key=lambda kind: self._kinds[kind].came))
            told += [longest_ago.tell(now)] if longest_ago.untold else []
        kind = self._kinds.setdefault(word, _Kind(fault))
        due = kind.is_due(now)
        kind.newest, kind.came, kind.untold = fault, now, kind.untold + 1
        return [*told, kind.tell(now)] if due else told

    def due(self, now: float) -> list[ProtocolError]:
        """What was not told yet and is to be by now; at infinity all of it."""
        return [kind.tell(now) for kind in self._kinds.values() if kind.untold and kind.is_due(now)]
