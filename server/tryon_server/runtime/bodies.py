"""Bodies: the default one, one that was made with the project's script, a moving mesh, or a mesh that stands.

What a mesh that stands holds is found as of a moving one, its unit, its axes and what is to be mended, where it is a
human's; else it is a closed surface in metres, Y up.
"""

from __future__ import annotations

import contextlib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.order import MeshReading
from tryon_solver.body.model import BodyError, BodyModel, default_body
from tryon_solver.files.convention import Told, find_for_body
from tryon_solver.files.cut_off import missing_ends
from tryon_solver.files.mesh_body import (
    MeshBody,
    is_moving_mesh,
    kind_of,
    make_body,
    read_mesh_body,
    refuse_foreign,
    still_frames,
)
from tryon_solver.files.npz_frames import read_npz
from tryon_solver.files.persons import SeveralError, refuse_several
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.standing import facing, find_stand, stands_on_its_head

BODY_FILE = "body.npz"
BYTES_MAX = 64 * 2**20  # of a body's file, and of what is packed in an .npz: 30 times the default body's
VERTICES_MAX = 100_000  # of a body: 20 times the default's; the solver looks at each of them in every step
COARSER = "Reduce it to about 10,000 vertices"
BODY_KEY = "rest_vertices"  # what an .npz of a body of ours holds, and none of a moving mesh
PLAIN_KINDS = (".ply", ".stl", ".off")  # meshes that stand and hold nothing but their triangles
MESH_KINDS = (".obj", ".glb", *PLAIN_KINDS)  # of bodies that stand
AS_IT_IS = "units and axes: m, Y up (as a closed surface is read that says nothing else; --body-units and --body-up do)"
SIZE_RANGE = (0.05, 5.0)  # [m] extent of a body; a mesh outside of it was drawn in another unit


def moves_itself(path: Path | None) -> bool:
    """Whether this is a moving mesh; what can't be read is left to be told by who reads it next."""
    try:
        return path is not None and path.exists() and is_moving_mesh(path)
    except (MeshFileError, OSError, zipfile.BadZipFile):
        return False


def kind_of_body(path: Path | None) -> str | None:
    """``default``, ``model``, ``frames``, ``glb`` or ``mesh`` (one that stands); None for what its reader is left to
    tell."""
    if path is None:
        return "default"
    with contextlib.suppress(MeshFileError, OSError, zipfile.BadZipFile):
        kind = kind_of(path)
        if kind in MESH_KINDS:
            return "glb" if kind == ".glb" else "mesh"
        if is_moving_mesh(path):
            return "frames"
        if kind == "folder" or (kind == ".npz" and not _has_frames(path)):
            return "model"
    return None


def load_moving_mesh(path: Path | None, reading: MeshReading, name: str | None = None) -> MeshBody | None:
    """The moving mesh in this file or folder, or a human's that stands but has to be mended, or read in a unit of its
    own; None when it is another kind of body. A file without an ending, such as an upload, is a mesh. `name` is what
    its owner calls it, None for its file's.

    Raises:
        ProblemError: it is one and can't be used.
    """
    if path is None or not path.exists():
        return None
    try:
        refuse_foreign(path, name or path.name)
        kind = kind_of(path)
        if kind in PLAIN_KINDS and not path.suffix:
            return _read_standing(path, kind, _told(reading), name)
        if reading.animation is None and (path.suffix or path.is_dir()) and not _has_frames(path):
            return _standing_mesh(path, kind, reading, name)
        return read_mesh_body(path, _told(reading), reading.fps, reading.animation, name)
    except MeshFileError as error:
        raise problem_error(
            "body.unusable", f"{error.place}: {error.message}", error.remedy, place="body", status=422
        ) from error
    except (BodyError, OSError, zipfile.BadZipFile) as error:
        why = _called(str(error), path, name)
        raise problem_error("body.unusable", why, "Export it again", place="body", status=422) from error


