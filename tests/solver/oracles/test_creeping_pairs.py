"""What may come closer although it is at or under its thickness offset already, as rounding and force may leave it."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.contact import bounds
from tryon_solver.contact.candidates import ContactSizes
from tryon_solver.contact.filtering import Passes
from tryon_solver.contact.verify import SAFE_SHARE

XI = 1.8e-3  # m
TRIANGLE = np.array([[-0.01, 0, -0.01], [0.012, 0, -0.008], [0, 0, 0.013]])


def moved(height, motion):
    """Height [m] of a vertex over a triangle's plane after a move by `motion` [m] upwards, as far as it is let."""
    x = np.vstack([[0, height, 0], TRIANGLE]).astype(np.float32)
    displacement = np.zeros((4, 3), np.float32)
    displacement[0, 1] = motion
    sizes = ContactSizes()
    sizes.xi_body = sizes.xi_self = XI
    sizes.d_hat = 1e-3
    alpha = wp.full(4, 1.0, dtype=wp.float32, device="cpu")
    positions, path = (wp.array(a, dtype=wp.vec3, device="cpu") for a in (x, displacement))
    kind, one = wp.zeros(1, dtype=wp.int32, device="cpu"), wp.ones(1, dtype=wp.int32, device="cpu")
    ids = wp.array([[0, 1, 2, 3]], dtype=wp.vec4i, device="cpu")
    distance = wp.array([height], dtype=wp.float32, device="cpu")
    changed, passes = wp.zeros(4, dtype=wp.int32, device="cpu"), Passes.allocate("cpu")
    inputs = [kind, one, 0, 1, ids, kind, distance, 4, sizes, positions, path, alpha, changed, alpha, passes.state]
    passes.repeat(lambda: wp.launch(bounds.shorten_kernel, 1, inputs, device="cpu"), 60)
    return float(np.float32(height) + alpha.numpy()[0] * np.float32(motion))


def test_a_pair_under_its_offset_never_comes_near_what_voids_a_commit():
    """Pushed by 1 mm, a thousand moves on end."""
    height = 0.9 * XI
    for _ in range(1000):
        height = moved(height, -1e-3)
        assert height > 1.02 * SAFE_SHARE * XI
    assert height < 0.65 * XI


@pytest.mark.parametrize("height", [0.52 * XI, 0.56 * XI, 0.9 * XI])
def test_a_pair_under_its_offset_may_part(height):
    for _ in range(20):
        height = moved(height, 1e-4)
    assert height > XI + 1e-4
