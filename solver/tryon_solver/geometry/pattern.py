"""Sewing patterns: reads and checks the pattern specification JSON that GarmentCode writes.

Source of the format: https://github.com/maria-korosteleva/GarmentCode (pygarment/pattern and pygarment/meshgen). A
specification is `{"pattern": {"panels": {name: panel}, "stitches": [...]}, "properties": {"units_in_meter": 100}}`.
Everything is converted to metres here, once. Every fault raises PatternError, which names the place and the remedy.

Four additions to the format. A stitch may carry the word "gather" as it may carry "right_wrong": it declares that one
side is meant to be much longer than the other. A panel may lie on the right side of another, as a pocket does:
`"on": {"panel": name, "at": [x, y], "turn": degrees, "open": [edges]}` puts its origin there in that panel's plane and
sews it on along all edges but the open ones; its own translation and rotation then count for nothing.
`properties.fabric` names what the garment is made of, for whoever dresses it and knows the name. Edges may carry
elastic, creases, buttons and zips (edge_effects.py).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tryon_solver.effect_words.fields import EffectError
from tryon_solver.geometry import curves, outline
from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.edge_effects import EdgeEffect, called_for, read_edge_effects
from tryon_solver.geometry.located_error import LocatedError
from tryon_solver.geometry.patch import Patch, lies_within, overlap
from tryon_solver.geometry.seam_numbers import fault_of_numbers
from tryon_solver.geometry.text_check import RENAME_IT, find_unencodable

# Ease of sleeve caps and waists reaches a length ratio of 1.10 in real patterns; beyond 1.5 a seam is far likelier to
# join the wrong edges than to be meant. Declared gathers go to a ratio of 4, beyond which pleats must be drawn.
SEAM_RATIO_LIMIT = 1.5
GATHER_RATIO_LIMIT = 4.0

# A piece smaller than a belt loop or larger than a floor-length full circle skirt was drawn in another unit. The
# largest piece of a garment for a person is larger than a hand.
PIECE_SIZE_MIN = 0.005  # m
PIECE_SIZE_MAX = 4.0  # m
LARGEST_PIECE_MIN = 0.1  # m
UNITS_IN_METER_MIN, UNITS_IN_METER_MAX = 0.1, 1e5  # from decametres to a hundredth of a millimetre
POSITION_MAX = 10.0  # m, of a piece from the origin between the feet

# Relative control points of real patterns stay within 2 edge lengths; absolute ones in centimetres do not.
CONTROL_POINT_MAX = 20.0

EDGE_LENGTH_MIN = 1e-4  # m, below the resolution of any cutter
AREA_MIN = 1e-6  # m^2
AREA_TO_PERIMETER_SQUARED_MIN = 1e-5  # a band ten thousand times longer than wide
CONTACT_TOLERANCE = 1e-6  # m

# Beyond this an arc is straight: it bulges by chord / 80,000, less than any cutter resolves.
STRAIGHT_RADIUS = 1e4  # chords
ROTATION_MAX = 3600.0  # degrees; more turns are no placement

# Bounds the outline tests to some seconds.
PANELS_MAX = 200
EDGES_MAX = 400  # of a panel
EDGES_TOTAL_MAX = 2000
CHECK_SEGMENTS = 32  # straight pieces that stand for a curved edge in the outline test
FLAT = 1e-4  # an outline thinner than this share of its length has no area to cross itself in

FABRIC_NAME_MAX = 200  # characters
STITCH_FLAGS = ("right_wrong", "gather")
WHOLE = "specification"


class PatternError(LocatedError):
    """A fault in a pattern: what is wrong, where, and what to do about it."""


@dataclass(frozen=True)
class PatternEdge:
    """One edge of a piece, running along the outline."""

    curve: curves.Curve  # in the piece's own plane, m
    length: float  # m
    label: str  # "" when the file gives none


@dataclass(frozen=True)
class Panel:
    """One flat piece of fabric. Its edges form a single closed loop, each starting where the one before ends."""

    name: str
    corners: Points  # (E, 2) m, corner e is the start of edge e
    edges: tuple[PatternEdge, ...]
    clockwise: bool  # the loop turns clockwise: the right side of the fabric faces the piece's -z
    translation: Points  # (3,) m
    rotation: Points  # (3, 3), world from piece
    label: str  # "" when the file gives none


@dataclass(frozen=True)
class StitchSide:
    """One edge of a stitch, by the index of its piece and of the edge in it."""

    panel: int
    edge: int


@dataclass(frozen=True)
class Stitch:
    """Two whole edges sewn together; `reversed` joins the start of one to the end of the other, the usual case."""

    first: StitchSide
    second: StitchSide
    reversed: bool
    gather: bool


@dataclass(frozen=True)
class Pattern:
    """A checked sewing pattern in metres."""

    panels: tuple[Panel, ...]
    stitches: tuple[Stitch, ...]
    patches: tuple[Patch, ...] = ()
    fabric: str | None = None  # its name; None where the file names none
    edge_effects: tuple[EdgeEffect, ...] = ()

    @property
    def panel_names(self) -> tuple[str, ...]:
        return tuple(panel.name for panel in self.panels)

    @property
    def effects(self) -> dict[str, dict[str, Any]]:
        """What its edges call for: effects by name, with all their parameters."""
        return called_for(self.edge_effects, self.panel_names, [len(panel.edges) for panel in self.panels])


class NotJsonError(PatternError):
    """A pattern file that can't be read as JSON."""


