"""Motions and bodies over REST, through a real server: kept by content, read as the command reads them, or refused."""

from __future__ import annotations

import asyncio
import hashlib
import io
import json
import re
import runpy
import struct
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from asking import answer_to, refused
from live_server import LiveServer

from tryon_client import connect
from tryon_protocol import SetMotionMessage, StatusMessage
from tryon_server.uploads.check import Telling, check
from tryon_solver.body import default_body
from tryon_solver.body.pose import Pose, skin

ROOT = Path(__file__).resolve().parents[2]
WALK = (ROOT / "server" / "tryon_server" / "demo" / "motions" / "walk.bvh").read_text()


def scaled(text: str, factor: float) -> str:
    """The same motion with its lengths in another unit."""
    lines, channels, motion = [], [], False
    for line in text.splitlines():
        words = line.split()
        if words and words[0] == "OFFSET":
            line = "OFFSET " + " ".join(f"{factor * float(word):.6f}" for word in words[1:])
        elif words and words[0] == "CHANNELS":
            channels += words[2:]
        elif words and words[0] == "Frame":
            motion = True
        elif motion and words:
            values = [float(w) * (factor if c.endswith("position") else 1.0) for w, c in zip(words, channels)]
            line = " ".join(f"{value:.6f}" for value in values)
        lines.append(line)
    return "\n".join(lines) + "\n"


def frames(count: int = 3, lean: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """The default body leaning over: (T, V, 3) m and faces."""
    body = default_body()
    shown = []
    for k in range(count):
        rotations = Pose.rest(body).rotations.copy()
        rotations[body.index_of["spine_3"]] = [np.sin(lean * k / 2), 0.0, 0.0, np.cos(lean * k / 2)]
        shown.append(skin(body, Pose(Pose.rest(body).root, rotations)))
    return np.array(shown), body.faces


def npz(vertices: np.ndarray, faces: np.ndarray, **more) -> bytes:
    held = io.BytesIO()
    np.savez_compressed(held, vertices=vertices.astype(np.float32), faces=faces, **more)
    return held.getvalue()


def zipped(entries: dict[str, bytes]) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return held.getvalue()


def obj(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*v) for v in vertices]
    lines += ["f {} {} {}".format(*face) for face in faces + 1]
    return "\n".join(lines).encode()


def post(live: LiveServer, kind: str, content: bytes | str, name: str = "mine", **told):
    return live.http.post(f"/api/{kind}", params={"name": name, **told}, content=content, timeout=240.0)


# Motions --------------------------------------------------------------------------------------------------------------


def test_a_motion_is_kept_by_content_and_says_how_it_was_read(live):
    reply = post(live, "motions", WALK, "My walk")
    assert reply.status_code == 201, reply.text
    motion = reply.json()
    assert motion["title"] == "My walk"
    assert motion["name"].startswith("my_walk-")
    found = motion["found"]
    assert (found["units"], found["up"]) == ("centimetres", "Y")
    assert motion["seconds"] == pytest.approx((found["frame_count"] - 1) / found["fps"], rel=1e-6)
    assert found["joints_mapped"]["left_forearm"]
    assert set(found["joints_mapped"].values()).isdisjoint(found["joints_unused"])
    assert any("centimetres" in note for note in found["notes"])
    assert reply.headers["location"] == f"/api/motions/{motion['name']}"
    assert live.http.get(reply.headers["location"]).json() == motion
    assert motion["kept_as"] is None
    assert post(live, "motions", WALK, "another name").json() == {**motion, "kept_as": "My walk"}
    assert post(live, "motions", WALK, "My walk").json() == motion
    listed = [entry["name"] for entry in live.http.get("/api/motions").json()]
    assert listed[0] == "sway"
    assert listed.count(motion["name"]) == 1
    assert live.http.delete(reply.headers["location"]).status_code == 204
    refused(live.http.get(reply.headers["location"]), 404, "motion.unknown")
    refused(live.http.delete(reply.headers["location"]), 404, "motion.unknown")
    assert [entry["name"] for entry in live.http.get("/api/motions").json()] == ["sway"]


