"""Bodies that stand in files of bare triangles, .ply and .stl: units and axes are found and told, or taken as told."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from tryon_server.problems import ProblemError
from tryon_server.runtime.bodies import AS_IT_IS, how_read, load_body, load_moving_mesh
from tryon_server.runtime.order import MeshReading
from tryon_server.uploads.check import Telling, check
from tryon_solver.body import default_body

BODY = default_body()
HEIGHT = np.ptp(BODY.rest_vertices[:, 1])


def written(path, scale=1.0, up="y", without=0):
    """The default body in another unit, with another axis up, and without some of its triangles."""
    x, y, z = scale * BODY.rest_vertices.T
    vertices = np.stack([x, -z, y] if up == "z" else [x, y, z], axis=1)
    trimesh.Trimesh(vertices, BODY.faces[without:], process=False).export(path)
    return path


@pytest.mark.parametrize("ending", [pytest.param("stl", marks=pytest.mark.long), "ply"])
def test_what_a_scanner_writes_is_a_human_in_millimetres_with_z_up(tmp_path, ending):
    body = load_moving_mesh(written(tmp_path / f"scan.{ending}", 1000.0, "z"), MeshReading())
    assert body is not None
    assert body.notes[0].startswith("units and axes: mm, Z up (its largest extent")
    assert "it stands still" in body.notes
    np.testing.assert_allclose(np.ptp(body.sequence.rest_vertices, axis=0)[1], HEIGHT, rtol=1e-3)


@pytest.mark.parametrize("ending", [pytest.param("stl", marks=pytest.mark.long), "ply"])
def test_an_open_one_is_mended_as_an_obj_is(tmp_path, ending):
    """In metres with Y up, too, where a closed one is read as it is."""
    body = load_moving_mesh(written(tmp_path / f"scan.{ending}", without=1), MeshReading())
    assert body is not None
    assert any("hole" in note for note in body.notes)
    closed = written(tmp_path / f"closed.{ending}")
    assert load_moving_mesh(closed, MeshReading()) is None
    assert len(load_body(closed).rest_vertices) == BODY.vertex_count
    assert how_read(closed) == (AS_IT_IS,)


def test_what_is_told_of_it_counts(tmp_path):
    path = written(tmp_path / "scan.stl", 100.0)
    body = load_moving_mesh(path, MeshReading(units="cm", up="y", facing="z"))
    assert body is not None
    assert body.notes[0].startswith("units and axes: cm, Y up (unit as told")
    with pytest.raises(ProblemError, match=r"in mm \(as told\) the body's largest extent is 0\.1\d+ m, no human's"):
        load_moving_mesh(path, MeshReading(units="mm"))
    lying = load_moving_mesh(path, MeshReading(up="z"))
    assert lying is not None
    assert np.ptp(lying.sequence.rest_vertices, axis=0)[2] == pytest.approx(HEIGHT, rel=1e-3)


@pytest.mark.parametrize("ending", [pytest.param("stl", marks=pytest.mark.long), "ply", "ascii"])
def test_an_upload_of_one_is_known_by_its_content(tmp_path, ending):
    path = written(tmp_path / f"scan.{'stl' if ending == 'ascii' else ending}", 1000.0, "z")
    if ending == "ascii":
        path.write_text(trimesh.exchange.stl.export_stl_ascii(trimesh.load_mesh(path)))
    reply = check(path.read_bytes(), Telling(kind="body", name="scan"))
    assert reply.body is not None, reply.problem
    assert reply.body.notes[0].startswith("units and axes: mm, Z up")
    assert reply.body.frame_count == 1


def test_an_upload_that_is_cut_off_is_refused(tmp_path):
    content = written(tmp_path / "scan.ply").read_bytes()
    reply = check(content[: len(content) // 2], Telling(kind="body", name="scan"))
    assert reply.problem is not None
    assert reply.problem.code == "body.unusable"
    assert "can't be read as a mesh" in reply.problem.message


def test_an_npz_of_no_mesh_says_what_it_holds_whatever_asks(tmp_path):
    path = tmp_path / "amass.npz"
    np.savez(path, poses=np.zeros((9, 156)), betas=np.zeros(16), trans=np.zeros((9, 3)), mocap_framerate=120.0)
    for read in (load_body, lambda path: load_moving_mesh(path, MeshReading())):
        with pytest.raises(ProblemError, match=r"it holds betas, .* trans: the parameters") as caught:
            read(path)
        assert caught.value.problem.remedy.endswith("vertices (frames, V, 3), faces (F, 3), and fps or dt")


def test_an_fbx_is_named_as_one(tmp_path):
    path = tmp_path / "actor.fbx"
    path.write_bytes(b"Kaydara FBX Binary  \x00\x1a\x00")
    for read in (load_body, lambda path: load_moving_mesh(path, MeshReading())):
        with pytest.raises(ProblemError, match="it is an FBX file") as caught:
            read(path)
        assert "Export it as a .glb" in caught.value.problem.remedy
    reply = check(path.read_bytes(), Telling(kind="motion", name="dance"))
    assert reply.problem is not None
    assert (reply.problem.code, reply.status) == ("motion.invalid", 422)
    assert "it is an FBX file" in reply.problem.message
    assert reply.problem.remedy.startswith("Convert it to BVH")


def test_an_upload_is_called_by_its_name_and_never_by_where_it_was_put(monkeypatch):
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    points = f"ply\nformat ascii 1.0\nelement vertex 1\n{axes}end_header\n0 0 0\n"
    reply = check(points.encode(), Telling(kind="body", name="points.ply"))
    assert reply.problem is not None
    assert reply.problem.message == "points.ply is no body: it holds no triangles"

    for error in (OSError, ZeroDivisionError):  # one that is told as the file's fault, and one nobody thought of
        def breaks(path, *_, error=error, **__):
            raise error(f"odd: '{path}'")

        monkeypatch.setattr("tryon_server.runtime.bodies.kind_of", breaks)
        reply = check(b"", Telling(kind="body", name="points.ply"))
        assert reply.problem is not None
        assert "odd: 'points.ply'" in reply.problem.message


@pytest.mark.parametrize(
    ("ending", "without"),
    [
        pytest.param("obj", 0, marks=pytest.mark.long),
        ("ply", 0),
        ("stl", 0),
        pytest.param("ply", 1, marks=pytest.mark.long),
    ],
)
def test_two_persons_in_one_file_are_refused_by_its_name(tmp_path, ending, without):
    path = tmp_path / f"couple.{ending}"
    both = np.concatenate([BODY.rest_vertices, BODY.rest_vertices + [0.8, 0.0, 0.0]])
    faces = np.vstack([BODY.faces[without:], BODY.faces + BODY.vertex_count])
    trimesh.Trimesh(both, faces, process=False).export(path)
    with pytest.raises(ProblemError, match=f"couple.{ending}: it holds 2 persons"):
        load_moving_mesh(path, MeshReading())
