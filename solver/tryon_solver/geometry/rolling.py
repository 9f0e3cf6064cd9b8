"""Rolls a flat piece onto a cylinder or a cone around a part of the body, without stretching it.

The cylinder's or cone's profile is a smooth convex curve around the part: the support function of the part's outline,
averaged over directions (an average of support functions is one again: the curve stays convex), plus an even distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

Points = NDArray[np.float64]

DIRECTIONS = 1440
# Half width of the averaging over directions: rounds the corners of the outline to bends a woven cloth takes.
SMOOTHING = np.radians(20.0)
# A piece that widens downwards by less than this share of its mean width has no cone of its own.
FLARE = 0.2
# A cone flatter than this (slant over radius at its upper edge) is no place for a garment.
STEEPEST_SLANT = 1.2


@dataclass(frozen=True)
class Profile:
    """A closed smooth convex curve in the plane with coordinates (c, n): c across the piece, n out of the body."""

    points: Points  # (DIRECTIONS + 1, 2) m, from the point furthest in n towards larger c, all round

    @property
    def travelled(self) -> Points:
        """Arc length (DIRECTIONS + 1,) m from the first point."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])


def profile_around(section: Points, distance: float) -> Profile:
    """The smooth convex curve around the points (K, 2) m in (c, n), K >= 3, an even distance [m] further out.

    Smoothing cuts corners: where the section is pointed, the curve can pass inside it by more than the distance.
    """
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS  # of the outward direction, from +n towards +c
    outward = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    corners = section[ConvexHull(section, qhull_options="QJ").vertices]  # QJ: a section on a line is joggled
    support = (corners @ outward.T).max(axis=0)
    order = np.fft.fftfreq(DIRECTIONS, d=1 / DIRECTIONS)
    # The first harmonic is the curve's place; averaging must not draw it towards the origin.
    kept = np.where(np.abs(order) <= 1, 1.0, np.exp(-0.5 * (order * SMOOTHING) ** 2))
    spectrum = np.fft.fft(support) * kept
    height = np.fft.ifft(spectrum).real + distance
    slope = np.fft.ifft(1j * order * spectrum).real
    along = np.stack([np.cos(angle), -np.sin(angle)], axis=1)
    points = height[:, None] * outward + slope[:, None] * along
    return Profile(np.vstack([points, points[:1]]))


def roll(flat: Points, part: Points, distance: float) -> Points | None:
    """The flat piece rolled on a cylinder around the part: positions (K, 3) m in (c, n, a); None where it does not fit.

    flat: (K, 2) m, the piece in its plane, c across and a along the cylinder's lines, upwards for the trunk.
    part: (B, 3) m, the part of the body in (c, n, a). distance: from the part [m]. The piece touches the cylinder where
    that is furthest in n, moved sideways only as far as it must to keep to the half facing n, with the distance to
    spare, so that front and back pieces cannot meet.
    """
    profile = profile_around(part[:, :2], distance)
    arc = _fitted(flat[:, 0] - profile.points[0, 0], profile.travelled, profile.points, distance)
    if arc is None:
        return None
    return np.column_stack([_along(arc, profile.travelled, profile.points), flat[:, 1]])


def roll_on_cone(flat: Points, part: Points, distance: float) -> Points | None:
    """As roll(), but onto a cone, for a piece that widens downwards; None also for a piece that does not.

    Distances and angles about the point where the flat piece's sides would meet become those about the cone's apex.
    """
    flat_apex = _flat_apex(flat)
    if flat_apex is None:
        return None
    top = float(flat[np.argmin(np.abs(flat[:, 0] - flat_apex[0])), 1])
    below = flat[np.abs(flat[:, 0] - flat_apex[0]) < 0.25 * np.ptp(flat[:, 0])]
    top = max(top, float(below[:, 1].max()))
    slant = flat_apex[1] - top
    middle = (part[:, :2].min(axis=0) + part[:, :2].max(axis=0)) / 2
    profile = profile_around(part[:, :2], distance)
    height = 0.0
    for _ in range(8):
        radius = float(profile.points[:, 1].max() - middle[1])
        if slant < STEEPEST_SLANT * radius:
            return None
        height = float(np.sqrt(slant**2 - radius**2))  # of the apex over the piece's upper edge
        # Seen from the apex, every point of the part must lie inside the profile at the upper edge.
        scale = height / (height + np.maximum(top - part[:, 2], 0.0))
        profile = profile_around(middle + scale[:, None] * (part[:, :2] - middle), distance)
    spokes = np.column_stack([profile.points - middle, np.full(len(profile.points), -height)])
    spokes /= np.linalg.norm(spokes, axis=1)[:, None]
    turned = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spokes, axis=0), axis=1))])
    offset = flat - flat_apex
    reach = np.hypot(offset[:, 0], offset[:, 1])
    angle = _fitted(np.arctan2(offset[:, 0], -offset[:, 1]), turned, profile.points, distance / slant)
    if angle is None:
        return None
    spoke = _along(angle, turned, spokes)
    spoke *= (reach / np.linalg.norm(spoke, axis=1))[:, None]
    return np.append(middle, top + height) + spoke


def _fitted(wanted: Points, travelled: Points, points: Points, margin: float) -> Points | None:
    """The positions along the closed curve, shifted as little as needed to lie between its extremes in -c and +c."""
    lowest = travelled[np.argmin(points[:, 0])] - travelled[-1] + margin / 2
    highest = travelled[np.argmax(points[:, 0])] - margin / 2
    if np.ptp(wanted) > highest - lowest:
        return None
    return wanted + max(0.0, lowest - wanted.min()) - max(0.0, wanted.max() - highest)


def _along(position: Points, travelled: Points, values: Points) -> Points:
    """The closed curve's values (K, d) at the signed positions (K,), less than the whole curve either way."""
    wrapped = np.mod(position, travelled[-1])
    return np.stack([np.interp(wrapped, travelled, column) for column in values.T], axis=1)


def _flat_apex(flat: Points) -> Points | None:
    """Where the sides of a piece (K, 2) that widens downwards meet, (c, a); None for a piece with steadier width."""
    rows = np.linspace(flat[:, 1].min(), flat[:, 1].max(), 13)
    row = np.clip(np.digitize(flat[:, 1], rows) - 1, 0, 11)
    used = np.unique(row)
    ends = np.array([[flat[row == k, 0].min(), flat[row == k, 0].max()] for k in used])
    level = (rows[:-1] + rows[1:])[used] / 2
    slope, at_zero = np.polyfit(level, ends[:, 1] - ends[:, 0], 1)
    mean_width = float((ends[:, 1] - ends[:, 0]).mean())
    if -slope * np.ptp(level) < FLARE * mean_width:
        return None
    apex = -at_zero / slope
    return np.array([np.polyval(np.polyfit(level, ends.mean(axis=1), 1), apex), apex])
