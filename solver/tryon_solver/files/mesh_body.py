"""A moving body from a stranger's file: OBJ frames in a folder or a .zip, an .npz of vertices, a .glb with a skin; or
one mesh.

Whatever is done to the mesh (welding, filling holes, remeshing) is done to its first frame and carried to the others as
weights of the file's own vertices, so that the surface moves as the file's does.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path, PurePosixPath

import numpy as np
import scipy.sparse as sp

from tryon_solver.body.making.closest import closest_points
from tryon_solver.body.making.remesh import remesh
from tryon_solver.body.mesh_sequence import MeshSequence, make_sequence
from tryon_solver.contact.crossings import CrossingSearch
from tryon_solver.files.convention import GLTF, USUAL_UNITS, Convention, Told, find_for_body
from tryon_solver.files.cut_off import describe, missing_ends, stand_of_half
from tryon_solver.files.foreign import LOOKED_AT as TELLING_BYTES
from tryon_solver.files.foreign import no_body
from tryon_solver.files.gltf import parse_glb
from tryon_solver.files.holes import fill_holes
from tryon_solver.files.jumps import refuse_jumps
from tryon_solver.files.npz_frames import FRAME_KEYS, read_npz, refuse_rate
from tryon_solver.files.numbering import frame_numbers, gaps
from tryon_solver.files.obj import Polygon, parse_frame, parse_obj, refuse_other_polygons
from tryon_solver.files.persons import refuse_several
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.sides import sides_told
from tryon_solver.files.standing import Stand, find_stand, stands, stands_on_its_head
from tryon_solver.files.surroundings import refuse_surroundings
from tryon_solver.geometry.distinct import ascending, distinct
from tryon_solver.geometry.seams import face_edges
from tryon_solver.geometry.surface_repair import (
    crowded_edges,
    hanging_on_none,
    three_corners,
    turned_alike,
    twins,
    usual_gap,
    weld_coincident,
)

VERTICES = 5_000  # of the collision surface
ENOUGH = 1.2  # times that many are left as they are
UNMESHED_MAX = 20_000  # vertices of a surface that is no manifold and can't be remeshed
VERTICES_MAX = 200_000
FRAMES_MAX = 20_000
BYTES_MAX = 2 * 2**30  # of positions, all frames
UNPACKED_MAX = 2**30  # bytes of OBJ text in an archive
GLB_DT = 1 / 60  # s, a skinned animation is sampled so often
USUAL_FPS = 30.0  # of a folder of frames, when nobody says
SAME_THROUGHOUT = 1e-3  # m, vertices welded in the first frame stay so close in all
STANDS = "it stands still"
HALF = "as half a person is not as tall as a grown-up, unless --body-units says otherwise"
TOLD_GAP = 1e-6  # m, vertices that are joined over less are taken as equal
LOOKED_AT = 12  # frames in which crossings are counted
REMESH_ROUNDS = 4
THICK = 2e-3  # m, twice the volume over the area; of a human's body it is about 70 mm

Frame = Callable[[int], np.ndarray]


@dataclass(frozen=True)
class RawFrames:
    """A moving mesh in the file's units: `frames` (T, V, 3) float32, `faces` (F, 3), `dt` s between frames."""

    frames: np.ndarray
    faces: np.ndarray
    dt: float
    told: Told
    name: str
    notes: tuple[str, ...]
    files: tuple[str, ...] = ()  # of the frames, where each is a file
    leftward: np.ndarray | None = None  # (3,) from joints named right to those named left; None where none are

    def place(self, frame: int) -> str:
        """Where a frame is."""
        return self.files[frame] if self.files else f"{self.name}, frame {frame}"


