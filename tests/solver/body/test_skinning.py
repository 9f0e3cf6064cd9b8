"""The Warp kernel against the numpy reference."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp
from body_cases import random_pose

from tryon_solver.body import BodyModel, Pose, skin
from tryon_solver.body.skinning import SkinningKernel


def test_kernel_matches_the_reference_within_a_micrometre(body: BodyModel, device: str) -> None:
    kernel = SkinningKernel(body, device)
    for pose in (Pose.rest(body), random_pose(body, 10), random_pose(body, 11)):
        out = wp.full(body.vertex_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device=device)
        kernel.run(pose, out)
        assert np.abs(out.numpy() - skin(body, pose)).max() < 1e-6


def test_second_run_leaves_nothing_of_the_first(body: BodyModel, device: str) -> None:
    kernel = SkinningKernel(body, device)
    out = wp.full(body.vertex_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device=device)
    kernel.run(random_pose(body, 12), out)
    kernel.run(random_pose(body, 13), out)
    assert np.abs(out.numpy() - skin(body, random_pose(body, 13))).max() < 1e-6


def test_output_of_the_wrong_kind_is_refused(body: BodyModel) -> None:
    kernel = SkinningKernel(body, "cpu")
    for out in (
        wp.zeros(body.vertex_count - 1, dtype=wp.vec3, device="cpu"),
        wp.zeros(body.vertex_count, dtype=wp.vec3d, device="cpu"),
    ):
        with pytest.raises(ValueError, match=f"out must be {body.vertex_count} vec3 on cpu"):
            kernel.run(Pose.rest(body), out)