def load_pattern(path: str | Path) -> Pattern:
    """Read and check the pattern specification file at the path. Raises PatternError."""
    return parse_pattern_bytes(read_pattern_file(path))


def read_pattern_file(path: str | Path) -> bytes:
    """What the file at the path holds, unchecked. Raises PatternError when it can't be read."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise PatternError(
            f"the file cannot be read ({error.strerror})", str(path), "Give the path of a pattern file"
        ) from error


def parse_pattern_bytes(content: bytes) -> Pattern:
    """Read and check a pattern specification: JSON in UTF-8. Raises PatternError; NotJsonError for what is no JSON."""
    spec = _read_json(content)
    if (found := find_unencodable(spec)) is not None:
        place, message = found
        raise PatternError(message, place.removeprefix("pattern."), RENAME_IT)
    return parse_pattern(spec)


def _read_json(content: bytes) -> Any:
    remedy = "Give the pattern specification in JSON that the pattern tool wrote"
    try:
        return json.loads(content.decode("utf-8-sig"), object_pairs_hook=_object)
    except UnicodeDecodeError as error:
        message = f"not a JSON file: it is not text in UTF-8 ({error.reason})"
        raise NotJsonError(message, f"byte {error.start}", remedy) from error
    except json.JSONDecodeError as error:
        raise NotJsonError(
            f"not a JSON file: {error.msg}", f"line {error.lineno} column {error.colno}", remedy
        ) from error
    except RecursionError as error:
        raise NotJsonError("not a JSON file: it is nested too deeply", WHOLE, remedy) from error
    except PatternError:
        raise
    except ValueError as error:  # Python's own limit on the digits of an integer
        raise NotJsonError("not a JSON file: a number has thousands of digits", WHOLE, remedy) from error


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object; of a key that stands twice, one would be lost without a word."""
    held: dict[str, Any] = {}
    for key, value in pairs:
        if key in held:
            message = f"the key {key!r:.80} stands twice in one object"
            raise PatternError(message, WHOLE, "Give each of the two a name of its own, or remove one")
        held[key] = value
    return held


def parse_pattern(spec: Mapping[str, Any]) -> Pattern:
    """Check a pattern specification and convert it to metres.

    spec: the parsed JSON. Raises PatternError at the first fault, naming it like "panels.front.edges[3].curvature".
    """
    remedy = "Give a pattern specification as GarmentCode writes it, with pattern.panels and properties.units_in_meter"
    if not isinstance(spec, Mapping) or not isinstance(spec.get("pattern"), Mapping):
        raise PatternError("this is not a sewing pattern: it has no 'pattern' object", WHOLE, remedy)
    body = spec["pattern"]
    panels_spec = body.get("panels")
    if not isinstance(panels_spec, Mapping) or not panels_spec:
        raise PatternError("the pattern has no panels", "panels", remedy)
    if len(panels_spec) > PANELS_MAX:
        raise PatternError(f"{len(panels_spec)} panels, more than {PANELS_MAX}", "panels", "Split the garment")
    edge_count = sum(len(panel["edges"]) for panel in panels_spec.values() if _has_edges(panel))
    if edge_count > EDGES_TOTAL_MAX:
        message = f"{edge_count} edges in all, more than {EDGES_TOTAL_MAX}"
        raise PatternError(message, "panels", "Use curves instead of many short lines")
    scale = _metres_per_unit(spec.get("properties"))
    panels = tuple(_panel(name, panels_spec[name], scale) for name in _panel_names(body, panels_spec))
    _check_garment_size(panels)
    stitches = _stitches(body.get("stitches", []), panels)
    patches = _patches(panels_spec, panels, stitches, scale)
    effects = _edge_effects(panels, panels_spec, stitches)
    return Pattern(panels, stitches, patches, _fabric(spec["properties"].get("fabric")), effects)