@dataclass(frozen=True)
class MeshBody:
    """A body that came as a moving mesh, ready to be worn on: what was found and done is in `notes`."""

    sequence: MeshSequence
    convention: Convention
    notes: tuple[str, ...]
    name: str = "body"
    cut_off: str = ""  # what there is to say of a person who is not there as a whole
    facing: np.ndarray | None = None  # (3,) the level unit vector that it faces along, where that was told
    lacks: frozenset[str] = frozenset()  # of cut_off.ENDS: what of a person is not there

    def for_patterns(self, frame: int = 0) -> MeshBody:
        """The same body where patterns expect one, which is told: patterns come without a place, meshes with theirs.

        They are put on in that `frame`. Raises MeshFileError when it does not stand there, unless it has no legs to
        stand on.
        """
        sequence = self.sequence
        time = frame * sequence.dt
        x = sequence.rest_vertices if frame == 0 else sequence.surface(sequence.sample(time))
        stand = self.stand(x)
        put = replace(sequence.put(stand.turn, stand.shift), dressed_at=time)
        return replace(self, sequence=put, notes=(*self.notes, *stand.notes))

    def stand(self, x: np.ndarray) -> Stand:
        """What puts it, at x (V, 3) m of one of its frames, where patterns expect a body. As `find_stand`."""
        if "legs" in self.lacks:
            return stand_of_half(x, self.sequence.faces, self.lacks, self.facing)
        return find_stand(x, self.sequence.faces, self.name, self.facing)


def is_moving_mesh(path: Path) -> bool:
    """Whether these are OBJ frames, an .npz of frames, or a .glb that moves: what `read_mesh_body` takes."""
    kind = kind_of(path)
    if kind == "folder":
        return bool(_frame_files(path))
    if kind == ".npz":
        with zipfile.ZipFile(path) as archive:
            names = {Path(name).stem for name in archive.namelist()}
        return any(set(keys) <= names for keys in FRAME_KEYS)
    return kind == ".zip" or (kind == ".glb" and parse_glb(path.read_bytes(), path.name).duration > 0)


def kind_of(path: Path) -> str:
    """".npz", ".zip", ".glb", ".obj", ".ply", ".stl", another ending, or "folder".

    By its name, without an ending by its content.
    """
    if path.is_dir():
        return "folder"
    if path.suffix:
        return path.suffix.lower()
    with path.open("rb") as file:
        start = file.read(TELLING_BYTES)
    if start.startswith(b"glTF"):
        return ".glb"
    if start.startswith((b"ply\n", b"ply\r")):
        return ".ply"
    triangles = int.from_bytes(start[80:84], "little")  # of a binary STL
    if (start.startswith(b"solid") and b"facet" in start) or path.stat().st_size == 84 + 50 * triangles > 84:
        return ".stl"
    if start[:2] != b"PK":
        return ".obj"
    with zipfile.ZipFile(path) as archive:
        return ".npz" if any(name.endswith(".npy") for name in archive.namelist()) else ".zip"


def refuse_foreign(path: Path, name: str) -> None:
    """Raises MeshFileError for a file of a kind that is known and not read, called `name` by its owner."""
    if path.is_dir():
        return
    with path.open("rb") as file:
        why = no_body(file.read(TELLING_BYTES), path.name)
    if why is not None:
        raise MeshFileError(why[0], name, why[1])


def read_mesh_body(
    path: Path,
    told: Told = Told(),  # noqa: B008
    fps: float | None = None,
    animation: str | None = None,
    name: str | None = None,
) -> MeshBody:
    """Read a moving mesh and make it a body.

    `told` what is known of its unit, axes and facing; `fps` frames a second, where the file does not say; `animation`
    of a .glb, by name, the first without that; `name` what its owner calls it, None for its file's. Raises
    MeshFileError or BodyError.
    """
    return make_body(read_frames(path, told, fps, animation, name))


