"""What is worn comes to where it hangs in another outfit before that takes its place: drawn there, under contact, on a
body that goes on."""

import pickle

import numpy as np
import pytest
from frame_judge import FrameJudge
from scipy.spatial.transform import Rotation

from tryon_server.app import BUILT_IN_PATTERNS
from tryon_server.runtime import production
from tryon_server.runtime.catching_up import CatchingUp, caught_up, taken_off_for
from tryon_server.runtime.order import DrapeOrder, GarmentOrder
from tryon_server.runtime.sources import LONGEST_MOVE
from tryon_solver.body.pose import Pose
from tryon_solver.drawn import FASTEST, in_both, left_after, seconds_for
from tryon_solver.effects.drawn import bind as bind_drawn
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.plain import parse_edit

STEP = 1 / 30


def order(folder, *names):
    innermost, *over = (GarmentOrder(name, BUILT_IN_PATTERNS / f"{name}.json", "cotton_jersey") for name in names)
    alone = DrapeOrder(innermost.pattern, innermost.fabric, "draft", "cpu", edge_length=0.05, wardrobe=folder)
    return alone.wearing((innermost, *over))


@pytest.fixture(scope="module")
def dressed(tmp_path_factory):
    """A T-shirt, and the same with a skirt over it, the waist of which gathers its hem."""
    folder = tmp_path_factory.mktemp("dressed")
    orders = [order(folder, "tshirt"), order(folder, "tshirt", "skirt")]
    drapes = [production.build_drape(ordered, tell_nobody) for ordered in orders]
    return [pickle.dumps(drape.packed()) for drape in drapes]


@pytest.fixture
def turned(dressed, tmp_path):
    """A skirt over a T-shirt, and under it."""
    drape = production.build_drape(order(tmp_path, "skirt", "tshirt"), tell_nobody)
    return [list(pickle.loads(packed).unpacking())[-1] for packed in (dressed[1], pickle.dumps(drape.packed()))]


@pytest.fixture
def both(dressed):
    return [list(pickle.loads(packed).unpacking())[-1] for packed in dressed]


def tell_nobody(_stage, _share):
    pass


def raised(drape, k):
    return Pose(drape.pose.root + [0.0, 0.01 * np.sin(0.2 * k), 0.0], drape.pose.rotations)


def judge_of(drape):
    """Judges frames of this drape by ipctk."""
    outfit = drape.outfit
    return FrameJudge(outfit.faces, outfit.body.faces, drape.cloth_positions(), drape.body_positions())


def way_of(drape, pose):
    """Two moves to there."""
    for k in (1, 2):
        yield
        drape.come_along()
        drape.advance(pose(), k * STEP)
    drape.come_along()


def apart(worn, other):
    """How far the T-shirt's vertices are from where the other has them [m]."""
    common = in_both(worn.worn_outfit().outfit, other.worn_outfit().outfit)
    return np.linalg.norm(worn.cloth_positions()[common.vertices] - common.there(other.cloth_positions()), axis=1)


def test_what_is_worn_is_led_over_and_passes_through_nothing(both):
    worn, other = both
    judges = [judge_of(one) for one in both]
    far = apart(worn, other)
    assert far.max() > 0.04, "it would jump"
    moved, led, k = [], 0, 0
    for _ in worn.come_to(other, way_of(other, lambda: worn.stance)):
        k, before = k + 1, worn.cloth_positions().copy()
        worn.advance(raised(worn, k), k * STEP)
        led += any(own.name == "drawn" for own in worn.simulation.plan.contributions)
        moved.append(np.linalg.norm(worn.cloth_positions() - before, axis=1).max())
        for one, judge in zip(both, judges):
            assert judge.judge(one.cloth_positions(), one.body_positions()).clean, k
    frames = seconds_for(far[:, None]) / STEP
    assert frames <= led <= frames + 1.5
    left = apart(worn, other)
    assert np.quantile(left, 0.95) < 0.003
    assert left.max() < 0.2 * far.max()
    assert max(moved) < 0.25 * far.max(), "gently"
    assert other.stance is worn.stance


