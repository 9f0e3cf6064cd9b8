"""The command line as a newcomer meets it: help, one real simulation, and one line of advice for whatever is wrong."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
from typing import get_args

import numpy as np
import patterns
import pytest
import trimesh

from tryon_server import cli, unused
from tryon_server.api.garments import BodyFacing, BodyUp, RestShape, Units, Up
from tryon_server.api.motions import BvhUnits
from tryon_server.cli import address_of, main
from tryon_server.problems import problem_error
from tryon_server.runtime import offline
from tryon_server.runtime.local import load_catalogue
from tryon_server.runtime.order import MeshReading
from tryon_server.sessions.commands import MotionReading
from tryon_solver.body import bvh, default_body
from tryon_solver.files import convention
from tryon_solver.geometry import rest_shape


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a tube to wear, a capsule to wear it, and things that are neither."""
    folder = tmp_path_factory.mktemp("cli")
    capsule = trimesh.creation.capsule(height=0.6, radius=0.14, count=[24, 24])
    capsule.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    capsule.apply_translation([0, 0.75, 0])
    capsule.export(folder / "capsule.obj")
    capsule.update_faces(np.arange(len(capsule.faces)) > 5)
    capsule.apply_scale(0.5)  # no size of a person, whose holes would be filled
    capsule.export(folder / "open.obj")
    (folder / "tube.json").write_bytes(patterns.as_bytes(patterns.tube(60.0, 40.0)))
    stitch_to_nowhere = patterns.tube()
    stitch_to_nowhere["pattern"]["stitches"][1][0]["edge"] = 9
    (folder / "nowhere.json").write_bytes(patterns.as_bytes(stitch_to_nowhere))
    (folder / "not.json").write_text("hello")
    with (folder / "large.ply").open("wb") as large:  # 300 MB of nothing, which take no place on the disk
        large.truncate(300 * 10**6)
    np.savez_compressed(folder / "bomb.npz", rest_vertices=np.zeros((10_000_000, 3), np.float32))
    fine = trimesh.creation.icosphere(subdivisions=7, radius=0.3)
    fine.export(folder / "fine.ply")
    unequal = patterns.tube()
    unequal["pattern"]["panels"]["front"] = patterns.piece(60.0, 120.0, 30.0)
    (folder / "unequal.json").write_bytes(patterns.as_bytes(unequal))
    (folder / "gathered.json").write_bytes(patterns.as_bytes(patterns.gathered()))
    (folder / "scarf.json").write_bytes(patterns.as_bytes(patterns.scarf()))
    flat = patterns.tube()
    flat["pattern"]["panels"]["back"]["vertices"] = [[0, 0], [20, 0], [60, 0], [40, 0]]
    (folder / "flat.json").write_bytes(patterns.as_bytes(flat))
    not_a_number = patterns.as_bytes(patterns.tube()).replace(b"80.0", b"NaN", 1)
    (folder / "nan.json").write_bytes(not_a_number)
    (folder / "not.bvh").write_text("hello")
    return folder


def simulate(folder, *options: str) -> list[str]:
    """A command that would work, with options that may change it."""
    files = [
        "--garment",
        str(folder / "tube.json"),
        "--body",
        str(folder / "capsule.obj"),
        "--out",
        str(folder / "o.npz"),
    ]
    return ["simulate", *files, "--edge-length", "0.05", "--seconds", "0.2", *options]


