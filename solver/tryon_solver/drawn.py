"""What is worn drawn to where it hangs in another outfit, before that takes its place: it would jump there otherwise.

What was put on anew hangs in other folds, and what is put on over it gathers it. Nothing that is seen with it may pass
through it on its way, so the way is simulated, under contact, in the outfit in which it is seen: that one lacks what is
put on, so the way is as free as it can be. Springs draw every vertex that both have, as stiff as what a skirt's waist
presses with asks for, in a move of dt after the time t of T in all, to

    p = y' + (1 - s) (x - y),   1 - s = (1 - ease((t + dt) / T)) / (1 - ease(t / T))

x is where it is, y and y' where the other has it before and after that move, so that x - y dwindles by `ease`, from and
to a standstill, however the body moves meanwhile. T is as long as no vertex goes faster than FASTEST on that way, whose
steepest is 15/8 of its mean; what contact holds back and then lets go is not drawn faster, either: p is no nearer to y'
than |x - y| - dt FASTEST. Ours.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from tryon_solver.body.motion import ease
from tryon_solver.dressing.outfit import Outfit
from tryon_solver.geometry.garment import Layer
from tryon_solver.rebind import take_over, with_effects
from tryon_solver.scene import Effect, Pins, Sleep
from tryon_solver.simulation import Simulation

SECONDS = 1 / 3  # simulated, that it takes at least, and as long as
FASTEST = 1.0  # m/s is the most that a vertex is drawn with against where the other has it: cloth that has slipped off
# hangs half a metre away
STEEPEST = 15 / 8  # times its mean slope, that of `ease` halfway
PULL = 1e5  # N/m^3, per area of what is drawn: 100 Pa, as a tight waist presses, hold it off by a millimetre


@dataclass(frozen=True)
class Drawn(Pins):
    """Cloth drawn from frame to frame to where the contribution's value "places" (K,) vec3 m has it."""

    module: ClassVar[str] = "tryon_solver.effects.drawn"


def in_both(worn: Outfit, other: Outfit) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """(K,) vertices of all garments that both outfits have in the same triangles, as each numbers them. None where
    these lie over each other in another order: cloth can't be drawn through cloth."""
    mine, theirs = [np.zeros(0, np.int32)], [np.zeros(0, np.int32)]
    there = {layer.name: (layer, one) for layer, one in zip(other.layers, other.worn)}
    common = [layer.name for layer in worn.layers if layer.name in there]
    if common == [layer.name for layer in other.layers if layer.name in common]:
        for layer, one in zip(worn.layers, worn.worn):
            if layer.name in there and np.array_equal(one.garment.faces, there[layer.name][1].garment.faces):
                mine.append(_numbers(layer))
                theirs.append(_numbers(there[layer.name][0]))
    return np.concatenate(mine), np.concatenate(theirs)


def _numbers(layer: Layer) -> npt.NDArray[np.int32]:
    return np.arange(layer.vertices.start, layer.vertices.stop, dtype=np.int32)


def without_draw(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """These effects, but what draws."""
    return tuple(effect for effect in effects if not isinstance(effect, Drawn))


def drawing(worn: Simulation, vertices: npt.NDArray[np.int32]) -> Iterator[Simulation | None]:
    """A simulation in which these vertices (K,) can be drawn, in parts, None after each but the last, between which the
    worn one may be advanced; `take_over` is to follow. Cloth that is drawn does not sleep."""
    awake = tuple(effect for effect in worn.scene.effects if not isinstance(effect, Sleep))
    stiffness = PULL * float(worn.scene.garment.vertex_areas().mean())
    yield from with_effects(worn, (*awake, Drawn(vertices, stiffness)))


def let_go(drawn: Simulation, effects: Sequence[Effect]) -> Simulation:
    """One that goes on from where the drawn one is, with these effects, which it had before."""
    *_, made = with_effects(drawn, tuple(effects))
    assert made is not None
    take_over(made, drawn)
    return made


def seconds_for(apart: npt.NDArray[np.floating]) -> float:
    """Simulated, that it takes to draw vertices that are `apart` (K, 3) m from where they are wanted."""
    farthest = float(np.linalg.norm(apart, axis=1).max(initial=0.0))
    return max(SECONDS, STEEPEST * farthest / FASTEST)


def left_after(apart: npt.NDArray[np.floating], t: float, dt: float, seconds: float) -> npt.NDArray[np.floating]:
    """(K, 3) m: what is to be left dt s later of vertices that are so far `apart` (K, 3) m at the time t of `seconds`:
    p - y' above."""
    share = 0.0
    if t + dt < seconds:
        share = float((1.0 - ease((t + dt) / seconds)) / (1.0 - ease(t / seconds)))
    length = np.linalg.norm(apart, axis=1, keepdims=True)
    slowest = 1.0 - dt * FASTEST / np.maximum(length, dt * FASTEST)
    left: npt.NDArray[np.floating] = np.maximum(share, slowest) * apart
    return left


def draw(simulation: Simulation, places: np.ndarray) -> None:
    """Draw to these places (K,) m in the next steps."""
    (contribution,) = (own for own in simulation.plan.contributions if own.name == "drawn")
    contribution.values["places"].assign(places.astype(np.float32))
