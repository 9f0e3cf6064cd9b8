#!/usr/bin/env python3
"""Draft the demo's own sewing patterns (T-shirt, overshirt, skirt, dress, trousers) for the default body, as JSON.

The drafts are ours; only the file format is GarmentCode's. All lengths here are centimetres, angles degrees. Pieces are
drawn as the viewer in front of the wearer sees them: x to the wearer's left, y up; back pieces turn clockwise, so that
their right side faces backwards. Running the script again writes the same bytes.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tryon_solver.geometry import curves

Point = tuple[float, float]
PATTERNS = Path(__file__).resolve().parents[1] / "server" / "tryon_server" / "demo" / "patterns"


@dataclass(frozen=True)
class Body:
    """Measures of the default body (scripts/make_body.py) by plane sections of its rest pose, in cm and degrees.

    Girths are those of a taut tape: perimeters of the sections' convex hulls.
    """

    bust_girth: float = 95.6  # at y = 126
    waist_girth: float = 77.3  # the smallest, at y = 108
    waist_height: float = 108.0
    hip_girth: float = 97.6  # at y = 84, the thighs' outside included
    upper_arm_girth: float = 31.0
    shoulder_point_height: float = 146.5  # where the shoulder meets the neck, at x = 7.5
    arm_slope: float = 48.5  # below the horizontal
    arm_x: float = 18.3  # the upper arm's axis at the shoulder joint
    arm_y: float = 136.9


BODY = Body()
WAISTBAND = {"ratio": 0.9, "stiffness": 30.0}  # N: worn at its own length it is pulled with 3 N, as a soft waistband is
FIRM_WAISTBAND = WAISTBAND | {"stiffness": 40.0}  # 4 N, for trousers: they weigh more, and each step draws at them
FRONT_Z, BACK_Z = 24.0, -18.0  # clear of the chest and of the back
BETWEEN_HALVES = 0.5  # of an open front, and its middle


@dataclass
class Piece:
    """One piece under construction: named edges around its outline."""

    start: Point
    label: str
    translation: tuple[float, float, float]
    turn: float = 0.0  # degrees about z
    vertices: list[Point] = field(default_factory=list)
    edges: list[dict] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.vertices.append(self.start)

    def line(self, name: str, end: Point) -> Piece:
        """A straight edge from the last point to the end."""
        return self._add(name, end, None)

    def cubic(self, name: str, end: Point, first: Point, second: Point) -> Piece:
        """A cubic Bezier edge from the last point to the end, with its control points."""
        start = self.vertices[-1]
        params = [relative(start, end, first), relative(start, end, second)]
        return self._add(name, end, {"type": "cubic", "params": params})

    def arc(self, name: str, end: Point, radius: float, counter_clockwise: bool) -> Piece:
        """The smaller circular arc from the last point to the end."""
        return self._add(name, end, {"type": "circle", "params": [rounded(radius), 0, int(counter_clockwise)]})

    def carry(self, name: str, **effects: dict) -> Piece:
        """Have the edge carry elastic, a crease or buttons, as edge_effects.py reads them."""
        self.edges[self.names.index(name)] |= effects
        return self

    def spec(self) -> dict:
        """The panel in the specification's form."""
        if self.vertices.pop() != self.start:
            raise ValueError("the outline is not closed")
        return {
            "translation": [rounded(value) for value in self.translation],
            "rotation": [0.0, 0.0, rounded(self.turn)],
            "vertices": [[rounded(x), rounded(y)] for x, y in self.vertices],
            "edges": self.edges,
            "label": self.label,
        }

    def _add(self, name: str, end: Point, curvature: dict | None) -> Piece:
        index = len(self.edges)
        following = 0 if end == self.start else index + 1
        edge: dict = {"endpoints": [index, following]}
        self.edges.append(edge if curvature is None else edge | {"curvature": curvature})
        self.names.append(name)
        self.vertices.append(end)
        return self


def relative(start: Point, end: Point, control: Point) -> list[float]:
    """The control point along and left of the edge, in edge lengths."""
    along = (end[0] - start[0], end[1] - start[1])
    offset = (control[0] - start[0], control[1] - start[1])
    squared = along[0] ** 2 + along[1] ** 2
    u = (along[0] * offset[0] + along[1] * offset[1]) / squared
    v = (along[0] * offset[1] - along[1] * offset[0]) / squared
    return [round(u, 6), round(v, 6)]


