"""What pictures show: which triangle is in front, which side of it, which cross; and what the file holds."""

import struct
import zlib

import numpy as np
import pytest
from frame_judge import FrameJudge
from harness.crossed import Crossings
from harness.frames import Frames
from harness.picture import Camera, Surface, drawn, write_png
from harness.portraits import CROSSED, portraits
from sample_runs import kept, over_ball
from small_scenes import sheet

AHEAD = Camera(azimuth=0, elevation=0, centre=np.zeros(3), reach=1.0)
TRIANGLE = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
ONE = np.array([[0, 1, 2]])
RED, BLUE, GREEN = np.eye(3)[[0]], np.eye(3)[[2]], np.eye(3)[[1]]


def hue(image, row, column):
    """Which of red, green and blue a pixel is; None on paper."""
    pixel = image[row, column]
    return None if (pixel == 255).all() else int(np.argmax(pixel))


def test_front_and_back_have_their_colours_and_what_is_nearer_hides_the_rest():
    front = Surface(TRIANGLE, ONE, RED, BLUE)
    assert hue(drawn([front], AHEAD, 40), 25, 20) == 0
    assert hue(drawn([Surface(TRIANGLE, ONE[:, ::-1], RED, BLUE)], AHEAD, 40), 25, 20) == 2
    assert hue(drawn([front], AHEAD, 40), 2, 2) is None
    nearer = Surface(TRIANGLE + [0, 0, 0.5], ONE, GREEN, GREEN)
    for order in ([front, nearer], [nearer, front]):
        assert hue(drawn(order, AHEAD, 40), 25, 20) == 1


def test_the_camera_shows_its_reach_up_and_to_the_right():
    seen = AHEAD.seen(np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]), 100)
    np.testing.assert_allclose(seen[:, :2], [[100, 50], [50, 0], [50, 50]])
    assert seen[2, 2] > 0
    side = Camera(90, 0, np.zeros(3), 1.0)
    np.testing.assert_allclose(side.seen(np.array([[0, 0, -1.0]]), 100)[0, :2], [100, 50], atol=1e-9)


def test_a_png_holds_the_picture(tmp_path):
    image = np.random.default_rng(3).integers(0, 256, (5, 7, 3), np.uint8)
    write_png(tmp_path / "x.png", image)
    data = (tmp_path / "x.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        name, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length]) == (zlib.crc32(name + body),)
        chunks[name] = body
        at += 12 + length
    assert struct.unpack(">IIBBBBB", chunks[b"IHDR"]) == (7, 5, 8, 2, 0, 0, 0)
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(5, 22)
    assert (rows[:, 0] == 2).all()  # differences to the row above
    np.testing.assert_array_equal(np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(5, 7, 3), image)


@pytest.mark.parametrize("height", [0.09, 0.07, 0.0, -0.2])
def test_what_crosses_is_what_the_judge_calls_unclean(height):
    x, faces, ball, ball_faces = over_ball(height)
    verdict = FrameJudge(faces, ball_faces, x, ball).judge(x, ball)
    found = Crossings(faces, ball_faces, len(x)).among(x, ball)
    assert found.any() == verdict.body_intersecting
    if found.any():
        far = np.linalg.norm(x[faces], axis=2)
        assert (far[found].min(1) < 0.081).all()
        assert (far[found].max(1) > 0.075).all()


def test_cloth_through_cloth_is_found_and_a_sheet_does_not_cross_itself():
    garment, x = sheet(9, 9, 0.2, 0.2)
    none = np.zeros((0, 3))
    assert not Crossings(garment.faces, none.astype(int), len(x)).among(x, none).any()
    upright = np.column_stack([0.013 + 0 * x[:, 0], x[:, 0] + 0.003, x[:, 2] + 0.002])
    two = np.vstack([garment.faces, garment.faces + len(x)])
    found = Crossings(two, none.astype(int), 2 * len(x)).among(np.vstack([x, upright]), none)
    assert found[: len(garment.faces)].any()
    assert found[len(garment.faces) :].any()
    assert (np.abs(np.vstack([x, upright])[two][found].mean(1)[:, 0] - 0.013) < 0.03).all()


def test_a_case_is_shown_in_the_frame_in_which_most_crosses(tmp_path):
    still = kept(tmp_path / "ours", [0.09] * 13)
    through = kept(tmp_path / "vbd", [0.09, 0.09, 0.0, *[0.09] * 10])
    said = portraits("needle", {"ours": still, "vbd": through}, tmp_path)
    assert said["seconds"] == 1.0
    assert said["crossed"]["ours"] == 0
    assert said["crossed"]["vbd"] > 0
    assert (tmp_path / "needle-ours.png").stat().st_size < 50_000
    sizes = {struct.unpack(">II", path.read_bytes()[16:24]) for path in tmp_path.glob("*.png")}
    ((width, height),) = sizes  # of all the same, without the paper above and below a lying sheet
    assert height < 0.9 * width


def test_frames_come_back_as_they_were_kept(tmp_path):
    folder = kept(tmp_path / "ours", [0.09, 0.08])
    back = Frames.load(folder / "needle.npz")
    assert len(back.cloth) == len(back.surface) == 2
    np.testing.assert_allclose(back.cloth[1] - back.cloth[0], np.tile([0, -0.01, 0], (81, 1)), atol=1e-7)
    assert back.dt == 0.5


def test_what_crosses_is_red():
    assert CROSSED[0] > 3 * max(CROSSED[1:])
