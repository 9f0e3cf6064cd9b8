"""What may be in a scene: every effect in its variants, the cloth, the body, and how it is simulated."""

from __future__ import annotations

from functools import cache

from covering_array import Factors, Row, covering_array

# One garment over another, of the same fabric or of another thickness and friction (covered_scene.py: OUTER); with
# "friction" they have the fabrics' own, or others for each pair of their pieces, and with "adhesion" they stick.
TWO = ("two of one fabric", "two of two fabrics")
LEVELS = {
    "cloth": ("sheet", "strip", "stack", "balloon", "tshirt", "skirt"),
    "garments": ("one", *TWO),
    "body": ("none", "ball", "moving ball", "person"),
    "air": ("none", "still", "wind", "sheltered", "gusts"),
    "adhesion": ("none", "tape", "static cling", "wet cling"),
    "stretch": ("fabric", "limit", "curves", "both"),
    "pressure": ("none", "blown", "gas"),
    "friction": ("none", "fabric", "pairs"),
    "elastic": ("none", "band", "drawstring"),
    "fasteners": ("none", "closed", "opened"),
    "pins": ("none", "held", "led"),
    "creases": ("none", "pressed", "pressed anew"),
    "fabric": ("cotton_jersey", "denim", "silk_charmeuse"),
    "gravity": ("down", "none"),
    "body contact": ("on", "off"),
    "self contact": ("on", "off"),
    "damping": ("none", "5 ms"),
    "sewing": ("none", "being closed"),
    "attached": ("none", "patch"),
    "sleep": ("none", "on"),
    "preset": ("draft", "live"),
    "rate": ("60", "30"),
}


def forbidden() -> list[Row]:
    """What Scene refuses, and what nobody would ask for: garments without a person, or through which one walks, a
    garment over another that it does not touch, and cloth that falls for three seconds in empty space."""
    parts: list[Row] = [
        {"body": "none", "body contact": "on"},
        {"body": "none", "air": "sheltered"},
        {"air": "gusts", "sleep": "on"},
        {"body": "person", "body contact": "off"},
        {"body contact": "off", "gravity": "down", "pins": "none", "air": "none"},
    ]
    for two in TWO:
        parts.append({"garments": two, "self contact": "off"})
        parts.append({"garments": two, "body contact": "off", "gravity": "down"})  # nothing holds the outer one
    for cloth in LEVELS["cloth"]:
        if cloth != "balloon":  # nothing else shuts air in
            parts.append({"cloth": cloth, "pressure": "gas"})
        worn = cloth in ("tshirt", "skirt")
        parts += [{"cloth": cloth, "body": body} for body in LEVELS["body"] if worn != (body == "person")]
    for sticks in LEVELS["adhesion"][1:]:
        parts.append({"adhesion": sticks, "body contact": "off", "self contact": "off"})
    return parts


SEED = 18  # of twenty the one with few rows, one alone without contact, and many of two garments
FACTORS = Factors(LEVELS, forbidden())


@cache
def rows() -> list[Row]:
    """The array: the same every time."""
    return covering_array(FACTORS, SEED)
