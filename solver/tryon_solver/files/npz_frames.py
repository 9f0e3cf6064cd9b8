"""The frames of a moving mesh in an .npz: each array is looked at before it is used, and refused by its name."""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tryon_solver.files.convention import BODY_AXES, UNITS
from tryon_solver.files.raw_mesh import MeshFileError

FRAME_KEYS = (("vertices", "faces"), ("body", "body_faces"))  # the second is what tryon simulate writes
RATES = (1.0, 1000.0)  # frames a second, slowest and fastest that can be meant
FPS_KEYS = ("fps", "mocap_framerate", "mocap_frame_rate", "framerate", "frame_rate")  # the second as AMASS has it
PARAMETER_KEYS = {"poses", "betas", "trans", "pose_body", "root_orient", "body_pose", "global_orient", "transl"}
MODEL_KEYS = {"v_template", "shapedirs"}  # of SMPL's own files
NAMED_MAX = 12  # keys that are told
SAME_RATE = 1e-3  # share by which fps and 1/dt may differ
OWN_RATE = "Write fps, frames a second, or dt, seconds between them, as one number; or say it with --body-fps"


@dataclass(frozen=True)
class NpzFrames:
    """What an .npz says: `frames` (T, V, 3) and `faces` (F, 3) whole numbers from 0 to V - 1; None what it leaves out.

    `dt` s between frames.
    """

    frames: np.ndarray
    faces: np.ndarray
    dt: float | None
    unit: str | None
    up: str | None


def read_npz(path: Path, name: str, bytes_max: int, rate_told: bool) -> NpzFrames:
    """Read the file, called `name` in what is said of it. `bytes_max` to unpack; with `rate_told` its own fps and dt
    are not looked at. Raises MeshFileError."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > bytes_max:
            raise MeshFileError(f"it has {size / 2**20:.0f} MiB to read", name, "Export fewer frames")
        with np.load(path, allow_pickle=False) as held:
            keys = set(held.files)
            names = next((pair for pair in FRAME_KEYS if set(pair) <= keys), None)
            if names is None:
                raise MeshFileError(*_without_mesh(keys, name))
            wanted = {*names, *FPS_KEYS, "dt", "units", "up"} & keys
            arrays = {key: np.asarray(held[key]) for key in wanted}
    except MeshFileError:
        raise
    except (
        OSError, ValueError, EOFError, RuntimeError, MemoryError, zipfile.BadZipFile, zlib.error
    ) as error:
        raise MeshFileError(f"it can't be read ({error})", name, "Write it with numpy.savez") from error
    frames, faces = _surface(arrays, names, name)
    return NpzFrames(
        frames,
        faces,
        None if rate_told else _interval(arrays, name),
        _word(arrays, "units", tuple(UNITS), name),
        _word(arrays, "up", BODY_AXES, name),
    )


def _without_mesh(keys: set[str], name: str) -> tuple[str, str, str]:
    """What there is to say of an archive that holds these and no mesh: message, place and remedy."""
    more = f" and {len(keys) - NAMED_MAX} more" if len(keys) > NAMED_MAX else ""
    holds = f"it holds {', '.join(sorted(keys)[:NAMED_MAX]) or 'nothing'}{more}"
    needed = "vertices (frames, V, 3), faces (F, 3), and fps or dt"
    if keys & MODEL_KEYS:
        return f"{holds}: a body model such as SMPL, not a mesh that moves", name, f"Pose it, and write {needed}"
    if keys & PARAMETER_KEYS:
        what = f"{holds}: the parameters of a body model such as SMPL, as AMASS has them, not a mesh"
        return what, name, f"Run the body model with them, and write what comes out as {needed}"
    return holds, name, f"Give it {needed}"


def refuse_rate(fps: float, place: str, remedy: str) -> None:
    """Raises MeshFileError for frames a second that can't be meant."""
    if not RATES[0] <= fps <= RATES[1]:
        raise MeshFileError(f"{fps:g} frames a second are not within {RATES[0]:g} and {RATES[1]:g}", place, remedy)


def _surface(arrays: Mapping[str, np.ndarray], names: tuple[str, str], name: str) -> tuple[np.ndarray, np.ndarray]:
    frames, faces = arrays[names[0]], arrays[names[1]]
    if frames.dtype.kind not in "iuf":
        raise MeshFileError(
            f"they are {frames.dtype}, no real numbers", f"{name}, {names[0]}", "Write them as float32 or float64"
        )
    if faces.dtype.kind not in "iu":
        raise MeshFileError(
            f"they are {faces.dtype}, no whole numbers", f"{name}, {names[1]}", "Write them as int32: ids from 0"
        )
    if frames.ndim not in (2, 3) or frames.shape[-1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshFileError(
            f"vertices are {frames.shape} and faces {faces.shape}", name, "They must be (frames, V, 3) and (F, 3)"
        )
    if frames.ndim == 2:
        frames = frames[None]
    if not len(frames):
        raise MeshFileError("there are no frames", f"{name}, {names[0]}", "Export at least one frame")
    wrong = np.argwhere((faces < 0) | (faces >= frames.shape[1]))
    if len(wrong):
        row, column = wrong[0]
        raise MeshFileError(
            f"a triangle refers to {faces[row, column]}, a vertex that is not there; there are 0 to "
            f"{frames.shape[1] - 1}",
            f"{name}, {names[1]}[{row}]",
            "Export it again; vertices are counted from 0",
        )
    return frames, faces.astype(np.int32)


def _interval(arrays: Mapping[str, np.ndarray], name: str) -> float | None:
    """Seconds between frames, by ``dt`` or ``fps``, or what else that is called."""
    rates: dict[str, float] = {}
    for key in (*FPS_KEYS, "dt"):
        if key in arrays:
            value = _number(arrays[key], f"{name}, {key}")
            if value <= 0:
                raise MeshFileError(f"it is {value:g}, which must be more than 0", f"{name}, {key}", OWN_RATE)
            rates[key] = 1 / value if key == "dt" else value
            refuse_rate(rates[key], f"{name}, {key}", OWN_RATE)
    (first, rate), *others = rates.items() or [("", 0.0)]
    for key, other in others:
        if abs(rate / other - 1) > SAME_RATE:
            raise MeshFileError(
                f"they contradict each other: {rate:g} a second and {other:g}",
                f"{name}, {first} and {key}",
                "Leave out the one that is wrong, or say it with --body-fps",
            )
    return 1 / rate if rates else None


def _number(array: np.ndarray, place: str) -> float:
    if array.size != 1 or array.dtype.kind not in "iuf":
        raise MeshFileError(f"it is {array.dtype} of shape {array.shape}, not one number", place, OWN_RATE)
    value = float(array.reshape(()))
    if not math.isfinite(value):
        raise MeshFileError(f"it is {value:g}, no finite number", place, OWN_RATE)
    return value


def _word(arrays: Mapping[str, np.ndarray], key: str, known: tuple[str, ...], name: str) -> str | None:
    """One of the known words, whichever letters are capitals."""
    if key not in arrays:
        return None
    array = arrays[key]
    value = array.reshape(-1)[0] if array.size == 1 else None
    text = value.decode(errors="replace") if isinstance(value, bytes) else value
    if not isinstance(text, str) or text.strip().lower() not in known:
        told = repr(str(text)) if isinstance(text, str) else f"{array.dtype} of shape {array.shape}"
        remedy = f"Write one of {', '.join(known)}"
        if key == "up":
            remedy = "Turn it so that y or z is up, and say which"
        raise MeshFileError(f"it is {told}, which is none of {', '.join(known)}", f"{name}, {key}", remedy)
    return text.strip().lower()