def read_frames(
    path: Path,
    told: Told = Told(),  # noqa: B008
    fps: float | None = None,
    animation: str | None = None,
    name: str | None = None,
) -> RawFrames:
    """The moving mesh of a file or folder as it is; as `read_mesh_body`. Raises MeshFileError."""
    name = name or path.name
    refuse_foreign(path, name)
    kind = kind_of(path)
    if fps is not None:
        refuse_rate(fps, f"{name}, --body-fps", "Say how many frames a second were recorded")
    if animation is not None and kind != ".glb":
        raise MeshFileError("only a .glb has animations to choose from", name, "Leave --body-animation out")
    if kind == "folder":
        files = _frame_files(path)
        if not files:
            raise MeshFileError("the folder holds no .obj frames", name, "Export into it one .obj file a frame")
        raw = _read_objs(name, [(f"{name}/{file.name}", file.read_bytes) for file in files], told, fps)
    elif kind == ".zip":
        raw = _read_zip(path, name, told, fps)
    elif kind == ".npz":
        raw = _read_npz(path, name, told, fps)
    elif kind == ".obj":
        mesh = parse_obj(path.read_text(errors="replace"), name)
        return still_frames(mesh.vertices, mesh.faces, told, name, mesh.notes)
    else:
        raw = _read_glb(path, name, told, animation)
    return _sound(raw)


def still_frames(
    vertices: np.ndarray, faces: np.ndarray, told: Told, name: str, notes: tuple[str, ...] = ()
) -> RawFrames:
    """A mesh that stands still, (V, 3) in the file's units with faces (F, 3). Raises MeshFileError."""
    _limit(name, 1, len(vertices))
    return _sound(RawFrames(vertices[None].astype(np.float32), faces, GLB_DT, told, name, (STANDS, *notes)))


def _sound(raw: RawFrames) -> RawFrames:
    """The same. Raises MeshFileError where its triangles or positions are none."""
    if not raw.faces.size:
        raise MeshFileError("it has no triangles", raw.name, "Export the mesh itself, with its faces")
    if raw.faces.min() < 0 or raw.faces.max() >= raw.frames.shape[1]:
        raise MeshFileError("a triangle refers to a vertex that is not there", raw.name, "Export it again")
    bad = np.flatnonzero(~np.isfinite(raw.frames).all(axis=(1, 2)))
    if len(bad):
        raise MeshFileError(f"frame {bad[0]} has a position that is not a finite number", raw.name, "Export it again")
    return raw


def _read_objs(
    name: str, files: Sequence[tuple[str, Callable[[], bytes]]], told: Told, fps: float | None
) -> RawFrames:
    """A frame a file, each as its name and what reads it, in the order of the numbers in their names."""
    numbers = frame_numbers([file for file, _ in files], name)
    order = sorted(range(len(files)), key=numbers.__getitem__)
    files = [files[k] for k in order]
    _limit(name, len(files), 0)
    first = parse_obj(files[0][1]().decode(errors="replace"), files[0][0])
    _limit(name, len(files), len(first.vertices))
    frames = np.empty((len(files), len(first.vertices), 3), np.float32)
    every: list[Polygon] = []
    for k, (file, read) in enumerate(files):
        text = read().decode(errors="replace")
        positions, polygons = parse_frame(text, file)
        if k == 0:
            every = polygons
        if len(positions) != len(first.vertices):
            raise MeshFileError(
                f"it has {len(positions)} vertices, the first frame has {len(first.vertices)}",
                file,
                "Export every frame of one mesh; where a modifier changes it from frame to frame, leave that out",
            )
        refuse_other_polygons(polygons, every, file)
        frames[k] = positions
    said = "as told" if fps else "as nothing says otherwise; --body-fps does"
    rate = fps or USUAL_FPS
    notes = [f"{len(files)} frames, {rate:g} a second ({said})", *gaps(sorted(numbers)), *first.notes]
    return RawFrames(frames, first.faces, 1 / rate, told, name, tuple(notes), tuple(file for file, _ in files))