def test_simulate_records_a_garment_on_a_body_of_ones_own(folder):
    command = simulate(folder, "--fps", "50", "--glb", str(folder / "o.glb"))
    done = subprocess.run(
        [sys.executable, "-m", "tryon_server.cli", *command], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Sewing the seams" in done.stderr
    assert "11 frames" in done.stdout
    with np.load(folder / "o.npz") as held:
        assert set(held) == {"cloth", "cloth_faces", "body", "body_faces", "dt", "reports", "notes"}
        cloth, body = held["cloth"], held["body"]
        assert cloth.shape == (11, cloth.shape[1], 3)
        assert body.shape == (11, 578, 3)
        assert np.isfinite(cloth).all()
        assert held["cloth_faces"].max() == cloth.shape[1] - 1
        assert float(held["dt"]) == pytest.approx(0.02)
        reports = json.loads(str(held["reports"]))
    assert len(reports) == 10
    assert reports[0]["times_ms"]
    nearest = np.clip(cloth, [0.0, 0.45, 0.0], [0.0, 1.05, 0.0])  # on the capsule's axis
    assert np.linalg.norm(cloth - nearest, axis=2).min() > 0.135, "the cloth is outside of the capsule"
    scene = trimesh.load_scene(folder / "o.glb")
    np.testing.assert_allclose(scene.geometry["cloth"].bounds, [cloth[-1].min(0), cloth[-1].max(0)], atol=1e-6)
    assert set(scene.geometry) == {"cloth", "body"}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--garment", "{}/absent.json"], ["absent.json"]),
        (["--garment", "{}/not.json"], ["JSON"]),
        (["--garment", "{}/nowhere.json"], ["stitches[1]"]),
        (
            ["--garment", "{}/unequal.json"],
            ["stitches[0]", "edge 1 of 'front' is 120.0 cm", "edge 3 of 'back' 50.0 cm", "Sew edges that match"],
        ),
        (
            ["--garment", "{}/gathered.json"],
            ["stitches[1]", "edge 3 of 'front' is 11.7 cm", "edge 1 of 'back' 50.0 cm", "Shorten the longer edge"],
        ),
        (["--garment", "{}/scarf.json"], ["stitches", "no stitches", "Sew it into a loop"]),
        (["--garment", "{}/flat.json"], ["panel 'back' has no area, or nearly none", "an outline of 120.0 cm"]),
        (["--garment", "{}/nan.json"], ["panels.front.translation[1]", "nan"]),
        (["--fabric", "steel"], ["no fabric 'steel'", "cotton_jersey"]),
        (["--preset", "perfect"], ["no preset 'perfect'", "Choose one of: auto, draft, live, fit, reference"]),
        (["--seconds", "1e9"], ["seconds", "6e+10 frames", "limit of 4 GiB", "Record less than", "--fps"]),
        (["--seconds", "1e308"], ["seconds", "limit of 4 GiB"]),
        (["--device", "cuda:77"], ["no device 'cuda:77'", "cpu"]),
        (["--motion", "moonwalk"], ["no motion 'moonwalk'", "walk"]),
        (["--motion", "{}/not.bvh"], ["not.bvh", "HIERARCHY"]),
        (["--body", "{}/absent.npz"], ["absent.npz"]),
        (["--body", "{}/not.json"], ["not.json"]),
        (["--body", "{}/open.obj"], ["not closed"]),
        (["--body", "{}/large.ply"], ["large.ply", "286 MiB", "Reduce it"]),
        (["--body", "{}/bomb.npz"], ["bomb.npz", "114 MiB", "Reduce it"]),
        pytest.param(["--body", "{}/fine.ply"], ["fine.ply", "163842 vertices", "Reduce it"], marks=pytest.mark.long),
        (["--fps", "5"], ["too few", "11"]),
        (["--edge-length", "1e-9"], ["edge length"]),
        (["--size", "9"], ["9 is no size", "0.5 to 2"]),
        (["--out", "{}/absent/o.npz"], ["can't be written"]),
        (["--out", "{}/o.txt"], ["neither .npz nor .glb"]),
        (["--glb", "{}"], ["can't be written"]),
        (["--dye", "reddish"], ["'reddish' is no colour"]),
        (["--print", "{}/absent.png", "--print-width", "0.2"], ["absent.png can't be read"]),
        (["--print", "{}/not.json", "--print-width", "0.2"], ["neither PNG nor JPEG"]),
        (["--print", "{}/not.json"], ["--print-width"]),
        (["--print-width", "0.2"], ["says nothing without --print"]),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_advice(folder, capsys, options, says):
    status = main(simulate(folder, *(option.format(folder) for option in options)))
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("tryon: ")]
    assert status == 2
    assert len(error) == 1
    for word in says:
        assert word in error[0]


def test_a_recording_too_large_for_its_mesh_is_refused_before_it_is_begun(folder, capsys, monkeypatch):
    """Its frames alone would do: with 14 frames of some 600 vertices in the body alone, the limit is passed."""
    monkeypatch.setattr(offline, "MOST_BYTES", 14 * offline.REPORT_BYTES + 7000 * offline.COORDINATES_BYTES)
    monkeypatch.setattr(offline, "_advance", lambda *_: pytest.fail("a frame was simulated"))
    assert main(simulate(folder, "--fps", "60")) == 2
    error = capsys.readouterr().err
    assert "0.2 s are 12 frames" in error
    assert "Record less than" in error


def test_the_worst_advice_of_a_recording_is_summed_up():
    reports = [
        {"advice": said, "max_stretch": stretch, "body_lag": lag, "retries": 0}
        for said, stretch, lag in [("", 1.9, 0.0), ("tight", 1.3, 0.0), ("tighter", 1.4, 0.01), ("caught", 1.2, 0.02)]
    ]
    empty, faces = np.zeros((5, 0, 3), np.float32), np.zeros((0, 3), np.int32)
    recording = offline.Recording(empty, faces, empty, faces, 0.5, tuple(reports))
    assert recording.advice() == [
        "3 of 4 frames were out of bounds, for example",
        "  at 1.50 s: tighter",
        "  at 2.00 s: caught",
    ]
    assert offline.Recording(empty, faces, empty, faces, 0.5, tuple(reports[:1])).advice() == []


