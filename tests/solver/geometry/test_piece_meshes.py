"""Meshes of pieces are made once, kept for a while, and can be handed on."""

import numpy as np
import pytest

from tryon_solver.geometry import piece_meshes
from tryon_solver.geometry.piece_meshes import PIECES_KEPT, keep, kept, triangulated

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    monkeypatch.setattr(piece_meshes, "_kept", {})


def outline(number: int) -> bytes:
    return (SQUARE * (1 + number)).tobytes()


def test_an_outline_is_meshed_once(monkeypatch):
    points, faces = triangulated(outline(0), 1.0)
    assert points[:4].tolist() == SQUARE.tolist()
    assert len(faces) >= 2
    monkeypatch.setattr(piece_meshes, "triangulate", lambda *_: pytest.fail("it was made again"))
    assert triangulated(outline(0), 1.0) == (points, faces)


def test_another_edge_length_is_another_mesh():
    assert len(triangulated(outline(0), 0.25)[0]) > len(triangulated(outline(0), 1.0)[0])


def test_what_was_handed_on_is_not_made_again(monkeypatch):
    mesh = triangulated(outline(3), 4.0)
    handed_on = kept()
    piece_meshes._kept.clear()
    keep(handed_on)
    monkeypatch.setattr(piece_meshes, "triangulate", lambda *_: pytest.fail("it was made again"))
    assert triangulated(outline(3), 4.0) == mesh


def test_a_mesh_that_is_kept_already_is_named_and_not_handed_on():
    mesh = triangulated(outline(0), 1.0)
    triangulated(outline(1), 1.0)
    keep({(outline(0), 1.0): None, (outline(2), 1.0): None})
    assert list(kept()) == [(outline(1), 1.0), (outline(0), 1.0)]  # the one used last at the end
    assert kept()[outline(0), 1.0] is mesh


def test_the_ones_used_last_are_kept():
    for number in range(PIECES_KEPT):
        triangulated(outline(number), 1.0 + number)
    triangulated(outline(0), 1.0)
    triangulated(outline(PIECES_KEPT), 1.0 + PIECES_KEPT)
    found = {key[0] for key in kept()}
    assert len(found) == PIECES_KEPT
    assert outline(0) in found
    assert outline(1) not in found