def _read_zip(path: Path, name: str, told: Told, fps: float | None) -> RawFrames:
    """OBJ frames in an archive, read without unpacking it to the disk."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            for entry in entries:
                place = PurePosixPath(entry.filename.replace("\\", "/"))
                if place.is_absolute() or ".." in place.parts or ":" in place.parts[0]:
                    raise MeshFileError(
                        f"its entry {entry.filename!r} leads out of the archive", name, "Pack the frames alone"
                    )
            frames = [entry for entry in entries if _is_frame(PurePosixPath(entry.filename.replace("\\", "/")))]
            if not frames:
                raise MeshFileError("it holds no .obj frames", name, "Pack a folder of .obj files, one a frame")
            size = sum(entry.file_size for entry in frames)
            if size > UNPACKED_MAX:
                raise MeshFileError(
                    f"its frames have {size / 2**20:.0f} MiB when they are unpacked, more than "
                    f"{UNPACKED_MAX / 2**20:.0f}",
                    name,
                    "Export fewer frames, or write an .npz",
                )
            frames.sort(key=lambda entry: entry.filename)
            files = [(f"{name}/{entry.filename}", partial(archive.read, entry)) for entry in frames]
            return _read_objs(name, files, told, fps)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        remedy = "Pack it again, without a password"
        raise MeshFileError(f"it can't be unpacked ({error})", name, remedy) from error


def _frame_files(folder: Path) -> list[Path]:
    """The .obj files in a folder."""
    return sorted(file for file in folder.iterdir() if _is_frame(PurePosixPath(file.name)))


def _is_frame(file: PurePosixPath) -> bool:
    """Whether this is an .obj file; hidden ones, and what macOS puts beside each ("._1.obj", "__MACOSX"), are not."""
    return file.suffix.lower() == ".obj" and not file.name.startswith(".") and "__MACOSX" not in file.parts


def _read_npz(path: Path, name: str, told: Told, fps: float | None) -> RawFrames:
    held = read_npz(path, name, BYTES_MAX, rate_told=fps is not None)
    _limit(name, *held.frames.shape[:2])
    unit, up = told.unit or held.unit, told.up or held.up
    source = "as the file says" if (unit, up) != (told.unit, told.up) else told.source
    said = "as told" if fps else "as the file says" if held.dt else "as nothing says otherwise; --body-fps does"
    dt = 1 / fps if fps else held.dt or 1 / USUAL_FPS
    note = f"{len(held.frames)} frames, {1 / dt:g} a second ({said})"
    with np.errstate(over="ignore"):  # what is too large for a float32 is told as not finite
        frames = held.frames.astype(np.float32)
    return RawFrames(frames, held.faces, dt, Told(unit, up, source, told.facing), name, (note,))


def _read_glb(path: Path, name: str, told: Told, animation: str | None) -> RawFrames:
    scene = parse_glb(path.read_bytes(), name, animation)
    raw = scene.raw_mesh()
    refuse_surroundings(raw)
    count = int(np.ceil(scene.duration / GLB_DT - 1e-6)) + 1
    _limit(name, count, len(raw.vertices))
    frames = np.stack([scene.positions(scene.begins + k * GLB_DT).astype(np.float32) for k in range(count)])
    if told.unit is None and told.up is None:
        told = replace(GLTF, facing=told.facing)
    note = f"an animation of {scene.duration:.2f} s, sampled every 1/{1 / GLB_DT:.0f} s" if count > 1 else STANDS
    choice = scene.animation
    offered = "; --body-animation names another" if choice and len(choice.names) > 1 and not choice.told else ""
    said = [f"{text}{offered}" if k == 0 else text for k, text in enumerate(scene.notes())]
    return RawFrames(frames, raw.faces, GLB_DT, told, name, (note, *said), leftward=scene.leftward())


def _limit(name: str, frames: int, vertices: int) -> None:
    if vertices > VERTICES_MAX:
        raise MeshFileError(f"it has {vertices} vertices, more than {VERTICES_MAX}", name, "Export it coarser")
    if frames > FRAMES_MAX or 12 * frames * vertices > BYTES_MAX:
        raise MeshFileError(
            f"{frames} frames of {vertices} vertices are too many", name, "Export fewer frames a second, or less of it"
        )


def make_body(raw: RawFrames) -> MeshBody:
    """Repair, coarsen and divide a moving mesh into parts.

    Raises MeshFileError when no unit or axis fits, or when it jumps.
    """
    used = np.unique(raw.faces[three_corners(raw.faces)])
    if not len(used):
        raise MeshFileError("none of its triangles has three corners", raw.name, "Export the mesh itself, with faces")
    convention = find_for_body(raw.frames[0][used], raw.told, raw.name)
    frames = convention.apply(raw.frames).astype(np.float32)
    refuse_jumps(frames, used, raw.dt, raw.place)
    weights, faces, turned, moved_by = _welded(frames, raw.faces)
    over = _upside_down(frames, weights, faces)
    if over:
        convention = replace(convention, over=True)
        frames = convention.apply(raw.frames).astype(np.float32)
    notes = [f"units and axes: {convention.describe()}", *raw.notes]
    if over:
        notes.insert(1, "its feet were above its head: it was turned over")
    x = weights @ frames[0].astype(np.float64)
    if 2 * len(hanging_on_none(faces)) > len(faces):
        raise MeshFileError(
            f"{len(hanging_on_none(faces))} of its {len(faces)} triangles hang on no other: their corners lie "
            f"{1e3 * usual_gap(x, faces):.2g} mm from the next ones, too far to be one",
            raw.name,
            "Merge its vertices by distance before exporting it",
        )
    if moved_by > TOLD_GAP:
        notes.append(f"vertices that nearly coincide were joined, which moves some by up to {1e3 * moved_by:.2g} mm")
    lacks = missing_ends(x, faces)
    half = describe(lacks)
    if lacks:
        if raw.told.unit is None and convention.unit not in USUAL_UNITS and convention.others:
            return make_body(replace(raw, told=replace(raw.told, unit=convention.others[0], source=HALF)))
        notes.append(half)
    part = turned_alike(faces)[1]
    parts = part.max() + 1
    if parts > 1:
        if not lacks:
            refuse_several(x, faces, raw.name)
        notes.append(f"it consists of {parts} separate parts")
    weights, faces, mended = fill_holes(weights, faces, x)
    notes += mended
    x = weights @ frames[0].astype(np.float64)
    inwards = _face_inwards(x, faces)
    faces = np.where(inwards[:, None], faces[:, ::-1], faces)
    _refuse_flat(x, faces, raw.name)
    ahead = convention.direction(raw.told.facing) if raw.told.facing else None
    notes += sides_told(turned ^ inwards[: len(turned)], part, frames[0][used], raw.leftward, convention, ahead)
    if weights.shape[0] > ENOUGH * VERTICES:
        if len(crowded_edges(faces)):
            notes.append("more than two triangles meet at some of its edges: it is left as fine as it is")
            if weights.shape[0] > UNMESHED_MAX:
                raise MeshFileError(
                    f"it has {weights.shape[0]} vertices and edges with more than two triangles", raw.name,
                    f"Export it with fewer than {UNMESHED_MAX} vertices, or as one clean surface",
                )
        else:
            before = weights.shape[0]
            weights, faces = _coarser(weights, faces, x)
            notes.append(f"its {before} vertices were remeshed to {weights.shape[0]}")
    moved = np.stack([weights @ frame.astype(np.float64) for frame in frames]).astype(np.float32)
    notes += _crossings(moved, faces)
    sequence = make_sequence(moved, faces, raw.dt)
    return MeshBody(sequence, convention, tuple(notes), raw.name, half, ahead, frozenset(lacks))


def _upside_down(frames: np.ndarray, weights: sp.csr_matrix, faces: np.ndarray) -> bool:
    """Whether the file has the person upside down: on the head at first, and later never on the feet, as after a
    handstand."""
    if not stands_on_its_head(weights @ frames[0].astype(np.float64), faces):
        return False
    chosen = np.unique(np.linspace(0, len(frames) - 1, LOOKED_AT).astype(int))[1:]
    return not any(stands(weights @ frames[k].astype(np.float64), faces) for k in chosen)


def _welded(frames: np.ndarray, faces: np.ndarray) -> tuple[sp.csr_matrix, np.ndarray, np.ndarray, float]:
    """Coincident vertices joined, doubled and flat triangles left out, all turned alike.

    Returns weights (B, V), faces (F, 3), which of them (F,) were turned, and how far [m] a vertex was moved.
    """
    joined = weld_coincident(frames[0].astype(np.float64), faces)
    first = np.unique(joined, return_index=True)[1]
    apart = np.zeros(len(joined), bool)
    for frame in frames[np.unique(np.linspace(0, len(frames) - 1, LOOKED_AT).astype(int))]:
        apart |= np.linalg.norm(frame - frame[first[joined]], axis=1) > SAME_THROUGHOUT
    if apart.any():
        joined = joined.copy()
        joined[apart] = joined.max() + 1 + np.arange(apart.sum())
    merged = joined[faces]
    merged = merged[three_corners(merged)]
    merged = merged[~twins(merged)]
    flipped, _, _ = turned_alike(merged)
    merged[flipped] = merged[flipped][:, ::-1]
    used, faces = np.unique(merged, return_inverse=True)
    first = np.unique(joined, return_index=True)[1]
    rows = np.arange(len(used))
    weights = sp.coo_matrix((np.ones(len(used)), (rows, first[used])), shape=(len(used), len(joined))).tocsr()
    moved = np.linalg.norm(frames[0] - frames[0][first[joined]], axis=1).max()
    return weights, faces.reshape(-1, 3).astype(np.int32), flipped, float(moved)


def _face_inwards(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F,) which triangles are of a part whose signed volume is negative."""
    _, part, _ = turned_alike(faces)
    a, b, c = (x[faces[:, k]] - x.mean(axis=0) for k in range(3))
    volume = np.bincount(part, np.einsum("fd,fd->f", a, np.cross(b, c)))
    return volume[part] < 0