@pytest.mark.parametrize("option", ["--seconds", "--edge-length", "--fps", "--size"])
@pytest.mark.parametrize("value", ["-1", "0", "nan", "soon"])
def test_numbers_must_be_above_zero(folder, capsys, option, value):
    with pytest.raises(SystemExit) as end:
        main(simulate(folder, option, value))
    assert end.value.code == 2
    assert option in capsys.readouterr().err


@pytest.mark.parametrize("command", [[], ["serve"], ["devices"], ["simulate"]])
def test_help_explains_every_option(capsys, command):
    with pytest.raises(SystemExit) as end:
        main([*command, "--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert "usage: tryon" in text
    for option in ("--garment", "--motion", "--out"):
        assert (option in text) == (command == ["simulate"])


def test_help_lists_every_fabric_motion_and_preset(capsys):
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    catalogue = load_catalogue()
    for names in ((f.name for f in catalogue.fabrics), (m.name for m in catalogue.motions)):
        *others, last = names
        assert f"{', '.join(others)} or {last}" in text
    assert set(cli.PRESETS.replace(" or ", ", ").split(", ")) == set(catalogue.presets)
    assert cli.PRESETS in text


def test_files_have_the_same_units_and_axes_wherever_they_are_told():
    assert cli.UNITS == get_args(Units) == tuple(convention.UNITS)
    assert cli.BVH_UNITS == get_args(BvhUnits) == tuple(bvh.UNITS)
    assert set(cli.UNITS) < set(cli.BVH_UNITS)
    assert cli.AXES == get_args(Up) == convention.AXES
    assert cli.REST_SHAPES == get_args(RestShape) == rest_shape.REST_SHAPES
    assert cli.BODY_AXES == get_args(BodyUp) == convention.BODY_AXES
    assert cli.FACINGS == get_args(BodyFacing) == tuple(convention.FACINGS)


def test_what_is_told_of_a_garment_a_body_and_a_motion_is_passed_on(folder, monkeypatch):
    taken = []

    def take(order, *_, **how):
        taken.append((order.reading, order.body_reading, how["motion_reading"]))
        raise problem_error("test.enough", "that is enough", "Nothing")

    monkeypatch.setattr(offline, "simulate", take)
    told = ["--units=mm", "--up=y", "--rest-shape=shape"]
    told += ["--body-units=cm", "--body-up=z", "--body-fps=24", "--body-animation=walk", "--body-facing=-y"]
    told += ["--motion-units=ft", "--motion-up=-y", "--motion-facing=-z"]
    told += ["--motion-joint", "left_hand=Left Paw", "--motion-joint=head=Skull"]
    assert main(["simulate", "--garment", "g.json", "--out", str(folder / "o.npz"), *told]) == cli.BAD_INPUT
    reading = MotionReading("ft", "-y", "-z", {"left_hand": "Left Paw", "head": "Skull"})
    garment = MeshReading("mm", "y", rest_shape="shape")
    assert taken == [(garment, MeshReading("cm", "z", 24.0, "walk", "-y"), reading)]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--units=cm"], ["--units says nothing here: the garment is a sewing pattern", "Leave it out, or give"]),
        (["--up=z", "--rest-shape=shape"], ["--up, --rest-shape say nothing here", "Leave them out"]),
        (["--body=default", "--body-up=z"], ["--body-up says nothing here: the body is the default one"]),
        (["--body=default", "--body-units=cm", "--body-facing=z"], ["--body-units, --body-facing say nothing here"]),
        (["--body={}/model.npz", "--body-up=z"], ["--body-up says nothing here: the body is a model"]),
        (["--body-fps=24"], ["--body-fps says nothing here: the body is a mesh that stands still"]),
        (["--body-animation=walk"], ["--body-animation says nothing here: the body is a mesh that stands still"]),
        (["--body={}/moving.npz", "--body-animation=walk"], ["--body-animation says nothing", "a file of frames"]),
        (["--body={}/one.glb", "--body-fps=24"], ["--body-fps says nothing here: the body is a .glb, whose animation"]),
        (["--motion-units=cm"], ["--motion-units says nothing here: there is no --motion", "or give a --motion"]),
        (["--motion-joint=head=Top"], ["--motion-joint says nothing here"]),
        (["--motion=walk"], ["the body is a mesh that stands still: it has no joints", "Leave --motion out"]),
        (["--body={}/moving.npz", "--motion=walk"], ["the body is a moving mesh, which brings its motion"]),
    ],
)
def test_what_is_told_and_says_nothing_is_refused_by_its_option(folder, capsys, options, says):
    body = default_body()
    if not (folder / "model.npz").exists():
        body.save(folder / "model.npz")
        np.savez(folder / "moving.npz", vertices=np.stack([body.rest_vertices] * 2), faces=body.faces, fps=30)
        trimesh.Trimesh(body.rest_vertices, body.faces, process=False).export(folder / "one.glb")
    assert main(simulate(folder, *(option.format(folder) for option in options))) == cli.BAD_INPUT
    said = capsys.readouterr().err
    for part in says:
        assert part in said


