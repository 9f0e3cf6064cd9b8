"""What is worn drawn to where it hangs in another outfit, before that takes its place: it would jump there otherwise.

What was put on anew hangs in other folds, and what is put on over it gathers it; what had come off hangs where it did
before. Nothing that is seen with it may pass through it on its way, so the way is simulated, under contact, in the
outfit in which it is seen: that one lacks what is put on, so the way is as free as it can be. Springs draw every vertex
that both have, in the same triangles or, by the pieces' flat places, in others, as stiff as what a skirt's waist
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
from tryon_solver.dressing.outfit import Outfit, Worn
from tryon_solver.dressing.returned import lies_off
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.overlay import Overlay
from tryon_solver.rebind import take_over, with_effects
from tryon_solver.scene import Effect, Pins, Sleep
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.leap import FALLEN

SECONDS = 1 / 3  # simulated, that it takes at least, and as long as
FASTEST = 0.6  # m/s is the most that a vertex is drawn with against where the other has it, 20 mm in a frame of 1/30 s:
# cloth that has slipped off hangs half a metre away, and takes a second and a half
STEEPEST = 15 / 8  # times its mean slope, that of `ease` halfway
PULL = 1e5  # N/m^3, per area of what is drawn: 100 Pa, as a tight waist presses, hold it off by a millimetre


@dataclass(frozen=True)
class Drawn(Pins):
    """Cloth drawn from frame to frame to where the contribution's value "wanted" (K,) vec3 m has it."""

    module: ClassVar[str] = "tryon_solver.effects.drawn"


@dataclass(frozen=True, eq=False)
class Common:
    """Cloth that two outfits have: vertices (K,) of the one, and where each lies in the other, its triangle's corners
    (K, 3) there and the `weights` (K, 3) of these."""

    vertices: npt.NDArray[np.int32]
    corners: npt.NDArray[np.int32]
    weights: npt.NDArray[np.float32]

    def there(self, x: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """(K, 3) m: where the other outfit, whose vertices are at x (N, 3) m, has them."""
        places: npt.NDArray[np.float32] = np.einsum("kc,kcd->kd", self.weights, x[self.corners])
        return places


def in_both(worn: Outfit, other: Outfit) -> Common:
    """What of all garments of the outfit that is worn is in the other one, too. Nothing where these lie over each other
    in another order: cloth can't be drawn through cloth."""
    found = [_nothing()]
    there = {layer.name: (layer, one) for layer, one in zip(other.layers, other.worn)}
    common = [layer.name for layer in worn.layers if layer.name in there]
    if common == [layer.name for layer in other.layers if layer.name in common]:
        for layer, one in zip(worn.layers, worn.worn):
            if layer.name in there:
                layer_there, one_there = there[layer.name]
                found.append(_in_garment(one, one_there, layer.vertices.start, layer_there.vertices.start))
    parts = zip(*((one.vertices, one.corners, one.weights) for one in found))
    return Common(*(np.concatenate(part) for part in parts))


def _in_garment(worn: Worn, other: Worn, first: int, first_there: int) -> Common:
    """What of a garment, whose vertices begin with the number `first`, is in another cut of it: of other triangles what
    the flat pieces of that have, too, if both were made of patterns."""
    if np.array_equal(worn.garment.faces, other.garment.faces):
        own = np.arange(worn.garment.vertex_count, dtype=np.int32)
        corner = np.tile(np.array([1.0, 0.0, 0.0], np.float32), (len(own), 1))
        return Common(first + own, np.tile((first_there + own)[:, None], 3), corner)
    if worn.panels is None or worn.welded is None or other.panels is None:
        return _nothing()
    overlay = Overlay.of(other.panels, worn.panels)
    over = np.flatnonzero(~lies_off(worn.panels, worn.garment.mean_edge_length(), other.panels, overlay))
    vertices, one_of = np.unique(worn.welded.welded_of_vertex[over], return_index=True)
    unsewn = over[one_of]
    corners = other.garment.faces[overlay.face[unsewn]] + first_there
    return Common((first + vertices).astype(np.int32), corners, overlay.weights[unsewn].astype(np.float32))


def _nothing() -> Common:
    return Common(np.zeros(0, np.int32), np.zeros((0, 3), np.int32), np.zeros((0, 3), np.float32))


def without_draw(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """These effects, but what draws."""
    return tuple(effect for effect in effects if not isinstance(effect, Drawn))


def drawing(worn: Simulation, vertices: npt.NDArray[np.int32]) -> Iterator[Simulation | None]:
    """A simulation in which these vertices (K,) can be drawn, in parts, None after each but the last, between which the
    worn one may be advanced; `take_over` is to follow. Cloth that is drawn does not sleep."""
    yield from with_effects(worn, drawn_with(worn.scene.effects, worn.scene.garment, vertices))


def drawn_with(effects: Sequence[Effect], garment: Garment, vertices: npt.NDArray[np.int32]) -> tuple[Effect, ...]:
    """The effects of a garment that has these, while these vertices (K,) of it are drawn."""
    awake = (effect for effect in effects if not isinstance(effect, Sleep))
    return (*awake, Drawn(vertices, PULL * float(garment.vertex_areas().mean())))


def let_go(drawn: Simulation, effects: Sequence[Effect]) -> Simulation:
    """One that goes on from where the drawn one is, with these effects, which it had before."""
    *_, made = with_effects(drawn, tuple(effects))
    assert made is not None
    take_over(made, drawn)
    return made


def seconds_for(apart: npt.NDArray[np.floating]) -> float:
    """Simulated, that it takes to draw vertices that are `apart` (K, 3) m from where they are wanted."""
    far = np.linalg.norm(apart, axis=1)
    farthest = float(far[far <= FALLEN].max(initial=0.0))
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


def draw(simulation: Simulation, here: np.ndarray, wanted: np.ndarray, dt: float) -> None:
    """Draw vertices that are `here` (K, 3) m to where they are `wanted` (K, 3) m in the steps of the next dt s."""
    (contribution,) = (own for own in simulation.plan.contributions if own.name == "drawn")
    for name, value in (("places", here), ("wanted", wanted), ("left", np.array([dt]))):
        contribution.values[name].assign(value.astype(np.float32))
