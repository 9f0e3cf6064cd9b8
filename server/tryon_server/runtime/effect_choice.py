"""Which effects a garment and its motion may call for, and why: what is armed where nobody chooses.

Thresholds are where an effect begins to be seen, not where it is needed: what is armed costs nothing (ours).
"""

from __future__ import annotations

from tryon_server.runtime.drape import Character

BRISK = 1.4
"""m/s, walking speed: where the linear drag of air at rest is set equal to the square law (effect_specs.AirDrag)."""
LOOSE = 0.04  # m off the body: a skirt or dress, where a T-shirt hangs at half of it
TIGHT = 0.5  # of the stretch that the fabric bears


def called_for(character: Character) -> dict[str, str]:
    """Names of effects -> why, for people."""
    found: dict[str, list[str]] = {}

    def arm(name: str, why: str) -> None:
        found.setdefault(name, []).append(why)

    if character.speed > BRISK:
        arm("wind", f"the cloth moves at {character.speed:.1f} m/s, where air resists by the square of the speed")
    if character.off_body > LOOSE:
        arm("wind", f"half of the cloth hangs over {100 * character.off_body:.0f} cm off the body, where wind takes it")
    if character.limit > 1.0 and (character.stretch - 1.0) / (character.limit - 1.0) > TIGHT:
        share = 100 * (character.stretch - 1.0)
        arm("stretch_curves", f"it is stretched by {share:.0f} %, where measured curves of the fabric tell")
        arm("adhesion", "it lies tight on the skin, to which damp cloth clings")
    if character.layered:
        arm("adhesion", "a piece lies on another, to which tape, hook and loop or a static charge may hold it")
    if character.closed:
        arm("pressure", "it has no opening, so it can be inflated")
    return {name: "; ".join(reasons) for name, reasons in found.items()}
