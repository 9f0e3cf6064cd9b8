"""A drape without a solver: a waving sheet on a body of three joints. It takes no time and can be told to misbehave.

The name of the fabric says how: ``cotton`` behaves, ``tight`` can't be dressed, ``nan`` yields a NaN after ten steps,
``failing`` raises in every step, ``crash`` ends the process after ten steps, ``greedy`` takes 32 MB
more in each step, ``slow`` takes 0.2 s a step, ``denim`` is out of bounds, ``resting`` is asleep, ``mesh`` has no
pattern. Its pattern is two squares sewn together. It takes on any shape but a narrower one than NARROWEST: that needs
another mesh, under RECUT it is dressed anew, and under TIGHTEST it can't be dressed. On the way to one of LATE_WIDTH it
finds that it needs another mesh.
"""

from __future__ import annotations

import os
from copy import copy, deepcopy
from dataclasses import asdict, dataclass, field, replace
from functools import partial

import numpy as np
from pretended_effects import PretendedEffects
from pretended_presets import PretendedPreset

from tryon_server.problems import problem_error
from tryon_server.runtime.drape import Outfit
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import Pose, skin
from tryon_solver.redesign.fabrics import made_of, named_fabric

SIDE = 12
NARROWEST, RECUT, TIGHTEST, LATE_WIDTH = 0.4, 0.33, 0.3, 0.7  # m, of the first square
RAMP = 0.25  # s, simulated, on the way to a shape
DRAWN = 0.1  # s, simulated, on the way to where another has it
PARTS = 4  # in which another mesh is put on
QUICKEST = 0.002  # s, in which it solves a frame
FITTING_SIZE = 0.93  # what a size that is looked for comes to


def small_body() -> BodyModel:
    """A prism of three storeys, one per joint."""
    ring = np.array([[0.1, 0, 0.1], [0.1, 0, -0.1], [-0.1, 0, 0.0]])
    vertices = np.concatenate([ring + np.array([0, y, 0]) for y in (0.0, 0.5, 1.0)])
    side = [[a, b, c] for k in (0, 3) for i in range(3) for a, b, c in quad(k + i, k + (i + 1) % 3)]
    faces = np.array([*side, [0, 2, 1], [6, 7, 8]], np.int32)
    return BodyModel(
        rest_vertices=vertices,
        faces=faces,
        joint_names=("hips", "spine", "head"),
        parents=np.array([-1, 0, 1], np.int32),
        rest_joints=np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 1.0, 0.0]]),
        skin_joints=np.repeat(np.arange(3, dtype=np.int32), 3)[:, None],
        skin_weights=np.ones((9, 1), np.float32),
    )


def quad(a: int, b: int) -> list[tuple[int, int, int]]:
    return [(a, b, b + 3), (a, b + 3, a + 3)]


@dataclass(frozen=True)
class Facts:
    iterations: int = 3
    residual: float = 1e-4
    error: float = 2.5e-4
    min_gap: float = 0.002
    gap_offset: float = 0.0018
    max_stretch: float = 1.01
    body_lag: float = 0.0
    pairs: int = 4
    retries: int = 0
    times_ms: dict[str, float] = field(default_factory=lambda: {"solve": 0.5})
    late: float = 0.0
    asleep: bool = False
    advice: str = ""

    def to_dict(self):
        return asdict(self)


def squares(width: float = 0.5):
    """The specification of two squares, 50 cm a side unless the first is another `width` m, sewn at their sides."""
    square = [[0, 0], [50, 0], [50, 50], [0, 50]]
    first = [[x * width / 0.5, y] for x, y in square]
    edges = [{"endpoints": [k, (k + 1) % 4]} for k in range(4)]
    panels = {
        name: {"vertices": vertices, "edges": edges, "translation": [0, 0, z], "rotation": [0, 0, 0]}
        for name, vertices, z in (("front", first, 20), ("back", square, -20))
    }
    stitches = [[{"panel": "front", "edge": e}, {"panel": "back", "edge": e}] for e in (1, 3)]
    return {
        "pattern": {"panels": panels, "stitches": stitches, "panel_order": ["front", "back"]},
        "properties": {"units_in_meter": 100, "curvature_coords": "relative", "normalize_panel_translation": False},
    }


def width_of(specification) -> float:
    """Of the first square's lower edge [m]."""
    (x0, _), (x1, _) = specification["pattern"]["panels"]["front"]["vertices"][:2]
    return round((x1 - x0) / 100, 6)


