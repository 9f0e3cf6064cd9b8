"""The solver's presets behind the server's interface: another one comes in force on a garment that is worn, which goes
on from where it is with all that it is worn with."""

import pickle

import numpy as np
import patterns
import pytest
import trimesh
from frame_judge import FrameJudge
from outfit_orders import overshirt_over_tshirt
from scripted_worker import allow, frames, work

from tryon_server.runtime import production
from tryon_server.runtime.order import DrapeOrder
from tryon_server.sessions.commands import BuyAccuracy, Run
from tryon_server.sessions.events import PresetInForce
from tryon_solver.effect_words.table import live, word_of
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.plain import parse_edit
from tryon_solver.settings import PRESETS

DT = 1 / 30
WAY = ("live", "fit", "reference", "draft")
HEM = [{"panel": "front", "edge": 0}, {"panel": "back", "edge": 0}]
FRAMES_PER_SECOND = 50.0  # of a worker that is driven by a script


@pytest.fixture(scope="module")
def hung(tmp_path_factory):
    """A bag over a capsule, put away."""
    folder = tmp_path_factory.mktemp("bag")
    capsule = trimesh.creation.capsule(height=0.6, radius=0.14, count=[16, 16])
    capsule.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    capsule.apply_translation([0, 0.75, 0])
    capsule.export(folder / "capsule.ply")
    (folder / "bag.json").write_bytes(patterns.as_bytes(patterns.bag(60.0, 40.0)))
    order = DrapeOrder(folder / "bag.json", "cotton_jersey", "draft", "cpu", 0.06, folder / "capsule.ply")
    return pickle.dumps(production.build_drape(order, lambda *_: None).packed())


@pytest.fixture
def bag(hung):
    *_, drape = pickle.loads(hung).unpacking()
    return drape


@pytest.fixture(scope="module")
def dressed(tmp_path_factory):
    """A T-shirt and an overshirt, put away."""
    order = overshirt_over_tshirt(tmp_path_factory.mktemp("dressed"))
    return pickle.dumps(production.build_drape(order, lambda *_: None).packed())


def advance(drape, frames):
    for _ in range(frames):
        drape.advance(drape.pose, drape.seconds + DT)
    return drape.cloth_positions().astype(np.float64)


def solve_as(drape, preset, meanwhile=lambda _part: None):
    """By this preset from now on; frames go on meanwhile. In the last of them cloth and surface are, and go, where they
    are as it comes in force."""
    for part, _ in enumerate(drape.solve_as(preset)):
        meanwhile(part)
        advance(drape, 1)
        state = drape.simulation.state
        last = state.x.numpy().tobytes(), state.v.numpy().tobytes()
    assert part > 3
    state = drape.simulation.state
    assert (state.x.numpy().tobytes(), state.v.numpy().tobytes()) == last, "nothing jumps"
    assert drape.preset == preset


def asked(**more):
    return {**live(), **{name: word_of(name).parameters(given) for name, given in more.items()}}


def bind(drape, wanted):
    for _ in drape.effects.rebind(wanted):
        advance(drape, 1)


def values_of(drape, name):
    return next(c for c in drape.simulation.plan.contributions if c.name == name).values


def judge_of(drape):
    outfit = drape.outfit
    return FrameJudge(outfit.faces, outfit.body.faces, drape.cloth_positions(), drape.body_positions())


def test_through_all_presets_while_it_is_worn_nothing_jumps_or_crosses(bag):
    advance(bag, 3)
    judge, garment = judge_of(bag), bag.simulation.scene.garment
    for preset in WAY:
        solve_as(bag, preset)
        assert bag.simulation.settings == PRESETS[preset]
        assert judge.judge(bag.cloth_positions(), bag.body_positions()).clean
        before = bag.cloth_positions()
        for _ in range(3):
            x = advance(bag, 1)
            assert judge.judge(x, bag.body_positions()).clean
        assert np.linalg.norm(x - before, axis=1).max() < 0.01
    assert bag.simulation.scene.garment is garment, "the mesh stays"


@pytest.mark.long
def test_two_garments_over_each_other_go_on_so_too(dressed):
    *_, worn = pickle.loads(dressed).unpacking()
    judge = judge_of(worn)
    for preset in ("live", "draft"):
        solve_as(worn, preset)
        x = advance(worn, 2)
        assert judge.judge(x, worn.body_positions()).clean
    assert worn.names == ("inner", "outer")


