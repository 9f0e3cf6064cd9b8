"""The same scene turned, mirrored, shifted by 100 m, and on another device: the same motion.

Steps of cloth that has come upon a ball, with all effects, converged: what is left are float32's roundings.
"""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from contact_scenes import square_on_sphere
from small_scenes import rigid_body, turn

from tryon_solver.body.pose import Pose
from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import (
    AirDrag,
    BodyContact,
    FabricDamping,
    Friction,
    Gravity,
    Scene,
    SelfContact,
    StrainLimit,
)
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

DT, STEPS = 1 / 60, 3
CONVERGED = replace(PRESETS["live"], contact_passes=20)
AGREES = 0.05e-3  # m
UPRIGHT = np.array([[0.0, 0, 0, 1]])
GRAVITY = np.array([0, -9.81, 0])


def effects(gravity):
    others = (BodyContact(), SelfContact(), Friction(), StrainLimit(), AirDrag(), FabricDamping())
    return (Gravity(tuple(float(g) for g in gravity)), *others)


def scene_seen(matrix, place):
    """The square over the ball, seen through an orthogonal matrix and shifted; mirrored, triangles turn round."""
    plain = square_on_sphere().scene
    garment, body = plain.garment, plain.body
    faces, uv, body_faces = garment.faces, garment.uv_corners, body.faces
    if np.linalg.det(matrix) < 0:
        # front stays front: the pattern is mirrored along weft, and corners are listed the other way round
        faces, body_faces = faces[:, [0, 2, 1]].copy(), body_faces[:, [0, 2, 1]].copy()
        uv = uv[:, [0, 2, 1]] * np.array([1.0, -1.0])
    seen = Garment(faces, uv, garment.panel_of_face, garment.vertex_count)
    x = plain.x_start @ matrix.T + place
    solid = rigid_body(body.rest_vertices @ matrix.T, body_faces)
    return Scene(seen, x, solid, plain.fabric, effects(matrix @ GRAVITY))


def steps(matrix, place, start=None, settings=CONVERGED, device="cpu", origin=None, count=STEPS):
    """Positions after each step, seen back through the matrix, of the scene led on from `start` (x, v)."""
    place = np.asarray(place, np.float64)
    stand = Pose(place, UPRIGHT)
    sim = build(scene_seen(matrix, place), settings, device, stand)
    if start is not None:
        x, v = start
        sim.state.x.assign((x @ matrix.T + place).astype(np.float32))
        sim.state.v.assign((v @ matrix.T).astype(np.float32))
    if origin is not None:
        sim.move_origin(np.asarray(origin, np.float64))
        stand, place = Pose(place - origin, UPRIGHT), place - origin
    found = []
    for k in range(1, count + 1):
        report = sim.advance(stand, k * DT)
        assert report.retries == 0
        found.append((sim.cloth_positions().astype(np.float64) - place) @ matrix)
    return sim, np.array(found)


@pytest.fixture(scope="module")
def touching():
    """The state (x, v) after eight steps, with contact, and three steps on from it."""
    sim, _ = steps(np.eye(3), np.zeros(3), count=8)
    start = sim.state.x.numpy().astype(np.float64), sim.state.v.numpy().astype(np.float64)
    assert sim.pairs.size > 30
    _, onward = steps(np.eye(3), np.zeros(3), start)
    assert np.abs(onward[-1] - start[0][: len(onward[-1])]).max() > 0.01
    return start, onward


def check(found, expected):
    apart = np.sqrt(((found - expected) ** 2).sum(-1)).max(axis=1)
    print(f"largest distance after each step: {', '.join(f'{1e3 * a:.4f}' for a in apart)} mm")
    assert apart.max() <= AGREES


@pytest.mark.parametrize("angles", [(0, 90, 0), (30, -50, 120)])
def test_turned(touching, angles):
    start, onward = touching
    check(steps(turn(angles), np.zeros(3), start)[1], onward)


@pytest.mark.parametrize("axis", [0, 2])
def test_mirrored(touching, axis):
    start, onward = touching
    mirror = np.eye(3)
    mirror[axis, axis] = -1
    check(steps(mirror, np.zeros(3), start)[1], onward)


def test_shifted_by_100_metres(touching):
    """The session's origin follows in whole metres; placed there, coordinates were rounded to 8 micrometres once."""
    start, onward = touching
    place = np.array([100.0, 0.0, -100.0])
    check(steps(np.eye(3), place, start, origin=place)[1], onward)


@pytest.mark.gpu
def test_cpu_and_cuda_agree(touching):
    """A step at a time from equal states."""
    wp.init()
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    start, onward = touching
    check(steps(np.eye(3), np.zeros(3), start, device="cuda:0", count=1)[1], onward[:1])