@pytest.mark.long
def test_the_unit_of_a_motion_is_found_and_can_be_told_where_that_is_wrong(live):
    """A child of 70 cm is taken for a grown-up in inches, which is said, unless it is told."""
    child = scaled(WALK, 0.42)
    taken = post(live, "motions", child).json()["found"]
    assert taken["units"] == "inches"
    said = "it could also be 0.61 m in centimetres: units tells"
    assert any(note.endswith(said) for note in taken["notes"])
    told = post(live, "motions", child, units="cm").json()
    assert told["found"]["units"] == "centimetres"
    assert any("as told" in note for note in told["found"]["notes"])
    metres = post(live, "motions", scaled(WALK, 0.01)).json()["found"]
    assert metres["units"] == "metres"
    refused(post(live, "motions", WALK, units="ell"), 422, "request.invalid")
    wrong = refused(post(live, "motions", WALK, units="mm"), 422, "motion.invalid")
    assert "not a human's" in wrong["message"]
    assert "it would be one in centimetres" in wrong["message"]
    assert wrong["remedy"].startswith("Say its unit with units (m, dm")
    assert "leave it out" in wrong["remedy"]
    unknown = refused(post(live, "motions", scaled(WALK, 31.0)), 422, "motion.invalid")
    assert "units (m, dm" in unknown["remedy"]


def test_a_calibration_pose_ahead_of_a_motion_is_told_and_a_jump_within_refused(live):
    head, motion = WALK.split("Frame Time:")
    rate, *frames = motion.strip().splitlines()
    frames = frames[:30]
    values = frames[0].split()
    zero = " ".join([*values[:3], *("0" for _ in values[3:])])

    def with_frames(lines: list[str]) -> str:
        count = re.sub(r"Frames:\s*\d+", f"Frames: {len(lines)}", head)
        return f"{count}Frame Time: {rate.strip()}\n" + "\n".join(lines) + "\n"

    reply = post(live, "motions", with_frames([zero, *frames]))
    assert reply.status_code == 201, reply.text
    found = reply.json()["found"]
    (note,) = [note for note in found["notes"] if "calibration" in note]
    assert note.startswith("its first frame is a pose apart")
    assert note.endswith("it begins with frame 2")
    assert found["frame_count"] == 30
    live.http.delete(reply.headers["location"])
    wrong = refused(post(live, "motions", with_frames([*frames, zero, *frames])), 422, "motion.invalid")
    assert "from frame 30 to frame 31 the joint 'RightHand' jumps" in wrong["message"]
    assert "cut the motion there, or mend the frame" in wrong["message"]


def without_legs(text: str) -> str:
    """The same motion of a person who ends at the hips."""
    skeleton, motion = text.split("MOTION\n")
    kept, dropped, column, depth, leg = [], set(), 0, 0, None
    for line in skeleton.splitlines():
        words = line.split()
        if words[:1] == ["JOINT"] and words[1].endswith("UpLeg"):
            leg = depth
        if words[:1] == ["CHANNELS"]:
            here = range(column, column + int(words[1]))
            column = here.stop
            dropped |= set(here) if leg is not None else set()
        depth += (words == ["{"]) - (words == ["}"])
        if leg is None:
            kept.append(line)
        elif words == ["}"] and depth == leg:
            leg = None
    said, rate, *frames = motion.strip().splitlines()
    rows = [" ".join(v for k, v in enumerate(frame.split()) if k not in dropped) for frame in frames]
    return "\n".join([*kept, "MOTION", said, rate, *rows]) + "\n"


def test_a_person_without_legs_lacks_legs_and_no_unit(live):
    """In centimetres, whose extent without legs would be one in other units."""
    wrong = refused(post(live, "motions", without_legs(WALK)), 422, "motion.invalid")
    assert "left_thigh" in wrong["message"]
    assert "units" not in wrong["message"]
    told = refused(post(live, "motions", without_legs(WALK), units="mm"), 422, "motion.invalid")
    assert "not a human's" in told["message"]


