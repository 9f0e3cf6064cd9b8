"""The effects that a running scene can be asked for, by name, with their parameters.

Light to import: nothing of the solver is needed to check what somebody asks for. What becomes of it in a scene is
tryon_solver/worn_effects.py, or the effect's own module where it comes from outside.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from tryon_solver.effect_words.fields import (
    Choice,
    Coordinate,
    Curve,
    Edges,
    EffectError,
    Field,
    Number,
    Panel,
    Panels,
    Rows,
    Vector,
    choose_one_of,
)
from tryon_solver.effect_words.outside import words_from_outside
from tryon_solver.effect_words.word import EffectWord

AUTO = "auto"  # in place of an effect's name: have those armed that garment and motion may call for
CLINGS = {"static_cling": (5.0, 5e-4), "wet_cling": (100.0, 0.05), "hook_and_loop": (2e4, 15.0), "tape": (1e3, 1.0)}
"""How strongly contacts stick: strength [Pa] and work [J/m^2], orders of magnitude (effect_specs.Adhesion); of hook
and loop those of a light closure, as on a cuff."""


GREATEST_PRESSURE = 1000.0
"""Pa that inflated pieces, and air that blows in its strongest gusts, may press with: fifty times a garment's usual
inflation, and over the 650 Pa of a violent storm of 30 m/s."""
STRONGEST_GUST = 3.0
"""Standard deviations of the wind's speed above its mean, which one in seven hundred moments exceeds."""

SKIN = "skin"
WORN_ON_BODY = "body"  # in place of a piece's name
FABRICS = (
    "cotton_jersey",
    "cotton_poplin",
    "wool_twill",
    "denim",
    "silk_charmeuse",
    "viscose_jersey",
    "polyester_satin",
    "linen",
    "silk_taffeta",
    "cotton_canvas",
)
"""Materials whose friction may be told: those of materials/fabric.py, which is higher than this."""


def _coefficient(name: str, about: str) -> Number:
    return Number(name, about, "", high=2.0, open=True)


def _coordinate(axis: Literal["x", "y"]) -> Coordinate:
    about = "of the spot, as the piece's pattern is drawn, in the size that is worn"
    return Coordinate(axis, about, "m", low=-10.0, high=10.0, needed=True, axis=axis)


def _line(about: str) -> Edges:
    return Edges("along", about, needed=True)


