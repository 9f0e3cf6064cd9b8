"""Which effects a garment and its motion may call for, and why: what is armed where nobody chooses.

Thresholds are where an effect begins to be seen, not where it is needed: what is armed costs nothing (ours). They are
of a tenth of the cloth: what one triangle at a seam or one vertex does is not what a garment is like.
"""

from __future__ import annotations

from dataclasses import replace

from tryon_server.runtime.drape import Character

AIR = 0.5 * 1.2 * 1.2
"""kg/m^3, of the pressure of air that cloth meets straight on, over the square of its speed (effect_specs.Wind)."""
LEANING = 0.5
"""Pressure of the air over the cloth's weight, from which wind is called for: a sheet that hangs leans by its arc
tangent, 27 degrees. Jersey of 180 g/m^2 does at 1.1 m/s, which a skirt's hem reaches in a walk."""
LOOSE = 0.08  # m off the body: a skirt's hem hangs at 9 cm, at 15 in a walk; a T-shirt's sleeves and hem at 4 to 7
TIGHT = 0.5  # of the stretch that the fabric bears: a skirt comes to 0.15 in a walk, to 0.7 in a squat
ON_SKIN = 0.5  # of the cloth lies on the body


def called_for(character: Character) -> dict[str, str]:
    """Names of effects -> why, for people."""
    found: dict[str, list[str]] = {}

    def arm(name: str, why: str) -> None:
        found.setdefault(name, []).append(why)

    pressed = _pressed(character)
    if pressed > LEANING:
        share = f"air that presses with {100 * pressed:.0f} % of its weight"
        arm("wind", f"a tenth of the cloth moves at {character.speed:.1f} m/s or more, through {share}")
    if character.off_body > LOOSE:
        off = f"{100 * character.off_body:.0f} cm off the body"
        arm("wind", f"a tenth of the cloth hangs {off} or farther, where wind takes it")
    if character.limit > 1.0 and (character.stretch - 1.0) / (character.limit - 1.0) > TIGHT:
        share = f"by {100 * (character.stretch - 1.0):.0f} % or more"
        arm("stretch_curves", f"a tenth of the cloth is stretched {share}, where measured curves of the fabric tell")
        if character.close > ON_SKIN:
            arm("adhesion", "it lies tight on the skin, to which damp cloth clings")
    if character.layered:
        arm("adhesion", "a piece lies on another, to which tape, hook and loop or a static charge may hold it")
    if character.closed:
        arm("pressure", "it has no opening, so it can be inflated")
    return {name: "; ".join(reasons) for name, reasons in found.items()}


def not_called_for(most: Character) -> dict[str, str]:
    """Names of effects that are looked for and not called for -> what was looked at, and from where on it would call
    for them, for people; `most` is what garment and motion have been like at most."""
    bears = 100 * (most.limit - 1.0)
    air = f"air presses with {100 * _pressed(most):.0f} % of its weight at most, where over {100 * LEANING:.0f} call"
    off = f"a tenth of the cloth hangs {100 * most.off_body:.0f} cm off the body, where over {100 * LOOSE:.0f} call"
    stretch = f"a tenth of the cloth is stretched by {100 * (most.stretch - 1.0):.0f} %"
    tight = f"{stretch} at most, where over {TIGHT * bears:.0f} call for it"
    looks = {
        "wind": f"{air} for it, and {off} for it",
        "stretch_curves": tight,
        "adhesion": f"no piece lies on another, and {tight} where half of it lies on the skin",
        "pressure": "it has openings, and what is open can't be inflated",
    }
    called = called_for(most)
    return {name: why for name, why in looks.items() if name not in called}


def at_most(before: Character | None, now: Character) -> Character:
    """What garment and motion have been like at most, `now` among it."""
    if before is None:
        return now
    return replace(
        now,
        speed=max(before.speed, now.speed),
        off_body=max(before.off_body, now.off_body),
        close=max(before.close, now.close),
        stretch=max(before.stretch, now.stretch),
    )


def _pressed(character: Character) -> float:
    """Pressure of the air on what moves fastest, over the cloth's weight."""
    return AIR * character.speed**2 / character.weight
