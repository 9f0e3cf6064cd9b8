"""Other effects, and other settings, while a garment is worn: it goes on from the very state that it was in, and they
act from there.

The scene is a square of cloth that slides over a ball and is held by friction.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from frame_judge import FrameJudge
from small_scenes import STILL, icosphere, rigid_body, sheet

from tryon_solver.contact.found import Found
from tryon_solver.rebind import HANGS_BY, take_over, with_effects, with_settings
from tryon_solver.scene import LIVE, AirDrag, Pressure, Scene, Wind
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build
from tryon_solver.stepping.clocked_contact import FIRST_ROOM

DT = 1 / 60
CALM = tuple(effect for effect in LIVE if not isinstance(effect, AirDrag))
BLOWN = (*CALM, Wind((0.0, 0.0, 3.0)))
# m in ten frames: contacts that are listed anew are summed in another order, which float32 has at the ninth digit of
# forces, and what slides follows them; a gram's weight is 1e-2 N, and a step of 1/60 s moves it by 1e-6 of 3 mm
ROUNDING = 1e-5
STATE = ("x", "x_committed", "x_start", "x_feasible", "v", "skin", "hold")


def dress(effects, preset="draft"):
    garment, x = sheet(13, 13, 0.3, 0.3)
    ball, faces = icosphere(0.1, 3)
    x = x + np.array([0.03, 0.104, -0.02])
    return build(Scene(garment, x, rigid_body(ball, faces), effects=effects), PRESETS[preset], "cpu", STILL)


def advance(sim, frames):
    for _ in range(frames):
        sim.advance(STILL, sim.state.time + DT)
    return sim.cloth_positions().astype(np.float64)


def rebound(worn, effects, meanwhile=0):
    """With these effects, taken over after so many frames in which it was built."""
    return taken_over(with_effects(worn, effects), worn, meanwhile)


def switched(worn, settings, meanwhile=0):
    """The same with these settings."""
    return taken_over(with_settings(worn, settings), worn, meanwhile)


def taken_over(building, worn, meanwhile):
    parts = []
    for part in building:
        if len(parts) < meanwhile:
            advance(worn, 1)
        parts.append(part)
    made = parts[-1]
    for name in STATE:  # what is not taken over shows
        getattr(made.state, name).fill_(np.nan)
    take_over(made, worn)
    return made


@pytest.fixture
def sliding():
    sim = dress(LIVE)
    advance(sim, 20)
    ids, given = sim.stages.contact[0].kept()
    assert len(ids) > 20
    assert np.abs(given).max() > 1e-6, "contacts hold"
    return sim


def test_under_the_same_effects_it_goes_on_as_it_would_have(sliding):
    other = rebound(sliding, LIVE, meanwhile=4)
    assert other.state.time == sliding.state.time
    assert np.array_equal(other.state.x.numpy(), sliding.state.x.numpy())
    assert np.array_equal(other.state.v.numpy(), sliding.state.v.numpy())
    for one, two in zip(other.stages.contact[0].kept(), sliding.stages.contact[0].kept()):
        assert np.array_equal(one, two)
    before = sliding.cloth_positions()
    ours, theirs = advance(other, 10), advance(sliding, 10)
    assert np.abs(theirs - before).max() > 1e-3, "it moves"
    assert np.abs(ours - theirs).max() < ROUNDING


def test_friction_is_not_forgotten(sliding):
    """Without what contacts have given it would creep, farther than by rounding."""
    other = rebound(sliding, LIVE)
    ids, _ = other.stages.contact[0].kept()
    other.stages.contact[0].restore(ids[:0], np.zeros((0, 3), np.float32))
    assert np.abs(advance(other, 10) - advance(sliding, 10)).max() > ROUNDING


def test_an_effect_acts_from_then_on_and_nothing_jumps_or_crosses(sliding):
    blown = rebound(sliding, BLOWN)
    speed = float(np.linalg.norm(sliding.state.v.numpy(), axis=1).max())
    before, surface = (found.astype(np.float64) for found in (sliding.cloth_positions(), sliding.body_positions()))
    judge = FrameJudge(sliding.scene.garment.faces, sliding.scene.body.faces, before, surface)
    first = advance(blown, 1)
    assert np.linalg.norm(first - before, axis=1).max() < DT * (speed + 9.81 * DT + 3.0), "as wind and weight have it"
    for _ in range(20):
        x = advance(blown, 1)
        assert judge.judge(x, blown.body_positions().astype(np.float64)).clean
    assert (x - advance(sliding, 21))[:, 2].mean() > 100 * ROUNDING, "the wind carries it along"


def test_contact_is_looked_for_where_the_garment_is(sliding, monkeypatch):
    """What has not looked yet has all vertices in one place, where every triangle is near every other: of a T-shirt
    that is room for gigabytes of them."""
    rooms, allocate = [], Found.allocate

    def noted(of_each, device):
        rooms.append(max(of_each))
        return allocate(of_each, device)

    monkeypatch.setattr(Found, "allocate", noted)
    *_, other = with_effects(sliding, BLOWN)
    assert other.region is not sliding.region, "it looks for itself from now on"
    known = max(sliding.candidates.size, FIRST_ROOM)
    assert 0 < max(rooms) <= 4 * known, "room for about as many as are known already"


def test_values_that_were_written_stay(sliding):
    windy = rebound(sliding, BLOWN)
    values = next(c for c in windy.plan.contributions if c.name == "wind").values
    values["velocity"].fill_((1.0, 0.0, 0.0))
    advance(windy, 1)
    again = rebound(windy, (*BLOWN, Pressure(2.0)))
    kept = next(c for c in again.plan.contributions if c.name == "wind").values
    assert tuple(kept["velocity"].numpy()[0]) == (1.0, 0.0, 0.0)
    assert kept["clock"].numpy()[0] == values["clock"].numpy()[0] > 0


def test_it_wakes_what_sleeps(sliding):
    sliding.state.asleep = True
    assert not rebound(sliding, LIVE).state.asleep


def test_effects_that_do_not_suit_are_refused_before_anything_is_built(sliding):
    with pytest.raises(ValueError, match="two laws of the same air"):
        next(with_effects(sliding, (*LIVE, Wind())))


WAY = ("draft", "live", "fit", "reference", "draft")


def built_there(worn, settings):
    """A simulation built with these settings where the worn one is, which knows of how it came to be there only where
    it went in the last two steps."""
    x, surface = (found.astype(np.float64) for found in (worn.cloth_positions(), worn.body_positions()))
    sim = build(replace(worn.scene, x_start=x), settings, "cpu", STILL, surface)
    for name in ("v", "skin", "hold"):
        getattr(sim.state, name).assign(getattr(worn.state, name).numpy())
    sim.state.time = worn.state.time
    sim.stages.contact[0].restore(*worn.stages.contact[0].kept())
    sim.solved.assign(worn.solved.numpy())
    sim.lead.begin_as(worn.lead)
    return sim


@pytest.mark.parametrize(("before", "after"), list(pairwise(WAY)))
def test_under_another_preset_it_goes_on_from_where_it_is_as_if_built_there(before, after):
    worn = dress(LIVE, before)
    advance(worn, 20)
    made = switched(worn, PRESETS[after], meanwhile=4)
    for name in STATE:
        assert getattr(made.state, name).numpy().tobytes() == getattr(worn.state, name).numpy().tobytes(), name
    assert made.state.time == worn.state.time
    assert made.settings == PRESETS[after]
    for one, two in zip(made.stages.contact[0].kept(), worn.stages.contact[0].kept()):
        assert np.array_equal(one, two)
    other = built_there(worn, PRESETS[after])
    ours, theirs, unchanged = (advance(sim, 3) for sim in (made, other, worn))
    assert np.array_equal(ours, theirs)
    assert not np.array_equal(ours, unchanged), "the presets differ"


def test_through_all_presets_nothing_jumps_or_crosses(sliding):
    worn = sliding
    before, surface = (found.astype(np.float64) for found in (worn.cloth_positions(), worn.body_positions()))
    judge = FrameJudge(worn.scene.garment.faces, worn.scene.body.faces, before, surface)
    for preset in WAY[1:]:
        speed = float(np.linalg.norm(worn.state.v.numpy(), axis=1).max())
        other = switched(worn, PRESETS[preset])
        assert judge.judge(other.cloth_positions().astype(np.float64), surface).clean
        for number in range(8):
            x = advance(other, 1)
            assert judge.judge(x, other.body_positions().astype(np.float64)).clean
            went = np.linalg.norm(x - before, axis=1).max()
            assert number > 0 or went < DT * (speed + 9.81 * DT), "as speed and weight have it"
        worn, before = other, x


def test_its_first_steps_wait_for_no_matrices(sliding, monkeypatch):
    """They are as long as the new settings cut a frame, for which the inverse was made beside."""
    worn = sliding
    advance(worn, 1)
    for preset, steps in (("fit", 2), ("draft", 1), ("live", 1), ("reference", 2)):
        made = switched(worn, PRESETS[preset], meanwhile=2)
        with monkeypatch.context() as patched:
            patched.setattr(Simulation, "reduced_inverse", lambda _: pytest.fail("a frame waits for an inverse"))
            advance(made, 1)
        assert made.counters.steps == steps
        worn = made


def test_steps_that_were_asked_to_be_longer_stay_so(sliding):
    """As one that can't keep up with a clock asks for them."""
    sliding.advance(STILL, sliding.state.time + 1 / 15, 1 / 15)
    made = switched(sliding, PRESETS["fit"])
    assert made.dt == pytest.approx(1 / 15)


