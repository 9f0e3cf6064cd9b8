"""What kernels cost is counted from their arrays, and held to roofs that are measured beside."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "solver" / "bench"), str(Path(__file__).parent)]

import costs  # noqa: E402
import roofline  # noqa: E402
from contact_scenes import DT, square_on_sphere  # noqa: E402
from costs import Cost  # noqa: E402
from document import document  # noqa: E402
from made_up import ABOUT  # noqa: E402
from roofline import Kernel, told  # noqa: E402

from tryon_solver.contact.found import STENCILS  # noqa: E402
from tryon_solver.contact.pairs import ContactPairs  # noqa: E402
from tryon_solver.linalg.paired_matrix import PairedMatrix  # noqa: E402
from tryon_solver.linalg.pcg_together import NOW  # noqa: E402
from tryon_solver.simulation import build  # noqa: E402


def matrix():
    """Two vertices of cloth, coupled with each other near and far, two of a body; a pair of all but the last."""
    m = PairedMatrix()
    m.columns = wp.array(np.array([[0, 1, 0], [1, 0, 1]], np.int32), dtype=wp.int32, device="cpu")
    m.blocks = wp.zeros((2, 3), dtype=wp.mat33, device="cpu")
    m.far_columns = wp.array(np.array([[1], [0]], np.int32), dtype=wp.int32, device="cpu")
    m.weights = wp.zeros((2, 1), dtype=wp.float32, device="cpu")
    m.diagonal = wp.zeros(4, dtype=wp.float32, device="cpu")
    m.held = wp.zeros(4, dtype=wp.vec3, device="cpu")
    m.count = wp.array(np.array([1, 0], np.int32), dtype=wp.int32, device="cpu")
    m.ids = wp.array(np.array([[0, 1, 2, 2], [3, 3, 3, 3]], np.int32), dtype=wp.vec4i, device="cpu")
    return m


def test_a_product_costs_what_its_entries_do():
    entries = 2 * (4 + 36) + 2 * (4 + 4)  # padding is none
    pair = 16 + 16 + 12 + 4 + 36 + 3 * 12 * 2  # three vertices, read and written
    # unknowns: p read, y written, the diagonal, and what holds them
    read = costs.product(matrix(), 3, directions=1)
    assert read == Cost(entries + pair + 3 * (3 * 12 + 4), 2 * 21 + 2 * 9 + 3 * (12 + 11) + 81)
    # z and q read, p and y written, and z + b q made wherever it is used
    made = costs.product(matrix(), 3, directions=2)
    assert made.bytes - read.bytes == 3 * 2 * 12 + 3 * 2 * 4
    assert made.operations - read.operations == 6 * (2 + 2 + 3 + 4)


def test_unknowns_are_the_cloth_and_what_pairs_couple_to_it():
    assert costs.coupled_unknowns(matrix()) == 3


def test_blocks_of_pairs_cost_by_pairs_that_are_there():
    pairs = ContactPairs.allocate(8, "cpu")
    pairs.ids.assign(np.array([[0, 1, 2, 3], [2, 3, 4, 5], *([[9, 9, 9, 9]] * 6)], np.int32))
    pairs.counters.assign(np.array([2, 0], np.int32))
    assert costs.contact_blocks(pairs) == Cost(2 * 84 + 6 * 72, 2 * 103)


def test_a_search_costs_more_with_more_triangles_and_answers():
    few = costs.pair_search(100, 64, 10)
    assert few.operations == (100 * 6 + 10) * 6
    assert costs.pair_search(100, 64, 11).bytes - few.bytes == 8
    assert costs.pair_search(100, 65, 10).bytes - few.bytes == 32 + 64


def test_taking_apart_costs_by_what_is_in_the_pairs_and_what_is_listed():
    own, other = np.array([[0, 1, 2], [1, 2, 3], [7, 8, 9]]), np.array([[4, 5, 6], [3, 4, 5]])
    close = np.array([[0, 0], [0, 1], [1, 1]])  # two triangles and two, of vertices 0 to 6
    assert costs.taking_apart(own, other, close, 5) == Cost(3 * 16 + 4 * 16 + 7 * 24 + 5 * 24, 5 * 60)


@pytest.mark.parametrize(
    ("cost", "roof", "share"), [(Cost(4000, 1000), "bytes", 0.5), (Cost(1000, 30000), "operations", 0.75)]
)
def test_a_kernel_is_held_to_the_roof_it_meets_first(cost, roof, share):
    found = told(Kernel("k", lambda: None, cost), 8e-6, copied=1e9, added=5e9)
    assert found["roof"] == roof
    assert found["share"] == pytest.approx(share)
    assert found["us"] == pytest.approx(8.0)


@pytest.fixture(scope="module")
def on_sphere():
    """A square that has met its sphere."""
    case = square_on_sphere()
    sim = build(case.scene, None, "cpu", case.pose_at(0))
    for k in range(1, 7):
        sim.advance(case.pose_at(k), k * DT)
    assert sim.reported.pairs > 0
    return sim


def test_the_product_that_is_timed_is_done_in_every_launch(on_sphere):
    """The GPU's kernel, which a processor runs, too: it goes on, and multiplies by the correction's matrix."""
    kernel = roofline.product_together(on_sphere)
    for _ in range(2):
        on_sphere.cg.product.zero_()
        on_sphere.cg.pulled.zero_()
        kernel.launch()
    assert on_sphere.cg.state.numpy()[int(NOW)] == 0
    p, cloth = on_sphere.cg.direction.numpy(), on_sphere.cloth_count
    np.testing.assert_array_equal(p, on_sphere.cg.both.numpy()[::2, :3])
    diagonal = on_sphere.work.diagonal.numpy()[cloth:]
    product = on_sphere.cg.product.numpy()
    np.testing.assert_allclose(product[cloth:], diagonal[:, None] * p[cloth:], rtol=1e-4)
    assert (np.abs(product[:cloth]) > 0).all()
    assert (on_sphere.cg.pulled.numpy()[:cloth] != 0).any()  # by the pairs


def test_searches_find_what_the_solver_found_at_first(on_sphere):
    kernels = roofline.searches(on_sphere)
    assert len(kernels) == 2
    for kernel, surface in zip(kernels, on_sphere.touching):
        none = costs.pair_search(on_sphere.cloth.face_count, surface.face_count, 0)
        assert kernel.cost.bytes > none.bytes


def test_what_is_taken_apart_is_listed_in_every_launch(on_sphere):
    """As often as it is timed: what lies beyond the room would be counted and not written."""
    found = []
    for kernel in roofline.stencils(on_sphere):
        own = kernel.launch.args[2]
        listed = (kernel.cost.operations // costs.CLOSEST_POINTS, own.ids.numpy())
        for _ in range(2):
            own.ids.fill_(-1)
            kernel.launch()
            assert own.counts.numpy()[int(STENCILS)] == listed[0] <= len(own.ids)
            np.testing.assert_array_equal(own.ids.numpy()[: listed[0]], listed[1][: listed[0]])
        found.append(listed[0])
    assert max(found) > 0


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The kernels of a coarse T-shirt in the walk."""
    out = tmp_path_factory.mktemp("roofline")
    command = [sys.executable, str(ROOT / "solver" / "bench"), "--out", str(out), "--seconds", "0.1", "--every", "0"]
    ran = subprocess.run([*command, "--vertices", "150", "--roofline"], capture_output=True, text=True, timeout=280)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return json.loads((out / "results.json").read_text()), (out / "table.md").read_text()