def does_not_stand(body: MeshBody, error: MeshFileError) -> ProblemError:
    """What there is to say of a moving mesh that stands in no frame in which a pattern could be put on."""
    message = f"{error.place}: {'; '.join(filter(None, (body.cut_off, error.message)))}"
    return problem_error("body.unusable", message, error.remedy, place="body", status=422)


def _has_frames(path: Path) -> bool:
    """Whether this is a moving mesh, or was meant to be: an .npz that is no body of ours."""
    if path.suffix.lower() == ".npz":
        with zipfile.ZipFile(path) as archive:
            return f"{BODY_KEY}.npy" not in archive.namelist()
    return is_moving_mesh(path)


def _standing_mesh(path: Path, kind: str, reading: MeshReading, name: str | None) -> MeshBody | None:
    """A mesh that stands and is no closed surface in metres as it is, where it is a human's; None for other bodies."""
    if kind not in MESH_KINDS:
        return None
    told = _told(reading)
    if told != Told():
        return _read_standing(path, kind, told, name)
    try:
        mesh = _closed_mesh(path, name)
    except ProblemError as plain:
        try:
            return _read_standing(path, kind, told, name)
        except SeveralError:
            raise
        except (MeshFileError, BodyError):
            raise plain from None
    x, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    if missing_ends(x, faces):
        told = Told("m", "y", "as a closed mesh is read")
    else:
        refuse_several(_upright(x, path.name), faces, name or path.name)
        if mesh.volume >= 0 and not _lies(x, faces, path.name):
            return None
    with contextlib.suppress(MeshFileError, BodyError):  # what is no human's is taken as it is
        return _read_standing(path, kind, told, name)
    return None


def _read_standing(path: Path, kind: str, told: Told, name: str | None = None) -> MeshBody:
    """A mesh that stands, as a moving one of one frame. Raises MeshFileError, BodyError or ProblemError."""
    if kind not in PLAIN_KINDS:
        return read_mesh_body(path, told, name=name)
    mesh = _triangles(path, kind, name)
    return make_body(still_frames(np.asarray(mesh.vertices), np.asarray(mesh.faces), told, name or path.name))


def how_read(path: Path | None) -> tuple[str, ...]:
    """What there is to say of a body that `load_body` read: of a mesh that was taken as it is."""
    return (AS_IT_IS,) if path is not None and path.is_file() and path.suffix.lower() in MESH_KINDS else ()


def _told(reading: MeshReading) -> Told:
    return Told(reading.units, reading.up, facing=reading.facing)


def _upright(vertices: npt.NDArray[np.float64], name: str) -> npt.NDArray[np.float64]:
    """The same (V, 3) in metres, Y up, where they are as large as a human; else as they are."""
    try:
        return find_for_body(vertices, Told(), name).apply(vertices)
    except MeshFileError:
        return vertices


def _lies(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int_], name: str) -> bool:
    """Whether these are a human's, (V, 3) with faces (F, 3), that does not stand along Y in metres but, with its feet,
    another way, or not where patterns expect a body."""
    try:
        found = find_for_body(vertices, Told(), name)
        x = found.apply(vertices)
        if stands_on_its_head(x, faces):
            return True
        if facing(x, faces) is None:
            return False
        return (found.unit, found.up) != ("m", "y") or bool(find_stand(x, faces, name).notes)
    except MeshFileError:
        return False


def load_body(path: Path | None) -> BodyModel:
    """The body in this file; of a folder, the file ``body.npz`` in it; the default body for None.

    A mesh file (.obj, .ply, .stl, ...) becomes a body of one joint. It is read in metres, Y up, facing +Z.

    Raises:
        ProblemError: there is no such file, or no body in it.
    """
    try:
        if path is None:
            return default_body()
        if path.is_dir():
            if not (path / BODY_FILE).exists():
                why = f"the folder holds neither .obj frames nor {BODY_FILE}"
                raise _unfit(path, why, "Export into it one .obj file a frame")
            path = path / BODY_FILE
        _check_size(path)
        _refuse_unread(path)
        body = BodyModel.load(path) if path.suffix == ".npz" else still_body(path)
    except MeshFileError as error:
        message = f"{error.place}: {error.message}"
        raise problem_error("body.unusable", message, error.remedy, place="body", status=422) from error
    except BodyError as error:
        raise problem_error("body.unusable", str(error), "Then try again", place="body", status=422) from error
    if len(body.rest_vertices) > VERTICES_MAX:
        raise _unfit(path, f"it has {len(body.rest_vertices)} vertices, more than {VERTICES_MAX}", COARSER)
    return body