def test_bought_accuracy_and_deadline_stay_under_another_preset(sliding):
    sliding.buy(1e-4, None)
    building = with_settings(sliding, PRESETS["live"])
    next(building)
    sliding.buy(2e-4, 0.05)  # while it is built
    *_, made = building
    take_over(made, sliding)
    assert made.settings == replace(PRESETS["live"], accuracy=2e-4, deadline=0.05)
    assert made.pace is sliding.pace, "what parts take is known"
    advance(made, 1)
    sliding.buy(None, None)
    unhurried = switched(sliding, PRESETS["draft"])
    unhurried.buy(None, 0.05)
    assert unhurried.pace is sliding.hurried


@pytest.mark.parametrize("name", HANGS_BY)
def test_settings_that_would_move_it_are_refused_before_anything_is_built(sliding, name):
    moved = replace(PRESETS["live"], **{name: 1.5 * getattr(PRESETS["live"], name)})
    with pytest.raises(ValueError, match=rf"settings\.{name} is .*leave it as it is, or dress the garment anew"):
        next(with_settings(sliding, moved))
    assert len({getattr(preset, name) for preset in PRESETS.values()}) == 1


def test_another_spacing_has_a_subspace_of_its_own(sliding):
    made = switched(sliding, replace(PRESETS["draft"], subspace_spacing=2.0))
    assert made.basis.shape[1] > sliding.basis.shape[1]
    assert switched(sliding, PRESETS["live"]).basis is sliding.basis
    advance(made, 1)