@pytest.mark.long
def test_kernels_of_a_worn_scene_are_held_to_their_roofs(run):
    (result,) = run[0]["roofline"]
    roofs = {"bytes": result["bytes_per_s"], "operations": result["operations_per_s"]}
    assert min(roofs.values()) > 0
    iterations, blocks, *searches = result["kernels"]
    assert "20 iterations" in iterations["kernel"]
    assert [s["kernel"].partition(" (")[0] for s in searches] == [
        f"{what} with the {name}"
        for what in ("pairs of triangles", "stencils of pairs of triangles")
        for name in ("body", "cloth")
    ]
    for kernel in (iterations, blocks, *searches):
        assert kernel["us"] > 0
        assert kernel["bytes"] > 0
        assert kernel["operations"] > 0
        reached = {what: kernel[what] / (1e-6 * kernel["us"]) / roof for what, roof in roofs.items()}
        assert kernel["share"] == pytest.approx(max(reached.values()))
        assert reached[kernel["roof"]] == max(reached.values())


@pytest.mark.long
def test_table_and_page_have_them(run):
    results, table = run
    for text in (table, document([{"name": "one", **results}], {})):
        assert "## Kernels and roofs" in text
        assert "| contact blocks of the Hessian (contact/pairs.py) | " in text
        assert "GFLOP/s" in text
    assert ABOUT.keys() <= results["about"].keys()