class WavingSheet(PretendedPreset):
    """SIDE x SIDE vertices in front of the root, waving as time goes by."""

    went = 0.0  # m, to where it is

    def __init__(self, behaviour: str) -> None:
        self.behaviour = behaviour
        body = small_body()
        grid = np.stack(np.meshgrid(np.linspace(0, 0.5, SIDE), np.linspace(0, 0.5, SIDE)), axis=-1).reshape(-1, 2)
        cell = np.array([[0, 1, SIDE + 1], [0, SIDE + 1, SIDE]])
        corner = np.add.outer(np.arange(SIDE - 1) * SIDE, np.arange(SIDE - 1)).ravel()
        faces = (corner[:, None, None] + cell).reshape(-1, 3).astype(np.int32)
        self.flat = np.column_stack([grid, np.full(len(grid), 0.3)])
        self.outfit = Outfit(
            vertex_count=len(grid),
            faces=faces,
            uv=grid[faces],
            panel_of_face=np.zeros(len(faces), np.int32),
            panel_names=("sheet",),
            body=body,
        )
        self.pose = Pose(root=np.zeros(3), rotations=np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)))
        self.origin = np.zeros(3)
        self.current, self.t, self.steps = self.pose, 0.0, 0
        self.hoard: list[np.ndarray] = []
        self.edited = ""
        self.specifications = {"": None if behaviour == "mesh" else made_of(squares(), behaviour)}
        self.shapes: list[float] = []
        self.late, self.there_at = False, 0.0
        self.comes_along, self.along = False, []  # in the next advance, and in each that there was
        self.comes_to = None  # another that goes along
        self.hurried = False
        self.bought: tuple[float | None, float | None] = (None, None)
        self.effects = PretendedEffects()

    own_motion = None
    outgrown = not_carried = ""
    waiting = False
    overstretched = 0.0  # share of its cloth

    @property
    def specification(self):
        return self.specifications[self.edited]

    @specification.setter
    def specification(self, specification) -> None:
        self.specifications = {**self.specifications, self.edited: specification}

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.specifications)

    def size_of(self, name) -> float | None:  # noqa: ARG002
        return self.outfit.size

    def edit_garment(self, name) -> None:
        assert name in self.names
        self.edited = name

    def take_off(self, *names):
        for _ in range(PARTS - 1):
            yield None
        sheet = copy(self)
        sheet.specifications = {own: value for own, value in self.specifications.items() if own not in names}
        sheet.effects = PretendedEffects(self.effects.asked, tuple(sheet.specifications))
        sheet.edited = self.edited if self.edited in sheet.names else sheet.names[-1]
        yield sheet

    @property
    def on_the_way(self) -> bool:
        return self.t < self.there_at

    @property
    def shape_of(self):
        return width_of

    def reshape(self, specification, shape=None) -> str:
        assert shape in (None, width_of(specification))
        self.outgrown, self.late = "", width_of(specification) == LATE_WIDTH
        if named_fabric(specification) != self.behaviour:
            return "it is of another fabric"
        if width_of(specification) < NARROWEST:
            return "the sheet is squeezed"
        self.shapes.append(width_of(specification))
        self.there_at = self.t + RAMP
        return ""

    def cutting(self, specification, fabric):
        return partial(deepcopy, (specification, fabric))

    def recut(self, cut, hung=None):  # noqa: ARG002
        specification, fabric = cut
        if width_of(specification) < RECUT or fabric == "tight":
            self.not_carried = "where the garment is worn, it would be stretched"
            return
        for _ in range(PARTS - 1):
            yield None
        sheet = WavingSheet(fabric)
        sheet.effects = PretendedEffects(self.effects.asked, tuple(self.specifications))
        sheet.specifications, sheet.edited = {**self.specifications, self.edited: specification}, self.edited
        sheet.t, sheet.current, sheet.origin = self.t, self.current, self.origin
        sheet.preset = self.preset
        yield sheet

    def packed(self) -> WavingSheet:
        return self

    def unpacking(self, specification=None):
        for _ in range(PARTS - 1):
            yield None
        sheet = copy(self)
        sheet.t, sheet.steps, sheet.shapes, sheet.along, sheet.there_at = 0.0, 0, [], [], 0.0
        if specification is not None and specification != sheet.specification:
            assert sheet.reshape(specification) == ""
        yield sheet

    @property
    def stance(self):
        return self.current

    @property
    def seconds(self) -> float:
        return self.t

    def come_to(self, other, way, off=()):
        yield from way
        worn = self
        if off:
            *parts, worn = self.take_off(*off)
            yield from parts
            worn.current, worn.t = self.current, self.t
        worn.comes_to, until = other, worn.t + DRAWN
        if worn is not self:
            yield worn
        while worn.t < until and not worn.hurried:
            yield
        worn.comes_to = None

    def come_at_once(self) -> None:
        if self.comes_to is not None:
            self.hurried = True

    def leap(self, by: np.ndarray) -> None:
        self.origin = self.origin + by

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        self.bought = accuracy, deadline

    def come_along(self) -> None:
        self.comes_along = True

    def advance(self, pose: Pose, t: float, longest_step: float = 0.0) -> Facts:  # noqa: ARG002
        assert t > self.t, "time goes forward"
        pose.validate(self.outfit.body)
        if self.comes_to is not None:
            self.comes_to.advance(pose, self.comes_to.t + t - self.t)
        self.steps += 1
        if self.late:
            self.outgrown = "a row is too long"
        if self.behaviour == "failing":
            raise RuntimeError("the step diverged")
        if self.behaviour == "crash" and self.steps > 10:
            os._exit(7)
        if self.behaviour == "greedy":
            self.hoard.append(np.ones(4_000_000))
        self.current, self.t = pose, t
        self.along, self.comes_along = [*self.along, self.comes_along], False
        advice = "the fabric is stretched by 35 %" if self.behaviour == "denim" else ""
        accuracy, deadline = self.bought
        error = Facts.error if accuracy is None else accuracy
        late = 0.0 if deadline is None or deadline >= QUICKEST else QUICKEST - deadline
        return Facts(self.iterations, asleep=self.behaviour == "resting", advice=advice, error=error, late=late)

    def cloth_positions(self) -> np.ndarray:
        wave = 0.05 * np.sin(6 * self.flat[:, 0] + 5 * self.t)
        positions = (self.flat + self._here().root + np.outer(wave, [0, 0, 1])).astype(np.float32)
        if self.behaviour == "nan" and self.steps > 10:
            positions[3, 1] = np.nan
        return positions

    def body_positions(self) -> np.ndarray:
        return skin(self.outfit.body, self._here()).astype(np.float32)

    def _here(self) -> Pose:
        return Pose(self.current.root - self.origin, self.current.rotations)