def rounded(value: float) -> float:
    """Hundredths of a millimetre: finer than any cutter, and the same on every machine."""
    return round(value, 3) + 0.0


def garment(pieces: dict[str, Piece], seams: list[tuple[str, str, str, str]]) -> dict:
    """The specification of the pieces, sewn along (piece, edge, piece, edge) by name."""

    def side(piece: str, edge: str) -> dict:
        return {"panel": piece, "edge": pieces[piece].names.index(edge)}

    stitches = [[side(a, i), side(b, j)] for a, i, b, j in seams]
    return {
        "pattern": {
            "panels": {name: piece.spec() for name, piece in pieces.items()},
            "stitches": stitches,
            "panel_order": list(pieces),
        },
        "parameters": {},
        "parameter_order": [],
        "properties": {
            "curvature_coords": "relative",
            "normalize_panel_translation": False,
            "normalized_edge_loops": True,
            "units_in_meter": 100,
        },
    }


@dataclass(frozen=True)
class Bodice:
    """Half measures of a bodice piece; y = 0 at its lower edge."""

    lower: float  # half width of the lower edge
    chest: float  # half width at the armhole's lowest point
    underarm: float  # height of that point
    shoulder: float  # half width at the shoulder's end
    neck: float  # half width of the neck opening
    top: float  # height of the shoulder at the neck
    fall: float  # how much lower the shoulder's end is

    def front(self, neck_depth: float, height: float) -> Piece:
        """The front piece, its lower edge at the height above the floor; counter-clockwise."""
        piece = Piece((-self.lower, 0.0), "body", (0.0, height, FRONT_Z))
        piece.line("lower", (self.lower, 0.0)).line("side_left", (self.chest, self.underarm))
        return self._top(piece, "left", 1.0, neck_depth).line("side_right", (-self.lower, 0.0))

    def half_front(self, s: float, neck_depth: float, height: float) -> Piece:
        """The front's half on the side s = +1 (left) or -1 (right), open along its middle; counter-clockwise."""
        start, one, two, end = self.armhole(s)
        drop = self.top - 0.55 * neck_depth
        side, middle, neck = (s * self.lower, 0.0), (0.0, self.top - neck_depth), (s * self.neck, self.top)
        leans = (s * self.neck, drop), (s * 0.55 * self.neck, self.top - neck_depth)
        piece = Piece((0.0, 0.0), "body", (s * BETWEEN_HALVES, height, FRONT_Z))
        if s > 0:
            piece.line("lower", side).line("side", start).cubic("armhole", end, one, two).line("shoulder", neck)
            return piece.cubic("neck", middle, *leans).line("centre", (0.0, 0.0))
        piece.line("centre", middle).cubic("neck", neck, leans[1], leans[0]).line("shoulder", end)
        return piece.cubic("armhole", start, two, one).line("side", side).line("lower", (0.0, 0.0))

    def back(self, neck_depth: float, height: float) -> Piece:
        """The back piece, seen from the front; clockwise."""
        piece = Piece((self.lower, 0.0), "body", (0.0, height, BACK_Z))
        piece.line("lower", (-self.lower, 0.0)).line("side_right", (-self.chest, self.underarm))
        return self._top(piece, "right", -1.0, neck_depth).line("side_left", (self.lower, 0.0))

    def armhole(self, s: float) -> tuple[Point, Point, Point, Point]:
        """Bezier points from the underarm to the shoulder's end on the side s = +1 (left) or -1 (right)."""
        end = self.top - self.fall
        depth = end - self.underarm
        inner = min(self.shoulder, self.chest) - 1.2
        return (
            (s * self.chest, self.underarm),
            (s * (0.8 * inner + 0.2 * self.chest), self.underarm + 0.02 * depth),
            (s * inner, self.underarm + 0.5 * depth),
            (s * self.shoulder, end),
        )

    def _top(self, piece: Piece, near: str, s: float, neck_depth: float) -> Piece:
        """Armhole, shoulder, neck, shoulder, armhole, from the side s to the other."""
        far = "right" if near == "left" else "left"
        neck_bottom = self.top - neck_depth
        start, one, two, end = self.armhole(s)
        piece.cubic(f"armhole_{near}", end, one, two).line(f"shoulder_{near}", (s * self.neck, self.top))
        middle = (0.0, neck_bottom)
        lean = 0.55 * self.neck
        drop = 0.55 * neck_depth
        piece.cubic(f"neck_{near}", middle, (s * self.neck, self.top - drop), (s * lean, neck_bottom))
        piece.cubic(
            f"neck_{far}", (-s * self.neck, self.top), (-s * lean, neck_bottom), (-s * self.neck, self.top - drop)
        )
        start, one, two, end = self.armhole(-s)
        return piece.line(f"shoulder_{far}", end).cubic(f"armhole_{far}", start, two, one)


