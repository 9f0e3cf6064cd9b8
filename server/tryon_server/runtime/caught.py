"""Cloth that is caught for good: seen by the figures of its frames, so that it can be put on anew.

Where a stream has a limb go through the trunk, cloth between the two has no place: it is drawn out, and it holds the
body's surface back. As a rule it comes free as the limb does. Where it does not, it stays drawn out to many times its
length, and each of its frames takes ten times as long as one of a garment that hangs well.
"""

from __future__ import annotations

from dataclasses import dataclass

STRETCHED = 2.0  # times its length, the triangle that is stretched most: no fabric gives so much
BEHIND = 0.15  # m that the body's surface is behind its skin: more than any fold of a body presses in
SECONDS = 1.0  # of the poses' time, in every frame of which it is both
PAUSE = 20.0  # s of it after which it is looked at again: who goes on crossing himself is not dressed over and over


@dataclass
class CaughtWatch:
    """For how long it has been caught [s], and how long nothing is looked at any more."""

    caught: float = 0.0
    pause: float = 0.0

    def see(self, stretch: float, behind: float, seconds: float) -> bool:
        """A frame of so many seconds has ended so: is the garment caught for good?"""
        self.pause = max(0.0, self.pause - seconds)
        both = stretch > STRETCHED and behind > BEHIND and not self.pause
        self.caught = self.caught + seconds if both else 0.0
        return self.caught >= SECONDS

    def relieved(self) -> None:
        """It is being put on anew."""
        self.caught, self.pause = 0.0, PAUSE


def told(stretch: float, behind: float) -> tuple[str, str]:
    """What there is to say of it, and what helps, for people."""
    what = (
        f"The garment is caught: it is stretched to {stretch:.1f} times its length and holds the body's surface "
        f"{100 * behind:.0f} cm back. It is put on anew, and worn on as it is until then."
    )
    return what, "Look whether the tracking has arms or legs go through the body."
