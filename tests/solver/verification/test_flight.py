"""Cloth that nothing but itself touches flies, beside a body, other pieces or none, against closed forms of implicit
Euler.

The ball is of 642 vertices with edges of 7.5 mm. Before it went as one its falls of more than six edges a step were
braked, so that it came to a floor 1.2 m below at 0.53 s at `live`, 60 times a second, and at 0.90 s at `draft`, 30.
"""

from dataclasses import replace

import numpy as np
import pytest
from frame_judge import FrameJudge
from scipy.spatial.transform import Rotation
from small_scenes import STILL, flattened, icosphere, rigid_body, sheet, slab

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.rebind import take_over, with_effects
from tryon_solver.scene import AirDrag, BodyContact, Fasteners, Gas, Gravity, Pins, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.leap import FALLEN

G = 9.81
ULP = 2.0**-23  # of a metre, half the spacing of float32 between 1 and 2 m
RADIUS = 0.05  # m
STEP = {"draft": 1 / 30, "live": 1 / 60}  # s
TOUCHING = (Gravity((0.0, -G, 0.0)), BodyContact(), SelfContact())


def ball(place, subdivisions=3):
    """A closed surface, flat at rest nowhere but in its own shape, around `place`."""
    x, faces = icosphere(RADIUS, subdivisions)
    return Garment(faces, flattened(x, faces), np.zeros(len(faces), np.int32), len(x)), x + place


def together(*parts):
    """One garment of several pieces, each a panel."""
    counts = np.cumsum([0, *(len(x) for _, x in parts)])
    return Garment(
        np.vstack([garment.faces + start for (garment, _), start in zip(parts, counts)]).astype(np.int32),
        np.vstack([garment.uv_corners for garment, _ in parts]),
        np.concatenate([np.full(len(garment.faces), k, np.int32) for k, (garment, _) in enumerate(parts)]),
        int(counts[-1]),
    ), np.vstack([x for _, x in parts])


def over_floor(parts, effects, preset):
    """On and over a floor whose upper side is at height 0."""
    garment, x = together(*parts)
    floor = rigid_body(*slab(1.0, 1.0, 0.05, 0.1))
    return build(Scene(garment, x, floor, FABRICS["cotton_jersey"], effects), PRESETS[preset], "cpu", STILL)


def risen(time):
    """The floor, which goes up at 0.3 m/s."""
    return replace(STILL, root=np.array([0.0, 0.3 * time, 0.0]))


def judge_of(sim):
    """Of its cloth on its body."""
    scene = sim.scene
    return FrameJudge(scene.garment.faces, scene.body.faces, sim.cloth_positions(), sim.body_positions())


def mean_velocity(sim):
    """(3,) float64 m/s, of the cloth's mass: what has it bend, as in its rest shape, has no part in it."""
    return (sim.mass[:, None] * sim.state.v.numpy()).sum(0) / sim.mass.sum()


def rounding(steps, dt):
    """m/s: each step's rounding of coordinates below 2 m is carried on."""
    return 4 * steps * ULP / dt


@pytest.mark.parametrize("gas", [False, True], ids=["cloth", "gas"])
@pytest.mark.parametrize("preset", ["draft", "live"])
def test_a_ball_comes_to_the_floor_when_implicit_euler_does(preset, gas):
    """v_n = -g n dt until the step that would lead through the floor, y_n = y_0 - g dt^2 n (n + 1)/2; in that step it
    comes to it, all of it by the same way, and crosses nothing; and it comes to rest unstrained."""
    height, dt = 1.2, STEP[preset]
    sim = over_floor([ball([0.0, height + RADIUS, 0.0])], (*TOUCHING, Gas()) if gas else TOUCHING, preset)
    judge, most = judge_of(sim), sim.contact.sizes.xi_body + sim.contact.sizes.d_hat
    landing = next(n for n in range(1, 99) if G * dt**2 * n * (n + 1) / 2 > height - most)
    for n in range(1, landing):
        report = sim.advance(STILL, n * dt)
        assert n < 4 or sim.candidates.size < sim.cloth_count, "once it flies, nothing is near it"
        np.testing.assert_allclose(mean_velocity(sim), [0.0, -G * n * dt, 0.0], rtol=0, atol=rounding(n, dt))
        assert report.error < 1e-5, "m"
    assert G * landing * dt > 6 * sim.mean_edge / dt, "faster than what was braked"
    before = sim.cloth_positions()
    report = sim.advance(STILL, landing * dt)
    way = sim.x_carried.numpy()[: sim.cloth_count] - before
    assert way[:, 1].max() < -0.1 * G * landing * dt**2, "it went"
    assert np.ptp(way, axis=0).max() < 4 * ULP, "as one"
    assert report.pairs > 0
    assert sim.cloth_positions()[:, 1].min() < most
    assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    for n in range(landing + 1, landing + 7):
        report = sim.advance(STILL, n * dt)
        assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    assert abs(mean_velocity(sim)[1]) < 0.1 * G * landing * dt, "it has come down"
    assert report.max_stretch < 1.05


