"""Effects of drapes without a solver: they do nothing but to be there. A pressure on pieces is refused at once, one of
666 Pa once it is half bound, and one of 13 Pa breaks."""

from __future__ import annotations

from collections.abc import Iterator

from tryon_server.runtime.drape import Character, EffectTimes
from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.table import live

PARTS = 5  # in which other effects are bound
CALM = Character(
    speed=0.1, off_body=0.01, close=0.8, stretch=1.01, limit=1.2, weight=1.8, layered=False, closed=False
)


class Compiled:
    """A task of an armoury: does nothing."""

    def __init__(self, names, device) -> None:
        self.names, self.device = names, device

    def __call__(self):
        return self.names


class PretendedEffects:
    def __init__(self, asked=None, garments=("",)) -> None:
        self.asked = live() if asked is None else asked
        self.garments = garments
        self.own = {}
        self.now = CALM
        self.caveats = {}
        self.bound, self.written, self.measured = 0, 0, 0

    def under_garments(self, _name, parameters):
        return parameters

    def check(self, asked) -> None:
        if asked.get("pressure", {}).get("panels"):
            raise EffectError("there is no piece of that name", "parameters.panels[0]", "Name another")

    def write(self, asked) -> None:
        self.asked = asked
        self.written += 1

    def fade(self, _wanted) -> float:
        return 0.0

    def rebind(self, asked) -> Iterator[None]:
        for k in range(PARTS):
            if k == PARTS // 2 and asked.get("pressure", {}).get("pressure") == 666:
                raise EffectError("it would burst", "parameters.pressure", "Lower it")
            if asked.get("pressure", {}).get("pressure") == 13:
                raise RuntimeError("a screw is loose")
            yield None
        self.asked = asked
        self.bound += 1

    def times(self) -> Iterator[tuple[str, EffectTimes]]:
        self.measured += 1
        yield "membrane", EffectTimes({"project": 0.5}, 5.0)
        for name in self.asked:
            yield name, EffectTimes({"add_gradient": 0.25, "start_step": 0.125}, 2.625)

    def plan(self, times) -> str:
        return f"project: membrane; {len(times)} measured"

    def character(self) -> Character:
        return self.now