def build(order, progress) -> WavingSheet:
    progress("Sewing", 0.5)
    if order.specification is not None and width_of(order.specification) < TIGHTEST:
        raise problem_error("garment.unfit", "it is too tight", "Make it wider.", place="garment")
    if order.fabric == "tight":
        told = order.body_reading
        on = f" on {order.body_name!r}; --body-animation is {told.animation}, --body-facing is {told.facing}"
        on = on if order.body_name else ""
        on += f"; it rests in its {order.reading.rest_shape}" if order.reading.rest_shape else ""
        raise problem_error("garment.unfit", f"a seam of {order.garment_name!r} stayed open{on}", "Enlarge the pieces.")
    for over in order.over:
        if over.fabric == "tight":
            why = f"{over.garment_name} can't be put on over {order.worn_as}"
            raise problem_error("garment.unfit", why, "Enlarge it.", place=f"garments.{over.worn_as}")
    sheet = WavingSheet(order.fabric).ordered(order.preset)
    worn = {one.worn_as: one.specification or made_of(squares(), one.fabric) for one in order.garments}
    worn[order.worn_as] = order.specification or sheet.specification
    sheet.specifications, sheet.edited = worn, order.of_edited.worn_as
    sheet.effects = PretendedEffects(garments=tuple(worn))
    sheet.outfit = replace(sheet.outfit, size=FITTING_SIZE if order.size is None else order.size)
    return sheet


def sway_at(t: float) -> float:
    """Where the root is [m] along x: to and fro once a second."""
    return 0.1 * np.sin(2 * np.pi * t)


def load_motion(name: str, _body: BodyModel, _file=None) -> Motion:
    if name != "sway":
        raise problem_error("motion.unknown", f"there is no motion {name!r}", "Choose another.")
    times = np.arange(101) / 100
    roots = np.column_stack([sway_at(times), 0 * times, 0 * times])
    return Motion(roots, np.tile([0.0, 0.0, 0.0, 1.0], (101, 3, 1)), 0.01, "sway")
