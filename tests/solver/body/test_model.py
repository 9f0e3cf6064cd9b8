"""The body model: what it refuses, how it is stored, and what the body made at set-up must be."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import ipctk
import numpy as np
import pytest
from body_cases import REPOSITORY

from tryon_solver.body import BodyError, BodyModel, default_body, default_body_path
from tryon_solver.body.making.checks import surface_faults, volume


def test_saved_model_comes_back_equal(finger: BodyModel, tmp_path: Path) -> None:
    path = tmp_path / "folder" / "body.npz"
    dataclasses.replace(finger, licence="CC0", recipe="abc").save(path)
    loaded = BodyModel.load(path)
    for field in dataclasses.fields(BodyModel):
        expected = {"licence": "CC0", "recipe": "abc"}.get(field.name, getattr(finger, field.name))
        np.testing.assert_array_equal(getattr(loaded, field.name), expected)
    assert [entry.name for entry in path.parent.iterdir()] == ["body.npz"], "a draft was left behind"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parents": np.array([-1, 1], dtype=np.int32)}, "earlier"),
        ({"parents": np.array([0, 0], dtype=np.int32)}, "-1 for joint 0"),
        ({"joint_names": ("same", "same")}, "unique"),
        ({"faces": np.array([[0, 1, 4]], dtype=np.int32)}, r"faces holds an index outside \[0, 4\)"),
        ({"skin_weights": np.full((4, 2), 0.4, dtype=np.float32)}, "sum to 1"),
        ({"rest_vertices": np.full((4, 3), np.nan)}, "rest_vertices holds a value that is not finite"),
        ({"rest_joints": np.zeros((2, 3), dtype=np.float32)}, "rest_joints is float32"),
    ],
)
def test_malformed_model_is_refused(finger: BodyModel, change: dict, message: str) -> None:
    with pytest.raises(BodyError, match=message):
        dataclasses.replace(finger, **change)


def test_missing_default_body_names_the_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TRYON_BODY", str(tmp_path / "none.npz"))
    with pytest.raises(BodyError, match=r"none\.npz.*python scripts/make_body\.py"):
        default_body()


def test_default_path_is_in_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TRYON_BODY", raising=False)
    assert default_body_path() == REPOSITORY / ".cache" / "tryon" / "body.npz"


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 broken", b"\x93NUMPY array"])
def test_file_that_is_no_body_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "body.npz"
    path.write_bytes(content)
    with pytest.raises(BodyError, match=r"body\.npz is not a body model"):
        BodyModel.load(path)


def test_array_file_that_is_no_body_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "body.npy", np.zeros(3))
    with pytest.raises(BodyError, match="is not a body model"):
        BodyModel.load(tmp_path / "body.npy")


def test_default_body_is_closed_outward_one_piece_and_cut_nowhere(body: BodyModel) -> None:
    assert surface_faults(body.rest_vertices, body.faces) == []
    edges = ipctk.edges(body.faces)
    mesh = ipctk.CollisionMesh(body.rest_vertices, edges, body.faces)
    assert not ipctk.has_intersections(mesh, body.rest_vertices)


def test_default_body_is_an_upright_adult_facing_forward(body: BodyModel) -> None:
    lowest, highest = body.rest_vertices.min(axis=0), body.rest_vertices.max(axis=0)
    assert 1.6 < highest[1] < 1.85
    assert abs(lowest[1]) < 2e-3
    assert 0.05 < volume(body.rest_vertices, body.faces) < 0.09
    joints = {name: body.rest_joints[k] for name, k in body.index_of.items()}
    assert joints["left_hand"][0] > 0.3 > -0.3 > joints["right_hand"][0], "x must point to the body's left"
    assert joints["left_toes"][2] > joints["left_foot"][2] + 0.05, "z must point forward"


def test_default_body_triangles_are_even_where_garments_lie(body: BodyModel) -> None:
    part = np.array([body.joint_names[k] for k in body.skin_joints[:, 0]])
    covered = np.array([not name.endswith(("head", "hand", "fingers", "foot", "toes")) for name in part])
    faces = body.faces[covered[body.faces].all(axis=1)]
    corners = body.rest_vertices[faces]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert 4000 < body.vertex_count < 6000
    assert np.percentile(lengths, 1) > 0.013
    assert np.percentile(lengths, 99) < 0.029
    a, b = corners - np.roll(corners, 1, axis=1), corners - np.roll(corners, -1, axis=1)
    cosines = (a * b).sum(axis=2) / (np.linalg.norm(a, axis=2) * np.linalg.norm(b, axis=2))
    assert np.degrees(np.arccos(cosines)).min() > 25.0


def test_default_body_is_left_right_balanced(body: BodyModel) -> None:
    for name, k in body.index_of.items():
        if name.startswith("left_"):
            mirrored = body.rest_joints[body.index_of["right_" + name.removeprefix("left_")]] * [-1.0, 1.0, 1.0]
            np.testing.assert_allclose(body.rest_joints[k], mirrored, atol=2e-3, err_msg=name)


def test_split_limb_joints_lie_on_the_limb(body: BodyModel) -> None:
    joints = {name: body.rest_joints[k] for name, k in body.index_of.items()}
    for side in ("left", "right"):
        for near, far in (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot")):
            start, middle, end = (joints[f"{side}_{name}"] for name in (near, f"{near}_twist", far))
            away = np.linalg.norm(np.cross(middle - start, end - start)) / np.linalg.norm(end - start)
            assert away < 1e-9
            assert 0.0 < (middle - start) @ (end - start) < (end - start) @ (end - start)
