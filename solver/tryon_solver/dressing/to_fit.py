"""In which size a pattern fits its wearer: smaller where its opening would slip, larger where it is too tight. Ours.

The opening that a garment hangs by is measured where the pattern places it (opening.py), which says what size to begin
with. Then sizes are worn. After one that can't be put on comes the nearest of the steps `LARGER` apart that was not
tried and is not known to be too small; after one that hangs by an opening that is still too wide, the size in which
that opening fits. What is worn in the end was put on in that very size. A garment may be too wide above and too narrow
below at once; then the smallest size that went on is worn, and its fit says what is too wide and why nothing smaller
helps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.dress import Dressed
from tryon_solver.dressing.fit import CrowdedError, CrumpledError, DressingError, StanceError, TightError
from tryon_solver.dressing.holding import NOTHING, Holding
from tryon_solver.dressing.opening import Opening, opening_as_drawn
from tryon_solver.files.cut_off import CROWN
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.geometry.size import SIZE_MAX, SIZE_MIN

LARGER = 1.1  # from one step to the next
STEPS = range(-7, 8)  # of the pattern's own size, which is step 0
SAME = 0.025  # sizes that differ by less are not both tried
MOST_TRIES = 5
OWN = 1.0
OTHER_HEIGHT = 0.15  # share by which a body is taller or shorter than whom patterns are drawn for
TRY_SIZES = "say --size fit, which looks for a size that fits this body"


class NoSizeError(DressingError):
    """In none of the sizes that were tried can the garment be put on."""


@dataclass(frozen=True)
class Fitted:
    """A garment in the size it fits in, and why in none of the others that were looked at."""

    dressed: Dressed
    size: float
    others: tuple[str, ...] = ()
    too_small: float = 0.0  # the largest smaller size that is known not to go on; 0: none is

    def upper_opening(self) -> Opening | None:
        """As that of a dressed garment, which knows nothing of its size."""
        opening = self.dressed.upper_opening()
        return None if opening is None else replace(opening, size=self.size, too_small=self.too_small)

    def describe(self) -> str:
        """In which size it is worn and why, for people."""
        return "; ".join([f"size {self.size:g}", *self.others])


def dress_to_fit(
    put_on: Callable[[float], Dressed], own: PanelMesh, body: WornBody, held: Holding = NOTHING
) -> Fitted:
    """Dress a pattern, which `put_on` does in any size, in its own size or one that fits the body.

    `own` is the pattern in its own size, to be measured, and `held` what holds it besides its cut.

    Raises NoSizeError when no size that was tried can be put on, at once what no size mends (a stance not fit for
    dressing; in the pattern's own size a piece that finds no place, the body between the sides of a seam), and what
    `put_on` raises besides.
    """
    return search(put_on, opening_as_drawn(own, body.surface(body.start()), body.faces, held))


def told_by_height(x: np.ndarray) -> str:
    """What there is to say of the height of x (V, 3) m, who stands along y, where a pattern in its own size was
    refused; "" where it is about the one that patterns are drawn for."""
    height = float(np.ptp(x[:, 1]))
    if abs(height / CROWN - 1.0) <= OTHER_HEIGHT:
        return ""
    return f"the body stands {height:.2f} m tall, and patterns are mostly drawn for about {CROWN:.2f} m"


def search(put_on: Callable[[float], Dressed], drawn: Opening | None) -> Fitted:
    """As `dress_to_fit`, with the opening of the pattern's own size as it is drawn."""
    size, too_small = OWN, 0.0
    others: list[str] = []
    refused: dict[float, DressingError | PlacementError] = {}
    worn: Fitted | None = None
    if drawn is not None and drawn.advice and drawn.fitting_size:
        others.append(f"in size 1, as drawn, {drawn.advice}")
        if not drawn.tight_below:
            size = min(max(round(drawn.fitting_size, 2), SIZE_MIN), SIZE_MAX)
    for _ in range(MOST_TRIES):
        try:
            dressed = put_on(size)
        except (DressingError, PlacementError) as error:
            sized = isinstance(error, TightError | CrumpledError | CrowdedError)
            if worn is None and (isinstance(error, StanceError) or (size == OWN and not sized)):
                raise
            others.append(f"in size {size:g}, {error.message}")
            refused[size] = error
            if isinstance(error, TightError):
                too_small = max(too_small, size)
            if worn is not None:
                break
            following = _nearest_step(size if isinstance(error, TightError) else OWN, too_small, list(refused))
            if following is None:
                break
            size = following
            continue
        worn = Fitted(dressed, size)
        opening = worn.upper_opening()
        if opening is None or not opening.advice or not opening.fitting_size or opening.tight_below:
            break
        smaller = max(round(opening.fitting_size, 2), SIZE_MIN)
        if not too_small < smaller < size or smaller in refused:
            break
        others.append(f"in size {size:g}, {opening.advice}")
        size = smaller
    if worn is None:
        raise _none_goes_on(refused)
    told = [said for said in others if not said.startswith(f"in size {worn.size:g}, ")]
    return replace(worn, others=tuple(told), too_small=max((s for s in refused if s < worn.size), default=0.0))


def _nearest_step(size: float, too_small: float, tried: list[float]) -> float | None:
    """The untried step nearest to `size`, the larger of two, that is not known to be too small; None without one."""
    steps = [round(LARGER**k, 2) for k in STEPS]
    left = [
        step
        for step in steps
        if too_small < step and SIZE_MIN <= step <= SIZE_MAX and all(abs(step / t - 1) > SAME for t in tried)
    ]
    return min(left, key=lambda step: (round(abs(math.log(step / size)) / math.log(LARGER)), -step), default=None)


def _none_goes_on(refused: dict[float, DressingError | PlacementError]) -> NoSizeError:
    """What to say when each of these sizes was refused: the one nearest the pattern's own says where it lies."""
    nearest = min(refused, key=lambda size: abs(math.log(size)))
    sizes = sorted(refused)
    why = "; ".join(f"in size {size:g}, {refused[size].message}" for size in sizes)
    remedy = "Change the pattern there"
    if all(isinstance(error, TightError) for error in refused.values()) and sizes[-1] < SIZE_MAX:
        remedy += f", or tell a size larger than {sizes[-1]:g}, or another fabric or body"
    else:
        remedy += ", or choose another fabric, a finer preset or another body"
    return NoSizeError(
        f"it goes on in none of the sizes {', '.join(f'{size:g}' for size in sizes)}: {why}",
        refused[nearest].place,
        remedy,
    )