def _refuse_flat(x: np.ndarray, faces: np.ndarray, name: str) -> None:
    """Raises MeshFileError for what is no body: a sheet, front and back of which lie on each other."""
    a, b, c = (x[faces[:, k]] - x.mean(axis=0) for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    volume = np.einsum("fd,fd->", a, np.cross(b, c)) / 6
    if 2 * volume < THICK * area:
        raise MeshFileError(
            f"it encloses no room: {1e3 * volume:.2g} litres within {area:.2f} m^2",
            name,
            "Export the body as a surface that goes around it, not a sheet or a flattened one",
        )


def _coarser(weights: sp.csr_matrix, faces: np.ndarray, x: np.ndarray) -> tuple[sp.csr_matrix, np.ndarray]:
    """Remeshed to about VERTICES vertices, each a point of a triangle of before."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    size = np.sqrt(2 / np.sqrt(3) * area / VERTICES)
    places, coarse = remesh(x, faces, np.full(len(x), size), REMESH_ROUNDS)
    on = closest_points(places, x, faces)
    rows = np.repeat(np.arange(len(places)), 3)
    bind = sp.coo_matrix((on.barycentric.ravel(), (rows, faces[on.faces].ravel())), shape=(len(places), len(x)))
    return (bind.tocsr() @ weights).tocsr(), coarse


def _crossings(frames: np.ndarray, faces: np.ndarray) -> list[str]:
    """A note when the body passes through itself in some of its frames."""
    sides = distinct(ascending(face_edges(faces))).rows
    search = CrossingSearch(sides, faces, np.arange(frames.shape[1]), "cpu")
    chosen = np.unique(np.linspace(0, len(frames) - 1, LOOKED_AT).astype(int))
    crossed = [k for k in chosen if len(search.find(frames[k]))]
    if not crossed:
        return []
    return [
        f"it passes through itself in {len(crossed)} of {len(chosen)} frames looked at: where it pinches cloth, its "
        "surface gives way"
    ]
