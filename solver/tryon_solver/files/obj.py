"""Wavefront OBJ: vertices, texture coordinates, polygons and lines; everything else in the file is passed over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tryon_solver.files.polygon import cut
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh

FLOATS = "Write plain numbers: an exporter that uses the decimal comma or leaves a field empty has to be set otherwise"
LISTED = 8  # lines in a note
NOWHERE = "Export the file again; every f and l must refer to v and vt lines of the same file"


class _Reader:
    """What has been read so far."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.vertices: list[tuple[float, float, float]] = []
        self.uv: list[tuple[float, float]] = []
        self.faces: list[tuple[int, int, int]] = []
        self.corner_uv: list[tuple[int, int, int]] = []
        self.part_of_face: list[int] = []
        self.origin: list[int] = []
        self.lines: list[tuple[int, int]] = []
        self.parts: dict[str, int] = {}
        self.part = ""
        self.unsound: list[int] = []  # lines of polygons that can't be filled with triangles

    def fault(self, number: int, message: str, remedy: str) -> MeshFileError:
        return MeshFileError(message, f"{self.name}, line {number}", remedy)

    def numbers(self, words: Sequence[str], least: int, number: int) -> list[float]:
        if len(words) < least:
            raise self.fault(number, f"{least} numbers are expected, there are {len(words)}", FLOATS)
        values = []
        for word in words[:least]:
            try:
                value = float(word)
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise self.fault(number, f"{word!r} is not a finite number", FLOATS)
            values.append(value)
        return values

    def index(self, word: str, count: int, what: str, number: int) -> int:
        """From the file's counting, from 1 or backwards from the last, to ours."""
        try:
            index = int(word)
        except ValueError:
            raise self.fault(number, f"{word!r} is not the number of a {what}", NOWHERE) from None
        index = index - 1 if index > 0 else count + index
        if not 0 <= index < count or word in ("0", "-0"):
            raise self.fault(number, f"there is no {what} {word} yet, there are {count}", NOWHERE)
        return index

    def corner(self, word: str, number: int) -> tuple[int, int]:
        """Vertex and texture coordinate, -1 where it has none."""
        fields = word.split("/")
        vertex = self.index(fields[0], len(self.vertices), "vertex", number)
        if len(fields) > 1 and fields[1]:
            return vertex, self.index(fields[1], len(self.uv), "texture coordinate", number)
        return vertex, -1

    def polygon(self, words: Sequence[str], number: int) -> None:
        if len(words) < 3:
            raise self.fault(number, f"a polygon has at least 3 corners, this one has {len(words)}", NOWHERE)
        corners = [self.corner(word, number) for word in words]
        part = self.parts.setdefault(self.part, len(self.parts))
        once = [corner for k, corner in enumerate(corners) if corner[0] != corners[k - 1][0]]
        corners = once if len(once) >= 3 else corners
        triangles, sound = cut([self.vertices[vertex] for vertex, _ in corners], [vertex for vertex, _ in corners])
        if not sound:
            self.unsound.append(number)
        for triangle in triangles:
            self.faces.append(tuple(corners[k][0] for k in triangle))  # type: ignore[arg-type]
            self.corner_uv.append(tuple(corners[k][1] for k in triangle))  # type: ignore[arg-type]
            self.part_of_face.append(part)
            self.origin.append(number)