def tilted(text: str, degrees: float) -> str:
    """The same motion below a joint that tilts all of it to the side."""
    skeleton, motion = text.split("MOTION\n")
    joints = skeleton.removeprefix("HIERARCHY\n").replace("ROOT", "JOINT", 1)
    head = "HIERARCHY\nROOT scene\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
    said, *frames = (line for line in motion.splitlines() if line.strip())
    rate, *frames = frames
    turned = [f"{degrees} 0 0 {frame}" for frame in frames]
    return "\n".join([head + joints + "}", "MOTION", said, rate, *turned]) + "\n"


@pytest.mark.long
def test_a_motion_that_leans_as_a_whole_is_told_to_be_tilted(live):
    notes = {}
    for degrees in (0.0, 25.0, 90.0):
        reply = post(live, "motions", tilted(WALK, degrees))
        assert reply.status_code == 201, reply.text
        notes[degrees] = " ".join(reply.json()["found"]["notes"])
        live.http.delete(reply.headers["location"])
    assert "lean from Y by 25 degrees as one: it was tilted in its export" in notes[25.0]
    assert "lean" not in notes[0.0]
    assert "up: -X, from feet to shoulders in its poses" in notes[90.0]
    assert "its rest pose stands along Y, its poses along -X: up is the poses'" in notes[90.0]
    assert "the person is played standing" in notes[90.0]
    assert "if it lies, with Y up, up=y tells" in notes[90.0]
    assert "is played" not in notes[0.0].replace("and is played so", "")
    assert "lean" not in notes[90.0]


@pytest.mark.long
def test_a_motion_whose_left_is_named_right_is_told(live):
    swapped = WALK.replace("Left", "?").replace("Right", "Left").replace("?", "Right")
    found = post(live, "motions", swapped).json()["found"]
    assert any("its joints named left, as 'LeftArm', are on its right" in note for note in found["notes"])
    assert found["joints_mapped"]["left_forearm"] == "RightForeArm"
    assert not any("named left" in note for note in post(live, "motions", WALK).json()["found"]["notes"])
    told = post(live, "motions", WALK, facing="-z").json()["found"]
    assert any("are on its right, as it faces along -z" in note for note in told["notes"])
    assert told["joints_mapped"]["left_forearm"] == "RightForeArm"
    wrong = refused(post(live, "motions", WALK, facing="y"), 422, "motion.invalid")
    assert "Say one of these with facing" in wrong["message"]
    assert refused(post(live, "motions", WALK, facing="up"), 422, "request.invalid")["place"] == "facing"


def lines_until(count: int) -> str:
    return "\n".join(WALK.splitlines()[:count])


