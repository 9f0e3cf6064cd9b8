"""What is measured on a decoded frame: everything it must catch is shown to it, as it comes from the wire."""

import numpy as np
import pytest
from frame_figures import FrameMeter
from small_scenes import icosphere, sheet

from tryon_protocol import BodySurface, FrameDecoder, FrameEncoder, Topology
from tryon_solver.geometry.garment import Garment

NAMES = ("pelvis", "head", "left_toes")
JOINTS = np.array([[0, 0, 0], [0, 0.5, 0], [0, -0.5, 0]])


def tube(columns=24, rows=9, radius=0.12, height=0.2):
    """A tube around the vertical axis from a sheet that closes on itself, and its corners' pattern coordinates."""
    flat, _ = sheet(columns + 1, rows, 2 * np.pi * radius, height)
    uv = np.empty((flat.vertex_count, 2))
    uv[flat.faces.ravel()] = flat.uv_corners.reshape(-1, 2)
    angle, y = uv[:, 0] / radius, uv[:, 1] - uv[:, 1].mean()
    x = np.column_stack([radius * np.cos(angle), y, radius * np.sin(angle)])
    number = np.arange(flat.vertex_count)
    number = number // (columns + 1) * columns + number % (columns + 1) % columns
    faces = number[flat.faces].astype(np.int32)
    places = np.empty((columns * rows, 3))
    places[number] = x
    return Garment(faces, flat.uv_corners, flat.panel_of_face, len(places)), places


class Dressed:
    """A tube around a ball of 10 cm, encoded and decoded: `shown` sends a state over the wire and measures it."""

    def __init__(self):
        self.garment, self.cloth = tube()
        self.body, faces = icosphere(0.1, 3)
        surface = BodySurface(
            rest_vertices=self.body.astype(np.float32),
            faces=faces,
            joint_names=NAMES,
            parents=np.array([-1, 0, 0]),
            rest_joints=JOINTS.astype(np.float32),
            skin_joints=np.zeros((len(self.body), 1), np.uint16),
            skin_weights=np.ones((len(self.body), 1), np.float32),
        )
        uv = self.garment.uv_corners.astype(np.float32)
        topology = Topology(1, self.garment.vertex_count, self.garment.faces.astype(np.uint32), surface, uv)
        self.encoder, self.decoder, self.time = FrameEncoder(topology), FrameDecoder(), 0.0
        self.decoder.set_topology(topology)
        self.still = np.tile([0.0, 0, 0, 1], (len(NAMES), 1))
        self.meter = FrameMeter(topology, self.frame(self.cloth, self.body), 9.4e-3)

    def frame(self, cloth, body, root=(0.0, 0, 0), rotations=None):
        self.time += 1 / 60
        turned = self.still if rotations is None else rotations
        sent = self.encoder.encode(cloth, body, np.array(root), turned, t_sim=self.time, t_published=self.time)
        return self.decoder.decode(sent.data)

    def shown(self, cloth, body, **pose):
        return self.meter.measure(self.frame(cloth, body, **pose), intersections=True)


@pytest.fixture
def dressed():
    return Dressed()


def test_a_worn_tube_keeps_every_limit(dressed):
    figures = dressed.shown(dressed.cloth, dressed.body)
    assert figures.verdict.clean
    assert figures.finite
    assert figures.worn
    assert figures.lag_max == 0
    assert figures.pinched_area == 0
    assert figures.stretch_max == pytest.approx(1.0, abs=0.02)


def test_a_vertex_pushed_into_the_body_is_caught(dressed):
    cloth = dressed.cloth.copy()
    middle = np.argmin(np.abs(cloth[:, 1]))
    cloth[middle] *= 0.09 / 0.12
    figures = dressed.shown(cloth, dressed.body)
    assert figures.verdict.body_intersecting


def test_a_frame_that_is_not_asked_has_no_verdict(dressed):
    assert dressed.meter.measure(dressed.frame(dressed.cloth, dressed.body), intersections=False).verdict is None


def test_skin_to_surface_is_measured_at_the_frames_own_pose(dressed):
    """The body a metre off and turned, its surface 5 mm out in one vertex and 2 mm in all others of the upper half."""
    turn = np.array([0, np.sin(0.4), 0, np.cos(0.4)])
    skin = dressed.meter.skinner.pose(np.array([1.0, 0, 0]), np.vstack([turn, dressed.still[1:]]))
    upper = dressed.body[:, 1] > 0
    surface = skin + np.where(upper, 2e-3, 0)[:, None] * dressed.body / 0.1
    surface[0] = skin[0] + 5e-3 * dressed.body[0] / 0.1
    figures = dressed.shown(
        dressed.cloth + np.array([1.0, 0, 0]), surface, root=(1.0, 0, 0), rotations=np.vstack([turn, dressed.still[1:]])
    )
    assert figures.lag_max == pytest.approx(5e-3, abs=1e-4)
    assert figures.lag_p95 == pytest.approx(2e-3, abs=1e-4)
    assert figures.pinched_lag_max == 0


def test_stretch_of_most_passes_over_one_triangle_in_a_thousand_and_no_more(dressed):
    """384 triangles: none may be left out, so the most stretched one is the measure of both."""
    cloth = dressed.cloth.copy()
    cloth[:, 1] *= 1.3
    figures = dressed.shown(cloth, dressed.body)
    assert len(dressed.garment.faces) == 384
    assert figures.stretch_max == pytest.approx(1.3, abs=0.01)
    assert figures.stretch_most == figures.stretch_max


@pytest.mark.parametrize(("up", "worn", "slid"), [(0.3, True, 0.3), (0.7, False, np.inf), (-0.45, False, 0.45)])
def test_a_tube_that_slid_off_is_not_worn(dressed, up, worn, slid):
    """The head is at 0.5 m, the toes at -0.5 m, the loops at 0.1 m and -0.1 m; the upper one may not slide."""
    figures = dressed.shown(dressed.cloth + np.array([0, up, 0]), dressed.body)
    assert figures.worn == worn
    assert figures.slid == pytest.approx(slid, abs=1e-3)


def test_hem_is_told_relative_to_the_pelvis(dressed):
    """The lowest loop, in the pelvis's frame: the body walking off with its garment moves nothing."""
    before = dressed.shown(dressed.cloth, dressed.body).hem
    turn = np.vstack([[0, np.sin(0.4), 0, np.cos(0.4)], dressed.still[1:]])
    c, s = np.cos(0.8), np.sin(0.8)
    rotated = dressed.cloth @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    away = np.array([0.3, 0, 0])
    skin = dressed.meter.skinner.pose(away, turn)
    after = dressed.shown(rotated + away, skin, root=away, rotations=turn).hem
    assert len(before) == 24
    assert before[:, 1].max() < -0.09
    np.testing.assert_allclose(after, before, atol=1e-4)
