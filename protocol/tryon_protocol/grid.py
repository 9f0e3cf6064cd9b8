"""The session's grid: int32 units of q, and the origin of int16 positions. PROTOCOL.md section 7.2."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .errors import ProtocolError

GRID = 1.0 / 16000.0
"""m, the default edge q of the grid: 1/16 mm."""
ORIGIN_STEP = 256
"""Origins are multiples of this many units."""
INT16_MAX = 32767
RECENTRE_BEYOND = 24576
"""Units. The origin moves only when the garment reaches farther than this from it: a hysteresis of half the range."""
MAX_SURFACE_ERROR = 2.0e-4
"""m. A grid whose rounding could move two surfaces towards each other by more than this is refused."""

Units = npt.NDArray[np.int32]


def check_grid(grid: float, thickness: float) -> None:
    """Refuse a grid on which rounding alone could close the gap that the solver keeps.

    Each of two vertices moves by at most sqrt(3)/2 q, so two surfaces approach by at most sqrt(3) q.

    Args:
        grid: q in m.
        thickness: m, the smallest thickness offset of a contact in the scene.

    Raises:
        ProtocolError: code "grid_too_coarse".
    """
    approach = math.sqrt(3.0) * grid
    if not approach < min(MAX_SURFACE_ERROR, thickness):
        raise ProtocolError(
            "grid_too_coarse",
            "grid",
            f"Rounding to {grid * 1e3:g} mm moves surfaces up to {approach * 1e3:.3f} mm towards each other; "
            f"allowed is less than {MAX_SURFACE_ERROR * 1e3:g} mm and less than the thickness {thickness * 1e3:g} mm.",
            "Choose a finer grid or a thicker fabric.",
        )


def quantise(positions: npt.NDArray[np.floating], grid: float, shift: npt.NDArray[np.float64], place: str) -> Units:
    """Round positions to grid units.

    Args:
        positions: (N,3) m, float32 or float64.
        grid: q in m.
        shift: (3,) m added to every position (in float64) before rounding.
        place: name for errors.

    Returns:
        (3,N) int32 units, one row per axis; |q * units - (positions + shift)| <= q/2.

    Raises:
        ProtocolError: code "unencodable_position" for NaN, infinity, or beyond int32, naming the vertex.
    """
    scaled: npt.NDArray[np.float64] = np.add(positions.T, shift[:, None], dtype=np.float64, order="C")
    scaled /= grid
    np.rint(scaled, out=scaled)
    if scaled.size and not (scaled.min() >= -(2.0**31) + 2 * INT16_MAX and scaled.max() <= 2.0**31 - 2 * INT16_MAX):
        with np.errstate(invalid="ignore"):
            vertex = int(np.flatnonzero(~(np.abs(scaled) <= 2.0**31 - 2 * INT16_MAX).all(axis=0))[0])
        raise ProtocolError(
            "unencodable_position",
            f"{place}[{vertex}]",
            f"The position {positions[vertex].tolist()} m isn't a finite place within {grid * 2**31:.0f} m.",
            "Don't publish this state: the solver has failed, or the session's origin lies too far away.",
        )
    return scaled.astype(np.int32)


def follow(origin: npt.NDArray[np.int64], units: Units) -> npt.NDArray[np.int64]:
    """The origin for these units: the present one while they lie well within reach, else one in their middle.

    Args:
        origin: (3,) present origin in units.
        units: (3,N), N >= 1.

    Raises:
        ProtocolError: code "cloth_too_large" when no origin has all vertices within int16.
    """
    low, high = units.min(axis=1).astype(np.int64), units.max(axis=1).astype(np.int64)
    far = (low - origin < -RECENTRE_BEYOND) | (high - origin > RECENTRE_BEYOND)
    if not far.any():
        return origin
    middle = ORIGIN_STEP * ((low + high) // (2 * ORIGIN_STEP))
    moved = np.where(far, middle, origin)
    reach = np.maximum(high - moved, moved - low)
    if (reach > INT16_MAX).any():
        axis = int(np.argmax(reach))
        raise ProtocolError(
            "cloth_too_large",
            "cloth",
            f"The garment spans {int(high[axis] - low[axis])} grid units along {'xyz'[axis]}; "
            f"a frame reaches {2 * INT16_MAX}.",
            "Use a coarser grid for this session, or check that no vertex has flown away.",
        )
    return moved
