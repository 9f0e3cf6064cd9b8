"""What a scene may ask of lines and vertices of its garments: what is sewn, pressed, fastened and pinned, one frozen
class of numbers for each effect, by the rules of effect_specs.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tryon_solver.checks import (
    check_flag,
    check_indices,
    check_number,
    check_numbers,
    check_tuple,
    check_whole_shares,
)
from tryon_solver.effect_spec import EffectSpec, check_apart, check_once, check_vertices

if TYPE_CHECKING:
    from tryon_solver.scene import Scene

SHARPEST_CREASE = 2.8  # rad: 160 degrees


@dataclass(frozen=True)
class Sewing(EffectSpec):
    """Open seams being drawn together while a garment is dressed.

    `stitches` (S, 2) int32 pairs of two vertices, each held by a spring of `stiffness` N/m at `share` of the way it was
    apart at the start; the contribution's value "share" (1,) is lowered from 1 to 0.
    """

    module: ClassVar[str] = "tryon_solver.effects.sewing"
    acts_by: ClassVar[tuple[str, ...]] = ("stitches", "stiffness")

    stitches: np.ndarray
    stiffness: float

    def __post_init__(self) -> None:
        check_indices("sewing: stitches", self.stitches, "S", 2)
        check_apart("sewing: stitches", self.stitches, "stitch")
        check_number("sewing: stiffness", self.stiffness)

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a vertex that the garment does not have."""
        check_vertices("sewing: stitches", self.stitches, scene)


@dataclass(frozen=True)
class Attached(EffectSpec):
    """Cloth sewn flat onto other cloth, as a pocket is: each of `vertices` (K,) int32 is drawn by a spring of
    `stiffness` N/m to the place on the cloth beneath that `weights` (K, 3), without unit, of the vertices `onto` (K, 3)
    int32 say: shares of 1.

    How far it stays off, the contact between the two says.
    """

    module: ClassVar[str] = "tryon_solver.effects.attached"
    acts_by: ClassVar[tuple[str, ...]] = ("vertices", "stiffness")

    vertices: np.ndarray
    onto: np.ndarray
    weights: np.ndarray
    stiffness: float

    def __post_init__(self) -> None:
        check_indices("attached: vertices", self.vertices, "K")
        count = len(self.vertices)
        check_indices("attached: onto", self.onto, count, 3)
        check_numbers("attached: weights", self.weights, count, 3)
        check_whole_shares("attached: weights", self.weights)
        check_number("attached: stiffness", self.stiffness)
        itself = (self.onto == self.vertices[:, None]) & (self.weights != 0)
        if itself.any():
            bad = int(np.argmax(itself.any(axis=1)))
            vertex = int(self.vertices[bad])
            raise ValueError(f"attached: onto of row {bad} names vertex {vertex} itself; name the cloth beneath")

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a vertex that the garment does not have."""
        check_vertices("attached: vertices", self.vertices, scene)
        check_vertices("attached: onto", self.onto, scene)


@dataclass(frozen=True)
class Pins(EffectSpec):
    """Cloth held or led by springs: `vertices` (K,) int32, each once, held where they start by `stiffness` N/m.

    The contribution's value "places" (K,) vec3 m may be written between steps: the vertices follow. `led` by the body's
    surface they are held where triangles of it take them: values "onto" (K,) vec3i, corners of each one's triangle
    among the scene's positions, cloth first, and "offsets" (K,) vec3 m in its frame (geometry/carried.py). All corners
    0, as at the start, hold nothing.
    """

    module: ClassVar[str] = "tryon_solver.effects.pins"
    acts_by: ClassVar[tuple[str, ...]] = ("vertices", "stiffness")

    vertices: np.ndarray
    stiffness: float = 2e4
    led: bool = False

    def __post_init__(self) -> None:
        check_indices("pins: vertices", self.vertices, "K")
        check_number("pins: stiffness", self.stiffness)
        check_flag("pins: led", self.led)
        once, count = np.unique(self.vertices, return_counts=True)
        if (count > 1).any():
            raise ValueError(f"pins: vertex {int(once[np.argmax(count)])} is listed twice; list it once")

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a vertex that the garment does not have, or where no body is that could lead."""
        check_vertices("pins: vertices", self.vertices, scene)
        if self.led and scene.body is None:
            raise ValueError("pins: led by a body, of which there is none; give the scene one, or hold them in space")


