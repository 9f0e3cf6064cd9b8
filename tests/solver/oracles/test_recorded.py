"""Steps that a GPU runs as graphs are the steps, whatever their length and however contacts come and go."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from contact_scenes import sleeve_on_limb
from scipy.spatial.transform import Rotation

from tryon_solver.body.pose import Pose
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects import friction
from tryon_solver.linalg import device_loop
from tryon_solver.linalg.device_loop import KeptGraph
from tryon_solver.reshape import reshape
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import record

TAKES, GIVES_BACK = 10, 11  # CU_GRAPH_NODE_TYPE_MEM_ALLOC and _MEM_FREE of the CUDA driver
LENGTHS = (1 / 60, 1 / 90, 1 / 72, 1 / 240)  # s, taken in turns


@wp.kernel
def add_kernel(by: wp.array(dtype=wp.int32), total: wp.array(dtype=wp.int32)):
    total[0] = total[0] + by[0]


@pytest.fixture
def gpu():
    wp.init()
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    return "cuda:0"


@pytest.mark.gpu
def test_a_graph_is_recorded_once_for_a_key(gpu):
    by, total = (wp.array([k], dtype=wp.int32, device=gpu) for k in (1, 0))
    graph, recorded = KeptGraph(), []

    def body():
        recorded.append(1)
        wp.launch(add_kernel, 1, [by, total], device=gpu)

    for key, step in ((1, 1), (1, 10), (2, 100), (2, 1000)):
        by.fill_(step)
        graph.run(body, key, gpu)
    assert int(total.numpy()[0]) == 1111
    assert len(recorded) == 2


def kinds_of_nodes(graph):
    """The driver's numbers of the kinds of a recorded graph's nodes, of which the bodies of loops are one each."""
    driver, count = ctypes.CDLL("libcuda.so.1"), ctypes.c_size_t()
    assert driver.cuGraphGetNodes(graph.graph, None, ctypes.byref(count)) == 0
    nodes, kinds = (ctypes.c_void_p * count.value)(), []
    assert driver.cuGraphGetNodes(graph.graph, nodes, ctypes.byref(count)) == 0
    for node in nodes:
        kind = ctypes.c_int(-1)
        assert driver.cuGraphNodeGetType(ctypes.c_void_p(node), ctypes.byref(kind)) == 0
        kinds.append(kind.value)
    return kinds


@pytest.mark.gpu
def test_a_sort_in_a_graph_is_seen_to_take_memory(gpu):
    grid, places = wp.HashGrid(8, 8, 8, device=gpu), wp.zeros(4096, dtype=wp.vec3, device=gpu)
    grid.reserve(4096)
    with wp.ScopedCapture(device=gpu) as recorded:
        grid.build(places, 0.1)
    assert {TAKES, GIVES_BACK} <= set(kinds_of_nodes(recorded.graph))


@pytest.mark.gpu
def test_no_graph_of_a_step_takes_memory(gpu):
    """One that does reads what is not its own once other simulations' graphs have come and gone beside it."""
    sim = build(sleeve_on_limb().scene, PRESETS["live"], gpu, limb_at(0.0))
    for k in range(14):
        if k >= 12:
            sim.come_along()
        sim.advance(limb_at(k / 60), k / 60)
    graphs = {**sim.graphs, "correction": sim.budget.graph, "search": sim.candidates.searches[1]}
    assert {"set_out_and_look_ahead", "be_brought_along", "come_along"} <= set(graphs)
    for name, kept in graphs.items():
        if kept._graph is not None:
            kinds = kinds_of_nodes(kept._graph)
            assert kinds, name
            assert not {TAKES, GIVES_BACK} & set(kinds), name


@pytest.mark.gpu
def test_recorded_steps_are_the_steps(gpu, monkeypatch):
    """A sleeve on a limb that bends, from the same start: by graphs and launch by launch."""
    found, errors = [], []
    for recorded in (True, False):
        if not recorded:
            for module in (device_loop, record):
                monkeypatch.setattr(module, "keeps_graphs", lambda _device: False)
        sim = build(sleeve_on_limb().scene, PRESETS["live"], gpu, limb_at(0.0))
        time, reports = 0.0, []
        for k in range(24):
            time += LENGTHS[k % len(LENGTHS)]
            reports.append(sim.advance(limb_at(time), time))
        assert (len(sim.graphs) >= 5) == recorded
        found.append((sim.cloth_positions(), [report.iterations for report in reports]))
        errors.append([report.error for report in reports])
        assert max(report.pairs for report in reports) > 20
    (one, cycles), (other, as_many) = found
    assert np.abs(one - other).max() < 2e-4
    assert cycles == as_many
    by_graphs, by_launches = (np.median(its) for its in errors)
    assert 0.5 * by_launches < by_graphs < 2 * by_launches, "of all pairs, not of as many as there were at first"


