"""Which way a trunk points at rest: the line from the middle of the hips to the middle of the shoulders.

Skeletons of people who all stand upright have it lean differently in their rest poses: hips lie where a marker's
distance or an artist's eye put them. Like a limb, a trunk is turned so that this line points where the source's points.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.skeletons import SIDES


def trunk_correction(ours: Mapping[str, np.ndarray], theirs: Mapping[str, np.ndarray]) -> np.ndarray:
    """(4,): the shortest turn from our trunk's direction to theirs, by rest places (3,) of hips and shoulders."""
    return quaternions.between(upwards(ours), upwards(theirs))


def upwards(places: Mapping[str, np.ndarray]) -> np.ndarray:
    """(3,) m: from the middle of the hips to the middle of the shoulders."""
    hips, shoulders = (
        0.5 * (places[f"{SIDES[0]}_{joint}"] + places[f"{SIDES[1]}_{joint}"]) for joint in ("thigh", "upper_arm")
    )
    return shoulders - hips