@dataclass(frozen=True)
class Fasteners(EffectSpec):
    """Buttons, hooks, the teeth of zips: `pairs` (K, 2) int32 of vertices, each held together by `stiffness` N/m. What
    is apart is drawn together at `speed` m/s, as by the hand that closes it.

    The contribution's value "closed" (K,) float32, all 1 at the start, may be written between steps: 0 is open, and in
    between is so much of the stiffness.
    """

    module: ClassVar[str] = "tryon_solver.effects.fasteners"
    acts_by: ClassVar[tuple[str, ...]] = ("pairs", "stiffness")

    pairs: np.ndarray
    stiffness: float = 2e4
    speed: float = 0.5

    def __post_init__(self) -> None:
        check_indices("fasteners: pairs", self.pairs, "K", 2)
        check_number("fasteners: stiffness", self.stiffness)
        check_number("fasteners: speed", self.speed, above=True)
        check_apart("fasteners: pairs", self.pairs, "pair")
        check_once("fasteners", self.pairs, "pair")

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a vertex that the garment does not have."""
        check_vertices("fasteners: pairs", self.pairs, scene)


@dataclass(frozen=True)
class ElasticLine:
    """Elastic sewn along `edges` (K, 2) int32 of the mesh, vertex pairs: unstrained it is `ratio` times as long as
    the line is in the pattern, and pulls with `stiffness` N times what it is longer than that, over the pattern's
    length. It does not push.
    """

    edges: np.ndarray
    ratio: float
    stiffness: float

    def __post_init__(self) -> None:
        check_indices("elastic: edges", self.edges, "K", 2)
        check_number("elastic: ratio", self.ratio, above=True)
        check_number("elastic: stiffness", self.stiffness)
        check_once("elastic", self.edges)


@dataclass(frozen=True)
class Elastic(EffectSpec):
    """Waistbands, belts, shirring threads, drawstrings: lines of the cloth that are drawn to another length. Two on the
    same edges are two bands, each of which pulls.

    The contribution's value "ratio" (L,) float32, one for each of the L `lines`, may be written between steps.
    """

    module: ClassVar[str] = "tryon_solver.effects.elastic"

    lines: tuple[ElasticLine, ...]

    def __post_init__(self) -> None:
        check_tuple("elastic: lines", self.lines, ElasticLine, "ElasticLine(edges, ratio, stiffness)")

    def check(self, scene: Scene) -> None:
        """Raises ValueError for what is no edge of the garment's mesh."""
        from tryon_solver.geometry.lines import corners_of_edges

        for k, line in enumerate(self.lines):
            check_vertices(f"elastic: line {k}: edges", line.edges, scene)
            corners_of_edges(scene.garment, line.edges, f"elastic: line {k}")

    def idle(self, scene: Scene) -> str:  # noqa: ARG002
        """Where no line pulls."""
        return "" if any(line.stiffness and len(line.edges) for line in self.lines) else "no line of it pulls"


@dataclass(frozen=True)
class Creases(EffectSpec):
    """Pressed creases, pleats and shaped seams: along `edges` (K, 2) int32 of the mesh, vertex pairs, the cloth rests
    at `angles` (K,) rad between its sides' normals instead of flat.

    Above 0 the edge is a ridge as seen from the front, below a valley. What holds it there is the fabric's own bending
    stiffness. The contribution's value "angles" (K,) float32 rad may be written between steps.
    """

    module: ClassVar[str] = "tryon_solver.effects.creases"
    acts_by: ClassVar[tuple[str, ...]] = ("edges",)

    edges: np.ndarray
    angles: np.ndarray

    def __post_init__(self) -> None:
        check_indices("creases: edges", self.edges, "K", 2)
        check_numbers("creases: angles", self.angles, "K")
        if len(self.angles) != len(self.edges):
            shape = self.angles.shape
            raise ValueError(f"creases: {len(self.edges)} edges, but angles of shape {shape}; give one for each")
        check_once("creases", self.edges)
        if not (np.abs(self.angles) <= SHARPEST_CREASE).all():
            bad = int(np.argmin(np.abs(self.angles) <= SHARPEST_CREASE))
            raise ValueError(
                f"creases: angle {bad} is {self.angles[bad]!r} rad; no fold is sharper than {SHARPEST_CREASE} rad, "
                "beyond which its sides touch"
            )

    def check(self, scene: Scene) -> None:
        """Raises ValueError for what is no inner edge of the garment's mesh."""
        from tryon_solver.geometry.lines import hinges_of_edges

        check_vertices("creases: edges", self.edges, scene)
        hinges_of_edges(scene.garment, self.edges, "creases")
