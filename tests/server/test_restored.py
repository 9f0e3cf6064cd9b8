"""Whatever was edited while it was worn, a server that was killed comes back wearing it: with the real solver, through
real processes."""

import json
from pathlib import Path

import numpy as np
import pytest
from asking import answered
from coarse_garments import EDGE_LENGTH
from killable_server import KillableServer
from watching import Viewer, crossing

from tryon_server.problems import ProblemError
from tryon_server.runtime import production
from tryon_server.runtime.order import DrapeOrder
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import mesh_in_size
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edits import Dart, ScaleGarment
from tryon_solver.redesign.fabrics import made_of

TSHIRT = Path(production.__file__).parents[1] / "demo/patterns/tshirt.json"
FABRIC = "cotton_jersey"
SMALLER = ScaleGarment((0.8, 0.8))


def area(positions, faces) -> float:
    """Of the cloth as it hangs [m^2]."""
    a, b, c = np.moveaxis(positions[faces].astype(np.float64), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def seen_area(viewer) -> float:
    topology, frame = viewer.seen[-1]
    return area(frame.cloth, topology.faces)


@pytest.mark.long
def test_a_garment_edited_until_nobody_can_put_it_on_is_worn_again_after_kill_9(tmp_path):
    """A T-shirt four fifths as large: its seams would not close around the body, which it is worn on all the same."""
    wishes = {"garment": "tshirt", "fabric": FABRIC, "motion": "walk"}
    with KillableServer(tmp_path, "coarse_garments:make_app") as server:
        session = server.open(**wishes)
        server.dressed(session)
        viewer = Viewer(server.stream_url(session))
        viewer.wait(6)
        unedited = seen_area(viewer)
        edit = {"edit": {"kind": "scale_garment", "factors": [0.8, 0.8]}}
        made = answered(server.http, server.http.post(f"/api/sessions/{session}/edits", json=edit))
        assert made.status_code == 201
        viewer.wait(30)
        worn = seen_area(viewer)
        viewer.close()
        pattern = server.http.get(f"/api/sessions/{session}/pattern").json()
        server.kill()
        server.start()
        again = server.open(continues=session, **wishes)
        told = server.dressed(again)
        viewer = Viewer(server.stream_url(again))
        viewer.wait(6)
        restored = seen_area(viewer)
        viewer.close()
        assert server.http.get(f"/api/sessions/{again}/pattern").json() == pattern
        assert any("put on as it was before its edits" in note for note in told["notes"])
        assert crossing(viewer.seen) == 0
        assert abs(restored - worn) < 0.25 * (unedited - worn), (unedited, worn, restored)
        undone = server.http.post(f"/api/sessions/{again}/edits/undo")
        assert answered(server.http, undone).json()["last"] == 0


def order(**more) -> DrapeOrder:
    return DrapeOrder(TSHIRT, FABRIC, "draft", "cpu", EDGE_LENGTH, worn_as="tshirt", **more)


def patterns(*edits):
    """The T-shirt's pattern, and those that these edits make of it, one of the other."""
    made = [made_of(json.loads(TSHIRT.read_text()), FABRIC)]
    for edit in edits:
        made.append(apply(made[-1], edit).specification)
    return made


@pytest.mark.parametrize(
    "edits",
    [
        pytest.param((SMALLER,), marks=pytest.mark.long),
        (Dart("front", 0, 0.5, 0.03, 0.1), SMALLER),
        pytest.param((SMALLER, Dart("front", 0, 0.5, 0.03, 0.1)), marks=pytest.mark.long),
    ],
    ids=["in its mesh", "in another mesh", "and another mesh after"],
)
def test_what_can_not_be_put_on_is_edited_while_worn(edits):
    *before, last = patterns(*edits)
    with pytest.raises(ProblemError, match="can't be put on"):
        production.build_drape(order(specification=last), lambda *_: None)
    drape = production.build_drape(order(specification=last, edited_from=tuple(before)), lambda *_: None)
    *_, unpacked = drape.packed().unpacking()
    for worn in (drape, unpacked):
        assert worn.own.shown == last
        assert rest_area(worn.simulation.scene.garment.uv_corners) == pytest.approx(meshed_area(last), rel=SAGITTA)
        worn.advance(worn.pose, 1 / 30)
        assert np.isfinite(worn.cloth_positions()).all()


SAGITTA = 0.01  # of a piece's area, by which curved edges in as many straight ones as before may differ


def rest_area(corners) -> float:
    """Of all pieces [m^2], as they are simulated."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def meshed_area(pattern) -> float:
    """Of all pieces of a pattern [m^2]."""
    panels = mesh_in_size(parse_pattern(pattern), EDGE_LENGTH, 1.0)
    return rest_area(panels.uv[panels.faces])