def bezier_length(points: tuple[Point, Point, Point, Point]) -> float:
    """Length of the cubic curve."""
    return curves.length(curves.Bezier(np.array(points)))


def solve(function: Callable[[float], float], low: float, high: float) -> float:
    """The root of an increasing function between low and high, by bisection."""
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return (low + high) / 2


@dataclass(frozen=True)
class Sleeve:
    """Half a sleeve, x along the arm from the shoulder's end, y = 0 along the upper seam, the underarm below it."""

    width: float  # half the girth at the underarm
    cuff: float  # half the girth at the hem
    length: float  # of the upper seam
    cap: float  # how far the underarm lies further down the arm than the shoulder's end

    def cap_curve(self) -> tuple[Point, Point, Point, Point]:
        """Bezier points from the shoulder's end to the underarm."""
        return (0.0, 0.0), (0.0, -0.5 * self.width), (self.cap, -0.5 * self.width), (self.cap, -self.width)

    def piece(self, s: float, forward: bool) -> Piece:
        """The front or back half for the side s = +1 (left) or -1 (right), along the arm."""
        slope = math.radians(BODY.arm_slope)
        along = (math.cos(slope), -math.sin(slope))
        up = (math.sin(slope), math.cos(slope))
        start = 3.0  # cm down the arm's axis from the joint
        x = BODY.arm_x + start * along[0] + self.width / 2 * up[0]
        y = BODY.arm_y + start * along[1] + self.width / 2 * up[1]
        place = (s * x, y, FRONT_Z - 4.0 if forward else BACK_Z + 4.0)
        piece = Piece((0.0, 0.0), "arm", place, -s * BODY.arm_slope)
        tip, one, two, underarm = [(s * px, py) for px, py in self.cap_curve()]
        hem_low, hem_high = (s * self.length, -self.cuff), (s * self.length, 0.0)
        if (s > 0) == forward:
            piece.cubic("cap", underarm, one, two).line("underarm", hem_low)
            return piece.line("hem", hem_high).line("top", tip)
        piece.line("top", hem_high).line("hem", hem_low).line("underarm", underarm)
        return piece.cubic("cap", tip, two, one)


def sleeves(bodice: Bodice, girth: float, cuff: float, length: float) -> dict[str, Piece]:
    """Set-in sleeves for the bodice's armholes, each of two pieces: `girth` at the underarm, `cuff` half the girth at
    the hem, which lies `length` below the underarm."""
    armhole = bezier_length(bodice.armhole(1.0))
    cap = solve(lambda c: bezier_length(Sleeve(girth / 2, girth / 2, 20.0, c).cap_curve()) - armhole, 1.0, 20.0)
    sleeve = Sleeve(width=girth / 2, cuff=cuff, length=cap + length, cap=cap)
    return {
        f"{side}_sleeve_{half}": sleeve.piece(s, half == "front")
        for side, s in (("left", 1.0), ("right", -1.0))
        for half in ("front", "back")
    }


def sleeve_seams(side: str, front_armhole: tuple[str, str]) -> list[tuple[str, str, str, str]]:
    """A sleeve's own seams, and those to the back and to the front's armhole, an edge of a piece."""
    front, back = f"{side}_sleeve_front", f"{side}_sleeve_back"
    seams = [(*front_armhole, front, "cap"), ("back", f"armhole_{side}", back, "cap")]
    return [*seams, (front, "top", back, "top"), (front, "underarm", back, "underarm")]


def tshirt() -> dict:
    """A loose T-shirt with set-in sleeves: six pieces."""
    ease = 9.0
    bodice = Bodice(
        lower=(BODY.hip_girth + 8.0) / 4,
        chest=(BODY.bust_girth + ease) / 4,
        underarm=38.0,
        shoulder=20.0,
        neck=8.8,
        top=63.0,
        fall=4.6,
    )
    height = BODY.shoulder_point_height + 2.5 - bodice.top
    girth = BODY.upper_arm_girth + 8.0
    pieces = {"front": bodice.front(8.5, height), "back": bodice.back(2.2, height)}
    pieces |= sleeves(bodice, girth, girth / 2 - 1.5, 8.0)
    seams = bodice_seams("front", "back")
    for side in ("left", "right"):
        seams += sleeve_seams(side, ("front", f"armhole_{side}"))
    return garment(pieces, seams)


