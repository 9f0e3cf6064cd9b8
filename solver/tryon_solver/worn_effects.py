"""What the effects that people ask for by name (effect_words) are in the scene of a worn garment: specs, on the lines
and pieces of its pattern. Of one from outside (effect_words/outside.py) its own module says it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module

import numpy as np

from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.rules import Parameters, in_scene
from tryon_solver.effect_words.table import (
    BY_NAME,
    CLINGS,
    GREATEST_PRESSURE,
    SKIN,
    STRONGEST_GUST,
    WORDS,
    WORN_ON_BODY,
)
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.edges_once import edges_once, refuse_contradictions
from tryon_solver.geometry.lines import corners_of_edges, hinges_of_edges
from tryon_solver.geometry.named_lines import Cut
from tryon_solver.materials.fabric import FABRICS, between_fabrics
from tryon_solver.scene import (
    Adhesion,
    AirDrag,
    Attached,
    BodyContact,
    Creases,
    Effect,
    Elastic,
    ElasticLine,
    FabricDamping,
    Fasteners,
    Friction,
    Gas,
    Gravity,
    Gusts,
    Pins,
    Pressure,
    Scene,
    SelfContact,
    Sleep,
    StrainLimit,
    StretchCurves,
    Wind,
)

SLIDES = "what slides resists more than what sticks"


def effects_of(asked: Mapping[str, Parameters], cut: Cut) -> tuple[Effect, ...]:
    """The scene's effects for these, by name, each with all its parameters (EffectWord.parameters); one whose place
    another takes is left out, and so is sleep in gusts. Raises EffectError."""
    return tuple(spec_of(word.name, asked[word.name], cut) for word in WORDS if word.name in in_scene(asked))


def spec_of(name: str, parameters: Parameters, cut: Cut) -> Effect:
    """What a scene lists for an effect. Raises EffectError."""
    try:
        maker = MAKERS.get(name) or import_module(BY_NAME[name].home).spec
        return maker(parameters, cut)
    except EffectError:
        raise
    except ValueError as error:  # a spec's own check
        raise in_place(error) from error


def check(scene: Scene, asked: Mapping[str, Parameters], cut: Cut) -> tuple[Effect, ...]:
    """`effects_of`, in this scene, whose stitches of pockets and patches stay. Raises EffectError where an effect does
    not suit the scene or another effect."""
    stitches = tuple(effect for effect in scene.effects if isinstance(effect, Attached))
    effects = (*effects_of(asked, cut), *stitches)
    try:
        replace(scene, effects=effects)
    except ValueError as error:
        raise in_place(error) from error
    return effects


def in_place(error: ValueError) -> EffectError:
    """A spec's or a scene's own words, "effect: what is wrong; what to do", as field, place and remedy."""
    message, _, remedy = str(error).partition("; ")
    kind, _, said = message.partition(": ")
    name = kind.replace(" ", "_")
    field = said.split(" ", 1)[0].rstrip(":")
    known = [field.name for field in BY_NAME[name].fields] if name in BY_NAME else []
    place = f"parameters.{field}" if field in known else "parameters"
    return EffectError(said or kind, place, (remedy or "Change its parameters")[:1].upper() + remedy[1:])


def values_of(name: str, parameters: Parameters, cut: Cut) -> dict[str, np.ndarray]:
    """What of an effect a running scene takes up without being bound anew: the values of its contribution (plan.py)
    by their names, shaped as there."""
    if not has_values(name):
        return {}
    maker = VALUES.get(name) or import_module(BY_NAME[name].home).values
    return maker(parameters, cut)


def covers(name: str, one: Parameters, other: Parameters, cut: Cut) -> bool:
    """Does the entry `one` of the effect's list act on all of the mesh that the `other` one does, and in the same way
    but for values? False where the pattern of that cut has not what they name."""
    if name not in ACTS_ON:
        return False
    try:
        first, second = (ACTS_ON[name](row, cut) for row in (one, other))
    except EffectError:
        return False
    return second <= first


def has_values(name: str) -> bool:
    """Is there anything that `values_of` tells of the effect?"""
    return name in VALUES or (name not in MAKERS and BY_NAME[name].changes_live)


def _gravity(p: Parameters, _cut: Cut) -> Effect:
    return Gravity(tuple(p["acceleration"]))


def _friction(p: Parameters, cut: Cut) -> Effect:
    told = ("body", "body_kinetic", "cloth", "cloth_kinetic", "materials", "pairs")
    if all(p[name] in (None, []) for name in told):
        return Friction(presliding=p["presliding"])
    count = len(cut.pieces)
    static = _static(p, cut)
    kinetic = static.copy()
    if p["cloth_kinetic"] is not None:
        kinetic[:count, :count] = p["cloth_kinetic"]
    if p["body_kinetic"] is not None:
        kinetic[count, :count] = kinetic[:count, count] = p["body_kinetic"]  # the body has nothing to do with itself
    for name, part in (("cloth", np.s_[:count, :count]), ("body", np.s_[count, :count])):
        if (kinetic[part] > static[part]).any():
            remedy = f"Give at most {static[part].min():g}, the least that it has while it sticks"
            raise EffectError(SLIDES, f"parameters.{name}_kinetic", remedy)

    def set_pair(row: Parameters, first: np.ndarray, second: np.ndarray, place: str) -> None:
        sliding = _sliding(row)
        if sliding > row["static"]:
            remedy = f"Give at most {row['static']:g}, what they have while they stick"
            raise EffectError(SLIDES, f"{place}.kinetic", remedy)
        for table, value in ((static, row["static"]), (kinetic, sliding)):
            table[np.ix_(first, second)] = table[np.ix_(second, first)] = value

    def piece(name: str, place: str) -> int:
        return count if name == WORN_ON_BODY else cut.panel(name, place)

    materials = np.array([*(of.fabric for of in cut.pieces), SKIN])
    _refuse_two_coefficients(p["materials"], "materials", lambda name, _place: name)
    _refuse_two_coefficients(p["pairs"], "pairs", piece)
    for k, row in enumerate(p["materials"]):
        first, second = (np.flatnonzero(materials == row[side]) for side in ("first", "second"))
        set_pair(row, first, second, f"parameters.materials[{k}]")
    for k, row in enumerate(p["pairs"]):
        place = f"parameters.pairs[{k}]"
        one, other = cut.panel(row["first"], f"{place}.first"), piece(row["second"], f"{place}.second")
        set_pair(row, np.array([one]), np.array([other]), place)
    return Friction(p["presliding"], static, kinetic)


def _refuse_two_coefficients(
    rows: Sequence[Parameters], name: str, meant: Callable[[str, str], Hashable]
) -> None:
    """Raise EffectError, naming both places, where the list of that `name` tells two coefficients of the same two;
    `meant` is what a row's name at a place stands for."""
    first: dict[frozenset[Hashable], int] = {}
    for k, row in enumerate(rows):
        sides = (meant(row[side], f"parameters.{name}[{k}].{side}") for side in ("first", "second"))
        before = rows[first.setdefault(frozenset(sides), k)]
        for field, here, there in (
            ("static", row["static"], before["static"]),
            ("kinetic", _sliding(row), _sliding(before)),
        ):
            if here != there:
                two = f"{row['first']!r:.80} and {row['second']!r:.80}"
                fault = f"another {field} of {two} is told at {name}[{rows.index(before)}]"
                raise EffectError(fault, f"parameters.{name}[{k}].{field}", "Tell the two once")


