"""What strangers bring, as `tryon simulate` takes it: two garments as meshes on two moving meshes, judged by ipctk."""

from pathlib import Path

import numpy as np
import pytest
from frame_judge import FrameJudge

from tryon_server.problems import ProblemError
from tryon_server.runtime.bodies import load_moving_mesh
from tryon_server.runtime.offline import simulate
from tryon_server.runtime.order import DrapeOrder, MeshReading
from tryon_solver.body import default_body
from tryon_solver.files.mesh_body import read_frames

SECONDS = 0.6


@pytest.fixture(scope="module")
def brought(strangers, tmp_path_factory):
    folder = tmp_path_factory.mktemp("strangers")
    strangers.write_all(folder, 1.0)
    return folder


def order(garment, body, **reading):
    return DrapeOrder(garment, "cotton_jersey", "draft", "cpu", body=body, **reading)


def unclean(recording):
    judge = FrameJudge(recording.cloth_faces, recording.body_faces, recording.cloth[0], recording.body[0])
    frames = zip(recording.cloth, recording.body)
    return [k for k, (cloth, body) in enumerate(frames) if not judge.judge(cloth, body).clean]


def tell_nobody(_what, _share):
    pass


@pytest.mark.parametrize(
    ("garment", "body", "found"),
    [
        (
            "skirt.obj",
            "walk",
            [
                "body: units and axes: cm, Z up",
                "body: 30 frames, 30 a second (as nothing says otherwise",
                "garment: units and axes: cm, Z up (as its body's",
                "garment: 27 stitch lines are sewn",
                "garment: rest shape: the pattern in its texture coordinates, in metres",
            ],
        ),
        pytest.param(
            "top.glb",
            "squat.glb",
            [
                "body: units and axes: m, Y up",
                "body: it is not closed: 1 holes are filled",
                "body: its 19268 vertices were remeshed to",
                "garment: units and axes: m, Y up",
                "garment: rest shape: the shape it comes in",
            ],
            marks=pytest.mark.long,
        ),
    ],
)
def test_strangers_garments_on_strangers_bodies(brought, garment, body, found):
    """Dressed where it lies, carried along, clean in every frame; everything found is told."""
    recording = simulate(order(brought / garment, brought / body), None, SECONDS, 30.0, tell_nobody)
    assert len(recording.cloth) == 19
    assert unclean(recording) == []
    assert sum(report["retries"] for report in recording.reports) == 0
    for beginning in found:
        assert any(note.startswith(beginning) for note in recording.notes), (beginning, recording.notes)
    # it is worn: it goes where the body goes, and is no statue
    body_moved = recording.body[-1].mean(axis=0) - recording.body[0].mean(axis=0)
    cloth_moved = recording.cloth[-1].mean(axis=0) - recording.cloth[0].mean(axis=0)
    assert np.linalg.norm(cloth_moved - body_moved) < 0.1
    assert np.linalg.norm(recording.cloth[-1] - recording.cloth[0], axis=1).max() > 0.01
    # and hangs where it was put, by friction and the waist's narrowness
    assert max(report["body_lag"] for report in recording.reports) < 0.02


def test_the_surface_follows_the_files_own_frames(brought):
    """At the times of the file's frames the body is where they say, centimetres and axes turned."""
    raw = read_frames(brought / "walk")
    ours = default_body().rest_vertices
    np.testing.assert_allclose(raw.frames[0][:, 2], 100 * ours[:, 1], atol=1e-3)
    np.testing.assert_allclose(raw.frames[0][:, 1], -100 * ours[:, 2], atol=1e-3)
    assert raw.frames.shape == (30, len(ours), 3)


@pytest.mark.long
def test_a_pattern_is_put_on_a_strangers_body_too(brought):
    shirt = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo" / "patterns" / "tshirt.json"
    wanted = order(shirt, brought / "walk", edge_length=0.03)
    recording = simulate(wanted, None, 0.3, 30.0, tell_nobody)
    assert unclean(recording) == []
    assert any(note.startswith("body: units and axes: cm, Z up") for note in recording.notes)