def overshirt() -> dict:
    """A shirt to be worn open over a T-shirt: seven pieces, wider everywhere, with sleeves to the elbows."""
    bodice = Bodice(
        lower=(BODY.hip_girth + 20.0) / 4,
        chest=(BODY.bust_girth + 22.0) / 4,
        underarm=40.5,
        shoulder=21.5,
        neck=9.8,
        top=68.0,
        fall=4.8,
    )
    height = BODY.shoulder_point_height + 3.5 - bodice.top
    girth = BODY.upper_arm_girth + 16.0
    pieces = {f"front_{side}": bodice.half_front(s, 12.0, height) for side, s in (("left", 1.0), ("right", -1.0))}
    pieces |= {"back": bodice.back(2.8, height), **sleeves(bodice, girth, girth / 2 - 2.0, 18.0)}
    seams = []
    for side in ("left", "right"):
        front = f"front_{side}"
        seams += [(front, edge, "back", f"{edge}_{side}") for edge in ("side", "shoulder")]
        seams += sleeve_seams(side, (front, "armhole"))
    return garment(pieces, seams)


def bodice_seams(front: str, back: str) -> list[tuple[str, str, str, str]]:
    """Side and shoulder seams."""
    return [
        (front, f"{edge}_{side}", back, f"{edge}_{side}") for edge in ("side", "shoulder") for side in ("left", "right")
    ]


@dataclass(frozen=True)
class FlaredSkirt:
    """A skirt cut from a ring: both pieces together are the sector of the angle, its inner arc the waist."""

    waist: float  # girth
    length: float
    angle: float  # degrees, of both pieces together

    @property
    def radius(self) -> float:
        """Of the waist's arc."""
        return self.waist / math.radians(self.angle)

    @property
    def rise(self) -> float:
        """How much higher the waist's corners lie than its middle, in the flat piece."""
        return self.radius * (1 - math.cos(math.radians(self.angle / 4)))

    def piece(self, height: float, forward: bool) -> Piece:
        """One half with the middle of its waist at the height above the floor."""
        half = math.radians(self.angle / 4)
        inner, outer = self.radius, self.radius + self.length

        def at(radius: float, side: float) -> Point:
            return side * radius * math.sin(half), inner - radius * math.cos(half)

        z = FRONT_Z - 2.0 if forward else BACK_Z
        s = 1.0 if forward else -1.0
        near, far = ("left", "right") if forward else ("right", "left")
        piece = Piece(at(outer, -s), "leg", (0.0, height, z))
        piece.arc("hem", at(outer, s), outer, forward).line(f"side_{near}", at(inner, s))
        return piece.arc("waist", at(inner, -s), inner, not forward).line(f"side_{far}", at(outer, -s))


def skirt_seams() -> list[tuple[str, str, str, str]]:
    return [("skirt_front", f"side_{side}", "skirt_back", f"side_{side}") for side in ("left", "right")]


def skirt() -> dict:
    """A flared skirt whose waist is the body's smallest girth, far less than the hips', so that it cannot slide down;
    elastic in it holds it where it is.

    Cloth lies 2 to 3 mm off the skin, where the girth is 1.5 cm more: the waist is stretched by 2 %, within any fabric.
    """
    shape = FlaredSkirt(waist=BODY.waist_girth, length=50.0, angle=100.0)
    height = BODY.waist_height - 1.0
    pieces = {"skirt_front": shape.piece(height, True), "skirt_back": shape.piece(height, False)}
    for piece in pieces.values():
        piece.carry("waist", elastic=WAISTBAND)
    return garment(pieces, skirt_seams())


def dress() -> dict:
    """A sleeveless dress: fitted bodice with broad shoulder straps, flared skirt.

    On the body, arms out, an armhole is 52 cm round: it is cut so deep that a fabric of 5 % stretch closes there.
    """
    bodice = Bodice(
        lower=(BODY.waist_girth + 5.0) / 4,
        chest=(BODY.bust_girth + 5.0) / 4,
        underarm=15.5,
        shoulder=17.8,
        neck=9.2,
        top=41.0,
        fall=3.2,
    )
    shape = FlaredSkirt(waist=4 * bodice.lower, length=48.0, angle=110.0)
    height = BODY.shoulder_point_height + 2.5 - bodice.top
    skirt_height = height - 2.0 - shape.rise
    pieces = {
        "front": bodice.front(12.0, height),
        "back": bodice.back(6.0, height),
        "skirt_front": shape.piece(skirt_height, True),
        "skirt_back": shape.piece(skirt_height, False),
    }
    seams = bodice_seams("front", "back") + skirt_seams()
    seams += [(half, "lower", f"skirt_{half}", "waist") for half in ("front", "back")]
    return garment(pieces, seams)


