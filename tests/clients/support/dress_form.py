"""A drape without a solver, made to be looked at: a dressmaker's form on three joints that wears a swinging tunic.

The fabric called ``tight`` can't be put on; every other one can, and ``denim`` brings advice. None is put on for as
long as there is a file "held" beside the server's data. Its frames have whatever error is asked for; under a deadline
they take QUICKEST at least.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from pretended_effects import PretendedEffects
from pretended_presets import PretendedPreset

from tryon_server.problems import problem_error
from tryon_server.runtime.drape import GarmentPart, Outfit
from tryon_solver.advice import advise, unmet
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import Pose, skin
from tryon_solver.geometry.garment import Layer
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.results import Counters
from tryon_solver.settings import PRESETS

HEIGHTS = [0.0, 0.45, 0.85, 1.0, 1.25, 1.4, 1.5, 1.62, 1.72]
RADII = [0.10, 0.13, 0.17, 0.14, 0.17, 0.10, 0.06, 0.09, 0.03]
AROUND = 48
ROWS = 24
JOINTS = ("hips", "chest", "head")
SECONDS = 4.0
FITTING_SIZE = 0.93  # what a size that is looked for comes to
QUICKEST = 0.02  # s, in which it solves a frame under a deadline
ADVICE = "the fabric is stretched by up to 35 %; try a larger size"


def radius(height: np.ndarray) -> np.ndarray:
    """Of the form at a height [m]."""
    return np.interp(height, HEIGHTS, RADII)


def form() -> BodyModel:
    """The form: a closed surface of revolution, bound to its joints by height."""
    heights = np.linspace(0.0, 1.72, 40)
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    ring = np.stack([np.sin(angles), np.zeros(AROUND), np.cos(angles)], axis=-1)
    rows = [radius(y) * ring + [0.0, y, 0.0] for y in heights]
    vertices = np.concatenate([*rows, [[0.0, 0.0, 0.0]], [[0.0, 1.72, 0.0]]])
    bottom, top, last = len(vertices) - 2, len(vertices) - 1, (len(heights) - 1) * AROUND
    faces = [face for row in range(len(heights) - 1) for i in range(AROUND) for face in quad(row, i)]
    faces += [(bottom, (i + 1) % AROUND, i) for i in range(AROUND)]
    faces += [(top, last + i, last + (i + 1) % AROUND) for i in range(AROUND)]
    bend = np.clip((vertices[:, 1] - 0.9) / 0.3, 0.0, 1.0)
    head = (vertices[:, 1] > 1.45).astype(np.float64)
    weights = np.stack([1.0 - bend, bend * (1.0 - head), bend * head], axis=-1).astype(np.float32)
    return BodyModel(
        rest_vertices=vertices,
        faces=np.array(faces, np.int32),
        joint_names=JOINTS,
        parents=np.array([-1, 0, 1], np.int32),
        rest_joints=np.array([[0.0, 0.9, 0.0], [0.0, 1.1, 0.0], [0.0, 1.5, 0.0]]),
        skin_joints=np.tile(np.arange(3, dtype=np.int32), (len(vertices), 1)),
        skin_weights=weights,
    )


def quad(row: int, i: int) -> list[tuple[int, int, int]]:
    """The two triangles between two rows at place ``i``, seen from outside."""
    a, b = row * AROUND + i, row * AROUND + (i + 1) % AROUND
    return [(a, b, b + AROUND), (a, b + AROUND, a + AROUND)]


@dataclass(frozen=True)
class Facts:
    iterations: int = 7
    residual: float = 1e-4
    error: float = 2.5e-4
    min_gap: float = 0.0012
    gap_offset: float = 0.0018
    max_stretch: float = 1.043
    body_lag: float = 0.002
    pairs: int = 320
    retries: int = 0
    times_ms: dict[str, float] = field(default_factory=lambda: {"smooth": 3.0, "correct_penetration": 5.5})
    advice: str = ""
    asleep: bool = False
    late: float = 0.0

    def to_dict(self) -> dict[str, object]:
        return asdict(self)

MOST_WORN = 3  # garments that go over each other


class Tunic(PretendedPreset):
    """Two pieces sewn at the sides, hanging around the form; its folds swing as time goes by. Where it is several
    garments, they are alike, one further out than the other."""

    def __init__(self, advice: str = "", fabrics: dict[str, str] | None = None) -> None:
        """`fabrics`: of the garments that are worn, by name, from the innermost outwards."""
        self.advice = advice
        self.fabrics = fabrics or {"": "cotton"}
        self.edited = self.names[-1]
        body = form()
        faces = np.array([face for row in range(ROWS - 1) for i in range(AROUND) for face in quad(row, i)], np.int32)
        self.angles = np.tile(2 * np.pi * np.arange(AROUND) / AROUND, ROWS)
        self.heights = np.repeat(np.linspace(0.55, 1.36, ROWS), AROUND)
        column = faces % AROUND
        column = np.where(column - column.min(axis=1, keepdims=True) > AROUND / 2, column - AROUND, column)
        count, vertices = len(self.names), ROWS * AROUND
        side = (column.min(axis=1) % AROUND >= AROUND // 2).astype(np.int32)
        uv = np.stack([0.02 * column, self.heights[faces]], axis=-1)
        self.outfit = Outfit(
            vertex_count=count * vertices,
            faces=np.vstack([faces + k * vertices for k in range(count)]),
            uv=np.concatenate([uv] * count),
            panel_of_face=np.concatenate([side + 2 * k for k in range(count)]),
            panel_names=tuple(f"{side}{k or ''}" for k in range(count) for side in ("front", "back")),
            body=body,
            garments=tuple(
                GarmentPart(fabric, Layer(name, *(slice(k * n, (k + 1) * n) for n in (vertices, len(faces), 2))))
                for k, (name, fabric) in enumerate(self.fabrics.items())
            ),
        )
        self.pose = Pose.rest(body)
        self.origin = np.zeros(3)
        self.current, self.t = self.pose, 0.0
        self.bought: tuple[float | None, float | None] = (None, None)
        self.effects = PretendedEffects(garments=self.names)

    own_motion = None
    on_the_way, not_carried, went, overstretched = False, "", 0.0, 0.0
    outgrown = ""
    waiting = False

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.fabrics)

    @property
    def specifications(self) -> dict[str, None]:
        return dict.fromkeys(self.fabrics)

    def size_of(self, _name: str) -> None:
        return None

    def edit_garment(self, name: str) -> None:
        self.edited = name

    def take_off(self, *names: str) -> Iterator[Tunic]:
        left = Tunic(self.advice, {own: fabric for own, fabric in self.fabrics.items() if own not in names})
        left.current, left.t, left.origin, left.preset = self.current, self.t, self.origin, self.preset
        yield left

    def packed(self) -> Tunic:
        return self

    def unpacking(self, _specification: object = None) -> Iterator[Tunic]:
        yield self

    @property
    def stance(self) -> Pose:
        return self.current

    @property
    def seconds(self) -> float:
        return self.t

    def come_to(self, _other: object, way: Iterator[None], off: Sequence[str] = ()) -> Iterator[Tunic | None]:
        yield from way
        if off:
            yield from self.take_off(*off)

    def leap(self, by: np.ndarray) -> None:
        self.origin = self.origin + by

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        self.bought = accuracy, deadline

    def come_at_once(self) -> None:
        """It is there already."""

    def come_along(self) -> None:
        """It feels nothing, ever."""

    def advance(self, pose: Pose, t: float, longest_step: float = 0.0) -> Facts:  # noqa: ARG002
        self.current, self.t = pose, t
        accuracy, deadline = self.bought
        error = Facts.error if accuracy is None else accuracy
        if deadline is None:
            return Facts(self.iterations, advice=self.advice, error=error)
        time.sleep(QUICKEST)
        late = max(0.0, QUICKEST - deadline)
        return Facts(self.iterations, advice=late_advice(late) if late else self.advice, error=error, late=late)

    def cloth_positions(self) -> np.ndarray:
        loose = np.clip((1.3 - self.heights) / 0.5, 0.0, 1.0)
        fold = 0.5 + 0.5 * np.sin(7 * self.angles + 2.0 * np.sin(2.5 * self.t))
        out = radius(self.heights) + 0.02 + loose * (0.05 + 0.05 * fold)
        rings = [
            np.stack([wide * np.sin(self.angles), self.heights, wide * np.cos(self.angles)], axis=-1)
            for wide in (out + 0.03 * k for k in range(len(self.names)))
        ]
        return (np.vstack(rings) + self._here().root - self.pose.root).astype(np.float32)

    def body_positions(self) -> np.ndarray:
        return skin(self.outfit.body, self._here()).astype(np.float32)

    def _here(self) -> Pose:
        return Pose(self.current.root - self.origin, self.current.rotations)


def late_advice(late: float) -> str:
    """As the solver says it, of `late` s."""
    return advise(Counters(), 0.0, FABRICS["denim"], np.ones(1), 0.0, unmet(PRESETS["draft"], 0.0, late))


def build(order, progress) -> Tunic:
    for step in range(4):
        progress("Sewing the pieces", step / 4)
    while order.wardrobe is not None and (order.wardrobe.parents[1] / "held").exists():
        time.sleep(0.02)
    if order.fabric == "tight":
        raise problem_error("garment.undressable", "the seam between front and back stayed open", "Enlarge the pieces")
    if len(order.garments) > MOST_WORN:
        raise problem_error("garment.unfit", f"{order.over[-1].worn_as} is too tight over the others", "Enlarge it")
    advice = ADVICE if order.fabric == "denim" else ""
    tunic = Tunic(advice, {one.worn_as: one.fabric for one in order.garments}).ordered(order.preset)
    size = FITTING_SIZE if order.size is None else order.size
    tunic.outfit = replace(tunic.outfit, size=size)
    if size > 1.0:
        tunic.outfit = replace(tunic.outfit, fit="the waist is 9.1 cm too wide", fitting_size=0.8)
    if order.body is not None:
        tunic.outfit = replace(tunic.outfit, notes=("body: it is not closed: 2 holes are filled",))
    return tunic


def load_motion(name: str, body: BodyModel, _file: object = None) -> Motion:
    """``walk`` goes half a metre forward and back, ``turn`` to the side."""
    times = np.linspace(0.0, SECONDS, 121)
    way = 0.25 * (1.0 - np.cos(2 * np.pi * times / SECONDS))
    across = np.array([0.0, 0.0, 1.0]) if name == "walk" else np.array([1.0, 0.0, 0.0])
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(times), len(JOINTS), 1))
    return Motion(body.rest_joints[0] + way[:, None] * across, rotations, times[1], name)
