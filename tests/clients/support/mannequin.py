"""A drape without a solver on the default body: a tunic that goes along with the chest, for what follows trackers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import ClassVar

import numpy as np
from dress_form import AROUND, quad
from pretended_effects import PretendedEffects
from pretended_presets import PretendedPreset

from tryon_server.runtime.drape import Outfit
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.model import BodyModel, default_body
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import Pose, skin, world_from_rest
from tryon_solver.body.retarget import retarget

ROWS = 16


@dataclass(frozen=True)
class Facts:
    iterations: int = 7
    residual: float = 1e-4
    error: float = 2.5e-4
    min_gap: float = 0.0012
    max_stretch: float = 1.02
    body_lag: float = 0.0
    pairs: int = 0
    retries: int = 0
    times_ms: dict[str, float] = field(default_factory=dict)
    advice: str = ""
    asleep: bool = False
    late: float = 0.0

    def to_dict(self) -> dict[str, object]:
        return asdict(self)


class Tunic(PretendedPreset):
    """A tube around the trunk, from the hips to below the shoulders, fixed to the chest."""

    def __init__(self) -> None:
        self.model = default_body()
        faces = np.array([face for row in range(ROWS - 1) for i in range(AROUND) for face in quad(row, i)], np.int32)
        angles = np.tile(2 * np.pi * np.arange(AROUND) / AROUND, ROWS)
        heights = np.repeat(np.linspace(0.85, 1.34, ROWS), AROUND)
        self.rest = np.stack([0.21 * np.sin(angles), heights, 0.17 * np.cos(angles)], axis=-1)
        self.outfit = Outfit(
            vertex_count=len(self.rest),
            faces=faces,
            uv=self.rest[faces][..., :2],
            panel_of_face=np.zeros(len(faces), np.int32),
            panel_names=("tube",),
            body=self.model,
        )
        self.pose = Pose.rest(self.model)
        self.origin = np.zeros(3)
        self.current = self.pose
        self.effects = PretendedEffects()

    own_motion = None
    names, edited = ("",), ""
    specifications: ClassVar[dict[str, None]] = {"": None}
    outgrown = ""
    waiting = False
    on_the_way, not_carried, went, overstretched = False, "", 0.0, 0.0

    seconds = 0.0

    @property
    def stance(self) -> Pose:
        return self.pose

    def come_at_once(self) -> None:
        """It is there already."""

    def come_along(self) -> None:
        """It feels nothing, ever."""

    def come_to(self, _other: object, way: Iterator[None], _off: Sequence[str] = ()) -> Iterator[Tunic | None]:
        yield from way

    def leap(self, by: np.ndarray) -> None:
        self.origin = self.origin + by

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        """It has no error, and takes no time."""

    def advance(self, pose: Pose, t: float, longest_step: float = 0.0) -> Facts:  # noqa: ARG002
        self.current = pose
        return Facts()

    def cloth_positions(self) -> np.ndarray:
        chest = world_from_rest(self.model, self._here())[self.model.index_of["spine_3"]]
        return (self.rest @ chest[:3, :3].T + chest[:3, 3]).astype(np.float32)

    def body_positions(self) -> np.ndarray:
        return skin(self.model, self._here()).astype(np.float32)

    def _here(self) -> Pose:
        return Pose(self.current.root - self.origin, self.current.rotations)


def build(_order: object, _progress: object) -> Tunic:
    return Tunic()


def load_motion(name: str, body: BodyModel, _file: object = None) -> Motion:
    """``walk`` sways half a metre to and fro, every other one stands."""
    times = np.linspace(0.0, 4.0, 121)
    way = 0.25 * (1.0 - np.cos(0.5 * np.pi * times)) * (name == "walk")
    rotations = np.tile(Pose.rest(body).rotations, (len(times), 1, 1))
    return Motion(body.rest_joints[0] + way[:, None] * np.array([0.0, 0.0, 1.0]), rotations, times[1], name)


def tracked_clip(name: str) -> dict[str, object]:
    """A demo motion as a headset's body tracking would tell it: joints by their WebXR names, no axes to rely on.

    Keys: names [K], rate [Hz], positions [T][K][3] m, hips [T][3] m: the middle between the hip joints.
    """
    from tryon_server.runtime.motions import MOTION_FOLDER
    from tryon_solver.body.tracking.conventions import WEBXR_MIDDLE, WEBXR_SIDED, sided

    body: BodyModel = default_body()
    motion: Motion = retarget(parse_bvh((MOTION_FOLDER / f"{name}.bvh").read_text(), name=name), body)
    places, _ = world_tracks(body, motion)
    others = {"waist": "spine_3", "chest": "spine_5"}
    table = sided(WEBXR_SIDED) | WEBXR_MIDDLE
    table = {part: joint for part, joint in table.items() if not part.endswith(("index", "little"))}
    ours = [body.index_of[others.get(part, part)] for part in table]
    hips = 0.5 * (places[:, body.index_of["left_thigh"]] + places[:, body.index_of["right_thigh"]])
    return {
        "names": list(table.values()),
        "rate": 1.0 / motion.dt,
        "positions": np.round(places[:, ours], 5).tolist(),
        "hips": hips.tolist(),
    }