def test_what_is_worn_in_another_mesh_is_led_to_where_the_same_fabric_hangs(dressed):
    """A T-shirt without its front, which hangs otherwise by now, to where the whole one hangs."""
    whole, other = (list(pickle.loads(dressed[0]).unpacking())[-1] for _ in range(2))
    without = apply(whole.specification, parse_edit({"kind": "remove_piece", "panel": "front"})).specification
    *_, worn = whole.recut(whole.cutting(without, "cotton_jersey")())
    for _ in range(20):
        worn.advance(worn.pose, worn.seconds + STEP)
    far = apart(worn, other)
    assert len(far) == worn.outfit.vertex_count
    assert far.max() > 0.03, "it would jump"
    judge = FrameJudge(worn.outfit.faces, worn.outfit.body.faces, worn.cloth_positions(), worn.body_positions())
    for _ in worn.come_to(other, way_of(other, lambda: worn.stance)):
        worn.advance(worn.pose, worn.seconds + STEP)
        assert judge.judge(worn.cloth_positions(), worn.body_positions()).clean
    assert apart(worn, other).max() < 0.1 * far.max()
    assert other.specification != worn.specification


def test_what_one_of_two_meshes_lacks_is_not_drawn(dressed):
    """The front of a whole T-shirt, to where it hangs without."""
    whole, other = (list(pickle.loads(dressed[0]).unpacking())[-1] for _ in range(2))
    without = apply(whole.specification, parse_edit({"kind": "remove_piece", "panel": "front"})).specification
    *_, other = other.recut(other.cutting(without, "cotton_jersey")())
    common = in_both(whole.worn_outfit().outfit, other.worn_outfit().outfit)
    there = common.there(other.cloth_positions())
    np.testing.assert_allclose(there, whole.cloth_positions()[common.vertices], atol=1e-3)
    names, panels = whole.outfit.panel_names, whole.outfit.panel_of_face
    of_others = np.unique(whole.outfit.faces[panels != names.index("front")])
    assert np.array_equal(np.sort(common.vertices), of_others)


@pytest.mark.parametrize("held", [0, 20, 40])
def test_what_hangs_far_off_is_drawn_no_faster_than_it_may(held):
    """Cloth that has slipped off, 0.6 m from where it is wanted, and beside it a centimetre; all goes exactly where it
    is drawn to, but for so many frames in which contact holds the first vertex,
    which is caught up with if it can be."""
    apart = np.array([[0.0, -0.6, 0.0], [0.01, 0.0, 0.0]])
    seconds, t, k = seconds_for(apart), 0.0, 0
    while t < seconds:
        left = left_after(apart, t, STEP, seconds)
        if k < held:
            left[0] = apart[0]
        assert np.linalg.norm(left - apart, axis=1).max() <= FASTEST * STEP * (1 + 1e-9)
        apart, t, k = left, t + STEP, k + 1
    assert seconds <= t < seconds + STEP
    assert np.linalg.norm(apart[1]) < 1e-12
    assert bool(np.linalg.norm(apart[0]) < 1e-12) is (held < 40)


def test_nobody_waits_for_what_has_fallen_from_the_body():
    apart = np.array([[0.0, -5.0, 0.0], [0.4, 0.0, 0.0]])
    assert seconds_for(apart) == seconds_for(apart[1:]) == pytest.approx(0.75 / FASTEST)
    left = left_after(apart, 0.74 / FASTEST, STEP, 0.75 / FASTEST)
    assert np.linalg.norm(left[0]) == pytest.approx(5.0 - FASTEST * STEP)


