"""The edits of a sewing pattern. Lengths and coordinates in metres, in the plane of the piece as the pattern draws it.

A piece is named as in the pattern; vertices and edges are counted from 0 as in its specification. A seam is named by
either of the two edges that it joins. Making an edit raises EditError when a field can't hold what it is given; whether
a garment has such a piece, and stays one, is found when the edit is applied (apply.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.fields import (
    Angle,
    BodyOrNone,
    Eased,
    Extent,
    Factors,
    FactorsOrNone,
    Flag,
    Gathered,
    Index,
    Length,
    Line,
    Move,
    Name,
    Percent,
    Place,
    Share,
    checks_of,
)
from tryon_solver.redesign.measures import factors_of


class _Checked:
    """Checks every field when the edit is made."""

    kind: ClassVar[str]  # its name in JSON
    remedy: ClassVar[str]  # what to do when its result is no garment

    def __post_init__(self) -> None:
        for name, check in checks_of(type(self)).items():
            object.__setattr__(self, name, check(getattr(self, name), name))


@dataclass(frozen=True)
class MoveVertex(_Checked):
    """Move one vertex of a piece; the curves that meet there stretch with it and keep their shape in proportion."""

    panel: Name
    vertex: Index
    by: Move  # m

    kind = "move_vertex"
    remedy = "Move it less far"


@dataclass(frozen=True)
class MoveHandle(_Checked):
    """Move a control point of an edge.

    A cubic curve has the handles 0 and 1, a quadratic one 0; a circular arc has 0, the middle of the arc, of which the
    move across the chord counts; a straight line has 0 and 1, at its thirds, and becomes a cubic curve.
    """

    panel: Name
    edge: Index
    handle: Index
    by: Move  # m

    kind = "move_handle"
    remedy = "Move it less far"


@dataclass(frozen=True)
class Lengthen(_Checked):
    """Move an edge outwards, a hem or the end of a sleeve: the edges beside it go on in the direction they have there.

    Negative shortens. The distance is across the edge, at its ends.
    """

    panel: Name
    edge: Index
    by: Length  # m

    kind = "lengthen"
    remedy = "Move the edge less far"


@dataclass(frozen=True)
class TakeIn(_Checked):
    """Move both sides of a seam into their pieces, each by the distance; negative lets out.

    The garment becomes narrower by twice the distance there. Sides that share a vertex (of a dart) keep it in place.
    """

    panel: Name
    edge: Index
    by: Length  # m

    kind = "take_in"
    remedy = "Take in, or let out, less"


@dataclass(frozen=True)
class ScalePiece(_Checked):
    """Make one piece wider and higher, along x and y of its own plane, about its middle."""

    panel: Name
    factors: Factors

    kind = "scale_piece"
    remedy = "Use factors nearer to 1"


@dataclass(frozen=True)
class ScaleGarment(_Checked):
    """Make all pieces wider and higher, each along x and y of its own plane, and their places with them.

    The garment's highest point keeps its height, so that waist or shoulders stay. By `factors`, or by measures of two
    bodies: the one that the pattern was `made_for`, and the one that is `wanted`.
    """

    factors: FactorsOrNone = None
    made_for: BodyOrNone = None
    wanted: BodyOrNone = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.factors is not None and (self.made_for is not None or self.wanted is not None):
            raise EditError("factors are told, and measures", "factors", "Tell one of them")
        if self.factors is None and (self.made_for is None or self.wanted is None):
            missing = "factors" if self.made_for is self.wanted else "made_for" if self.made_for is None else "wanted"
            remedy = "Give factors [width, height], or the measures of two bodies: made_for and wanted"
            raise EditError("it is not told what to scale the garment by", missing, remedy)
        if self.made_for is not None and self.wanted is not None:
            factors_of(self.made_for, self.wanted)

    @property
    def scale(self) -> tuple[float, float]:
        """Width and height over those it has."""
        if self.made_for is None or self.wanted is None:
            assert self.factors is not None
            return self.factors
        return factors_of(self.made_for, self.wanted)

    kind = "scale_garment"
    remedy = "Use factors nearer to 1"


@dataclass(frozen=True)
class Gather(_Checked):
    """Declare a seam gathered: one of its sides may be up to four times as long as the other.

    to: gather this edge to so much of its length, 0.6 for 60 %: it becomes as long as that takes on the other side, by
    which its piece is fanned out from its far side.
    """

    panel: Name
    edge: Index
    to: Gathered = None

    kind = "gather"
    remedy = "Sew edges whose lengths are nearer to each other"


@dataclass(frozen=True)
class Ease(_Checked):
    """Declare a seam sewn plainly, with ease: one side is at most half as long again as the other.

    by, or percent: this edge becomes so much longer than the other side, or shorter; its piece is fanned as by Gather.
    """

    panel: Name
    edge: Index
    by: Eased = None  # m
    percent: Percent = None  # of the other side's length

    kind = "ease"
    remedy = "Bring its edges to nearer lengths first"


@dataclass(frozen=True)
class OpenSeam(_Checked):
    """Undo a seam."""

    panel: Name
    edge: Index

    kind = "open_seam"
    remedy = "Close another seam first that holds the pieces around the body"


@dataclass(frozen=True)
class CloseSeam(_Checked):
    """Sew two edges together.

    right_wrong: the start of one comes to the start of the other, which is so when the right side of one piece meets
    the wrong side of the other.
    """

    panel: Name
    edge: Index
    to_panel: Name
    to_edge: Index
    gather: Flag = False
    right_wrong: Flag = False

    kind = "close_seam"
    remedy = "Choose edges that fit each other"


@dataclass(frozen=True)
class Cut(_Checked):
    """Cut a piece in two along the straight line between two points outside of it, or on its outline.

    The larger part keeps the piece's name. Seams across which the cut runs are divided, the other side with them.
    sewn: the two parts are sewn together along the cut, else it stays open; of its parts one that is then sewn to
    nothing is taken away, if the other is not.
    """

    panel: Name
    line: Line  # m
    sewn: Flag = False

    kind = "cut"
    remedy = "Cut elsewhere, or have the parts sewn together"


@dataclass(frozen=True)
class Dart(_Checked):
    """Take a wedge out of a piece at an edge and sew its legs together.

    The edge becomes shorter by the dart's width; an edge sewn to it keeps its length and is divided where the dart is.
    """

    panel: Name
    edge: Index
    position: Share  # of the edge's length, of the middle of the dart's mouth
    width: Extent  # m, of the mouth, along the edge
    depth: Extent  # m, from the mouth to the point, across the edge

    kind = "dart"
    remedy = "Make it less wide or less deep, or place it elsewhere"


@dataclass(frozen=True)
class SewnOn(_Checked):
    """Sew a rectangle of the same fabric flat onto a piece.

    `at` is where its middle comes to on the piece; `turn` turns it there, counter-clockwise as the piece is drawn.
    """

    panel: Name
    at: Place  # m
    width: Extent  # m
    height: Extent  # m
    turn: Angle = 0.0  # degrees

    remedy = "Place it further inside the piece, or make it smaller"


@dataclass(frozen=True)
class Patch(SewnOn):
    """Sewn on all around."""

    kind = "patch"


@dataclass(frozen=True)
class Pocket(SewnOn):
    """Open at its upper edge."""

    kind = "pocket"


@dataclass(frozen=True)
class RemovePiece(_Checked):
    """Take a piece away with its seams."""

    panel: Name

    kind = "remove_piece"
    remedy = "Keep the piece, or close another seam first that holds the rest around the body"


@dataclass(frozen=True)
class ChangeFabric(_Checked):
    """Make the garment of another fabric, in the same pieces."""

    fabric: Name

    kind = "change_fabric"
    remedy = "Choose another fabric"


Edit = (
    MoveVertex
    | MoveHandle
    | Lengthen
    | TakeIn
    | ScalePiece
    | ScaleGarment
    | Gather
    | Ease
    | OpenSeam
    | CloseSeam
    | Cut
    | Dart
    | Patch
    | Pocket
    | RemovePiece
    | ChangeFabric
)

KINDS: dict[str, type[Edit]] = {
    each.kind: each
    for each in (
        MoveVertex,
        MoveHandle,
        Lengthen,
        TakeIn,
        ScalePiece,
        ScaleGarment,
        Gather,
        Ease,
        OpenSeam,
        CloseSeam,
        Cut,
        Dart,
        Patch,
        Pocket,
        RemovePiece,
        ChangeFabric,
    )
}