def test_what_flies_above_another_stops_when_that_does():
    """A patch falls with a ball of air, 1.3 mm above it: on their ways nothing is between them, until the ball stops
    short of the floor. Vertex by vertex both were stretched to 5 and 7 then, and the step was void."""
    dt, height = STEP["live"], 1.2
    patch, x = sheet(5, 5, 0.02, 0.02)
    parts = [ball([0.0, height + RADIUS, 0.0]), (patch, x + [0.0, height + 2 * RADIUS + 1.3e-3, 0.0])]
    sim = over_floor(parts, (*TOUCHING, Gas(panels=(0,))), "live")
    judge, flew, landed = judge_of(sim), False, False
    for n in range(1, 35):
        report = sim.advance(STILL, n * dt)
        flew = flew or bool(sim.flight.flies.numpy().all())
        landed = landed or report.pairs > 0
        assert report.retries == 0
        assert report.max_stretch < 1.25
        assert not landed or judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    assert flew
    assert landed


def test_one_piece_flies_while_another_lies():
    """A sheet lies on a floor that goes up, where the ball falls beside it: that is touched, and goes with the
    floor."""
    dt, steps = STEP["live"], 26
    cloth, x = sheet(13, 13, 0.3, 0.3)
    sim = over_floor([(cloth, x + [-0.3, 0.0035, 0.0]), ball([0.3, 1.2, 0.0])], TOUCHING, "live")
    falls = np.arange(sim.cloth_count) >= len(x)
    for n in range(1, steps + 1):
        report = sim.advance(risen(n * dt), n * dt)
        assert n < 4 or (sim.flight.flies.numpy()[sim.flight.piece_of.numpy()] == falls).all()
    assert report.pairs > 0
    v = sim.state.v.numpy()
    np.testing.assert_allclose(v[falls, 1].mean(), -G * steps * dt, rtol=0, atol=rounding(steps, dt))
    lying = sim.cloth_positions()[~falls] - (x + [-0.3, 0.0035, 0.0])
    np.testing.assert_allclose(lying, np.broadcast_to([0.0, 0.3 * steps * dt, 0.0], lying.shape), rtol=0, atol=2e-3)


@pytest.mark.parametrize("outside", ["drag", "pins"])
def test_the_way_is_as_long_as_what_is_outside_lets_it_be(outside):
    """v_{n+1} = (v_n + dt g)/(1 + dt c/rho) in air that drags; by pins of stiffness k that were let go a way u ago,
    v_{n+1} = (v_n + dt (g - k u_n/m))/(1 + dt^2 k/m)."""
    drag, stiffness, dt, steps = 3.0, 2.0, STEP["draft"], 12
    garment, x = ball([0.0, 1.2, 0.0])
    held = {"drag": AirDrag(drag), "pins": Pins(np.arange(len(x)), stiffness / len(x))}[outside]
    sim = over_floor([(garment, x)], (*TOUCHING, held), "draft")
    mass = sim.mass.sum()
    speed, way, flew = 0.0, 0.0, False
    for n in range(1, steps + 1):
        sim.advance(STILL, n * dt)
        flew = flew or bool(sim.flight.flies.numpy().any())
        if outside == "drag":
            speed = (speed + dt * G) / (1 + dt * drag * sim.area.sum() / mass)
        else:
            speed = (speed + dt * (G - stiffness * way / mass)) / (1 + dt**2 * stiffness / mass)
        way += dt * speed
        np.testing.assert_allclose(mean_velocity(sim), [0.0, -speed, 0.0], rtol=0, atol=1e-3)
    assert flew