MOTION_FAULTS = {
    "nothing": ("", "line 1", "HIERARCHY"),
    "no text": (b"\xfe\x01\x02\x80" * 100, "line 1", "HIERARCHY"),
    "UTF-16": (WALK.encode("utf-16"), "motion", "UTF-16"),
    "cut off in a frame": (WALK[: len(WALK) * 2 // 3], "line ", "values, expected"),
    "cut off between frames": (lines_until(WALK.count("\n") - 20), "motion", "promises"),
    "cut off in the skeleton": (lines_until(20), "motion", "ends before the word MOTION"),
    "no time between frames": (WALK.replace("Time: 0.016667", "Time: 0"), "line 144", "says 0 s"),
    "not a number": (WALK.replace("OFFSET 0", "OFFSET nan", 1), "line ", "not a finite number"),
}


def some_of(names, quick: set[str]):
    """Each name; all but the quick ones are long tests."""
    return [pytest.param(name, marks=[] if name in quick else pytest.mark.long) for name in names]


def check_motion_fault(name: str, place: str, message: str, remedy: str) -> None:
    _, where, says = MOTION_FAULTS[name]
    assert place.startswith(where)
    assert says in message
    assert "xport the motion again" in remedy
    assert "unit" not in remedy


@pytest.mark.parametrize("name", MOTION_FAULTS)
def test_what_a_motion_that_can_not_be_read_is_told(name):
    """As its check says it, without a server around it."""
    content = MOTION_FAULTS[name][0]
    reply = check(content if isinstance(content, bytes) else content.encode(), Telling(kind="motion", name="mine"))
    assert reply.problem is not None
    assert (reply.status, reply.problem.code) == (422, "motion.invalid")
    check_motion_fault(name, reply.problem.place, reply.problem.message, reply.problem.remedy)


@pytest.mark.parametrize("name", some_of(MOTION_FAULTS, {"nothing", "cut off in a frame"}))
def test_a_motion_that_can_not_be_read_is_refused_with_the_line(live, name):
    body = refused(post(live, "motions", MOTION_FAULTS[name][0]), 422, "motion.invalid")
    check_motion_fault(name, body["place"], body["message"], body["remedy"])
    assert live.http.get("/api/motions").json()[1:] == [
        entry for entry in live.http.get("/api/motions").json() if entry["found"]
    ]
    assert live.http.get("/api/motions").json()[1:] == [
        entry for entry in live.http.get("/api/motions").json() if entry["found"]
    ]


def test_a_motion_of_no_human_names_the_joints_that_are_missing(live):
    dog = WALK.replace("LeftArm", "FrontLeftLeg").replace("left_upper_arm", "front_left_leg")
    if dog == WALK:
        dog = WALK.replace("Left", "Port").replace("left", "port")
    body = refused(post(live, "motions", dog), 422, "motion.invalid")
    assert "lacks a joint" in body["message"]
    assert "It has: Hips, " in body["message"]
    assert "with joint=left_upper_arm=NAME" in body["remedy"]


@pytest.mark.long
def test_joints_whose_names_do_not_tell_can_be_told(live):
    odd = WALK.replace("LeftForeArm", "Gizmo 1").replace("RightHand\n", "Paw\n")
    unknown = refused(post(live, "motions", odd), 422, "motion.invalid")
    assert "lacks a joint for: left_forearm (expected 'LeftForeArm'" in unknown["message"]
    wanted = "Say which joints of the file these are with joint=left_forearm=NAME joint=right_hand=NAME, or rename them"
    assert unknown["remedy"].startswith(wanted)
    told = post(live, "motions", odd, joint=["left_forearm=Gizmo 1", "right_hand=Paw"]).json()
    assert told["found"]["joints_mapped"]["left_forearm"] == "Gizmo 1"
    assert "joints, as told: left_forearm is Gizmo 1, right_hand is Paw" in told["found"]["notes"]
    wrong = refused(post(live, "motions", odd, joint=["left_forearm=Gadget"]), 422, "motion.invalid")
    assert "left_forearm is told to be 'Gadget', which is no joint" in wrong["message"]
    assert "joint=left_forearm=NAME" in wrong["remedy"]
    tail = refused(post(live, "motions", odd, joint="tail=Paw"), 422, "motion.invalid")
    assert "no part is called 'tail'; parts are pelvis, head, left_upper_arm" in tail["message"]
    for bad in ("head", ["head=A", "head=B"]):
        assert refused(post(live, "motions", WALK, joint=bad), 422, "motion.joint")["place"] == "joint"
    assert refused(post(live, "motions", WALK, joint=["a=b"] * 17), 422, "request.invalid")["place"] == "joint"


def test_the_axis_that_is_up_in_a_motion_can_be_told(live):
    told = post(live, "motions", tilted(WALK, 90.0), up="y").json()["found"]
    assert told["up"] == "Y"
    assert "up: Y, as told" in told["notes"]
    assert refused(post(live, "motions", WALK, up="w"), 422, "request.invalid")["place"] == "up"


def test_a_motion_uploaded_meanwhile_can_be_chosen_in_a_session(live):
    session = live.open()
    name = post(live, "motions", WALK, "late").json()["name"]

    async def choose() -> bool:
        async with connect(live.stream_url(session)) as stream:
            assert name in stream.welcome.motions
            await stream.send(SetMotionMessage(motion=name))
            async for event in stream:
                if isinstance(event, StatusMessage) and event.motion == name:
                    return True
        return False

    assert asyncio.run(asyncio.wait_for(choose(), 60.0))
    live.http.delete(f"/api/sessions/{session}")
    live.http.delete(f"/api/motions/{name}")


# Bodies ---------------------------------------------------------------------------------------------------------------


def test_a_body_is_kept_and_wears_a_garment_as_it_moves(live):
    content = npz(*frames(), fps=24.0)
    reply = post(live, "bodies", content, "Bow")
    assert reply.status_code == 201, reply.text
    body = reply.json()
    assert body["id"].startswith("bow-")
    assert (body["frame_count"], body["seconds"]) == (3, pytest.approx(2 / 24))
    assert any(note.startswith("units and axes: m, Y up") for note in body["notes"])
    assert live.http.get(reply.headers["location"]).json() == body
    assert post(live, "bodies", content, "again").json() == {**body, "kept_as": body["name"]}
    assert live.http.get("/api/bodies").json() == [body]
    session = live.http.post("/api/sessions", json={"garment": "tube", "body": body["id"], "size": 1.25}).json()
    assert (session["body"], session["motion"], session["size"]) == (body["id"], "own", 1.25)
    wish = {"garment": "tube", "body": body["id"], "motion": "sway"}
    refused(live.http.post("/api/sessions", json=wish), 422, "motion.two")
    live.http.delete(f"/api/sessions/{session['id']}")
    ended = live.http.get(f"/api/sessions/{session['id']}").json()
    assert (ended["state"], ended["body"], ended["size"]) == ("closed", body["id"], 1.25)
    assert live.http.delete(f"/api/bodies/{body['id']}").status_code == 204
    refused(live.http.post("/api/sessions", json={"garment": "tube", "body": body["id"]}), 404, "body.unknown")


@pytest.mark.long
def test_frames_of_centimetres_with_z_up_come_in_an_archive(live):
    vertices, faces = frames(11)
    strange = 100.0 * np.stack([vertices[..., 0], -vertices[..., 2], vertices[..., 1]], axis=-1)
    entries = {f"bow/bow_{k}.obj": obj(x, faces) for k, x in enumerate(strange)}
    entries |= {"__MACOSX/bow/._bow_1.obj": b"\x00\x05", "readme.txt": b"hello"}
    body = post(live, "bodies", zipped(entries), "bow", fps=10).json()
    assert (body["frame_count"], body["seconds"]) == (11, pytest.approx(1.0)), "frame 10 is the last one, not the third"
    assert any("cm, Z up" in note for note in body["notes"])
    live.http.delete(f"/api/bodies/{body['id']}")


@pytest.mark.long
def test_a_glb_with_a_skin_that_is_open_says_so(live, tmp_path):
    script = runpy.run_path(str(ROOT / "scripts" / "make_strangers.py"))
    script["write_squat"](tmp_path / "squat.glb", default_body(), 0.2)
    body = post(live, "bodies", (tmp_path / "squat.glb").read_bytes(), "squat").json()
    assert any("it is not closed: 1 holes are filled" in note for note in body["notes"])
    assert body["seconds"] == pytest.approx(0.2, abs=0.05)
    live.http.delete(f"/api/bodies/{body['id']}")


@pytest.mark.long
@pytest.mark.parametrize("told", [{}, {"up": "x"}])
def test_a_body_may_have_x_up(live, told):
    vertices, faces = frames(2)
    body = post(live, "bodies", npz(vertices[..., [1, 2, 0]], faces), "lying", **told).json()
    assert body["notes"][0].startswith("units and axes: m, X up")
    assert "it faces where its toes point" in body["notes"][0]
    faced = post(live, "bodies", npz(vertices[..., [1, 2, 0]], faces), "lying", facing="-y", **told).json()
    assert faced["id"] != body["id"]
    assert "it faces along -y, as told" in faced["notes"][0]
    along_up = post(live, "bodies", npz(vertices[..., [1, 2, 0]], faces), facing="x", **told)
    wrong = refused(along_up, 422, "body.unusable")
    assert "it can't face along x, as told: x is up" in wrong["message"]
    assert wrong["remedy"] == "Say another axis with facing, or which one is up with up"
    for one in (body, faced):
        live.http.delete(f"/api/bodies/{one['id']}")


def test_axes_that_are_none_of_a_bodys_or_of_a_garments_are_refused(live):
    assert refused(post(live, "bodies", b"", facing="w"), 422, "request.invalid")["place"] == "facing"
    assert refused(post(live, "bodies", b"", up="w"), 422, "request.invalid")["place"] == "up"
    assert refused(post(live, "garments", b"v 0 0 0", up="x"), 422, "request.invalid")["place"] == "up"


def animated(names: tuple[str, ...]) -> bytes:
    """The squat with so many animations, all the same but for their names."""
    script = runpy.run_path(str(ROOT / "scripts" / "make_strangers.py"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "squat.glb"
        script["write_squat"](path, default_body(), 0.1)
        content = path.read_bytes()
    size = int.from_bytes(content[12:16], "little")
    document = json.loads(content[20 : 20 + size])
    document["animations"] = [document["animations"][0] | {"name": name} for name in names]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + size :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


@pytest.mark.long
def test_one_of_several_animations_is_chosen_by_name_and_goes_with_the_body_into_a_session(live):
    content = animated(("idle", "squat"))
    first = post(live, "bodies", content, "Actor").json()
    assert any("'idle' is read, the first; animation names another" in note for note in first["notes"])
    told = post(live, "bodies", content, "Actor", animation="squat", facing="z").json()
    assert told["id"] != first["id"]
    assert any("'squat' is read, as told" in note for note in told["notes"])
    wrong = refused(post(live, "bodies", content, animation="fly"), 422, "body.unusable")
    assert "no animation 'fly'" in wrong["message"]
    assert wrong["remedy"] == "Say one of: 'idle', 'squat'"
    session = live.http.post("/api/sessions", json={"garment": "tube", "body": told["id"], "fabric": "tight"}).json()
    deadline = time.monotonic() + 60.0
    while (reply := live.http.get(f"/api/sessions/{session['id']}").json())["state"] != "failed":
        assert time.monotonic() < deadline, reply
        time.sleep(0.05)
    assert "stayed open on 'Actor'; animation is squat, facing is z. Enlarge the pieces." in reply["detail"]
    live.http.delete(f"/api/sessions/{session['id']}")
    for body in (first, told):
        assert live.http.delete(f"/api/bodies/{body['id']}").status_code == 204


def test_a_body_that_passes_through_itself_says_so(live):
    body = default_body()
    rotations = Pose.rest(body).rotations.copy()
    rotations[body.index_of["left_upper_arm"]] = [0.0, 0.0, -np.sin(0.6), np.cos(0.6)]
    folded = skin(body, Pose(Pose.rest(body).root, rotations))
    reply = post(live, "bodies", npz(np.stack([body.rest_vertices, folded]), body.faces), "folded").json()
    assert any("it passes through itself in 1 of 2 frames" in note for note in reply["notes"])
    live.http.delete(f"/api/bodies/{reply['id']}")


def hurt() -> bytes:
    vertices, faces = frames(2)
    vertices[1, 7, 2] = np.nan
    return npz(vertices, faces)


def bomb() -> bytes:
    return zipped({f"{k}.obj": b"v 0 0 0\n" * 2**22 for k in range(33)})


def one_obj() -> bytes:
    vertices, faces = frames(1)
    return obj(vertices[0], faces)


def unequal() -> bytes:
    vertices, faces = frames(2)
    return zipped({"1.obj": obj(vertices[0], faces), "2.obj": obj(vertices[1][:-5], faces[:9])})


def told_of(**fields) -> bytes:
    """An .npz of frames with more fields."""
    vertices, faces = frames(2)
    packed = io.BytesIO()
    np.savez(packed, vertices=vertices, faces=faces, **fields)
    return packed.getvalue()


BAD_BODIES = {
    "no frames a second": (lambda: told_of(fps=0), "fps: it is 0, which must be more than 0"),
    "a unit of its own": (lambda: told_of(units="furlong"), "units: it is 'furlong'"),
    "nothing": (lambda: b"", "no polygons"),
    "no mesh": (lambda: b"hello" * 100, "no polygons"),
    "NaN": (hurt, "frame 1 has a position that is not a finite number"),
    "triangles of nothing": (lambda: npz(frames(2)[0], frames(1)[1] + 10**6), "a vertex that is not there"),
    "other arrays": (lambda: zipped({"a.npy": b"x"}), "it holds a"),
    "cut off": (lambda: npz(*frames(2))[:-2000], "not a zip file"),
    "a bomb": (bomb, "1056 MiB when they are unpacked"),
    "a way out": (lambda: zipped({"../../evil.obj": one_obj()}), "leads out of the archive"),
    "another way out": (lambda: zipped({"C:\\evil.obj": one_obj()}), "leads out of the archive"),
    "no frames": (lambda: zipped({"readme.txt": b"hello"}), "no .obj frames"),
    "other frames": (unequal, "the first frame has"),
    "a mouse": (lambda: npz(0.0001 * frames(2)[0], frames(1)[1]), "human"),
    "half a glb": (lambda: b"glTF\x02\x00\x00\x00\xff\xff\x00\x00" + b"\x00" * 100, "glTF"),
}


def check_bad_body(name: str, place: str, message: str, remedy: str) -> None:
    assert BAD_BODIES[name][1] in message
    assert place == "body"
    assert "--" not in remedy, "options of the command mean nothing here"


@pytest.mark.parametrize("name", some_of(BAD_BODIES, BAD_BODIES.keys() - {"a bomb"}))
def test_what_a_body_that_can_not_be_worn_on_is_told(name):
    """As its check says it, without a server around it."""
    reply = check(BAD_BODIES[name][0](), Telling(kind="body", name="mine"))
    assert reply.problem is not None
    assert (reply.status, reply.problem.code) == (422, "body.unusable")
    check_bad_body(name, reply.problem.place, reply.problem.message, reply.problem.remedy)


@pytest.mark.parametrize("name", some_of(BAD_BODIES, {"NaN", "a way out", "half a glb"}))
def test_a_body_that_can_not_be_worn_on_is_refused_and_the_server_goes_on(live, name):
    body = refused(post(live, "bodies", BAD_BODIES[name][0]()), 422, "body.unusable")
    check_bad_body(name, body["place"], body["message"], body["remedy"])
    assert live.http.get("/api/bodies").json() == []
    assert live.http.get("/api/health").json()["status"] == "ok"


@pytest.mark.parametrize(("kind", "cap"), [("motions", "64 MiB"), ("bodies", "128 MiB")])
def test_300_mb_are_refused_before_they_are_sent(live, kind, cap):
    status, body, sent = answer_to(live, f"Content-Length: {300 * 10**6}", [b"[" * 1000], f"/api/{kind}")
    assert status.startswith("HTTP/1.1 413")
    assert sent == 1000
    assert body["code"] == "body.too_long"
    assert cap in body["message"]
    assert "TRYON_SERVER_MAX_" in body["remedy"]


@pytest.mark.parametrize("kind", ["motions", "bodies"])
def test_names_must_be_printable_and_pages_of_others_may_not_upload(live, kind):
    one = kind[:-1] if kind == "motions" else "body"
    refused(post(live, kind, b"x", "  "), 422, f"{one}.name")
    evil = {"origin": "http://evil.example"}
    refused(live.http.post(f"/api/{kind}", content=b"x", headers=evil), 403, "origin.refused")
    refused(live.http.delete(f"/api/{kind}/x", headers=evil), 403, "origin.refused")


def test_what_was_uploaded_survives_a_restart_and_a_lost_file_is_told(tmp_path):
    server = LiveServer(tmp_path)
    motion = post(server, "motions", WALK, "kept").json()
    content = npz(*frames(2))
    body = post(server, "bodies", content, "kept").json()
    server.stop()
    server = LiveServer(tmp_path)
    assert server.http.get("/api/motions").json()[1] == motion
    assert server.http.get("/api/bodies").json() == [body]
    server.open(motion=motion["name"])
    digest = hashlib.sha256(content).hexdigest()
    (tmp_path / "data" / "blobs" / digest[:2] / digest).unlink()
    refused(server.http.post("/api/sessions", json={"garment": "tube", "body": body["id"]}), 410, "body.lost")
    server.stop()
