"""Other effects while a garment is worn: it goes on from the very state that it was in, and the effect acts from there.

The scene is a square of cloth that slides over a ball and is held by friction.
"""

import numpy as np
import pytest
from frame_judge import FrameJudge
from small_scenes import STILL, icosphere, rigid_body, sheet

from tryon_solver.contact.found import Found
from tryon_solver.rebind import take_over, with_effects
from tryon_solver.scene import LIVE, AirDrag, Pressure, Scene, Wind
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.clocked_contact import FIRST_ROOM

DT = 1 / 60
CALM = tuple(effect for effect in LIVE if not isinstance(effect, AirDrag))
BLOWN = (*CALM, Wind((0.0, 0.0, 3.0)))
# m in ten frames: contacts that are listed anew are summed in another order, which float32 has at the ninth digit of
# forces, and what slides follows them; a gram's weight is 1e-2 N, and a step of 1/60 s moves it by 1e-6 of 3 mm
ROUNDING = 1e-5


def dress(effects):
    garment, x = sheet(13, 13, 0.3, 0.3)
    ball, faces = icosphere(0.1, 3)
    x = x + np.array([0.03, 0.104, -0.02])
    return build(Scene(garment, x, rigid_body(ball, faces), effects=effects), PRESETS["draft"], "cpu", STILL)


def advance(sim, frames):
    for _ in range(frames):
        sim.advance(STILL, sim.state.time + DT)
    return sim.cloth_positions().astype(np.float64)


def rebound(worn, effects, meanwhile=0):
    """With these effects, taken over after so many frames in which it was built."""
    parts = []
    for part in with_effects(worn, effects):
        if len(parts) < meanwhile:
            advance(worn, 1)
        parts.append(part)
    take_over(parts[-1], worn)
    return parts[-1]


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

    def noted(pairs, stencils, device):
        rooms.append(max(pairs, stencils))
        return allocate(pairs, stencils, device)

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