@dataclass(frozen=True)
class TrouserLeg:
    """One of the four pieces of a pair of trousers; x = 0 along its straight centre seam, heights above the floor."""

    waist: float  # of the piece, at the height `top`
    hip: float  # the same at the height `widest`
    beyond: float  # how far the fork lies beyond the centre seam, between the legs
    outer: float  # where the hem ends outside
    top: float
    widest: float
    fork: float
    bottom: float

    def piece(self, s: float, forward: bool) -> Piece:
        """The piece for the side s = +1 (left) or -1 (right), moved aside so that the forks of both lie apart."""
        bend = self.fork + 20.0  # where the centre seam begins to turn between the legs
        inner = -self.beyond + 2.0  # nearly straight up to the fork: what slants there crumples where four seams meet

        def at(x: float, y: float) -> Point:
            return s * x, y - self.bottom

        corners = [at(inner, self.bottom), at(self.outer, self.bottom), at(self.hip, self.widest)]
        corners += [at(self.waist, self.top), at(0.0, self.top), at(0.0, bend), at(-self.beyond, self.fork)]
        curves_at = {
            "hip": (at(self.hip, self.widest + 10.0), at(self.waist + 2.5, self.top - 6.0)),
            "fork": (at(0.0, self.fork + 7.3), at(-self.beyond / 3, self.fork + 0.7)),  # level where the legs meet
        }
        names = ["hem", "outside", "hip", "waist", "centre", "fork", "inside"]
        sides = [(name, corners[k], corners[(k + 1) % 7]) for k, name in enumerate(names)]
        bends = {name: curves_at.get(name) for name in names}
        if (s > 0) != forward:  # the other way round
            sides = [(name, end, start) for name, start, end in reversed(sides)]
            bends = {name: points and (points[1], points[0]) for name, points in bends.items()}
        place = (s * (self.beyond + 1.0), self.bottom, FRONT_Z if forward else BACK_Z)
        piece = Piece(sides[0][1], "leg", place)
        for name, _, end in sides:
            controls = bends[name]
            piece = piece.line(name, end) if controls is None else piece.cubic(name, end, *controls)
        return piece


def trousers() -> dict:
    """Loose trousers down to the ankles: four pieces. Their waist is the body's smallest girth, as the skirt's, and has
    firmer elastic in it."""
    hip = (BODY.hip_girth + 6.0) / 4
    same = {"top": BODY.waist_height - 1.0, "widest": 83.0, "fork": 68.0, "bottom": 12.0}
    front = TrouserLeg(waist=BODY.waist_girth / 4, hip=hip, beyond=6.0, outer=21.0, **same)
    back = TrouserLeg(waist=BODY.waist_girth / 4, hip=hip, beyond=7.5, outer=21.0, **same)
    pieces = {
        "front_left": front.piece(1.0, True),
        "front_right": front.piece(-1.0, True),
        "back_left": back.piece(1.0, False),
        "back_right": back.piece(-1.0, False),
    }
    for piece in pieces.values():
        piece.carry("waist", elastic=FIRM_WAISTBAND)
    seams = [
        (f"front_{side}", edge, f"back_{side}", edge)
        for side in ("left", "right")
        for edge in ("outside", "hip", "inside")
    ]
    halves = [(f"{half}_left", f"{half}_right") for half in ("front", "back")]
    seams += [(left, edge, right, edge) for left, right in halves for edge in ("centre", "fork")]
    return garment(pieces, seams)


GARMENTS = {"tshirt": tshirt, "overshirt": overshirt, "skirt": skirt, "dress": dress, "trousers": trousers}


def write_patterns(folder: Path) -> list[Path]:
    """Write every pattern into the folder; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, draft in GARMENTS.items():
        files.append(folder / f"{name}.json")
        files[-1].write_text(json.dumps(draft(), indent=1) + "\n", encoding="utf-8")
    return files


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=PATTERNS, help="the folder to write to (%(default)s)")
    for file in write_patterns(parser.parse_args().out):
        print(f"wrote {file}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