def _sliding(row: Parameters) -> float:
    """What a row has while it slides: where that is not told, as while it sticks."""
    return float(row["static"] if row["kinetic"] is None else row["kinetic"])


def _static(p: Parameters, cut: Cut) -> np.ndarray:
    """(P + 1, P + 1): coefficients between the pieces and the body, which is last: as told of all cloth and the body,
    else as the pieces' fabrics have them. Raises EffectError where it is not told and no fabric is known."""
    count = len(cut.pieces)
    fabrics = [FABRICS[piece.fabric] for piece in cut.pieces if piece.fabric in FABRICS]
    for name in ("body", "cloth"):
        if p[name] is None and len(fabrics) < count:
            fault = f"{name} is not told, and what the pieces are made of is not known"
            raise EffectError(fault, f"parameters.{name}", "Give both static coefficients, or none of all these")
    static = between_fabrics(fabrics) if len(fabrics) == count else np.zeros((count + 1, count + 1))
    if p["cloth"] is not None:
        static[:count, :count] = p["cloth"]
    if p["body"] is not None:
        static[count, :] = static[:, count] = p["body"]
    return static


def _stretch_curves(p: Parameters, _cut: Cut) -> Effect:
    return StretchCurves(*(tuple((x, y) for x, y in p[name]) for name in ("warp", "weft")))