def parse_obj(text: str, name: str = "mesh.obj") -> RawMesh:
    """Read an OBJ file's text. Raises MeshFileError naming the line and the remedy."""
    reader = _Reader(name)
    for number, line in _logical_lines(text):
        words = line.split()
        keyword, rest = words[0], words[1:]
        if keyword == "v":
            x, y, z = reader.numbers(rest, 3, number)
            reader.vertices.append((x, y, z))
        elif keyword == "vt":
            values = reader.numbers(rest, min(2, max(len(rest), 1)), number)
            reader.uv.append((values[0], values[1] if len(values) > 1 else 0.0))
        elif keyword == "f":
            reader.polygon(rest, number)
        elif keyword == "l":
            ids = [reader.corner(word, number)[0] for word in rest]
            reader.lines += list(pairwise(ids))
        elif keyword in ("o", "g"):
            reader.part = " ".join(rest)
    if not reader.faces:
        raise MeshFileError("it has no polygons", name, "Export the mesh itself, not a curve or an empty object")
    corner_uv = np.array(reader.corner_uv, np.int64)
    bare = (corner_uv < 0).any(axis=1)
    has_uv = not bare.any()
    return RawMesh(
        vertices=np.array(reader.vertices, np.float64).reshape(-1, 3),
        faces=np.array(reader.faces, np.int32),
        uv=np.array(reader.uv, np.float64)[corner_uv] if has_uv else None,
        lines=np.array(reader.lines, np.int32).reshape(-1, 2),
        part_of_face=np.array(reader.part_of_face, np.int32),
        part_names=tuple(reader.parts),
        origin_of_face=np.array(reader.origin, np.int32),
        origin_word="line",
        name=name,
        without_uv=np.flatnonzero(bare & ~bare.all()),
        notes=_notes(reader),
    )


def _notes(reader: _Reader) -> tuple[str, ...]:
    """What was found in the polygons, for people."""
    if not (lines := reader.unsound):
        return ()
    more = f" and {len(lines) - LISTED} more" if len(lines) > LISTED else ""
    where = f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines[:LISTED]))}{more}"
    return (
        f"{len(lines)} of its polygons cross or cover themselves, or have no area ({reader.name}, {where}): the "
        "triangles that they are cut into overlap; mend them, or cut them into triangles before exporting",
    )


@dataclass(frozen=True)
class Polygon:
    """An f line of a frame: its `line`, what follows the f, and how many vertices were there before it."""

    line: int
    words: str
    before: int

    def corners(self) -> tuple[int, ...]:
        """Vertices from 0; a field that is no number is -1."""
        found = []
        for word in self.words.split():
            try:
                number = int(word.split("/")[0])
            except ValueError:
                number = 0
            found.append(number - 1 if number >= 0 else self.before + number)
        return tuple(found)


def parse_frame(text: str, name: str) -> tuple[np.ndarray, list[Polygon]]:
    """(V, 3) vertices of a frame of a sequence, and its polygons as they are written."""
    reader = _Reader(name)
    polygons = []
    for number, line in _logical_lines(text):
        if line.startswith(("v ", "v\t")):
            x, y, z = reader.numbers(line.split()[1:], 3, number)
            reader.vertices.append((x, y, z))
        elif line.startswith(("f ", "f\t")):
            polygons.append(Polygon(number, line[2:], len(reader.vertices)))
    return np.array(reader.vertices, np.float64).reshape(-1, 3), polygons


def refuse_other_polygons(polygons: Sequence[Polygon], first: Sequence[Polygon], name: str) -> None:
    """Raises MeshFileError when a frame has other polygons than the first; one with none has the first's."""
    if not polygons:
        return
    same = "Export every frame of one mesh, with its vertices and polygons in the same order"
    if len(polygons) != len(first):
        raise MeshFileError(f"it has {len(polygons)} polygons, the first frame has {len(first)}", name, same)
    for here, there in zip(polygons, first):
        if (here.words, here.before) != (there.words, there.before) and here.corners() != there.corners():
            raise MeshFileError(
                f"its polygon f {here.words.strip()} is f {there.words.strip()} in the first frame",
                f"{name}, line {here.line}",
                same,
            )


def _logical_lines(text: str) -> list[tuple[int, str]]:
    """(number, text) of the lines that say something; a backslash at its end goes on with the next."""
    found: list[tuple[int, str]] = []
    held, start = "", 0
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.split("#", 1)[0].rstrip()
        if not held:
            start = number
        if line.endswith("\\"):
            held += line[:-1] + " "
            continue
        whole = (held + line).strip()
        held = ""
        if whole:
            found.append((start, whole))
    return found