def test_what_flies_feels_nothing_of_a_body_that_comes_by():
    """A floor that from one step to the next goes sideways at 4 m/s, which no body does: the ball falls straight down.
    What the floor would have carried it by is what it counts as having felt."""
    dt, steps = STEP["live"], 18
    sim = over_floor([ball([0.0, 1.2, 0.0])], TOUCHING, "live")
    still, speed = 10, np.array([4.0, -0.5, 0.0])
    assert np.linalg.norm(speed) > sim.settings.hardest_kick
    for n in range(1, steps + 1):
        sim.advance(replace(STILL, root=max(n - still, 0) * dt * speed), n * dt)
        assert n < still or sim.flight.flies.numpy().all()
        np.testing.assert_allclose(mean_velocity(sim), [0.0, -G * n * dt, 0.0], rtol=0, atol=rounding(n, dt))
        if n == still + 1:
            felt = sim.body.felt.numpy()[: sim.cloth_count]
            assert (np.linalg.norm(felt, axis=1) < sim.settings.hardest_kick).all()
    felt = sim.body.felt.numpy()[: sim.cloth_count]
    np.testing.assert_allclose(felt, np.broadcast_to(speed, felt.shape), rtol=0, atol=1e-3)


def passing(place, effects, preset):
    """How far cloth beside the way of a ball that goes by at 3 m/s, half a metre off, and does not touch it, is from
    where it was, at most [m]: a closed ball, or with Pins a flag that hangs by its upper side."""
    dt, steps = STEP[preset], round(0.8 / STEP[preset])
    if Pins in effects:
        garment, x = sheet(13, 13, 0.2, 0.2)
        x = x[:, [0, 2, 1]] * [1.0, -1.0, 1.0] + place
        top = np.flatnonzero(x[:, 1] > x[:, 1].max() - 1e-6)
        effects = (Gravity(), BodyContact(), SelfContact(), AirDrag(), Pins(top))
    else:
        garment, x = ball(place)
    scene = Scene(garment, x, rigid_body(*icosphere(0.12, 2)), FABRICS["cotton_jersey"], effects)
    sim = build(scene, PRESETS[preset], "cpu", STILL)
    farthest = 0.0
    for n in range(1, steps + 1):
        gone = 3.0 * max(n * dt - 0.3, 0.0)
        report = sim.advance(replace(STILL, root=np.array([-gone, 0.0, 0.0])), n * dt)
        farthest = max(farthest, float(np.linalg.norm(sim.cloth_positions() - x, axis=1).max()))
        assert report.pairs == 0
    return farthest


@pytest.mark.parametrize("preset", ["draft", "live"])
@pytest.mark.parametrize("effects", [(BodyContact(), SelfContact()), (Pins,)], ids=["ball", "flag"])
def test_what_rests_in_the_room_stays_while_a_body_goes_by(effects, preset):
    """The root's motion took it along, and what the solve was not granted of the way back it was dragged: the ball by
    104 to 127 mm, the flag by 21 and 86."""
    assert passing([0.0, 0.0, 0.5], effects, preset) < 2e-3


def test_what_the_body_leads_goes_along_with_it():
    """Pins that it leads hang on where the root takes them before the solve does."""
    cloth, x = sheet(9, 9, 0.2, 0.2)
    leading = BodyContact(), Pins(np.arange(9), led=True)
    scene = Scene(cloth, x + [0.0, 0.3, 0.0], rigid_body(*icosphere(0.05, 2)), FABRICS["denim"], leading)
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    for n in range(1, 5):
        sim.advance(replace(STILL, root=np.array([0.05 * n, 0.0, 0.0])), n * STEP["live"])
        assert not sim.flight.flies.numpy().any()