def test_every_option_that_tells_of_a_file_is_in_the_table(capsys):
    """With the kinds that it says something of, so that none is ignored in silence."""
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    known = {unused.option(subject, what) for subject, told in unused.USES.items() for what in told}
    offered = set(re.findall(r"--(?:body|motion)-\w+|--(?:units|up|rest-shape)\b", capsys.readouterr().out))
    assert offered == known


def test_a_scene_and_a_file_of_frames_are_both_written_where_both_are_scenes(folder, monkeypatch):
    written = []
    monkeypatch.setattr(offline.Recording, "save_glb", lambda _, path: written.append(path))
    empty, faces = np.zeros((5, 0, 3), np.float32), np.zeros((0, 3), np.int32)
    monkeypatch.setattr(offline, "simulate", lambda *_, **__: offline.Recording(empty, faces, empty, faces, 0.5, ()))
    assert main(simulate(folder, "--out", str(folder / "a.glb"), "--glb", str(folder / "b.glb"))) == 0
    assert written == [folder / "a.glb", folder / "b.glb"]


@pytest.mark.parametrize("told", [["head"], ["head="], ["head=A", "head=B"]])
def test_a_joint_that_is_not_told_as_a_pair_is_refused(folder, capsys, told):
    joints = [word for pair in told for word in ("--motion-joint", pair)]
    assert main(["simulate", "--garment", "g.json", "--out", str(folder / "o.npz"), *joints]) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert "--motion-joint" in said
    assert "PART=NAME, such as left_forearm=LeftElbow" in said


def test_devices_names_the_processor(capsys):
    assert main(["devices"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("cpu ")


def test_serve_refuses_a_taken_port_and_unknown_settings(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("TRYON_SERVER_DATA_DIR", str(tmp_path))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["serve", "--port", str(port)]) == 2
    assert f"port {port}" in capsys.readouterr().err
    monkeypatch.setenv("TRYON_SERVER_PROT", "1")
    assert main(["serve"]) == 2
    assert "TRYON_SERVER_PROT" in capsys.readouterr().err


@pytest.mark.parametrize(("option", "value", "known"), [("preset", "fine", "draft"), ("device", "abacus", "cpu")])
def test_serve_refuses_a_preset_or_device_that_no_session_could_have(tmp_path, capsys, option, value, known):
    assert main(["serve", "--port", "0", "--data-dir", str(tmp_path), f"--{option}", value]) == 2
    said = capsys.readouterr().err
    assert f"no {option} {value!r}" in said.replace("this machine has ", "")
    assert known in said


@pytest.mark.parametrize(
    ("host", "url"),
    [("127.0.0.1", "http://127.0.0.1:8000/"), ("0.0.0.0", "http://127.0.0.1:8000/"), ("::1", "http://[::1]:8000/")],
)
def test_address_can_be_opened_on_this_machine(host, url):
    assert address_of(host, 8000) == url


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--lost-percent", "150", "from 0 to 100"),
        ("--lost-percent", "nan", "from 0 to 100"),
        ("--rate", "1e9", "from 1 to 1000"),
        ("--rate", "0.5", "from 1 to 1000"),
    ],
)
def test_a_tracker_that_can_not_be_is_refused_with_the_range(capsys, option, value, says):
    with pytest.raises(SystemExit):
        main(["headset-sim", option, value])
    assert f"{value} is not a number {says}" in capsys.readouterr().err


@pytest.mark.parametrize("content", [None, b"", b"no certificate"])
def test_a_certificate_to_trust_that_is_none_is_named(tmp_path, capsys, content):
    authority = tmp_path / "authority.pem"
    if content is not None:
        authority.write_bytes(content)
    assert main(["headset-sim", "--authority", str(authority)]) == 2
    said = capsys.readouterr().err
    assert str(authority) in said
    assert "tryon serve --tls" in said
