"""A triangle mesh as a file has it: in the file's own units and axes, nothing joined, nothing dropped."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tryon_solver.geometry.located_error import LocatedError


class MeshFileError(LocatedError):
    """A mesh file that can't be used: what is wrong, where in the file, and what to do about it."""


@dataclass(frozen=True)
class RawMesh:
    """Triangles in the file's units. V vertices, F triangles, L lines."""

    vertices: np.ndarray  # (V, 3) float64, file units
    faces: np.ndarray  # (F, 3) int32
    uv: np.ndarray | None  # (F, 3, 2) float64, texture coordinates of every corner; None where the file has none
    lines: np.ndarray  # (L, 2) int32, vertices joined by a line that is no side of a polygon
    part_of_face: np.ndarray  # (F,) int32, index into part_names
    part_names: tuple[str, ...]  # objects and groups
    origin_of_face: np.ndarray  # (F,) int32, the line or the number of the polygon in the file
    origin_word: str  # what origin_of_face counts: "line" or "triangle"
    name: str  # of the file, for messages
    without_uv: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))  # faces that have none; others have
    notes: tuple[str, ...] = ()  # what the format's reader found, for people

    def only(self, faces: np.ndarray, note: str) -> RawMesh:
        """These triangles, sorted, and the lines between their corners alone; with a note of why."""
        bare = np.zeros(len(self.faces), bool)
        bare[self.without_uv] = True
        return replace(
            self,
            faces=self.faces[faces],
            uv=None if self.uv is None else self.uv[faces],
            lines=self.lines[np.isin(self.lines, self.faces[faces]).all(axis=1)],
            part_of_face=self.part_of_face[faces],
            origin_of_face=self.origin_of_face[faces],
            without_uv=np.flatnonzero(bare[faces]),
            notes=(*self.notes, note),
        )

    def place(self, face: int) -> str:
        """Where a triangle is in the file."""
        return f"{self.name}, {self.origin_word} {int(self.origin_of_face[face])}"

    def places(self, faces: np.ndarray, most: int = 8) -> str:
        """Where these triangles are, the first few of them."""
        numbers = np.unique(self.origin_of_face[faces])
        listed = ", ".join(str(int(number)) for number in numbers[:most])
        more = f" and {len(numbers) - most} more" if len(numbers) > most else ""
        return f"{self.name}, {self.origin_word}{'s' if len(numbers) > 1 else ''} {listed}{more}"
