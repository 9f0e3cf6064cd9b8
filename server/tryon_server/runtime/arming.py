"""Effects made ready to be bound: their kernels compiled into Warp's cache by another process, and nothing else.

Compiling an effect takes seconds the first time on a machine, in which a simulation would stand still.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tryon_server.runtime.beside import Beside, Made, NotMade


@dataclass(frozen=True)
class Compiling:
    """Compiles the kernels of effects, by name, for a device. Call it in any process."""

    names: tuple[str, ...]
    device: str

    def __call__(self) -> tuple[str, ...]:
        """Their names."""
        from tryon_server.runtime.devices import choose_device
        from tryon_solver.effect_words.table import BY_NAME
        from tryon_solver.kernels import compile_effects

        compile_effects([BY_NAME[name].home for name in self.names], choose_device(self.device))
        return self.names


class Armoury:
    """Which effects are compiled, and the compiling of others beside the simulation.

    Args:
        beside: where it is done; given up when all is.
        device: what is compiled for.
        task: what compiles effects of these names for that device.
    """

    def __init__(
        self, beside: Beside, device: str, task: Callable[[tuple[str, ...], str], Callable[[], object]]
    ) -> None:
        self._beside = beside
        self._device = device
        self._task = task
        self._ready: set[str] = set()
        self._compiling: tuple[str, ...] = ()

    @property
    def compiling(self) -> tuple[str, ...]:
        """Names of those that are being compiled."""
        return self._compiling

    def is_ready(self, name: str) -> bool:
        """Are the effect's kernels compiled?"""
        return name in self._ready

    def hold(self, names: Iterable[str]) -> None:
        """These are bound, so they are compiled."""
        self._ready.update(names)

    def want(self, names: Iterable[str]) -> None:
        """Have these compiled, after those that are being compiled; returns at once."""
        missing = tuple(name for name in names if name not in self._ready)
        if missing and not self._compiling:
            self._compiling = missing
            self._beside.begin(self._task(missing, self._device))

    def look(self) -> NotMade | None:
        """Take note of what has been compiled; why it could not be, where it could not. Then it counts as ready all
        the same: whoever binds it compiles it, and tells what is wrong."""
        if not self._compiling:
            return None
        outcome = self._beside.outcome()
        if outcome is None:
            return None
        self._ready.update(self._compiling)
        self._compiling = ()
        self._beside.close()
        return None if isinstance(outcome, Made) else outcome
