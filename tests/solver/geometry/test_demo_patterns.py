"""Claims on the demo's own patterns: they are what the script writes, and their openings fit the body they are for."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.weld import weld

REPOSITORY = Path(__file__).resolve().parents[3]
DEMO_PATTERNS = REPOSITORY / "server" / "tryon_server" / "demo" / "patterns"
NAMES = ("dress", "skirt", "trousers", "tshirt")


@pytest.fixture(scope="module")
def script():
    """The names of scripts/make_demo_patterns.py."""
    return runpy.run_path(str(REPOSITORY / "scripts" / "make_demo_patterns.py"))


def test_the_script_writes_the_committed_bytes(script, tmp_path):
    written = script["write_patterns"](tmp_path)
    assert sorted(path.stem for path in written) == sorted(path.stem for path in DEMO_PATTERNS.glob("*.json"))
    for path in written:
        assert path.read_bytes() == (DEMO_PATTERNS / path.name).read_bytes()


def girths(mesh):
    """Girths [cm] of the sewn garment's openings, measured in the pattern, by the set of pieces they run through."""
    sewn = weld(mesh)
    lengths = {}
    side = {}
    for face, corners in enumerate(sewn.vertex_of_corner.tolist()):
        for k in range(3):
            side[corners[k], corners[(k + 1) % 3]] = (face, k)
    for loop in boundary_loops(sewn.vertex_of_corner):
        places = [side[a, b] for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist())]
        ends = [(sewn.uv_corners[f, k], sewn.uv_corners[f, (k + 1) % 3]) for f, k in places]
        pieces = frozenset(mesh.panel_names[sewn.panel_of_face[f]] for f, _ in places)
        lengths.setdefault(pieces, []).append(100 * sum(float(np.linalg.norm(b - a)) for a, b in ends))
    return {pieces: sorted(values) for pieces, values in lengths.items()}


def test_the_tshirt_has_a_neck_two_sleeves_and_a_hem_that_fit(script, meshed):
    body = script["BODY"]
    openings = girths(meshed(DEMO_PATTERNS / "tshirt.json", 0.016))
    neck, hem = openings[frozenset({"front", "back"})]
    # Wider than the neck and far narrower than the way round both shoulders: it can be worn and cannot slip off.
    assert 45 < neck < 65
    assert hem > body.hip_girth + 4
    for arm in ("left", "right"):
        (sleeve,) = openings[frozenset({f"{arm}_sleeve_front", f"{arm}_sleeve_back"})]
        assert sleeve > body.upper_arm_girth + 4


def test_the_skirt_holds_at_the_waist_by_being_narrower_than_the_hips(script, meshed):
    body = script["BODY"]
    waist, hem = girths(meshed(DEMO_PATTERNS / "skirt.json", 0.016))[frozenset({"skirt_front", "skirt_back"})]
    # Cloth lies at least 2 mm off the skin: it must stretch to close there, by less than the stiffest fabric's 5 %.
    on_skin = body.waist_girth + 2 * np.pi * 0.2
    assert 1.005 < on_skin / waist < 1.03
    assert waist < 0.8 * body.hip_girth
    assert hem > 1.3 * body.hip_girth


def test_the_dress_has_a_neck_two_armholes_and_a_wide_hem(script, meshed):
    body = script["BODY"]
    openings = girths(meshed(DEMO_PATTERNS / "dress.json", 0.016))
    armholes_and_neck = openings[frozenset({"front", "back"})]
    assert len(armholes_and_neck) == 3
    assert all(length > body.upper_arm_girth + 8 for length in armholes_and_neck)
    (hem,) = openings[frozenset({"skirt_front", "skirt_back"})]
    assert hem > 1.3 * body.hip_girth


def test_the_trousers_hold_at_the_waist_and_have_two_hems(script, meshed):
    body = script["BODY"]
    openings = girths(meshed(DEMO_PATTERNS / "trousers.json", 0.016))
    (waist,) = openings[frozenset({"front_left", "front_right", "back_left", "back_right"})]
    assert 1.005 < (body.waist_girth + 2 * np.pi * 0.2) / waist < 1.03
    for side in ("left", "right"):
        (hem,) = openings[frozenset({f"front_{side}", f"back_{side}"})]
        assert 40 < hem < 60  # wider than a heel is round, 32 cm on this body


@pytest.mark.parametrize("name", NAMES)
def test_sewn_edges_of_the_demo_have_equal_lengths(name):
    pattern = load_pattern(DEMO_PATTERNS / f"{name}.json")
    for stitch in pattern.stitches:
        one, other = (pattern.panels[side.panel].edges[side.edge].length for side in (stitch.first, stitch.second))
        assert one == pytest.approx(other, rel=2e-3)
