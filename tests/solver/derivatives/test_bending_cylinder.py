"""A panel rolled to a cylinder of radius r holds 1/2 k_bend A / r^2, whatever the direction in which it is rolled; one
that is bent in two directions what a plate of Poisson's ratio -1/3 holds."""

import numpy as np
import pytest
from small_scenes import fabric, garment_of

from tryon_solver.baselines.hinge_rows import hinge_rows
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.scene import Scene
from tryon_solver.simulation import build

K_BEND, RADIUS = 3e-5, 0.05


@pytest.fixture(scope="module")
def garment():
    """A square of 30 cm, meshed as garments are."""
    panel = {
        "vertices": [[0, 0], [30, 0], [30, 30], [0, 30]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
        "translation": [0, 0, 0],
        "rotation": [0, 0, 0],
    }
    pattern = {"pattern": {"panels": {"square": panel}, "stitches": []}, "properties": {"units_in_meter": 100}}
    mesh = mesh_pattern(parse_pattern(pattern), 0.006)
    return garment_of(mesh.uv, mesh.faces)


@pytest.mark.parametrize("degrees", [0, 20, 45, 70, 90])
def test_cylinder_holds_the_closed_form_energy(garment, degrees):
    uv = np.empty((garment.vertex_count, 2))
    uv[garment.faces] = garment.uv_corners
    along = uv @ [np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]
    across = uv @ [-np.sin(np.radians(degrees)), np.cos(np.radians(degrees))]
    x = np.column_stack([RADIUS * np.sin(along / RADIUS), across, RADIUS * np.cos(along / RADIUS)])
    sim = build(Scene(garment, x, None, fabric(k_bend=K_BEND), ()))
    matrix = next(c for c in sim.plan.contributions if c.name == "bending").stiffness.matrix.matrix()
    energy = 0.5 * np.einsum("ia,ia->", x, matrix @ x)
    # each interior edge stands for a third of its two triangles: boundary edges have no hinge
    area = hinge_rows(garment)[2].sum() / 3
    assert energy == pytest.approx(0.5 * K_BEND * area / RADIUS**2, rel=0.06)


@pytest.mark.parametrize(("first", "second"), [(1.0, 0.0), (1.0, 1.0), (1.0, -1.0), (2.0, 1.0)])
def test_double_curvature_holds_what_a_plate_does(garment, first, second):
    """1/2 k_bend A (a^2 + b^2 - 2/3 a b) of the principal curvatures a and b: a little bent, z = (a u^2 + b v^2)/2."""
    uv = np.empty((garment.vertex_count, 2))
    uv[garment.faces] = garment.uv_corners
    vertices, row, area = hinge_rows(garment)
    z = 0.5 * (first * uv[:, 0] ** 2 + second * uv[:, 1] ** 2)
    expected = 0.5 * K_BEND * area.sum() / 3 * (first**2 + second**2 - 2 / 3 * first * second)
    held = 0.5 * K_BEND * ((row * z[vertices]).sum(axis=1) ** 2 / area).sum()
    assert held == pytest.approx(expected, rel=0.06)
