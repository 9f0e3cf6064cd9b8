"""Patterns are worn where they belong by bodies that stand elsewhere, look elsewhere or have their head down."""

from pathlib import Path

import numpy as np
import pytest

import tryon_solver.dressing.dress as dressing
import tryon_solver.dressing.dress_mesh as dressing_mesh
from tryon_server.problems import ProblemError
from tryon_server.runtime.bodies import load_moving_mesh
from tryon_server.runtime.offline import simulate
from tryon_server.runtime.order import DrapeOrder, MeshReading
from tryon_solver.body import default_body
from tryon_solver.dressing.fit import TightError
from tryon_solver.geometry.boundary_loops import boundary_loops

PATTERNS = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo" / "patterns"
BODY = default_body()
REST = BODY.rest_vertices
FACING_X = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def tell_nobody(_what, _share):
    pass


def order(garment, body):
    return DrapeOrder(PATTERNS / garment, "cotton_jersey", "draft", "cpu", body=body, edge_length=0.03)


def saved(path, frames):
    np.savez(path, vertices=frames.astype(np.float32), faces=BODY.faces, fps=30.0)
    return path


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """The same body where it belongs."""
    path = saved(tmp_path_factory.mktemp("usual") / "u.npz", REST[None])
    recording = simulate(order("tshirt.json", path), None, 0.1, 30.0, tell_nobody)
    assert not any("patterns" in note or "turned over" in note for note in recording.notes)
    return recording


@pytest.mark.long
@pytest.mark.parametrize(
    ("strange", "told"),
    [
        (REST - [0.0, 0.9, 0.0], "stood on the floor: raised by 0.90 m"),
        (REST @ FACING_X.T + [5.0, 0.0, 0.0], "turned by 90° about the vertical, to face +Z"),
        (REST * [-1.0, -1.0, 1.0], "its feet were above its head: it was turned over"),
    ],
    ids=["pelvis", "aside", "upside_down"],
)
def test_a_shirt_is_worn_on_the_trunk(tmp_path, usual, strange, told):
    """As on the same body where it belongs; which is what was wrong with it, told."""
    recording = simulate(order("tshirt.json", saved(tmp_path / "b.npz", strange[None])), None, 0.1, 30.0, tell_nobody)
    assert any(told in note for note in recording.notes), recording.notes
    # the body is left 2 cm before the middle, or put over it
    np.testing.assert_allclose(recording.body[0], usual.body[0], atol=0.03)
    np.testing.assert_allclose(recording.cloth[-1].mean(axis=0), usual.cloth[-1].mean(axis=0), atol=0.05)
    assert np.ptp(recording.cloth[-1], axis=0) == pytest.approx(np.ptp(usual.cloth[-1], axis=0), abs=0.1)


