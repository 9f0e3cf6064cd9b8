"""Holes of a body are filled, whatever else is wrong with it elsewhere."""

import numpy as np
import scipy.sparse as sp

from tryon_solver.body import default_body
from tryon_solver.files.holes import fill_holes

BODY = default_body()
X = BODY.rest_vertices
NAVEL = int(np.argmax(X[:, 2] - 9 * abs(X[:, 1] - 1.1) - 9 * abs(X[:, 0])))
NEAR = np.unique(BODY.faces[(BODY.faces == NAVEL).any(axis=1)])
BELLY = np.isin(BODY.faces, NEAR).all(axis=1) | (BODY.faces == NAVEL).any(axis=1)



def open_edges(faces):
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    return unique[counts == 1]


def with_fin(faces, on):
    """A triangle more at the first edge of triangle `on`, to a vertex of its own."""
    a, b = faces[on, :2]
    x = np.vstack([X, (X[a] + X[b]) / 2 + [0.0, 0.0, 0.03]])
    return x, np.vstack([faces, [[a, b, len(X)]]]).astype(np.int32), (X[a] + X[b]) / 2


def filled(x, faces):
    return fill_holes(sp.identity(len(x), format="csr"), faces, x)


def test_a_hole_away_from_a_crowded_edge_is_filled_and_both_are_told():
    faces = BODY.faces[~BELLY]
    rim = open_edges(faces)
    assert len(rim) >= 4
    head = int(np.argmax(X[faces].mean(axis=1)[:, 1]))
    x, crowded, where = with_fin(faces, head)
    weights, closed, notes = filled(x, crowded)
    assert weights.shape[0] == len(x) + 1
    assert len(closed) == len(crowded) + len(rim)
    assert len(open_edges(closed)) == 2  # the fin's own
    assert notes[0] == "it is not closed: 1 holes are filled, so that no cloth slips in"
    at = ", ".join(f"{c:.2f}" for c in where)
    assert notes[1].startswith(f"more than two triangles meet at 1 of its edges (at {at} m); 2 open edges beside them")
    np.testing.assert_allclose((weights @ x)[-1], x[np.unique(rim)].mean(axis=0), atol=1e-9)


def test_a_hole_at_a_crowded_edge_is_left_and_told():
    faces = BODY.faces[~BELLY]
    rim = open_edges(faces)
    on = int(np.flatnonzero(np.isin(faces[:, :2], rim).any(axis=1))[0])
    x, crowded, _ = with_fin(faces, on)
    weights, closed, notes = filled(x, crowded)
    assert weights.shape[0] == len(x)
    np.testing.assert_array_equal(closed, crowded)
    assert len(notes) == 1
    assert f"{len(open_edges(closed))} open edges beside them are not filled" in notes[0]


def test_a_closed_body_has_nothing_to_say():
    weights, closed, notes = filled(X, BODY.faces)
    np.testing.assert_array_equal(closed, BODY.faces)
    assert (weights.shape[0], notes) == (len(X), [])