def _wind(p: Parameters, _cut: Cut) -> Effect:
    speed = float(np.linalg.norm(p["velocity"])) * (1.0 + STRONGEST_GUST * p["gusts"])
    pressure = 0.5 * p["density"] * p["broadside"] * speed**2
    if pressure > GREATEST_PRESSURE:
        blown = f"gusts of {speed:.3g} m/s press" if p["gusts"] else "it presses"
        remedy = "Have it blow slower or with weaker gusts, or lower density or broadside: cloth is torn by more than"
        fault = f"{blown} with {pressure:.0f} Pa on cloth that faces it"
        raise EffectError(fault, "parameters.velocity", f"{remedy} {GREATEST_PRESSURE:g} Pa")
    gusts = Gusts(p["gusts"], p["gust_length"], int(p["seed"])) if p["gusts"] else None
    numbers = {name: p[name] for name in ("shelter", "shelter_length", "density", "broadside", "along")}
    return Wind(tuple(p["velocity"]), gusts, **numbers)


def _pressure(p: Parameters, cut: Cut) -> Effect:
    panels = [cut.panel(name, f"parameters.panels[{k}]") for k, name in enumerate(p["panels"])]
    return Pressure(p["pressure"], tuple(panels))


def _gas(p: Parameters, cut: Cut) -> Effect:
    panels = tuple(cut.panel(name, f"parameters.panels[{k}]") for k, name in enumerate(p["panels"]))
    spec = Gas(panels=panels)
    openings = len(boundary_loops(spec.faces_of(cut.garment)))
    if openings:
        fault = f"air gets out through {openings} opening{'s' if openings > 1 else ''} that these pieces leave together"
        remedy = "Name pieces that close a volume together, or ask for pressure, which open pieces can have"
        raise EffectError(fault, "parameters.panels", remedy)
    return spec


def _pins(p: Parameters, cut: Cut) -> Effect:
    spots = [
        np.array([cut.vertex_at(row["panel"], (row["x"], row["y"]), f"parameters.points[{k}]")])
        for k, row in enumerate(p["points"])
    ]
    lines = [cut.mesh_edges(row["along"], f"parameters.lines[{k}].along").ravel() for k, row in enumerate(p["lines"])]
    if not spots and not lines:
        raise EffectError("nothing is pinned", "parameters.points", "Tell a spot of a piece, or an edge in lines")
    vertices = np.unique(np.concatenate([*spots, *lines])).astype(np.int32)
    return Pins(vertices, p["stiffness"], led=p["to"] == "body")


def _elastic(p: Parameters, cut: Cut) -> Effect:
    each = edges_once(cut, p["lines"], "parameters.lines")
    refuse_contradictions(cut, p["lines"], ("ratio", "stiffness"), "parameters.lines")
    return Elastic(tuple(ElasticLine(e, row["ratio"], row["stiffness"]) for e, row in zip(each, p["lines"])))


def elastic_lengths(p: Parameters, cut: Cut) -> np.ndarray:
    """(L,) m in the pattern, of each line."""
    flat = cut.garment.uv_corners.reshape(-1, 2)
    each = edges_once(cut, p["lines"], "parameters.lines")
    corners = [corners_of_edges(cut.garment, edges, "elastic") for edges in each]
    return np.array([np.linalg.norm(flat[of[:, 0]] - flat[of[:, 1]], axis=1).sum() for of in corners])


def _creases(p: Parameters, cut: Cut) -> Creases:
    edges = edges_once(cut, p["lines"], "parameters.lines")
    refuse_contradictions(cut, p["lines"], ("angle",), "parameters.lines")
    for k, line in enumerate(edges):
        try:
            hinges_of_edges(cut.garment, line, "creases")
        except ValueError as error:
            remedy = "Press an edge that is sewn: a border has but one side"
            raise EffectError("it is no seam along all its length", f"parameters.lines[{k}].along", remedy) from error
    return Creases(np.vstack(edges), _angles(p, edges))


def _angles(p: Parameters, edges: Sequence[np.ndarray]) -> np.ndarray:
    """(K,) rad, of each line's edges."""
    angles = np.radians([row["angle"] for row in p["lines"]]).astype(np.float32)
    return np.repeat(angles, [len(line) for line in edges])


def _fasteners(p: Parameters, cut: Cut) -> Effect:
    rows = _fastened(p, cut)
    first: dict[frozenset[int], int] = {}
    for k, pairs in enumerate(rows):
        for pair in pairs.tolist():
            before = first.setdefault(frozenset(pair), k)
            if p["rows"][before]["closed"] != p["rows"][k]["closed"]:
                fault = f"it has a button of rows[{before}], of which closed is {p['rows'][before]['closed']:g}"
                remedy = "Have the same closed in both, or one row of them"
                raise EffectError(fault, f"parameters.rows[{k}].closed", remedy)
    return Fasteners(np.vstack(_pairs_once(rows)), p["stiffness"], p["speed"])


