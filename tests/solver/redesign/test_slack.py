"""Slack of a rest shape: as taut as before to begin with, its own in the end."""

import numpy as np
import pytest

from tryon_solver.geometry.garment import Garment
from tryon_solver.redesign.slack import LEAST, Slack

SQUARE = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]])
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
ALONG = np.array([0.6, 0.8])  # the direction of a stretch


def square():
    return Garment(FACES, SQUARE[FACES], np.zeros(2, np.int32), 4)


def stretched(by):
    """The square's vertices (4, 3) m in space, `by` times as long along ALONG, tilted out of its plane."""
    flat = SQUARE @ (np.eye(2) + (by - 1.0) * np.outer(ALONG, ALONG))
    return flat @ np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]])


def stretches(corners, x):
    """(F, 2) principal stretches, the smaller first, of triangles with these corners (F, 3, 2) m at rest."""
    gradient = np.einsum("fkd,fke->fde", x[FACES], Garment(FACES, corners, np.zeros(2, np.int32), 4).corner_gradients())
    return np.linalg.svd(gradient, compute_uv=False)[:, ::-1]


@pytest.mark.parametrize(("before", "bears"), [(1.0, 1.0), (1.1, 1.1), (0.9, 1.0)])
def test_to_begin_with_it_is_as_taut_as_it_was_and_in_the_end_as_it_lies(before, bears):
    garment, x = square(), stretched(1.4)
    slack = Slack.of(garment, x, stretched(before)[FACES])
    first, half, last = (stretches(slack.given(garment.uv_corners, share), x) for share in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(first, [[1.0, bears]] * 2, rtol=1e-9)
    np.testing.assert_allclose(half, [[1.0, 1.4 / (0.5 + 0.5 * 1.4 / bears)]] * 2, rtol=1e-9)
    np.testing.assert_allclose(last, [[1.0, 1.4]] * 2, rtol=1e-9)
    assert slack.largest_strain() == pytest.approx(np.log(1.4 / bears))
    np.testing.assert_array_equal(slack.given(garment.uv_corners, 1.0), garment.uv_corners)


def test_what_came_from_nowhere_is_slack_altogether():
    garment, x, carried = square(), stretched(1.3), stretched(1.3)[FACES]
    carried[1] = 0.0
    slack = Slack.of(garment, x, carried)
    assert slack.faces.tolist() == [1]
    np.testing.assert_allclose(stretches(slack.given(garment.uv_corners, 0.0), x), [[1.0, 1.3], [1.0, 1.0]], rtol=1e-9)


def test_what_is_as_taut_as_it_was_has_none():
    garment, x = square(), stretched(1.15)
    assert Slack.of(garment, x, x[FACES]) is None
    assert Slack.of(garment, x, stretched(1.15 / (LEAST - 0.001))[FACES]) is None