def test_a_body_that_lies_is_refused_for_a_pattern(tmp_path):
    path = tmp_path / "b.npz"
    lying = REST[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    np.savez(path, vertices=lying[None].astype(np.float32), faces=BODY.faces, fps=30.0, units="m", up="y")
    with pytest.raises(ProblemError, match="does not stand") as caught:
        simulate(order("tshirt.json", path), None, 0.1, 30.0, tell_nobody)
    assert caught.value.problem.place == "body"


@pytest.mark.parametrize(
    "error", [ValueError("zero-size array"), pytest.param(IndexError("out of bounds"), marks=pytest.mark.long)]
)
def test_geometry_that_fails_in_placing_is_a_refusal(tmp_path, monkeypatch, error):
    def fails(*_):
        raise error

    monkeypatch.setattr(dressing, "place_around", fails)
    with pytest.raises(ProblemError, match="can't be put on: the pieces find no place around this body") as caught:
        simulate(order("tshirt.json", saved(tmp_path / "b.npz", REST[None])), None, 0.1, 30.0, tell_nobody)
    assert caught.value.problem.code == "garment.unfit"
    assert caught.value.problem.remedy


@pytest.mark.parametrize(
    ("tight", "error"),
    [
        (False, RuntimeError("Factor is singular")),
        (True, ValueError("zero-size array")),
        pytest.param(False, ValueError("zero-size array"), marks=pytest.mark.long),
        pytest.param(False, KeyError(3), marks=pytest.mark.long),
        pytest.param(True, KeyError(3), marks=pytest.mark.long),
        pytest.param(True, RuntimeError("Factor is singular"), marks=pytest.mark.long),
    ],
)
def test_what_fails_in_sewing_is_a_refusal(tmp_path, monkeypatch, tight, error):
    """Or in looking for what to say of a garment that is too tight."""

    def fails(*_, **__):
        raise error

    def is_tight(*_, **__):
        raise TightError("it is too tight", "panels.front", "Enlarge it")

    monkeypatch.setattr(dressing, "sew", is_tight if tight else fails)
    monkeypatch.setattr(dressing, "opening_as_drawn", fails)
    with pytest.raises(ProblemError, match="can't be put on: the pieces can't be sewn on this body") as caught:
        simulate(order("tshirt.json", saved(tmp_path / "b.npz", REST[None])), None, 0.1, 30.0, tell_nobody)
    problem = caught.value.problem
    assert problem.code == "garment.unfit"
    assert str(error) in problem.message
    assert "edge length" in problem.remedy


def test_what_fails_in_sewing_a_mesh_is_a_refusal(tmp_path, monkeypatch):
    def fails(*_, **__):
        raise RuntimeError("Factor is singular")

    monkeypatch.setattr(dressing_mesh, "build", fails)
    corners = (REST[BODY.faces][..., 1] > 0.95).all(axis=1) & (REST[BODY.faces][..., 1] < 1.2).all(axis=1)
    belt = BODY.faces[corners]
    text = ["v {} {} {}".format(*v) for v in 1.03 * REST] + ["f {} {} {}".format(*f) for f in belt + 1]
    (tmp_path / "belt.obj").write_text("\n".join(text))
    worn = DrapeOrder(tmp_path / "belt.obj", "cotton_jersey", "draft", "cpu")
    with pytest.raises(ProblemError, match="can't be put on: it can't be freed and sewn on this body") as caught:
        simulate(worn, None, 0.1, 30.0, tell_nobody)
    assert caught.value.problem.code == "garment.unfit"


def test_half_a_person_is_what_is_wrong_not_the_garment(tmp_path, monkeypatch):
    def is_tight(*_, **__):
        raise TightError("it is too tight", "panels.front", "Enlarge it")

    def cut(name, height, shift):
        used, faces = np.unique(BODY.faces[(REST[BODY.faces][..., 1] > height).all(axis=1)], return_inverse=True)
        half = (REST[used] + shift)[None].astype(np.float32)
        np.savez(tmp_path / name, vertices=half, faces=faces.reshape(-1, 3), fps=30.0)
        return order("tshirt.json", tmp_path / name)

    monkeypatch.setattr(dressing, "sew", is_tight)
    with pytest.raises(ProblemError, match="of the body, it is cut off: below it ends in an open rim") as caught:
        simulate(cut("half.npz", 0.85, [0.0, 0.0, 0.0]), None, 0.1, 30.0, tell_nobody)
    problem = caught.value.problem
    assert problem.message.endswith("where legs and feet should be; as it is, it is too tight")
    assert problem.place == "body"
    assert "from head to feet" in problem.remedy


def torso() -> str:
    """An OBJ file of trunk and arms alone, capped at neck and hips, standing on the floor."""
    middle = (REST[:, 1] > 0.85) & (REST[:, 1] < 1.47)
    used, faces = np.unique(BODY.faces[middle[BODY.faces].all(axis=1)], return_inverse=True)
    x, faces = REST[used] - [0.0, 0.85, 0.0], faces.reshape(-1, 3)
    for loop in boundary_loops(faces):
        centre = x[loop].mean(axis=0)
        normal = np.linalg.svd(x[loop] - centre)[2][2]
        x[loop] -= np.outer((x[loop] - centre) @ normal, normal)
        faces = np.vstack([faces, np.stack([np.roll(loop, -1), loop, np.full(len(loop), len(x))], axis=1)])
        x = np.vstack([x, centre])
    lines = ["v {} {} {}".format(*v) for v in x] + ["f {} {} {}".format(*f) for f in faces + 1]
    return "\n".join(lines)


@pytest.mark.long
def test_a_mannequins_torso_wears_a_shirt_and_is_told_to_be_one(tmp_path, usual):
    (tmp_path / "torso.obj").write_text(torso())
    recording = simulate(order("tshirt.json", tmp_path / "torso.obj"), None, 0.1, 30.0, tell_nobody)
    notes = " ".join(recording.notes)
    assert "above it ends in a flat cap" in notes
    assert "where legs and feet should be" in notes
    assert "raised by 0.86 m, its upper end to where patterns expect a neck" in notes
    # around the chest, as on the whole body
    assert recording.cloth[-1][:, 1].max() == pytest.approx(usual.cloth[-1][:, 1].max(), abs=0.1)
    assert abs(recording.cloth[-1][:, [0, 2]].mean(axis=0)).max() < 0.1


@pytest.mark.parametrize(("placed", "read"), [(REST, False), (REST - [0.0, 0.9, 0.0], True), (REST @ FACING_X.T, True)])
def test_a_closed_mesh_that_stands_elsewhere_is_placed_too(tmp_path, placed, read):
    text = ["v {} {} {}".format(*v) for v in placed] + ["f {} {} {}".format(*f) for f in BODY.faces + 1]
    (tmp_path / "stands.obj").write_text("\n".join(text))
    body = load_moving_mesh(tmp_path / "stands.obj", MeshReading())
    assert (body is not None) == read
    if body is not None:
        np.testing.assert_allclose(body.for_patterns().sequence.rest_vertices, REST, atol=0.03)