NOWHERE = (0.0, 0.0, 0.0)
RAMP = Number("ramp", "over which it comes in, changes and goes, at least", "s", live=True, high=5.0, untold=0.1)
"""As long as an edit's shape takes to come (live_edit.py): at full strength at once a frame takes many iterations."""
GUSTS = (
    Number("gusts", "how much the wind's speed varies, over its mean; 0: it blows evenly", "", high=1.0),
    Number("gust_length", "how large its eddies are", "m", low=0.1, high=100.0, untold=5.0),
    Number("seed", "which gusts are drawn", "", high=2**31 - 1, whole=True),
)
ELASTIC = (
    Number("ratio", "its length, over the line's", "", live=True, idle=1.0, low=0.2, high=1.5, untold=0.8),
    Number("stiffness", "force per strain", "N", low=0.1, high=1000.0, untold=30.0),
)
CREASE = (Number("angle", "above 0 a ridge", "degrees", live=True, idle=0.0, low=-160.0, high=160.0, untold=60.0),)
BUTTONS = Number("buttons", "how many, evenly; null: a zip", "", low=1, high=64, open=True, whole=True)
BUILT_IN = (
    EffectWord(
        "gravity",
        "Gravity",
        "weight",
        (
            Vector("acceleration", "of what falls", "m/s²", True, idle=NOWHERE, longest=50.0, untold=(0.0, -9.81, 0.0)),
            RAMP,
        ),
    ),
    EffectWord("body_contact", "Contact with the body", "keeps the cloth off the body", kept=True),
    EffectWord("self_contact", "Contact with itself", "keeps the cloth off the cloth", kept=True),
    EffectWord(
        "friction",
        "Friction",
        "static and kinetic, of all contacts; what is not told is as the fabrics have it",
        (
            Number("presliding", "by how much a contact gives before it slides", "m", low=1e-6, high=1e-2, untold=1e-4),
            _coefficient("body", "static, between cloth and body"),
            _coefficient("body_kinetic", "of cloth that slides on the body"),
            _coefficient("cloth", "static, between cloth and cloth"),
            _coefficient("cloth_kinetic", "of cloth that slides on cloth"),
            Rows(
                "materials",
                "two fabrics, or a fabric and the skin, that have others, wherever they are worn",
                fields=(
                    Choice("first", "a fabric", of=FABRICS),
                    Choice("second", "another fabric, the same, or the skin", of=(SKIN, *FABRICS)),
                    Number("static", "while they stick", "", high=2.0, untold=0.3),
                    _coefficient("kinetic", "while they slide; null: as while they stick"),
                ),
            ),
            Rows(
                "pairs",
                "two pieces, or a piece and the body, that have others, whatever they are made of",
                fields=(
                    Panel("first", "a piece of the garment", needed=True),
                    Panel("second", 'another one, the same, or "body"', needed=True, besides=(WORN_ON_BODY,)),
                    Number("static", "while they stick", "", high=2.0, untold=0.3),
                    _coefficient("kinetic", "while they slide"),
                ),
            ),
        ),
    ),
    EffectWord(
        "strain_limit",
        "Strain limit",
        "stiffens the fabric where it is stretched as far as it goes",
        (Number("stiffness", "of what is stretched farther", "N/m", low=100.0, high=1e5, untold=20000.0),),
    ),
    EffectWord(
        "stretch_curves",
        "Measured stretch",
        "measured curves of the fabric, in place of its own stiffness: tension by strain, from (0, 0) on, rising",
        (Curve("warp", "along the warp", "N/m"), Curve("weft", "along the weft", "N/m")),
    ),
    EffectWord(
        "air_drag",
        "Air at rest",
        "slows the cloth in proportion to its speed",
        (Number("coefficient", "force per area and speed", "N s/m³", high=20.0, untold=1.7),),
    ),
    EffectWord(
        "wind",
        "Wind",
        "air that blows, or stands still, and presses by the square of the speed; it takes the place of air at rest",
        (
            Vector("velocity", "where it blows to", "m/s", True, idle=NOWHERE, longest=30.0, untold=(2.0, 0.0, 0.0)),
            *GUSTS,
            Number("shelter", "share of it that the body keeps off what is behind it", "", high=1.0, untold=0.8),
            Number("shelter_length", "in which it wins that back", "m", low=0.05, high=20.0, untold=1.0),
            Number("density", "of the air", "kg/m³", high=10.0, untold=1.2),
            Number("broadside", "coefficient of cloth that the air meets straight on", "", high=5.0, untold=1.2),
            Number("along", "coefficient of cloth that it strokes", "", high=5.0, untold=0.01),
            RAMP,
        ),
        takes_place_of=("air_drag",),
    ),
    EffectWord(
        "fabric_damping",
        "Damping of the fabric",
        "calms vibrations within the cloth",
        (Number("time", "damping over stiffness (effect_specs.FabricDamping)", "s", high=0.1, untold=5e-3),),
    ),
    EffectWord(
        "pressure",
        "Inflated pieces",
        "more pressure behind the cloth than before it",
        (
            Number(
                "pressure",
                "how much more",
                "Pa",
                live=True,
                idle=0.0,
                low=-200.0,
                high=GREATEST_PRESSURE,
                untold=20.0,
            ),
            Panels("panels", "pieces that it acts on; none: all"),
            RAMP,
        ),
    ),
    EffectWord(
        "gas",
        "Shut-in air",
        "pieces that close a volume together, full of air that resists being squeezed; a body within counts as air",
        (
            Number(
                "share",
                "of the air that they have room for as it is shut in",
                "",
                live=True,
                idle=1.0,
                low=0.5,
                high=2.0,
                untold=1.0,
            ),
            Panels("panels", "pieces that shut it in; none: all"),
            RAMP,
        ),
    ),
    EffectWord(
        "pins",
        "Pins",
        "hold spots and edges of the garment where they are as the pins are set",
        (
            Choice("to", "what they are pinned to: the body, which leads them, or the room", of=("body", "room")),
            Rows(
                "points",
                "spots of pieces that are pinned",
                fields=(
                    Panel("panel", "the piece", needed=True),
                    _coordinate("x"),
                    _coordinate("y"),
                ),
            ),
            Rows(
                "lines",
                "edges of the pattern that are pinned all along",
                fields=(_line("edges, one after the other"),),
            ),
            Number("stiffness", "of the pin at each vertex", "N/m", low=10.0, high=1e5, untold=1000.0),
        ),
        lined=True,
    ),
    EffectWord(
        "elastic",
        "Elastic",
        "waistbands, cuffs, drawstrings: lines of the pattern that are drawn to another length",
        (
            Rows(
                "lines",
                "edges of the pattern with elastic in them",
                live=True,
                needed=True,
                fields=(_line("edges that it is sewn along"), *ELASTIC),
            ),
            RAMP,
        ),
        lined=True,
    ),
    EffectWord(
        "creases",
        "Creases",
        "seams that are pressed: they rest at an angle instead of flat",
        (
            Rows(
                "lines",
                "sewn edges of the pattern that are pressed",
                live=True,
                needed=True,
                fields=(_line("edges that are pressed"), *CREASE),
            ),
            RAMP,
        ),
        lined=True,
    ),
    EffectWord(
        "fasteners",
        "Buttons and zips",
        "hold two edges of the pattern together, and can be opened",
        (
            Rows(
                "rows",
                "pairs of edges of the pattern that are fastened",
                live=True,
                needed=True,
                fields=(
                    Edges("first", "one side", needed=True),
                    Edges("second", "the other side", needed=True),
                    BUTTONS,
                    Number("closed", "1: closed, 0: open", "", live=True, idle=0.0, untold=1.0),
                ),
            ),
            Number("stiffness", "of each button or tooth", "N/m", low=10.0, high=1e5, untold=2e4),
            Number("speed", "at which what is apart is drawn together", "m/s", low=0.01, high=10.0, untold=0.5),
            RAMP,
        ),
        lined=True,
    ),
    EffectWord(
        "adhesion",
        "Adhesion",
        "contacts that stick: tape, hook and loop, static or wet cling",
        (
            Choice("kind", "what makes it stick", of=tuple(CLINGS)),
            Number("strength", "against being pulled off; null: the kind's", "Pa", high=1e5, open=True),
            Number("work", "to part it; null: the kind's", "J/m²", high=100.0, open=True),
            Number("share", "of it that still sticks", "", live=True, idle=0.0, untold=1.0),
            Panels("panels", "pieces that are sticky; none: all"),
            RAMP,
        ),
    ),
    EffectWord(
        "sleep",
        "Sleep",
        "leaves a garment alone that hangs still on a body that stands still",
        (
            Number("time", "for which nothing has to have moved", "s", low=0.05, high=60.0, untold=0.5),
            Number("speed", "below which cloth stands still, RMS", "m/s", low=1e-5, high=0.1, untold=1e-3),
        ),
    ),
)
WORDS = (*BUILT_IN, *words_from_outside({word.name for word in BUILT_IN}))
"""These, and what installed packages bring (outside.py)."""
BY_NAME: Mapping[str, EffectWord] = {word.name: word for word in WORDS}
ON_EDGES: Mapping[str, tuple[Field, ...]] = {
    "elastic": ELASTIC,
    "crease": CREASE,
    "fastened": (Panel("as", "a name that both sides have", needed=True), BUTTONS),
}
"""What an edge of a pattern may carry (geometry/edge_effects.py), and the parameters of each."""
LIVE = ("gravity", "body_contact", "self_contact", "friction", "strain_limit", "air_drag", "fabric_damping", "sleep")
"""What a garment is worn with unless something else is asked for: the scene's LIVE (tryon_solver/scene.py)."""


def live() -> dict[str, dict[str, Any]]:
    """Parameters of each of LIVE, by name."""
    return {name: BY_NAME[name].parameters() for name in LIVE}


def word_of(name: str) -> EffectWord:
    """The effect of this name. Raises EffectError, which lists those that there are."""
    if name not in BY_NAME:
        raise EffectError(f"there is no effect {name!r:.80}", "name", choose_one_of(name, tuple(BY_NAME)))
    return BY_NAME[name]
