"""In which size a pattern fits its wearer: smaller where its opening would slip, larger where it is too tight. Ours.

The opening that a garment hangs by is measured where the pattern places it (opening.py), which says what size to begin
with. Then sizes are worn: what can't be put on because it is too tight, or crumples where it is sewn, is tried larger,
and what hangs by an opening that is still too wide in the size in which that opening fits. A garment may be too wide
above and too narrow below at once; then the smallest size that can be put on is worn, and its fit says what is too
wide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.dress import Dressed
from tryon_solver.dressing.fit import CrumpledError, DressingError, TightError
from tryon_solver.dressing.opening import Opening, opening_as_drawn
from tryon_solver.geometry.panel_mesh import PanelMesh

LARGER = 1.1  # the next size of a garment that can't be put on
MOST_TRIES = 5


@dataclass(frozen=True)
class Fitted:
    """A garment in the size it fits in, and why in none of the others that were looked at."""

    dressed: Dressed
    size: float
    others: tuple[str, ...]

    def upper_opening(self) -> Opening | None:
        """As that of a dressed garment, which knows nothing of its size."""
        opening = self.dressed.upper_opening()
        return None if opening is None else replace(opening, size=self.size)

    def describe(self) -> str:
        """In which size it is worn and why, for people."""
        return "; ".join([f"size {self.size:g}", *self.others])


def dress_to_fit(
    mesh: Callable[[float], PanelMesh], put_on: Callable[[PanelMesh], Dressed], body: WornBody
) -> Fitted:
    """Dress the pattern that `mesh` cuts in any size, with `put_on`, in its own size or one that fits the body.

    Raises what `mesh` and `put_on` raise; of what is tried larger the last, if no size that was tried can be put on.
    """
    return search(mesh, put_on, opening_as_drawn(mesh(1.0), body.surface(body.start()), body.faces))


def search(
    mesh: Callable[[float], PanelMesh], put_on: Callable[[PanelMesh], Dressed], drawn: Opening | None
) -> Fitted:
    """As `dress_to_fit`, with the opening of the pattern's own size as it is drawn."""
    size, too_small = 1.0, 0.0
    others: list[str] = []
    worn: Fitted | None = None
    refused: DressingError | None = None
    if drawn is not None and drawn.advice:
        others.append(f"in size 1, {drawn.advice}")
        size = round(drawn.fitting_size, 2)
    for _ in range(MOST_TRIES):
        try:
            dressed = put_on(mesh(size))
        except (TightError, CrumpledError) as error:
            others.append(f"in size {size:g}, {error.message}")
            if worn is not None:
                return Fitted(worn.dressed, worn.size, tuple(others))
            refused, too_small, size = error, size, round(LARGER * size, 2)
            continue
        worn = Fitted(dressed, size, tuple(others))
        opening = worn.upper_opening()
        if opening is None or not opening.advice:
            return worn
        smaller = round(opening.fitting_size, 2)
        if not too_small < smaller < size:
            return worn
        others.append(f"in size {size:g}, {opening.advice}")
        size = smaller
    if worn is not None:
        return worn
    assert refused is not None
    raise refused