@pytest.mark.parametrize("preset", ["draft", "live"])
@pytest.mark.parametrize("apart", [0.004, 0.5])
def test_a_piece_falls_freely_below_one_that_hangs(apart, preset):
    """With no body about. All went by one common way, and what of a fall was not granted stopped it: at 8 mm an edge it
    hung in the air from 3.2 m/s on, 30 times a second."""
    dt, steps = STEP[preset], round(0.8 / STEP[preset])
    cloth, flat = sheet(21, 21, 0.2, 0.2)
    x = flat[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    garment, start = together((cloth, x), (cloth, x - [0.0, 0.2 + apart, 0.0]))
    held = np.flatnonzero(start[: len(x), 1] > start[:, 1].max() - 1e-6)
    effects = (Gravity((0.0, -G, 0.0)), SelfContact(), Pins(held))
    scene = Scene(garment, start, None, FABRICS["cotton_jersey"], effects)
    sim = build(scene, PRESETS[preset], "cpu")
    for n in range(1, steps + 1):
        report = sim.advance(None, n * dt)
    fell = sim.state.v.numpy()[len(x) :]
    np.testing.assert_allclose(fell.mean(0), [0.0, -G * steps * dt, 0.0], rtol=0, atol=5e-2)
    assert np.abs(sim.state.v.numpy()[: len(x)]).max() < 0.1
    assert report.error < 1e-4


def test_pieces_that_go_by_themselves_keep_their_own_momentum():
    """One is thrown up above one at rest, with no body and nothing between: both had gone by what is common to all."""
    dt, steps, up = STEP["draft"], 12, 4.0
    cloth, flat = sheet(21, 21, 0.2, 0.2)
    garment, start = together((cloth, flat + [0.0, 0.5, 0.0]), (cloth, flat))
    scene = Scene(garment, start, None, FABRICS["cotton_jersey"], (Gravity((0.0, -G, 0.0)), SelfContact()))
    sim = build(scene, PRESETS["draft"], "cpu")
    v = sim.state.v.numpy()
    v[: len(flat)] = [0.0, up, 0.0]
    sim.state.v.assign(v)
    for n in range(1, steps + 1):
        sim.advance(None, n * dt)
        v = sim.state.v.numpy()
        np.testing.assert_allclose(v[: len(flat)].mean(0), [0.0, up - G * n * dt, 0.0], rtol=0, atol=1e-2)
        np.testing.assert_allclose(v[len(flat) :].mean(0), [0.0, -G * n * dt, 0.0], rtol=0, atol=1e-2)


def test_what_an_open_button_would_join_flies_by_itself():
    """A ball beside a sheet that lies on the floor: closed, it holds it; from when it is opened on, the ball gains what
    gravity gives."""
    dt = STEP["live"]
    cloth, x = sheet(9, 9, 0.2, 0.2)
    parts = [(cloth, x + [-0.3, 0.0035, 0.0]), ball([0.3, 2.0, 0.0])]
    button = np.array([[0, len(x)]], np.int32)
    sim = over_floor(parts, (*TOUCHING, Fasteners(button, 1.0)), "live")
    of_ball = sim.flight.piece_of.numpy()[-1]
    closed = next(c for c in sim.plan.contributions if c.name == "fasteners").values["closed"]
    for n in range(1, 21):
        sim.advance(STILL, n * dt)
        assert not sim.flight.flies.numpy().any()
    closed.zero_()
    speeds = []
    for n in range(21, 33):
        sim.advance(STILL, n * dt)
        speeds.append(sim.state.v.numpy()[len(x) :, 1].mean())
        assert n < 23 or sim.flight.flies.numpy()[of_ball] == 1
    np.testing.assert_allclose(np.diff(speeds[3:]), -G * dt, rtol=0, atol=1e-3)


def test_what_is_near_and_comes_along_does_not_fly():
    """A garment that nobody sees yet goes with the body whatever it was about to do, and has its speed then: what is
    loose and untouched for a moment would be left behind by a body that is led elsewhere."""
    dt, steps = STEP["live"], 18
    sim = over_floor([ball([0.0, 1.2, 0.0])], TOUCHING, "live")
    for n in range(1, steps + 1):
        sim.advance(STILL, n * dt)
    assert sim.flight.flies.numpy().all()
    before = sim.cloth_positions().mean(0)
    assert before[1] < FALLEN
    sim.come_along()
    sim.advance(replace(STILL, root=np.array([0.05, 0.0, 0.0])), (steps + 1) * dt)
    assert not sim.flight.flies.numpy().any()
    np.testing.assert_allclose(sim.cloth_positions().mean(0) - before, [0.05, -G * dt**2, 0.0], rtol=0, atol=1e-3)


def fallen(*others):
    """A sheet that lies on the floor, a ball in the air 1.25 m beside it, and others; at `live`."""
    cloth, x = sheet(9, 9, 0.2, 0.2)
    parts = [(cloth, x + [-0.3, 0.0035, 0.0]), ball([0.0, 0.5, 1.8], 2), *others]
    return over_floor(parts, TOUCHING, "live"), len(x)


def turned(degrees):
    """The floor, turned about the vertical."""
    return replace(STILL, rotations=Rotation.from_euler("y", [degrees], degrees=True).as_quat())


def test_what_has_fallen_off_keeps_its_way_and_its_velocity_where_the_rest_comes_along():
    """The floor turns by 6 degrees in each step, by 11 m/s where the ball falls. What lies on it lies as it would with
    no ball about, and has the floor's speed."""
    dt, falling, steps = STEP["live"], 12, 16
    cloth, x = sheet(9, 9, 0.2, 0.2)
    (sim, lie), alone = fallen(), over_floor([(cloth, x + [-0.3, 0.0035, 0.0])], TOUCHING, "live")
    start = sim.cloth_positions()[lie:].mean(0)
    for n in range(1, steps + 1):
        for one in (sim, alone):
            if n > falling:
                one.come_along()
            one.advance(turned(6.0 * max(n - falling, 0)), n * dt)
        v, x = sim.state.v.numpy(), sim.cloth_positions()
        np.testing.assert_allclose(v[lie:].mean(0), [0.0, -G * n * dt, 0.0], rtol=0, atol=2 * rounding(n, dt))
        way = x[lie:].mean(0) - start
        np.testing.assert_allclose(way, [0.0, -G * dt**2 * n * (n + 1) / 2, 0.0], rtol=0, atol=8 * n * ULP)
        np.testing.assert_allclose(x[:lie], alone.cloth_positions(), rtol=0, atol=1e-4)
        np.testing.assert_allclose(v[:lie], alone.state.v.numpy(), rtol=0, atol=1e-4 / dt)
    assert v[:lie, 2].max() > 1.0, "m/s"


@pytest.mark.parametrize("along", [True, False])
def test_what_has_fallen_off_goes_on_so_in_another_simulation(along):
    """As in one that was made beside the stream: no step of its own has told who is touched. Of two patches that touch
    each other that is found where it begins, and they do not fly, however far off they are."""
    dt, patch, speed = STEP["live"], sheet(5, 5, 0.1, 0.1), np.array([0.5, -2.0, 0.0])
    sim, lie = fallen(*((patch[0], patch[1] + [1.8, height, 0.0]) for height in (0.5, 0.5012)))
    of, before = sim.flight.piece_of.numpy(), sim.cloth_positions()
    falls = of == of[lie]
    sim.state.v.assign(np.where(np.arange(len(of))[:, None] < lie, 0.0, speed))
    if along:
        sim.come_along()
    sim.advance(turned(6.0), dt)
    assert sim.flight.flies.numpy().tolist() == [int(piece == of[lie]) for piece in range(4)]
    velocity = sim.state.v.numpy()[falls].mean(0)
    settled = sim.settings.correction_tolerance  # m/s: the correction of those that touch moves all by up to this
    np.testing.assert_allclose(velocity, speed - [0.0, G * dt, 0.0], rtol=0, atol=settled)
    way = sim.cloth_positions()[falls].mean(0) - before[falls].mean(0)
    np.testing.assert_allclose(way, dt * velocity, rtol=0, atol=8 * ULP)
    felt = sim.body.felt.numpy()[: len(of)][falls]
    assert np.linalg.norm(felt, axis=1).max() < sim.settings.hardest_kick, "to land is no jerk of the body"


def test_under_other_effects_it_flies_on_and_what_lies_does_not():
    """A simulation that takes over has collected no pairs yet; who is touched is told by those of the one before."""
    dt, steps = STEP["live"], 22
    cloth, x = sheet(9, 9, 0.2, 0.2)
    worn = over_floor([(cloth, x + [-0.3, 0.0035, 0.0]), ball([0.3, 1.2, 0.0])], TOUCHING, "live")
    for n in range(1, steps + 1):
        worn.advance(risen(n * dt), n * dt)
    *_, sim = with_effects(worn, (*TOUCHING, AirDrag(1e-6)))
    take_over(sim, worn)
    expected = worn.flight.flies.numpy()
    assert sorted(expected) == [0, 1]
    sim.advance(risen((steps + 1) * dt), (steps + 1) * dt)
    assert sim.flight.flies.numpy().tolist() == expected.tolist()
    fell = sim.state.v.numpy()[len(x) :, 1]
    assert np.abs(fell + G * (steps + 1) * dt).max() < 1e-3, "m/s: of the drag there is hardly any"