def _edge_effects(
    panels: Sequence[Panel], specs: Mapping[str, Any], stitches: Sequence[Stitch]
) -> tuple[EdgeEffect, ...]:
    seams = [tuple((side.panel, side.edge) for side in (stitch.first, stitch.second)) for stitch in stitches]
    try:
        return read_edge_effects([(panel.name, specs[panel.name]["edges"]) for panel in panels], seams)
    except EffectError as error:
        raise PatternError(error.message, error.place, error.remedy) from error


def _has_edges(panel: Any) -> bool:
    return isinstance(panel, Mapping) and isinstance(panel.get("edges"), list)


def _metres_per_unit(properties: Any) -> float:
    place = "properties.units_in_meter"
    if not isinstance(properties, Mapping) or "units_in_meter" not in properties:
        raise PatternError(
            "the unit of length is not stated", place, "State it: 100 for centimetres, 1000 for millimetres"
        )
    units = _number(properties["units_in_meter"], place)
    if not UNITS_IN_METER_MIN <= units <= UNITS_IN_METER_MAX:
        raise PatternError(f"{units:g} units in a metre is not a unit of length", place, "State 100 for centimetres")
    coordinates = properties.get("curvature_coords", "relative")
    if coordinates != "relative":
        remedy = "Write curvature relative to the edge (GarmentCode's default)"
        raise PatternError(f"curvature coordinates {coordinates!r} are not read", "properties.curvature_coords", remedy)
    return 1.0 / units


def _fabric(name: Any) -> str | None:
    if name is not None and not (isinstance(name, str) and 0 < len(name) <= FABRIC_NAME_MAX):
        message = f"not the name of a fabric, a text of at most {FABRIC_NAME_MAX} characters"
        raise PatternError(message, "properties.fabric", "Name a fabric, or leave it out")
    return name


def _panel_names(body: Mapping[str, Any], panels: Mapping[str, Any]) -> list[str]:
    """Names of the panels in the stated order, else in the file's."""
    order = body.get("panel_order")
    if order is None:
        return list(panels)
    named = isinstance(order, list) and all(isinstance(name, str) for name in order)
    if not named or sorted(order) != sorted(panels):
        remedy = "List each name of panels once, or leave it out"
        raise PatternError("it does not list every panel once", "panel_order", remedy)
    return order


def _panel(name: str, spec: Any, scale: float) -> Panel:
    place = f"panels.{name}"
    if not isinstance(spec, Mapping):
        raise PatternError("not a panel", place, "Give an object with vertices and edges")
    vertices = _vertices(spec.get("vertices"), f"{place}.vertices", scale)
    ends = _edge_loop(spec.get("edges"), f"{place}.edges", len(vertices))
    _check_piece_size(vertices, place)
    pairs = enumerate(zip(spec["edges"], ends))
    edges = tuple(_edge(edge, vertices[a], vertices[b], f"{place}.edges[{i}]", scale) for i, (edge, (a, b)) in pairs)
    area = _check_outline(edges, place)
    translation = _vector(spec.get("translation", [0, 0, 0]), 3, f"{place}.translation") * scale
    if np.abs(translation).max() > POSITION_MAX:
        raise PatternError(
            f"the panel is placed {np.abs(translation).max():.3g} m from the origin",
            f"{place}.translation",
            f"Place it within {POSITION_MAX:g} m, and check properties.units_in_meter",
        )
    degrees = _vector(spec.get("rotation", [0, 0, 0]), 3, f"{place}.rotation")
    if np.abs(degrees).max() > ROTATION_MAX:
        message = f"the panel is turned by {np.abs(degrees).max():.3g} degrees"
        raise PatternError(message, f"{place}.rotation", "Give angles about x, y and z in degrees, -180 to 180")
    angles = np.radians(degrees)
    corners = vertices[[a for a, _ in ends]]
    label = _label(spec, place)
    return Panel(name, corners, edges, area < 0, translation, rotation_from_euler(angles), label)