def test_a_standing_mesh_is_mended_and_read_in_its_unit(brought, tmp_path):
    """Centimetres, Z up, with a hole at the mouth: no closed surface in metres, but a human."""
    lines = (brought / "walk" / "walk_0001.obj").read_text().splitlines()
    faces = [k for k, line in enumerate(lines) if line.startswith("f ")]
    path = tmp_path / "stands.obj"
    path.write_text("\n".join(lines[: faces[100]] + lines[faces[110] :]))
    body = load_moving_mesh(path, MeshReading())
    assert body is not None
    assert body.notes[0].startswith("units and axes: cm, Z up")
    assert any("not closed" in note for note in body.notes)
    assert body.sequence.duration == 0.0
    ours = default_body().rest_vertices
    np.testing.assert_allclose(body.sequence.rest_vertices[: len(ours)], ours, atol=1e-5)


@pytest.mark.long
def test_a_standing_mesh_inside_out_is_told_too(tmp_path):
    ours = default_body()

    def written(faces):
        text = ["v {} {} {}".format(*v) for v in ours.rest_vertices] + ["f {} {} {}".format(*f) for f in faces + 1]
        (tmp_path / "stands.obj").write_text("\n".join(text))
        return tmp_path / "stands.obj"

    body = load_moving_mesh(written(ours.faces[:, ::-1]), MeshReading())
    assert body is not None
    assert any(note.startswith("it is inside out") for note in body.notes)
    assert load_moving_mesh(written(ours.faces), MeshReading()) is None


@pytest.mark.parametrize(("up", "axes"), [pytest.param("Z", [2, 0, 1], marks=pytest.mark.long), ("X", [1, 2, 0])])
def test_a_closed_standing_mesh_with_another_axis_up_is_stood_up(tmp_path, up, axes):
    """It is closed and in metres: nothing but its shape says that it does not stand along Y."""
    ours = default_body()
    x = ours.rest_vertices[:, axes]
    text = ["v {} {} {}".format(*v) for v in x] + ["f {} {} {}".format(*f) for f in ours.faces + 1]
    (tmp_path / "stands.obj").write_text("\n".join(text))
    body = load_moving_mesh(tmp_path / "stands.obj", MeshReading())
    assert body is not None
    assert body.notes[0].startswith(f"units and axes: m, {up} up")
    assert np.ptp(body.sequence.rest_vertices[:, 1]) == pytest.approx(np.ptp(ours.rest_vertices[:, 1]), rel=1e-3)


def test_a_motion_besides_a_moving_mesh_is_refused(brought):
    with pytest.raises(ProblemError, match="brings its motion"):
        simulate(order(brought / "skirt.obj", brought / "walk"), "walk", SECONDS, 30.0, tell_nobody)


def test_frames_of_different_meshes_are_refused(brought, tmp_path):
    for k, name in enumerate(("walk_0001.obj", "walk_0002.obj")):
        text = (brought / "walk" / name).read_text()
        (tmp_path / f"f{k}.obj").write_text(text if k == 0 else text.replace("v ", "# ", 1))
    with pytest.raises(ProblemError, match=r"f1\.obj.*4821 vertices, the first frame has 4822") as caught:
        simulate(order(brought / "skirt.obj", tmp_path), None, SECONDS, 30.0, tell_nobody)
    assert caught.value.problem.place == "body"


def test_a_wrong_unit_is_answered_with_the_right_one(brought):
    reading = MeshReading(units="m")
    with pytest.raises(ProblemError, match=r"in m .*172 m") as caught:
        simulate(
            order(brought / "skirt.obj", brought / "walk", body_reading=reading), None, SECONDS, 30.0, tell_nobody
        )
    assert "--body-units" in caught.value.problem.remedy


def test_a_garment_that_lies_elsewhere_is_refused(brought, tmp_path):
    path = tmp_path / "away.obj"
    lines = (brought / "skirt.obj").read_text().splitlines()
    path.write_text("\n".join(f"v 500 500 {line.split()[3]}" if line.startswith("v ") else line for line in lines))
    with pytest.raises(ProblemError, match="not where the body is") as caught:
        simulate(order(path, None), None, 0.1, 30.0, tell_nobody)
    assert caught.value.problem.place == "garment"
