"""Moving meshes from files: frames of an .npz, what is said of them, and how a surface is mended."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from small_glb import glb

from tryon_solver.body import default_body
from tryon_solver.files.convention import Convention, Told
from tryon_solver.files.mesh_body import is_moving_mesh, make_body, read_frames
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.sides import side_of, sides_told

BODY = default_body()
FRAMES = np.stack([np.add(BODY.rest_vertices, [0.0, 0.0, 0.02 * k]) for k in range(4)])


def saved(path, **arrays):
    np.savez(path, **arrays)
    return path


def test_frames_of_an_npz_with_what_it_says_of_itself(tmp_path):
    path = saved(tmp_path / "a.npz", vertices=100 * FRAMES, faces=BODY.faces, fps=24, units="cm", up="Y")
    assert is_moving_mesh(path)
    raw = read_frames(path)
    assert raw.dt == pytest.approx(1 / 24)
    assert (raw.told.unit, raw.told.up, raw.told.source) == ("cm", "y", "as the file says")
    body = make_body(raw)
    assert "cm, Y up" in body.notes[0]
    np.testing.assert_allclose(body.sequence.surface(body.sequence.sample(2 / 24)), FRAMES[2], atol=1e-6)


def test_what_tryon_records_can_be_worn_on(tmp_path):
    path = saved(tmp_path / "b.npz", body=FRAMES.astype(np.float32), body_faces=BODY.faces, dt=1 / 50, cloth=FRAMES)
    raw = read_frames(path)
    assert raw.frames.shape == FRAMES.shape
    assert raw.dt == pytest.approx(0.02)
    assert raw.told.unit is None


def test_frames_a_second_that_are_told_win_and_those_that_are_assumed_are_said(tmp_path):
    path = saved(tmp_path / "c.npz", vertices=FRAMES, faces=BODY.faces)
    assert "30 a second (as nothing says otherwise" in read_frames(path).notes[0]
    assert read_frames(path, fps=12.0).dt == pytest.approx(1 / 12)
    assert "12 a second (as told)" in read_frames(path, fps=12.0).notes[0]


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"vertices": FRAMES}, "it holds vertices"),
        ({"vertices": FRAMES[..., :2], "faces": BODY.faces}, "vertices are"),
        ({"vertices": FRAMES.reshape(4, -1), "faces": BODY.faces}, rf"vertices are \(4, {3 * BODY.vertex_count}\) and"),
        ({"vertices": FRAMES, "faces": BODY.faces + 1}, "a vertex that is not there"),
        ({"vertices": FRAMES, "faces": np.where(BODY.faces == 7, -1, BODY.faces)}, r"faces\[\d+\]: .*refers to -1"),
        ({"vertices": FRAMES, "faces": BODY.faces.astype(np.int64) + 2**32}, "a vertex that is not there"),
        ({"vertices": FRAMES, "faces": BODY.faces + 0.5}, "faces: they are float64, no whole numbers"),
        ({"vertices": FRAMES + 1j, "faces": BODY.faces}, "vertices: they are complex128, no real numbers"),
        ({"vertices": FRAMES.astype("U8"), "faces": BODY.faces}, "vertices: they are <U8"),
        ({"vertices": FRAMES, "faces": BODY.faces[:0]}, "it has no triangles"),
        ({"vertices": FRAMES[:0], "faces": BODY.faces}, "vertices: there are no frames"),
        ({"vertices": FRAMES, "faces": BODY.faces, "fps": 0}, "fps: it is 0, which must be more than 0"),
        ({"vertices": FRAMES, "faces": BODY.faces, "dt": 0.0}, "dt: it is 0, which must be more than 0"),
        ({"vertices": FRAMES, "faces": BODY.faces, "fps": [24, 25]}, r"fps: it is int64 of shape \(2,\), not one"),
        ({"vertices": FRAMES, "faces": BODY.faces, "dt": [0.1, 0.1]}, r"dt: it is float64 of shape \(2,\), not one"),
        ({"vertices": FRAMES, "faces": BODY.faces, "fps": "24"}, "fps: it is <U2"),
        ({"vertices": FRAMES, "faces": BODY.faces, "fps": np.nan}, "fps: it is nan, no finite number"),
        ({"vertices": FRAMES, "faces": BODY.faces, "fps": 24, "dt": 1 / 30}, "fps and dt: they contradict .* 24 .* 30"),
        ({"vertices": FRAMES, "faces": BODY.faces, "fps": 1001}, "fps: 1001 frames a second are not within 1 and 1000"),
        ({"vertices": FRAMES, "faces": BODY.faces, "dt": 2.0}, "dt: 0.5 frames a second are not within 1 and 1000"),
        ({"vertices": FRAMES, "faces": BODY.faces, "units": "furlong"}, "units: it is 'furlong', which is none of m"),
        ({"vertices": FRAMES, "faces": BODY.faces, "units": 100}, "units: it is int64"),
        ({"vertices": FRAMES, "faces": BODY.faces, "up": "w"}, "up: it is 'w', which is none of y, z, x"),
        ({"vertices": np.where(FRAMES > 1.7, np.nan, FRAMES), "faces": BODY.faces}, "frame 0 has a position"),
    ],
)
def test_what_is_wrong_with_an_npz_is_said(tmp_path, arrays, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        read_frames(saved(tmp_path / "d.npz", **arrays))
    assert caught.value.remedy


@pytest.mark.parametrize("key", ["mocap_framerate", "mocap_frame_rate", "framerate", "frame_rate"])
def test_the_rate_goes_by_the_name_that_amass_gives_it_too(tmp_path, key):
    path = saved(tmp_path / "i.npz", vertices=FRAMES, faces=BODY.faces, **{key: 120.0})
    raw = read_frames(path)
    assert raw.dt == pytest.approx(1 / 120)
    assert "120 a second (as the file says)" in raw.notes[0]
    both = saved(tmp_path / "j.npz", vertices=FRAMES, faces=BODY.faces, fps=60, **{key: 120.0})
    with pytest.raises(MeshFileError, match=f"fps and {key}: they contradict each other: 60 a second and 120"):
        read_frames(both)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        (
            {"poses": np.zeros((9, 156)), "betas": np.zeros(16), "trans": np.zeros((9, 3)), "mocap_framerate": 120.0},
            "it holds betas, mocap_framerate, poses, trans: the parameters of a body model such as SMPL, as AMASS has",
        ),
        ({"v_template": FRAMES[0], "f": BODY.faces, "shapedirs": np.zeros(1)}, "a body model such as SMPL, not a mesh"),
        ({"verts": FRAMES, "f": BODY.faces}, "it holds f, verts"),
        ({f"k{k:02}": np.zeros(1) for k in range(20)}, "k10, k11 and 8 more"),
    ],
)
def test_an_npz_without_a_mesh_says_what_it_holds_and_what_is_needed(tmp_path, arrays, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        read_frames(saved(tmp_path / "k.npz", **arrays))
    assert "vertices (frames, V, 3), faces (F, 3), and fps or dt" in caught.value.remedy


def test_capitals_do_not_matter_and_fps_and_dt_may_agree(tmp_path):
    path = saved(tmp_path / "g.npz", vertices=FRAMES, faces=BODY.faces, units="CM", up=b"Z", fps=24, dt=0.041667)
    raw = read_frames(path)
    assert (raw.told.unit, raw.told.up) == ("cm", "z")
    assert raw.dt == pytest.approx(1 / 24)


def test_frames_a_second_that_are_told_stand_in_for_a_bad_field_but_have_bounds(tmp_path):
    path = saved(tmp_path / "h.npz", vertices=FRAMES, faces=BODY.faces, fps=0)
    assert read_frames(path, fps=24.0).dt == pytest.approx(1 / 24)
    for fps in (0.5, 1001.0, float("nan")):
        with pytest.raises(MeshFileError, match=r"--body-fps: .* not within 1 and 1000"):
            read_frames(path, fps=fps)


def frame_file(path, shift, faces="f 1 2 3\nf 1 3 4\n"):
    path.write_text("".join(f"v {x} {y} {shift}\n" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))) + faces)


def test_frames_in_capitals_are_read_in_the_order_of_their_numbers_and_gaps_are_told(tmp_path):
    for number in (10, 0, 1):
        frame_file(tmp_path / f"F{number}.OBJ", number)
    (tmp_path / "._F0.OBJ").write_bytes(b"\x00\x05")
    assert is_moving_mesh(tmp_path)
    raw = read_frames(tmp_path)
    np.testing.assert_array_equal(raw.frames[:, 0, 2], [0, 1, 10])
    assert "numbering has gaps (10 follows 1)" in raw.notes[1]
    assert raw.place(2) == f"{tmp_path.name}/F10.OBJ"


@pytest.mark.parametrize("packed", [False, True])
def test_what_computers_put_beside_frames_is_skipped(tmp_path, packed):
    junk = ("._f_1.obj", ".DS_Store", "Thumbs.db", "__MACOSX/._f_1.obj", "__MACOSX/f_1.obj")
    frame_file(tmp_path / "f_1.obj", 0.0)
    frame_file(tmp_path / "f_2.obj", 1.0)
    path = tmp_path
    (tmp_path / "__MACOSX").mkdir()
    for name in junk:
        (tmp_path / name).write_bytes(b"\x00\x05\x16\x07")
    if packed:
        path = tmp_path / "frames.zip"
        with zipfile.ZipFile(path, "w") as archive:
            for name in (*junk, "f_1.obj", "f_2.obj"):
                archive.write(tmp_path / name, f"take/{name}")
    raw = read_frames(path)
    assert [Path(file).name for file in raw.files] == ["f_1.obj", "f_2.obj"]
    assert not any("gaps" in note for note in raw.notes)


def test_frames_by_the_same_step_have_no_gaps(tmp_path):
    for number in (2, 4, 6):
        frame_file(tmp_path / f"{number}.obj", number)
    assert len(read_frames(tmp_path).notes) == 1


def test_a_frame_with_other_polygons_is_refused_by_its_name(tmp_path):
    frame_file(tmp_path / "1.obj", 0)
    frame_file(tmp_path / "2.obj", 0, "f 1 3 4\nf 1 2 3\n")
    with pytest.raises(MeshFileError, match="in the first frame") as caught:
        read_frames(tmp_path)
    assert caught.value.place == f"{tmp_path.name}/2.obj, line 5"


def test_a_folder_without_frames_says_so(tmp_path):
    assert not is_moving_mesh(tmp_path)
    with pytest.raises(MeshFileError, match=r"no \.obj frames"):
        read_frames(tmp_path)


def test_triangles_that_are_all_points_are_refused(tmp_path):
    path = saved(tmp_path / "i.npz", vertices=FRAMES, faces=np.zeros((5, 3), int))
    with pytest.raises(MeshFileError, match="none of its triangles has three corners"):
        make_body(read_frames(path))


def test_a_surface_inside_out_and_in_parts_is_turned_and_counted(tmp_path):
    """The body turned inside out, and a ball of its own beside it, as eyes and teeth are."""
    ball = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) * 0.02 + [0.0, 1.6, 0.3]
    octahedron = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    frames = np.concatenate([FRAMES, np.tile(ball, (4, 1, 1))], axis=1)
    faces = np.vstack([BODY.faces[:, ::-1], np.array(octahedron) + BODY.vertex_count])
    body = make_body(read_frames(saved(tmp_path / "e.npz", vertices=frames, faces=faces), Told("m", "y")))
    assert any("2 separate parts" in note for note in body.notes)
    x = body.sequence.rest_vertices
    a, b, c = (x[body.sequence.faces[:, k]] for k in range(3))
    volume = np.einsum("fd,fd->", a, np.cross(b, c)) / 6
    assert 0.04 < volume < 0.12


def inside_out(note):
    return note.startswith("it is inside out, its triangles face inwards as those of a mirrored export do")


def volume(sequence):
    a, b, c = (sequence.rest_vertices[sequence.faces[:, k]] for k in range(3))
    return float(np.einsum("fd,fd->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize(
    ("mirror", "reverse", "told"),
    [
        (1, False, 0),
        (1, True, 1),
        pytest.param(-1, False, 1, marks=pytest.mark.long),
        pytest.param(-1, True, 0, marks=pytest.mark.long),
    ],
)
def test_a_body_inside_out_is_turned_over_and_told(tmp_path, mirror, reverse, told):
    """Mirrored with its faces turned it is a body like another; nothing but its face normals gives it away."""
    faces = BODY.faces[:, ::-1] if reverse else BODY.faces
    path = saved(tmp_path / "j.npz", vertices=FRAMES * [mirror, 1, 1], faces=faces)
    body = make_body(read_frames(path))
    assert sum(inside_out(note) for note in body.notes) == told
    assert volume(body.sequence) == pytest.approx(volume(make_body(read_frames(saved_plain(tmp_path))).sequence))


def saved_plain(folder):
    return saved(folder / "plain.npz", vertices=FRAMES, faces=BODY.faces)


def test_a_body_whose_corners_nearly_coincide_is_one_surface(tmp_path):
    moved = FRAMES[:, BODY.faces.ravel()] + np.random.default_rng(3).normal(0.0, 2e-5, (3 * len(BODY.faces), 3))
    path = saved(tmp_path / "l.npz", vertices=moved, faces=np.arange(3 * len(BODY.faces)).reshape(-1, 3))
    body = make_body(read_frames(path))
    assert len(body.sequence.rest_vertices) == BODY.vertex_count
    assert len(body.sequence.faces) == len(BODY.faces)
    assert any(note.startswith("vertices that nearly coincide were joined, which moves") for note in body.notes)
    assert not any("not closed" in note or "parts" in note for note in body.notes)


def test_a_body_that_falls_apart_is_refused(tmp_path):
    moved = FRAMES[:, BODY.faces.ravel()] + np.random.default_rng(3).normal(0.0, 1e-3, (3 * len(BODY.faces), 3))
    path = saved(tmp_path / "m.npz", vertices=moved, faces=np.arange(3 * len(BODY.faces)).reshape(-1, 3))
    with pytest.raises(MeshFileError, match=r"triangles hang on no other: their corners lie 1\.?\d* mm") as caught:
        make_body(read_frames(path))
    assert caught.value.remedy == "Merge its vertices by distance before exporting it"


def test_a_few_triangles_that_face_inwards_are_counted(tmp_path):
    faces = BODY.faces.copy()
    faces[100:107] = faces[100:107, ::-1]
    body = make_body(read_frames(saved(tmp_path / "k.npz", vertices=FRAMES, faces=faces)))
    assert f"7 of its {len(faces)} triangles faced inwards: they are turned over" in body.notes
    assert not any(inside_out(note) for note in body.notes)


def test_triangles_turned_at_random_are_counted_and_not_told_to_be_mirrored(tmp_path):
    turned = np.random.default_rng(5).random(len(BODY.faces)) < 0.55
    faces = np.where(turned[:, None], BODY.faces[:, ::-1], BODY.faces)
    body = make_body(read_frames(saved(tmp_path / "n.npz", vertices=FRAMES, faces=faces)))
    assert f"{turned.sum()} of its {len(faces)} triangles faced inwards: they are turned over" in body.notes
    assert not any(inside_out(note) for note in body.notes)


@pytest.fixture(scope="module")
def squat(strangers, tmp_path_factory):
    path = tmp_path_factory.mktemp("glb") / "squat.glb"
    strangers.write_squat(path, BODY, 0.1)
    return path.read_bytes()


def rewritten(content, change):
    """The .glb with its document changed."""
    size = int.from_bytes(content[12:16], "little")
    document = json.loads(content[20 : 20 + size])
    change(document)
    return glb(document, content[28 + size :])


def mirror(document):
    children = {child for node in document["nodes"] for child in node.get("children", ())}
    roots = [k for k in range(len(document["nodes"])) if k not in children]
    document["nodes"].append({"scale": [-1, 1, 1], "children": roots})


def swap_names(document):
    for node in document["nodes"]:
        name = node.get("name", "")
        node["name"] = name.replace("left", "?").replace("right", "left").replace("?", "right")


@pytest.mark.parametrize(("change", "swapped"), [(lambda _: None, False), (mirror, True), (swap_names, True)])
def test_a_rig_whose_left_is_right_is_told(squat, tmp_path, change, swapped):
    path = tmp_path / "squat.glb"
    path.write_bytes(rewritten(squat, change))
    raw = read_frames(path)
    metres = Convention("m", "y", "in a test")
    unturned = np.zeros(5, bool), np.zeros(5, int)
    notes = sides_told(*unturned, raw.frames[0], raw.leftward, metres)
    assert [note.startswith("its joints named left are on its right") for note in notes] == [True] * swapped
    about = [[-1, 1, -1]]  # who faces backwards has left and right where they belong
    assert len(sides_told(*unturned, raw.frames[0] * about, raw.leftward * about[0], metres)) == swapped
    assert sides_told(*unturned, raw.frames[0][:9], raw.leftward, metres) == []


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("LeftArm", "left"), ("mixamorig:RightFoot", "right"), ("thigh.L", "left"), ("Bip01 R Thigh", "right"),
        ("l_hip", "left"), ("upperarm_r", "right"), ("lShldr", "left"), ("rfemur", None), ("Spine", None),
        ("pelvis", None), ("Head", None), ("J_Bip_L_UpperArm", "left"), ("LeftRight", None),
    ],
)  # fmt: skip
def test_sides_are_read_from_the_names_of_joints(name, side):
    assert side_of(name) == side


def test_a_folder_with_a_body_of_ours_is_no_moving_mesh(tmp_path):
    assert not is_moving_mesh(tmp_path)
    BODY.save(tmp_path / "body.npz")
    assert not is_moving_mesh(tmp_path / "body.npz")


@pytest.mark.parametrize("axis", [0, 2])
def test_a_body_that_encloses_no_room_is_refused(tmp_path, axis):
    flat = FRAMES * [axis != 0, 1.0, axis != 2]
    path = saved(tmp_path / "flat.npz", vertices=flat, faces=BODY.faces)
    with pytest.raises(MeshFileError, match="it encloses no room") as caught:
        make_body(read_frames(path, Told("m", "y")))
    assert "around it" in caught.value.remedy