def test_what_has_fallen_off_goes_on_falling_in_a_mesh_that_comes_to_where_the_body_is(both):
    """A skirt 8 m aside of who turns by 5 degrees a frame, 21 m/s there, while a T-shirt of another fabric is made
    beside: when that has come to the body's stance, the skirt is where it is beside the worn one."""
    _, worn = both
    skirt, sim = worn.layer_of("skirt").vertices, worn.simulation
    x = sim.cloth_positions()
    x[skirt] += [8.0, -2.0, 0.0]
    sim.start_at(x, worn.body_positions(), sim.body.pose)

    def turn(frames):
        for _ in range(frames):
            k = round(worn.seconds / STEP) + 1
            root = Rotation.from_euler("y", 5.0 * k, degrees=True) * Rotation.from_quat(worn.pose.rotations[0])
            worn.advance(Pose(worn.pose.root, np.vstack([root.as_quat(), worn.pose.rotations[1:]])), k * STEP)

    turn(6)
    worn.edit_garment("tshirt")
    *_, made = worn.recut(worn.cutting(worn.specification, "denim")())
    turn(1)
    list(caught_up(made, worn, lambda: worn.stance))
    assert made.stance is worn.stance
    there = made.layer_of("skirt").vertices
    np.testing.assert_allclose(made.cloth_positions()[there], worn.cloth_positions()[skirt], rtol=0, atol=1e-3)
    np.testing.assert_allclose(made.simulation.state.v.numpy()[there], sim.state.v.numpy()[skirt], rtol=0, atol=0.05)
    shirts = (one.cloth_positions()[one.layer_of("tshirt").vertices] for one in (made, worn))
    assert np.linalg.norm(np.subtract(*shirts), axis=1).max() < 0.05, "it has come along"


def test_what_was_made_frames_ago_catches_up_in_parts_between_which_what_is_worn_goes_on(both):
    worn, other = both
    frame = LONGEST_MOVE
    for k in range(1, 6):
        worn.advance(worn.pose, k * frame)
    advanced, frames = [other.simulation.counters.steps], 5
    for _ in caught_up(other, worn, lambda: worn.stance):
        frames += 1
        worn.advance(worn.pose, frames * frame)
        advanced.append(other.simulation.counters.steps)
    assert other.seconds == worn.seconds
    assert 6 <= frames <= 12
    assert max(np.diff(advanced)) <= 2, "no frame waits for more"


def test_what_catches_up_goes_as_fast_as_the_body_and_no_faster(both):
    """The body goes 4 cm a frame; all six of them in one move would throw the cloth at 7 m/s."""
    worn, other = both
    pose = worn.pose
    for k in range(1, 7):
        worn.advance(Pose(pose.root + [0.0, 0.0, 0.04 * k], pose.rotations), k * LONGEST_MOVE)
    for _ in caught_up(other, worn, lambda: worn.stance):
        pass
    assert other.stance is worn.stance
    velocity = other.simulation.state.v.numpy()
    assert np.median(velocity[:, 2]) == pytest.approx(0.04 / LONGEST_MOVE, rel=0.1)
    assert np.linalg.norm(velocity, axis=1).max() < 2 * 0.04 / LONGEST_MOVE


def test_who_can_wait_no_longer_has_it_there_at_once(both):
    worn, other = both
    coming, step = worn.come_to(other, iter(())), 0
    worn.come_at_once()  # nothing is on its way yet
    while worn._coming_to is None or worn._coming_to.seconds == 0.0:
        next(coming)
        step += 1
        worn.advance(worn.pose, step * STEP)
    worn.come_at_once()
    assert list(coming) == []
    assert any(own.name == "drawn" for own in worn.simulation.plan.contributions), "nobody lets go of what is put away"
    assert worn._coming_to is None


def test_who_is_given_up_leaves_what_is_worn_as_it_hangs_by_itself(both):
    worn, other = both
    hung = worn.cloth_positions().copy()
    coming, k = worn.come_to(other, iter(())), 0
    while k < 5 or not any(own.name == "drawn" for own in worn.simulation.plan.contributions):
        next(coming)
        k += 1
    for step in range(1, 8):
        worn.advance(worn.pose, step * STEP)
        next(coming)
    coming.close()
    assert not any(own.name == "drawn" for own in worn.simulation.plan.contributions)
    drawn = np.linalg.norm(worn.cloth_positions() - hung, axis=1)
    assert drawn.max() > 0.02
    steps = other.simulation.counters.steps
    for step in range(8, 40):
        worn.advance(worn.pose, step * STEP)
    assert other.simulation.counters.steps == steps
    back = np.linalg.norm(worn.cloth_positions() - hung, axis=1)
    assert back.max() < drawn.max()