def test_effects_stay_with_the_values_that_they_are_at_and_go_to(bag):
    """An elastic line that is on its way, and another value that is written to it while the preset is built."""
    bind(bag, asked(elastic={"lines": [{"along": HEM, "ratio": 0.9, "stiffness": 60.0}], "ramp": 1.0}))
    advance(bag, 3)
    other = asked(elastic={"lines": [{"along": HEM, "ratio": 0.95, "stiffness": 60.0}], "ramp": 0.5})
    solve_as(bag, "live", lambda part: bag.effects.write(other) if part == 2 else None)
    assert bag.effects.asked == other
    at = float(values_of(bag, "elastic")["ratio"].numpy()[0])
    assert 0.9 < at < 1.0
    advance(bag, 20)
    assert float(values_of(bag, "elastic")["ratio"].numpy()[0]) == pytest.approx(0.95)


def test_an_edit_that_comes_meanwhile_is_worn_and_can_go_on(bag):
    wider = apply(bag.specification, parse_edit({"kind": "scale_piece", "panel": "front", "factors": [1.0, 1.05]}))
    widest = apply(bag.specification, parse_edit({"kind": "scale_piece", "panel": "front", "factors": [1.0, 1.1]}))

    def edited(part):
        if part == 2:
            assert bag.reshape(wider.specification) == ""

    solve_as(bag, "live", edited)
    assert bag.reshape(widest.specification) == ""
    advance(bag, 60)
    assert not bag.on_the_way
    corners = bag.simulation.scene.garment.uv_corners
    front = bag.outfit.panel_of_face == bag.outfit.panel_names.index("front")
    assert np.ptp(corners[front][..., 1]) == pytest.approx(0.44, rel=0.02)
    assert bag.preset == "live"


def test_what_was_bought_stays_and_the_caveat_of_few_iterations_goes(bag):
    bag.buy(1e-4, 0.5)
    assert "friction" in bag.effects.caveats
    solve_as(bag, "live")
    assert (bag.simulation.settings.accuracy, bag.simulation.settings.deadline) == (1e-4, 0.5)
    assert "friction" not in bag.effects.caveats


def test_another_cut_and_another_process_have_it_too(bag):
    solve_as(bag, "live")
    dart = {"kind": "dart", "panel": "front", "edge": 0, "position": 0.5, "width": 0.05, "depth": 0.1}
    cut = apply(bag.specification, parse_edit(dart)).specification
    *_, other = bag.recut(bag.cutting(cut, "cotton_jersey")())
    assert other.preset == "live"
    *_, copy = pickle.loads(pickle.dumps(other.packed())).unpacking()
    assert copy.preset == "live"
    *_, as_fit = other.packed().solved_as("fit").unpacking()
    assert as_fit.preset == "fit"
    advance(as_fit, 1)


def test_what_fails_halfway_leaves_all_as_it_was(bag, monkeypatch):
    simulation = bag.simulation
    with monkeypatch.context() as patched:
        patched.setitem(PRESETS, "stiff", PRESETS["live"].__class__(d_hat=4e-3))
        with pytest.raises(ValueError, match=r"settings\.d_hat"):
            list(bag.solve_as("stiff"))
    assert bag.simulation is simulation
    advance(bag, 1)


def test_at_most_one_frame_is_missed_while_it_is_built(hung):
    """In the loop of a session, where a frame and each part of another scene take half of the time between frames."""
    clocks = []

    def build(_order, _progress):
        *_, drape = pickle.loads(hung).unpacking()
        advance, solve_as = drape.advance, drape.solve_as

        def advancing(*args):
            clocks[0].now += 0.5 / FRAMES_PER_SECOND
            return advance(*args)

        def slowly(preset):
            for part in solve_as(preset):
                clocks[0].now += 0.5 / FRAMES_PER_SECOND
                yield part

        drape.advance, drape.solve_as = advancing, slowly
        return drape

    script = [(0.001, Run(True)), (0.001, allow(1000)), (0.5, BuyAccuracy(preset="fit")), (2.0, BuyAccuracy())]
    connection = work(script, 3.5, motion=None, build=build, begun=clocks.append)
    told = [event for event in connection.events if isinstance(event, PresetInForce)]
    assert told == [PresetInForce("draft"), PresetInForce("fit", "fit"), PresetInForce("draft")]
    seen = frames(connection)
    assert len(seen) > 100
    assert np.diff([frame.seq for frame in seen]).tolist() == [1] * (len(seen) - 1)
    steps = np.rint(np.diff([frame.t_sim for frame in seen[1:]]) * FRAMES_PER_SECOND)
    assert steps.max() <= 2, "at most one is missed at a time"