def _pairs_once(rows: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Of each row the pairs (K, 2) that are not fastened yet: a button told twice, from either side, is one, and so are
    two between the same vertices of a coarse mesh."""
    taken: set[frozenset[int]] = set()
    found = []
    for pairs in rows:
        new = []
        for k, pair in enumerate(map(frozenset, pairs.tolist())):
            if pair not in taken:
                taken.add(pair)
                new.append(k)
        found.append(pairs[new])
    return found


def _fastened(p: Parameters, cut: Cut) -> list[np.ndarray]:
    """Pairs (K, 2) int32 of vertices of each row: buttons in the middle of equal parts of both edges, a zip's teeth at
    all vertices of the one that has fewer."""
    rows = []
    for k, row in enumerate(p["rows"]):
        sides = cut.facing(*(cut.line(row[side], f"parameters.rows[{k}].{side}") for side in ("first", "second")))
        count = row["buttons"] or min(len(side) for side in sides)
        shares = (np.arange(count) + 0.5) / count if row["buttons"] else np.linspace(0.0, 1.0, count)
        pairs = np.column_stack([side[np.rint(shares * (len(side) - 1)).astype(int)] for side in sides])
        apart = pairs[:, 0] != pairs[:, 1]
        if not apart.any():
            place = f"parameters.rows[{k}]"
            raise EffectError("the two edges are one seam", place, "Name two edges that are not sewn together")
        rows.append(pairs[apart].astype(np.int32))
    return rows


def _closed(p: Parameters, cut: Cut) -> np.ndarray:
    counts = [len(pairs) for pairs in _pairs_once(_fastened(p, cut))]
    return np.repeat([row["closed"] for row in p["rows"]], counts).astype(np.float32)


def _adhesion(p: Parameters, cut: Cut) -> Effect:
    strength, work = CLINGS[p["kind"]]
    vertices = None
    if p["panels"]:
        panels = [cut.panel(name, f"parameters.panels[{k}]") for k, name in enumerate(p["panels"])]
        faces = cut.garment.faces[np.isin(cut.garment.panel_of_face, panels)]
        vertices = np.unique(faces).astype(np.int32)
    strength = strength if p["strength"] is None else p["strength"]
    work = work if p["work"] is None else p["work"]
    return Adhesion(strength, work, vertices)


MAKERS: Mapping[str, Callable[[Parameters, Cut], Effect]] = {
    "gravity": _gravity,
    "body_contact": lambda _p, _cut: BodyContact(),
    "self_contact": lambda _p, _cut: SelfContact(),
    "friction": _friction,
    "strain_limit": lambda p, _cut: StrainLimit(p["stiffness"]),
    "stretch_curves": _stretch_curves,
    "air_drag": lambda p, _cut: AirDrag(p["coefficient"]),
    "wind": _wind,
    "fabric_damping": lambda p, _cut: FabricDamping(p["time"]),
    "pressure": _pressure,
    "gas": _gas,
    "pins": _pins,
    "elastic": _elastic,
    "creases": _creases,
    "fasteners": _fasteners,
    "adhesion": _adhesion,
    "sleep": lambda p, _cut: Sleep(speed=p["speed"], fastest=2.5 * p["speed"], time=p["time"]),
}
def _along(row: Parameters, cut: Cut) -> frozenset[Hashable]:
    """Each edge of the mesh along the entry's line, and how stiff it is there, if that is told."""
    edges = np.sort(cut.mesh_edges(row["along"], "along"), axis=1).tolist()
    return frozenset((low, high, row.get("stiffness")) for low, high in edges)


ACTS_ON: Mapping[str, Callable[[Parameters, Cut], frozenset[Hashable]]] = {
    "elastic": _along,
    "creases": _along,
    "fasteners": lambda row, cut: frozenset(map(frozenset, _fastened({"rows": [row]}, cut)[0].tolist())),
}
VALUES: Mapping[str, Callable[[Parameters, Cut], dict[str, np.ndarray]]] = {
    "gravity": lambda p, _cut: {"acceleration": np.array([p["acceleration"]], np.float32)},
    "wind": lambda p, _cut: {"velocity": np.array([p["velocity"]], np.float32)},
    "pressure": lambda p, _cut: {"pressure": np.array([p["pressure"]], np.float32)},
    "gas": lambda p, _cut: {"share": np.array([p["share"]], np.float64)},
    "elastic": lambda p, _cut: {"ratio": np.array([row["ratio"] for row in p["lines"]], np.float32)},
    "creases": lambda p, cut: {"angles": _angles(p, edges_once(cut, p["lines"], "parameters.lines"))},
    "fasteners": lambda p, cut: {"closed": _closed(p, cut)},
    "adhesion": lambda p, _cut: {"share": np.array([p["share"]], np.float32)},
}