def test_what_the_other_raises_is_told_and_what_is_worn_goes_on(both, monkeypatch):
    worn, other = both
    coming = worn.come_to(other, iter(()))

    def failing(*_):
        raise RuntimeError("it diverged")

    monkeypatch.setattr(other, "advance", failing)
    def go_on():
        for step, _ in enumerate(coming, 1):
            worn.advance(worn.pose, step * STEP)

    with pytest.raises(RuntimeError, match="diverged"):
        go_on()
    assert not any(own.name == "drawn" for own in worn.simulation.plan.contributions)
    worn.advance(worn.pose, worn.seconds + STEP)


def test_what_is_put_away_on_the_way_draws_no_more(both):
    worn, other = both
    coming = worn.come_to(other, iter(()))
    while worn._coming_to is None:
        next(coming)
    assert all(type(effect).module != bind_drawn.__module__ for effect in worn.packed().scene.effects)
    coming.close()


def parted(drape):
    """The cloth of each garment [m], by name, where it is seen."""
    cloth = drape.cloth_positions() + drape.origin
    return {layer.name: cloth[layer.vertices] for layer in drape.worn_outfit().outfit.layers}


@pytest.mark.long
def test_in_another_order_nothing_that_is_seen_twice_jumps_and_nothing_passes_through_anything(turned):
    """Between two frames that both show it no garment goes farther than cloth that is led may, and as the body does, a
    quarter more; the two outfits have it 60 mm apart and more. The T-shirt, that comes off, goes as the body does until
    then, 2 mm a frame at most, but for a vertex of a fold that snaps, 10 mm in one frame."""
    worn, other = turned
    far = {name: np.linalg.norm(parted(worn)[name] - place, axis=1).max() for name, place in parted(other).items()}
    assert min(far.values()) > 0.06, "they would jump"
    again = taken_off_for(worn.names, other.names)
    assert again == ("tshirt",)
    judge, moved, nearly_all, k = judge_of(worn), {"tshirt": [], "skirt": []}, {"tshirt": [], "skirt": []}, 0
    now = [worn]
    catching_up = CatchingUp(iter([other]), lambda: now[-1].stance, worn, again)
    for made in catching_up.parts():
        before, k = parted(now[-1]), k + 1
        if made is None:
            now[-1].advance(raised(other, k), now[-1].seconds + STEP)
        else:
            now.append(made)
            judge = judge_of(made)
        for name, place in parted(now[-1]).items():
            if name in before:
                ways = np.linalg.norm(place - before[name], axis=1)
                moved[name].append(ways.max())
                nearly_all[name].append(np.quantile(ways, 0.99))
        assert judge.judge(now[-1].cloth_positions(), now[-1].body_positions()).clean, k
    assert [drape.names for drape in now] == [("tshirt", "skirt"), ("skirt",), ("skirt", "tshirt")]
    assert max(moved["skirt"]) < min(1.25 * FASTEST * STEP, 0.2 * far["skirt"])
    assert max(moved["tshirt"]) < 1.25 * FASTEST * STEP
    assert max(nearly_all["tshirt"]) < 0.003, "as it hung until it was off"


def test_garments_that_lie_in_another_order_are_not_drawn_through_each_other(both):
    _, other = both
    outfit = other.worn_outfit().outfit
    turned = type(outfit)(outfit.worn[::-1])
    assert len(in_both(outfit, turned).vertices) == 0
    common = in_both(outfit.without("tshirt"), outfit)
    first = outfit.layers[1].vertices.start
    assert np.array_equal(common.vertices + first, common.corners[:, 0])
