"""What IPC Toolkit is asked of a way: its no to a long one beside thin fabric is asked again in pieces, and stays a no
where something is in the way."""

import ipctk
import numpy as np
from harness.oracle import Oracle
from small_scenes import icosphere, sheet

NOBODY, NOWHERE = np.zeros((0, 3), np.int32), np.zeros((0, 3))


def sheets(apart):
    """Two squares above each other, `apart` m."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    faces = np.vstack([garment.faces, garment.faces + len(x)]).astype(np.int32)
    return np.vstack([x, x + [0.003, apart, 0.002]]), faces, len(x)


def test_a_way_through_something_is_not_free():
    x, faces, count = sheets(1e-3)
    after = x.copy()
    after[count:, 1] -= 2e-3
    assert not Oracle(faces, NOBODY, x, NOWHERE).is_free(x, after)
    ball, ball_faces = icosphere(0.02, 1)
    over = Oracle(faces, ball_faces, x + [0, 0.05, 0], ball)
    before = np.vstack([x + [0, 0.05, 0], ball])
    assert not over.is_free(before, np.vstack([x - [0, 0.05, 0], ball]))


def test_a_no_by_tolerance_is_asked_again(monkeypatch):
    """Ten centimetres together, ten micrometres apart: each piece is asked, and the whole is free."""
    x, faces, _ = sheets(1e-5)
    oracle, asked = Oracle(faces, NOBODY, x, NOWHERE), []
    really = ipctk.is_step_collision_free

    def unsure(mesh, a, b):
        asked.append(np.abs(b - a).max())
        return asked[-1] < 0.05 and really(mesh, a, b)

    monkeypatch.setattr(ipctk, "is_step_collision_free", unsure)
    assert oracle.is_free(x, x + [0, 0, 0.1])
    assert len(asked) == 17
    assert asked[0] > 0.05 > max(asked[1:])
