"""A list that a GPU extends by itself is the one that the host extends: nothing is missing, and the cloth goes where it
went."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct, extend

FRAMES, DT = 40, 1 / 60


@pytest.fixture
def gpu():
    wp.init()
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    return "cuda:0"


def rows_of(candidates):
    """(C, 5) kinds and vertices of all that is listed, in an order of their own, each as often as it is."""
    kind, ids = (one.numpy()[: candidates.size] for one in (candidates.kind, candidates.ids))
    rows = np.column_stack([kind, ids])
    return rows[np.lexsort(rows.T)]


def without_room(sim):
    """Let there be room for what is on the list, and no more."""
    exact = sim.candidates.of_room(sim.candidates.size)
    exact.take_over(sim.candidates, sim.candidates.size)
    sim.candidates.__dict__.update(exact.__dict__)


def play(monkeypatch, device, by_itself, crowded=False):
    """Frames (T, N, 3) m, the lists in each, and how often the host extended one, the device did, and the
    host made room for what that found. `crowded`: there is never room for any more."""
    garment, x = sheet(15, 15, 0.3, 0.3)
    ball, faces = icosphere(0.1, 3)
    scene = Scene(garment, x + np.array([0.01, 0.104, -0.02]), rigid_body(ball, faces), fabric(), WORN)
    settings = replace(PRESETS["draft"], deterministic=True, search_slack=2e-4)
    sim = build(scene, settings, device, STILL)
    cloth, lists, by_host, by_device, rooms = [], [], [], [], []
    own = {name: getattr(correct, name) for name in ("note_extensions", "search_further", "iterate_newton")}
    make_room = correct.make_room_for_extension

    def noted(sim, allowed, outcome):
        by_device.append(allowed - outcome.searches)
        own["note_extensions"](sim, allowed, outcome)

    def begun(sim, *given, **named):
        if crowded and sim.candidates.size:
            without_room(sim)
        return own["iterate_newton"](sim, *given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(correct, "note_extensions", noted)
        patch.setattr(correct, "iterate_newton", begun)
        patch.setattr(correct, "search_further", lambda *given: (by_host.append(1), own["search_further"](*given)))
        patch.setattr(correct, "make_room_for_extension", lambda sim: (rooms.append(1), make_room(sim)))
        if not by_itself:
            for module in (correct, extend):
                patch.setattr(module, "extends_by_itself", lambda _: False)
        for k in range(1, FRAMES + 1):
            sim.advance(STILL, k * DT)
            cloth.append(sim.cloth_positions())
            lists.append(rows_of(sim.candidates))
    return np.array(cloth), lists, len(by_host), sum(by_device), len(rooms)


@pytest.mark.gpu
@pytest.mark.parametrize("crowded", [False, True])
def test_the_device_extends_as_the_host_does(monkeypatch, gpu, crowded):
    """Also where there is no room for what it finds: the host makes some then."""
    cloth, lists, by_host, by_device, rooms = play(monkeypatch, gpu, by_itself=True, crowded=crowded)
    again, wanted, each, *_ = play(monkeypatch, gpu, by_itself=False)
    assert each > 20
    assert by_device > each / 2
    assert (rooms > 5) == crowded
    assert by_host < each / 2
    np.testing.assert_array_equal(cloth, again)
    for one, other in zip(lists, wanted, strict=True):
        np.testing.assert_array_equal(one, other)
