"""In which size a pattern fits its wearer: larger where it is too tight, smaller where its opening would slip. Ours.

Sizes are told apart by wearing them: what dressing refuses as too tight is tried larger, and what hangs by an opening
that is wider than the body there (opening.py) in the size in which that opening fits. A garment may be too wide above
and too narrow below at once; then the smallest size that can be put on is worn, and its fit says what is too wide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tryon_solver.dressing.dress import Dressed
from tryon_solver.dressing.fit import TightError
from tryon_solver.geometry.panel_mesh import PanelMesh

LARGER = 1.1  # the next size of a garment that was too tight
MOST_TRIES = 5


@dataclass(frozen=True)
class Fitted:
    """A garment in the size it fits in, and why in none of the others that were tried."""

    dressed: Dressed
    size: float
    tried: tuple[str, ...]

    def describe(self) -> str:
        """In which size it is worn and why, for people."""
        if not self.tried:
            return f"size {self.size:g}"
        return f"size {self.size:g}; {'; '.join(self.tried)}"


def dress_to_fit(mesh: Callable[[float], PanelMesh], put_on: Callable[[PanelMesh], Dressed]) -> Fitted:
    """Dress the pattern that `mesh` cuts in any size, with `put_on`, in its own size or the nearest that fits.

    Raises what `mesh` and `put_on` raise; TightError if the garment is too tight in every size that was tried.
    """
    size, too_small, tried = 1.0, 0.0, []
    worn: Fitted | None = None
    refused: TightError | None = None
    for _ in range(MOST_TRIES):
        try:
            dressed = put_on(mesh(size))
        except TightError as error:
            tried.append(f"in size {size:g}, {error.message}")
            if worn is not None:
                return Fitted(worn.dressed, worn.size, tuple(tried))
            refused, too_small, size = error, size, round(LARGER * size, 2)
            continue
        worn = Fitted(dressed, size, tuple(tried))
        opening = dressed.upper_opening()
        if opening is None or not opening.advice:
            return worn
        smaller = round(size * opening.fitting_size, 2)
        if not too_small < smaller < size:
            return worn
        tried.append(f"in size {size:g}, {opening.advice}")
        size = smaller
    if worn is not None:
        return worn
    assert refused is not None
    raise refused