def _refuse_unread(path: Path) -> None:
    """Raises MeshFileError for what is known to be no body. What is missing or no archive is told by its reader."""
    with contextlib.suppress(OSError, zipfile.BadZipFile):
        refuse_foreign(path, path.name)
        if path.suffix == ".npz" and _has_frames(path):
            read_npz(path, path.name, BYTES_MAX, rate_told=False)


def _check_size(path: Path, name: str | None = None) -> None:
    """Look at how much there is to read before it is read. What is missing or no archive is told by its reader."""
    size = 0
    with contextlib.suppress(OSError):
        size = path.stat().st_size
    if path.suffix == ".npz":
        with contextlib.suppress(OSError, zipfile.BadZipFile), zipfile.ZipFile(path) as archive:
            size = max(size, sum(entry.file_size for entry in archive.infolist()))
    if size > BYTES_MAX:
        why = f"it has {size / 2**20:.0f} MiB to read, more than {BYTES_MAX / 2**20:.0f}"
        raise _unfit(name or path, why, COARSER)


def still_body(path: Path) -> BodyModel:
    """A closed mesh as a body of one joint. Raises ProblemError when it can't be read or is not a closed surface."""
    mesh = _closed_mesh(path)
    if mesh.volume < 0:
        mesh.invert()
    return one_joint_body(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32))


def _triangles(path: Path, kind: str = "", name: str | None = None) -> Any:
    """The file's triangles as trimesh has them, of the `kind` that its ending says or else this. Raises ProblemError
    when it holds none, with the `name` that its owner calls it."""
    import trimesh  # slow to load, and only mesh files need it

    _check_size(path, name)
    try:
        mesh = trimesh.load_mesh(path, file_type=kind.removeprefix(".") or None, process=True)
    except Exception as error:
        why = f"it can't be read as a mesh ({_called(str(error), path, name)})"
        raise _unfit(name or path, why, "Give a .npz body or a closed mesh file") from error
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise _unfit(name or path, "it holds no triangles", "Give a .npz body or a closed mesh file")
    return mesh


def _closed_mesh(path: Path, name: str | None = None) -> Any:
    """The same where it is a closed surface of a size that metres can mean. Raises ProblemError where it is not."""
    mesh = _triangles(path, name=name)
    if not mesh.is_watertight or not mesh.is_winding_consistent:
        raise _unfit(name or path, "its surface is not closed", "Close its holes and orient its faces alike")
    extent = float(mesh.extents.max())
    if not SIZE_RANGE[0] <= extent <= SIZE_RANGE[1]:
        raise _unfit(name or path, f"it is {extent:g} m large", "Export it in metres")
    return mesh


def one_joint_body(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32]) -> BodyModel:
    """A surface (V, 3) m with faces (F, 3) on one joint at the origin."""
    return BodyModel(
        rest_vertices=vertices,
        faces=faces,
        joint_names=("body",),
        parents=np.array([-1], np.int32),
        rest_joints=np.zeros((1, 3)),
        skin_joints=np.zeros((len(vertices), 1), np.int32),
        skin_weights=np.ones((len(vertices), 1), np.float32),
    )


def _called(text: str, path: Path, name: str | None) -> str:
    """The text with the `name` that its owner gave the file instead of where a server keeps it."""
    return text if name is None else text.replace(str(path), name)


def _unfit(name: str | Path, why: str, remedy: str) -> ProblemError:
    return problem_error("body.unusable", f"{name} is no body: {why}", remedy, place="body", status=422)