def with_little_room(sim):
    """Lists of pairs, and of what contacts keep, that the first steps outgrow one after the other."""
    sim.pairs.__dict__.update(ContactPairs.allocate(16, sim.device).__dict__)
    return sim


@pytest.mark.gpu
def test_what_contacts_keep_is_not_lost_when_lists_grow(gpu, monkeypatch):
    """A graph that was recorded when pairs had their room, and what contacts keep had not yet."""
    monkeypatch.setattr(friction, "FIRST_ROOM", 16)
    found = []
    for recorded in (True, False):
        if not recorded:
            for module in (device_loop, record):
                monkeypatch.setattr(module, "keeps_graphs", lambda _device: False)
        sim = with_little_room(build(sleeve_on_limb().scene, PRESETS["live"], gpu, limb_at(0.0)))
        for k in range(1, 13):
            sim.advance(limb_at(k / 60), k / 60)
        (term,) = sim.stages.contact
        ids, given = term.kept()
        assert len(ids) > 2 * friction.FIRST_ROOM
        found.append({tuple(v): g for v, g in zip(ids.tolist(), given, strict=True)})
    one, other = found
    same = one.keys() & other.keys()
    assert len(same) > 0.9 * max(len(one), len(other))
    apart = [np.linalg.norm(one[v] - other[v]) for v in same]
    assert np.median([np.linalg.norm(g) for g in other.values()]) > 1e-5
    assert np.median(apart) < 1e-6


def test_a_graph_is_recorded_anew_when_what_contacts_keep_has_grown(monkeypatch):
    monkeypatch.setattr(friction, "FIRST_ROOM", 16)
    sim = build(sleeve_on_limb().scene, PRESETS["live"], "cpu", limb_at(0.0))
    (term,) = sim.stages.contact
    before = record.baked(sim)
    assert record.baked(sim) == before
    assert term.room() < sim.pairs.capacity
    term.make_room(sim.pairs)
    assert term.room() == sim.pairs.capacity
    assert record.baked(sim) != before


def reshaped_while_worn(preset, device, watch):
    """Steps of a sleeve on a bending limb, twelve, of which a third are after the fabric has become a thousandth larger
    in the pattern, so that no list grows for it; what `watch` has after the first eight and in the end."""
    sim = build(sleeve_on_limb().scene, PRESETS[preset], device, limb_at(0.0))
    garment, mass, seen = sim.scene.garment, sim.total_mass, []
    for k in range(12):
        if k == 8:
            seen.append(list(watch))
            reshape(sim, replace(garment, uv_corners=1.001 * garment.uv_corners))
        sim.advance(limb_at((k + 1) / 60), (k + 1) / 60)
    assert sim.total_mass == pytest.approx(1.001**2 * mass, rel=1e-6)
    assert sim.mass_told.numpy()[0] == pytest.approx(sim.total_mass, rel=1e-6)
    return *seen, list(watch)


@pytest.mark.parametrize("preset", ["draft", "live"])
def test_another_rest_shape_is_no_other_key(preset, monkeypatch):
    """What depends on it is read on the device: a drag, an edit a frame, would be recorded anew in each."""
    keys, run = [], KeptGraph.run

    def told(graph, body, key, device):
        keys.append(key)
        run(graph, body, key, device)

    monkeypatch.setattr(KeptGraph, "run", told)
    before, after = reshaped_while_worn(preset, "cpu", keys)
    later = after[len(before) :]
    assert len(later) >= 8
    assert all(key in before for key in later)


@pytest.mark.gpu
@pytest.mark.parametrize("preset", ["draft", "live"])
def test_another_rest_shape_is_recorded_nowhere(preset, gpu, monkeypatch):
    recorded, begin = [], wp.ScopedCapture.__enter__

    def told(capture):
        recorded.append(1)
        return begin(capture)

    monkeypatch.setattr(wp.ScopedCapture, "__enter__", told)
    before, after = reshaped_while_worn(preset, gpu, recorded)
    assert len(before) > 3
    assert len(after) == len(before)


def limb_at(time):
    """A limb that bends to and fro."""
    bent = Rotation.from_euler("y", 0.6 * np.sin(3 * time)).as_quat()
    return Pose(np.zeros(3), np.array([[0.0, 0, 0, 1], bent]))
