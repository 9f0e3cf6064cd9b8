"""The body: a closed surface, a skeleton and skin weights. Metres, Y up, facing +Z, soles at y = 0 in the rest pose."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tryon_solver.body.on_device import MovingBody
    from tryon_solver.body.pose import Pose

BODY_VARIABLE = "TRYON_BODY"
MAKE_COMMAND = "python scripts/make_body.py"


class BodyError(ValueError):
    """A body model is missing or malformed; the message names the place and the remedy."""


@dataclass(frozen=True)
class BodyModel:
    """A skinned body. Arrays are checked on construction and must not be written to afterwards.

    Raises BodyError naming the offending array when shapes, indices, weights or the order of the joints are wrong.
    """

    rest_vertices: np.ndarray  # (B, 3) float64 m
    faces: np.ndarray  # (F, 3) int32, closed, outward
    joint_names: tuple[str, ...]  # (J,)
    parents: np.ndarray  # (J,) int32, -1 for the root; parents before children
    rest_joints: np.ndarray  # (J, 3) float64 m
    skin_joints: np.ndarray  # (B, K) int32
    skin_weights: np.ndarray  # (B, K) float32, rows sum to 1
    licence: str = field(default="", compare=False)  # terms of the data the body was made from
    recipe: str = field(default="", compare=False)  # digest of what made it, see scripts/make_body.py

    def __post_init__(self) -> None:
        joints, vertices = len(self.joint_names), len(self.rest_vertices)
        _expect("rest_vertices", self.rest_vertices, (vertices, 3), np.float64)
        _expect("faces", self.faces, (len(self.faces), 3), np.int32)
        _expect("parents", self.parents, (joints,), np.int32)
        _expect("rest_joints", self.rest_joints, (joints, 3), np.float64)
        _expect("skin_joints", self.skin_joints, (vertices, self.skin_joints.shape[-1]), np.int32)
        _expect("skin_weights", self.skin_weights, self.skin_joints.shape, np.float32)
        if len(set(self.joint_names)) != joints or joints == 0:
            raise BodyError("joint_names must be unique and not empty")
        if self.parents[0] != -1 or any(not 0 <= parent < j for j, parent in enumerate(self.parents) if j):
            raise BodyError("parents must be -1 for joint 0 and for every other joint the index of an earlier one")
        for name, indices, bound in (("faces", self.faces, vertices), ("skin_joints", self.skin_joints, joints)):
            if indices.size and not 0 <= indices.min() <= indices.max() < bound:
                raise BodyError(f"{name} holds an index outside [0, {bound})")
        for name in ("rest_vertices", "rest_joints", "skin_weights"):
            if not np.isfinite(getattr(self, name)).all():
                raise BodyError(f"{name} holds a value that is not finite")
        sums = self.skin_weights.astype(np.float64).sum(axis=1)
        if vertices and (np.abs(sums - 1.0).max() > 1e-6 or self.skin_weights.min() < 0.0):
            raise BodyError("skin_weights must not be negative and each row must sum to 1 within 1e-6")

    @property
    def joint_count(self) -> int:
        return len(self.joint_names)

    @property
    def vertex_count(self) -> int:
        return len(self.rest_vertices)

    @cached_property
    def index_of(self) -> dict[str, int]:
        """Joint name -> index."""
        return {name: index for index, name in enumerate(self.joint_names)}

    @cached_property
    def ancestors(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """What forward kinematics runs through: joints with their ancestors one step up, then two, four, eight, ...;
        who has none so far up is left out. After as many rounds a joint has all above it in its transform."""
        rounds, above = [], self.parents.astype(int)
        while (above >= 0).any():
            joints = np.flatnonzero(above >= 0)
            rounds.append((joints, above[joints]))
            above = np.where(above >= 0, above[above], -1)
        return tuple(rounds)

    def start(self) -> Pose:
        """The rest pose."""
        from tryon_solver.body.pose import Pose

        return Pose.rest(self)

    def surface(self, stance: Pose) -> np.ndarray:
        """(B, 3) float64 m: the vertices at a pose."""
        from tryon_solver.body.pose import skin

        return skin(self, stance)

    def on_device(self, device: str) -> MovingBody[Pose]:
        """The body ready to be followed by a simulation."""
        from tryon_solver.body.skinning import SkinningKernel

        return SkinningKernel(self, device)

    def save(self, path: str | Path) -> None:
        """Write a compressed .npz; the folder is made when missing. The file appears whole or not at all."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_name(f".{path.name}.{os.getpid()}")
        with draft.open("wb") as file:
            np.savez_compressed(
                file,
                rest_vertices=self.rest_vertices,
                faces=self.faces,
                joint_names=np.array(self.joint_names),
                parents=self.parents,
                rest_joints=self.rest_joints,
                skin_joints=self.skin_joints,
                skin_weights=self.skin_weights,
                licence=np.array(self.licence),
                recipe=np.array(self.recipe),
            )
        draft.replace(path)

    @staticmethod
    def load(path: str | Path) -> BodyModel:
        """Read what `save` wrote. Raises BodyError naming the file when it is missing or no body."""
        path = Path(path)
        try:
            with np.load(path, allow_pickle=False) as held:
                return BodyModel(
                    rest_vertices=held["rest_vertices"],
                    faces=held["faces"],
                    joint_names=tuple(str(name) for name in held["joint_names"]),
                    parents=held["parents"],
                    rest_joints=held["rest_joints"],
                    skin_joints=held["skin_joints"],
                    skin_weights=held["skin_weights"],
                    licence=str(held["licence"]),
                    recipe=str(held["recipe"]),
                )
        except FileNotFoundError:
            raise BodyError(f"there is no body model at {path}; make it with `{MAKE_COMMAND}`") from None
        except (OSError, EOFError, KeyError, TypeError, zipfile.BadZipFile, ValueError) as fault:
            raise BodyError(f"{path} is not a body model ({fault}); remake it with `{MAKE_COMMAND} --force`") from fault


def default_body_path() -> Path:
    """Where the default body lies: the environment variable TRYON_BODY, or .cache/tryon/body.npz of the checkout."""
    named = os.environ.get(BODY_VARIABLE)
    return Path(named) if named else Path(__file__).resolve().parents[3] / ".cache" / "tryon" / "body.npz"


def default_body() -> BodyModel:
    """The body made at set-up. Raises BodyError with the command that makes it when it is missing."""
    path = default_body_path()
    if not path.exists():
        raise BodyError(
            f"the default body is not at {path}. Make it once with `{MAKE_COMMAND}` (downloads 48 MB, takes about "
            f"half a minute), or set {BODY_VARIABLE} to a body made elsewhere."
        )
    return BodyModel.load(path)


def _expect(name: str, array: np.ndarray, shape: tuple[int, ...], dtype: type) -> None:
    if array.shape != shape or array.dtype != dtype:
        wanted = np.dtype(dtype).name
        raise BodyError(f"{name} is {array.dtype} of shape {array.shape}, expected {wanted} of shape {shape}")