def rotation_from_euler(angles: Points) -> Points:
    """Rotation matrix Rz Ry Rx (3, 3) of the angles (3,) about x, y, z [rad]: the order of GarmentCode's mesher."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _vertices(spec: Any, place: str, scale: float) -> Points:
    if not isinstance(spec, Sequence) or isinstance(spec, str) or len(spec) < 2:
        raise PatternError("a panel needs corner points", place, "Give them as [x, y] pairs")
    return np.array([_vector(point, 2, f"{place}[{i}]") for i, point in enumerate(spec)]) * scale


def _edge_loop(spec: Any, place: str, vertex_count: int) -> list[tuple[int, int]]:
    """End points of the edges, checked to form one closed loop through all vertices."""
    if not isinstance(spec, list) or len(spec) < 2:
        raise PatternError("a panel needs at least two edges", place, "Give the edges of its outline in order")
    if len(spec) > EDGES_MAX:
        raise PatternError(f"{len(spec)} edges, more than {EDGES_MAX}", place, "Use curves instead of many short lines")
    ends = []
    for i, edge in enumerate(spec):
        here = f"{place}[{i}]"
        pair = edge.get("endpoints") if isinstance(edge, Mapping) else None
        if not isinstance(pair, list) or len(pair) != 2 or not all(_is_index(v) for v in pair):
            raise PatternError(
                "an edge needs two end points", here, "Give endpoints as two indices of the panel's vertices"
            )
        for vertex in pair:
            if not 0 <= vertex < vertex_count:
                raise PatternError(f"there is no vertex {vertex}", f"{here}.endpoints", f"Use 0 to {vertex_count - 1}")
        ends.append((pair[0], pair[1]))
    for i, (_, end) in enumerate(ends):
        following = (i + 1) % len(ends)
        if ends[following][0] != end:
            start = ends[following][0]
            message = (
                f"the edges do not close a loop: edge {i} ends at vertex {end}, edge {following} starts at {start}"
            )
            raise PatternError(message, f"{place}[{i}].endpoints", "List the edges in order around one closed outline")
    if sorted(start for start, _ in ends) != list(range(vertex_count)):
        message = "the loop of edges does not pass once through every vertex"
        raise PatternError(message, place, "Use each vertex in one loop; holes and detached points are not read")
    return ends


def _edge(spec: Mapping[str, Any], start: Points, end: Points, place: str, scale: float) -> PatternEdge:
    if np.hypot(*(end - start)) < EDGE_LENGTH_MIN:
        raise PatternError("the edge's end points coincide", place, "Remove the edge or move a vertex")
    curvature = spec.get("curvature")
    curve = edge_curve(curvature, start, end, f"{place}.curvature", scale)
    return PatternEdge(curve, curves.length(curve), _label(spec, place))


def edge_curve(spec: Any, start: Points, end: Points, place: str, scale: float) -> curves.Curve:
    """The curve of an edge from start to end, each (2,) m, with this curvature; None is a straight line.

    scale: metres in a unit of the file. A bare [u, v] is a quadratic curve, as in GarmentCode's older files. Raises
    PatternError.
    """
    if spec is None:
        return curves.line(start, end)
    kind, params = ("quadratic", [spec]) if isinstance(spec, list) else _curvature_parts(spec, place)
    if kind == "circle":
        return _circle(params, start, end, place, scale)
    controls = {"quadratic": 1, "cubic": 2}.get(kind)
    if controls is None:
        raise PatternError(f"unknown curvature type {kind!r}", f"{place}.type", "Use quadratic, cubic or circle")
    if len(params) != controls:
        raise PatternError(
            f"a {kind} edge has {controls} control points, not {len(params)}", f"{place}.params", "Give [u, v] pairs"
        )
    points = np.array([_vector(point, 2, f"{place}.params[{i}]") for i, point in enumerate(params)])
    if np.abs(points).max() > CONTROL_POINT_MAX:
        message = f"a control point lies {np.abs(points).max():.3g} edge lengths away"
        raise PatternError(
            message, f"{place}.params", "Give control points relative to the edge, [u, v] in edge lengths"
        )
    return curves.relative_bezier(start, end, points)


def _curvature_parts(spec: Any, place: str) -> tuple[Any, list[Any]]:
    if (
        not isinstance(spec, Mapping)
        or not isinstance(spec.get("params"), list)
        or not isinstance(spec.get("type"), str)
    ):
        raise PatternError("not a curvature", place, 'Give {"type": "quadratic" | "cubic" | "circle", "params": [...]}')
    return spec["type"], spec["params"]


def _circle(params: list[Any], start: Points, end: Points, place: str, scale: float) -> curves.Curve:
    if len(params) != 3 or any(flag not in (0, 1) for flag in params[1:]):
        raise PatternError("not a circular arc", f"{place}.params", "Give [radius, large_arc 0 or 1, right 0 or 1]")
    radius = _number(params[0], f"{place}.params[0]") * scale
    if radius > PIECE_SIZE_MAX and params[1]:
        message = f"the larger arc of a circle of radius {radius:.3g} m does not fit a panel of {PIECE_SIZE_MAX:g} m"
        raise PatternError(message, f"{place}.params[0]", "Give a smaller radius, or 0 for large_arc")
    if radius > STRAIGHT_RADIUS * np.hypot(*(end - start)):
        return curves.line(start, end)
    try:
        return curves.arc_by_flags(start, end, radius, bool(params[1]), bool(params[2]))
    except ValueError as error:
        raise PatternError(
            str(error), f"{place}.params[0]", "Give at least half the distance of the end points"
        ) from error


def _check_piece_size(points: Points, place: str) -> None:
    size = float((points.max(axis=0) - points.min(axis=0)).max())
    if not PIECE_SIZE_MIN <= size <= PIECE_SIZE_MAX:
        raise PatternError(
            f"the panel is {size:.3g} m across, outside {PIECE_SIZE_MIN:g} to {PIECE_SIZE_MAX:g} m",
            place,
            "Check properties.units_in_meter: 100 for centimetres, 1000 for millimetres",
        )


def _check_garment_size(panels: Sequence[Panel]) -> None:
    sizes = [float(np.ptp(panel.corners, axis=0).max()) for panel in panels]
    if max(sizes) < LARGEST_PIECE_MIN:
        raise PatternError(
            f"the largest panel is only {max(sizes):.3g} m across, less than {LARGEST_PIECE_MIN:g} m",
            f"panels.{panels[int(np.argmax(sizes))].name}",
            "Check properties.units_in_meter: 100 for centimetres, 1000 for millimetres",
        )


def _polygon(edges: Sequence[PatternEdge]) -> tuple[Points, list[int]]:
    """The outline as a polygon (n, 2) m, and into how many pieces each edge is cut for it."""
    pieces = [1 if curves.is_straight(edge.curve) else CHECK_SEGMENTS for edge in edges]
    return np.vstack([curves.sample_by_arc_length(edge.curve, n)[:-1] for edge, n in zip(edges, pieces)]), pieces


def _check_outline(edges: Sequence[PatternEdge], place: str) -> float:
    """Signed area [m^2] of the piece; raises when its outline encloses nothing or meets itself."""
    polygon, pieces = _polygon(edges)
    _check_piece_size(polygon, place)
    owner = np.repeat(np.arange(len(edges)), pieces)
    area = outline.signed_area(polygon)
    perimeter = sum(edge.length for edge in edges)
    contact = outline.self_contact(polygon, CONTACT_TOLERANCE)
    small = abs(area) < max(AREA_MIN, AREA_TO_PERIMETER_SQUARED_MIN * perimeter**2)
    if small and (contact is None or outline.flatness(polygon) < FLAT):  # parts of a crossed outline can cancel
        name = place.removeprefix("panels.")
        size = f"{abs(area) * 1e4:.3g} cm^2 within an outline of {perimeter * 100:.1f} cm"
        message = f"the panel {name!r} has no area, or nearly none: {size}"
        raise PatternError(message, place, "Move its vertices apart, or remove the panel and its stitches")
    if contact is not None:
        first, second = sorted(int(owner[i]) for i in contact)
        where = polygon[contact[0]] * 100
        point = f"({where[0]:.1f}, {where[1]:.1f}) cm"
        message = f"the outline crosses or touches itself: edges {first} and {second} meet near {point}"
        raise PatternError(message, f"{place}.edges[{second}]", "Draw an outline that does not cross itself")
    return area


def _stitches(spec: Any, panels: Sequence[Panel]) -> tuple[Stitch, ...]:
    if not isinstance(spec, list):
        raise PatternError("not a list of stitches", "stitches", "Give pairs of {panel, edge}")
    index = {panel.name: i for i, panel in enumerate(panels)}
    used: dict[StitchSide, int] = {}
    stitches = []
    for s, entry in enumerate(spec):
        place = f"stitches[{s}]"
        if not isinstance(entry, list) or len(entry) < 2:
            raise PatternError("a stitch joins two edges", place, "Give [{panel, edge}, {panel, edge}]")
        for k, flag in enumerate(entry[2:], start=2):
            if flag not in STITCH_FLAGS:
                raise PatternError(
                    f"unknown word {flag!r}", f"{place}[{k}]", f"Use {' or '.join(STITCH_FLAGS)}, or leave it out"
                )
        sides = [_stitch_side(side, panels, index, f"{place}[{k}]") for k, side in enumerate(entry[:2])]
        for k, side in enumerate(sides):
            if side in used:
                name = panels[side.panel].name
                message = f"edge {side.edge} of panel {name!r} is sewn twice, first by stitches[{used[side]}]"
                raise PatternError(message, f"{place}[{k}]", "Sew each edge once; split an edge that meets two others")
            used[side] = s
        stitch = Stitch(sides[0], sides[1], "right_wrong" not in entry[2:], "gather" in entry[2:])
        _check_lengths(stitch, panels, place)
        stitches.append(stitch)
    fault = fault_of_numbers(spec)
    if fault is not None:
        raise PatternError(*fault)
    return tuple(stitches)


def _stitch_side(spec: Any, panels: Sequence[Panel], index: Mapping[str, int], place: str) -> StitchSide:
    if not isinstance(spec, Mapping) or not isinstance(spec.get("panel"), str) or not _is_index(spec.get("edge")):
        raise PatternError("a side of a stitch names a panel and an edge", place, 'Give {"panel": name, "edge": index}')
    if spec["panel"] not in index:
        raise PatternError(f"there is no panel {spec['panel']!r}", f"{place}.panel", f"Use one of {', '.join(index)}")
    panel = index[spec["panel"]]
    count = len(panels[panel].edges)
    if not 0 <= spec["edge"] < count:
        message = f"panel {spec['panel']!r} has no edge {spec['edge']}"
        raise PatternError(message, f"{place}.edge", f"Use 0 to {count - 1}")
    return StitchSide(panel, spec["edge"])


def _check_lengths(stitch: Stitch, panels: Sequence[Panel], place: str) -> None:
    lengths = [panels[side.panel].edges[side.edge].length for side in (stitch.first, stitch.second)]
    ratio = max(lengths) / min(lengths)
    limit = GATHER_RATIO_LIMIT if stitch.gather else SEAM_RATIO_LIMIT
    if ratio > limit:
        for side in (stitch.first, stitch.second):
            _check_spread(panels[side.panel])
        names = [f"edge {side.edge} of {panels[side.panel].name!r}" for side in (stitch.first, stitch.second)]
        sizes = [f"{length * 100:.1f} cm" for length in lengths]
        message = (
            f"the stitched edges differ too much in length: {names[0]} is {sizes[0]} long and {names[1]} {sizes[1]}, a "
            f"ratio of {ratio:.2f} over {limit:g}"
        )
        remedy = "Shorten the longer edge" if stitch.gather else 'Sew edges that match, or add "gather" to the stitch'
        raise PatternError(message, place, remedy)


def _check_spread(panel: Panel) -> None:
    """Refuse corners, three or more, on one line; a crescent may have them, if its edges fit what they are sewn to."""
    count = len(panel.corners)
    if count < 3 or outline.flatness(panel.corners) >= FLAT:
        return
    message = f"the {count} corners of the panel {panel.name!r} lie on one line: only its curved edges enclose an area"
    raise PatternError(message, f"panels.{panel.name}", "Move its vertices apart, or remove the panel and its stitches")


def _patches(
    specs: Mapping[str, Any], panels: Sequence[Panel], stitches: Sequence[Stitch], scale: float
) -> tuple[Patch, ...]:
    """The panels that lie on others."""
    index = {panel.name: i for i, panel in enumerate(panels)}
    laid = {name for name in index if specs[name].get("on") is not None}
    sewn = {side.panel for stitch in stitches for side in (stitch.first, stitch.second)}
    patches: list[Patch] = []
    for name in (panel.name for panel in panels if panel.name in laid):
        place, spec = f"panels.{name}.on", specs[name]["on"]
        if not isinstance(spec, Mapping) or not isinstance(spec.get("panel"), str):
            raise PatternError("it does not say on which panel", place, 'Give {"panel": name, "at": [x, y]}')
        hosts = [other for other in index if other not in laid]
        if spec["panel"] not in hosts:
            message = f"there is no panel {spec['panel']!r} that lies on none itself"
            raise PatternError(message, f"{place}.panel", f"Use one of {', '.join(hosts)}")
        if index[name] in sewn:
            message = f"{name!r} lies on another panel and is sewn to an edge, too"
            raise PatternError(message, place, "Open its seams, or leave out `on`")
        patch = _patch(index[name], index[spec["panel"]], spec, panels, scale, place)
        shape = patch.on_host(_polygon(panels[patch.panel].edges)[0])
        for other in (other for other in patches if other.host == patch.host):
            if overlap(shape, other.on_host(_polygon(panels[other.panel].edges)[0])):
                message = f"{name!r} and {panels[other.panel].name!r} overlap on {spec['panel']!r}"
                raise PatternError(message, f"{place}.at", "Place them apart")
        patches.append(patch)
    return tuple(patches)


def _patch(panel: int, host: int, spec: Mapping[str, Any], panels: Sequence[Panel], scale: float, place: str) -> Patch:
    at = _vector(spec.get("at"), 2, f"{place}.at") * scale
    turn = np.radians(_number(spec.get("turn", 0), f"{place}.turn"))
    opened = spec.get("open", [])
    count = len(panels[panel].edges)
    if not isinstance(opened, list) or not all(_is_index(edge) and 0 <= edge < count for edge in opened):
        raise PatternError("not a list of its edges", f"{place}.open", f"Give indices from 0 to {count - 1}")
    if len(set(opened)) == count:
        raise PatternError("none of its edges is sewn on", f"{place}.open", "Leave at least one edge out of the list")
    if panels[panel].clockwise != panels[host].clockwise:
        message = f"its outline runs the other way round than that of {panels[host].name!r}"
        raise PatternError(message, place, "List its edges in the opposite order")
    patch = Patch(panel, host, (float(at[0]), float(at[1])), float(turn), frozenset(opened))
    if not lies_within(patch.on_host(_polygon(panels[panel].edges)[0]), _polygon(panels[host].edges)[0]):
        message = f"{panels[panel].name!r} reaches over the edge of {panels[host].name!r}, or touches it"
        raise PatternError(message, f"{place}.at", "Place it further inside, or make it smaller")
    return patch


def _label(spec: Mapping[str, Any], place: str) -> str:
    label = spec.get("label", "")
    if not isinstance(label, str):
        raise PatternError("a label is text", f"{place}.label", "Give a string or leave it out")
    return label


def _vector(spec: Any, count: int, place: str) -> Points:
    if not isinstance(spec, Sequence) or isinstance(spec, str) or len(spec) != count:
        raise PatternError(f"not {count} numbers", place, f"Give a list of {count} numbers")
    return np.array([_number(value, f"{place}[{i}]") for i, value in enumerate(spec)])


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PatternError(f"{value!r:.60} is not a number", place, "Give a finite number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise PatternError(f"the number is {number}", place, "Give a finite number")
    return number


def _is_index(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
