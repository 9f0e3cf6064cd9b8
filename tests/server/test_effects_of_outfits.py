"""What is asked of effects goes along to the next outfit: by the garments' names, and without what can't be worn."""

import pytest
from pretended_effects import PretendedEffects

from tryon_server.runtime.effect_desk import EffectDesk
from tryon_server.sessions.commands import ChangeEffect
from tryon_server.sessions.events import EffectRefused, EffectsTold
from tryon_solver.effect_words.fields import EffectError
from tryon_solver.effect_words.rules import with_pieces
from tryon_solver.effect_words.table import word_of

PIECES = {"shirt": ("front", "back"), "skirt": ("flounce",)}


class Worn(PretendedEffects):
    """Garments of PIECES, whose pieces can be sticky."""

    def _owner(self, piece):
        for garment in self.garments:
            if piece in {*PIECES[garment], *(f"{garment}/{own}" for own in PIECES[garment])}:
                return garment
        return None

    def under_garments(self, name, parameters):
        if name != "adhesion":
            return parameters
        return {**parameters, "panels": [self._full_name(piece) for piece in parameters["panels"]]}

    def _full_name(self, piece):
        """One of no garment that is worn keeps its name, as a Cut has it."""
        owner = self._owner(piece)
        return piece if owner is None else f"{owner}/{piece.rpartition('/')[2]}"

    def check(self, asked):
        for piece in asked.get("adhesion", {}).get("panels", ()):
            if self._owner(piece) is None:
                raise EffectError(f"there is no piece {piece}", "parameters.panels[0]", "Name another")

    def rebind(self, asked):
        self.check(asked)
        yield from super().rebind(asked)


class Lined(PretendedEffects):
    """Garments whose lines have elastic; each pattern of OWN_LINES has some by itself."""

    def __init__(self, garments):
        super().__init__(garments=garments)
        rows = [line(f"{name}/{piece}", 0.9) for name in garments for piece in OWN_LINES.get(name, ())]
        if rows:
            self.own = {"elastic": word_of("elastic").parameters({"lines": rows})}
            self.asked = {**self.asked, **self.own}

    def under_garments(self, name, parameters):
        (garment,) = self.garments if len(self.garments) == 1 else (None,)
        return with_pieces(name, parameters, lambda piece: piece if "/" in piece else f"{garment}/{piece}")


OWN_LINES = {"skirt": ("flounce",)}


def line(piece, ratio):
    return {"along": [{"panel": piece, "edge": 0}], "ratio": ratio, "stiffness": 30.0}


class Ready:
    """An armoury in which everything is compiled."""

    compiling = ()

    def is_ready(self, _name):
        return True

    def look(self):
        return None

    def want(self, names):
        list(names)

    hold = want


class AtWind(Ready):
    """One that compiles wind, and does not come to its end."""

    compiling = ("wind",)

    def is_ready(self, name):
        return name != "wind"


@pytest.fixture
def desk():
    told = []
    desk = EffectDesk(told.append, Ready(), lambda: 0.0, {})
    desk.told = told
    return desk


def settle(desk, worn, busy=False):
    for _ in range(30):
        desk.go_on(worn, 0.0, busy)


def ask(desk, worn, **effects):
    for ticket, (name, parameters) in enumerate(effects.items()):
        desk.take(ChangeEffect(ticket + 1, name, "active", parameters))
    settle(desk, worn)


def last(desk, name):
    news = [event for event in desk.told if isinstance(event, EffectsTold)][-1]
    return next(effect for effect in news.effects.effects if effect.name == name)


def sticky(desk, garments=("shirt",)):
    worn = Worn(garments=garments)
    settle(desk, worn)
    ask(desk, worn, wind={"velocity": [0, 0, 2]}, adhesion={"panels": ["front"]})
    assert {"wind", "adhesion"} <= set(worn.asked)
    return worn


def test_what_is_not_brought_out_of_an_effect_is_told_with_why_it_acts_and_told_no_more_once_it_is(desk):
    worn = Worn(garments=("shirt",))
    worn.caveats = {"friction": "it is coarse"}
    settle(desk, worn)
    assert last(desk, "friction").why == "every garment is worn with it; it is coarse"
    assert last(desk, "gravity").why == "every garment is worn with it"
    worn.caveats = {}
    settle(desk, worn)
    assert last(desk, "friction").why == "every garment is worn with it"


def test_pieces_are_named_with_their_garments_once_others_are_worn(desk):
    sticky(desk)
    assert desk.wishes["effects"]["adhesion"]["parameters"]["panels"] == ["front"]
    settle(desk, Worn(garments=("shirt",)))
    assert desk.wishes["effects"]["adhesion"]["parameters"]["panels"] == ["front"], "as it was"
    both = Worn(garments=("skirt", "shirt"))
    settle(desk, both)
    assert both.bound == 1
    assert both.asked["adhesion"]["panels"] == ["shirt/front"]
    assert last(desk, "adhesion").state == last(desk, "wind").state == "active"
    assert desk.wishes["effects"]["adhesion"]["parameters"]["panels"] == ["shirt/front"]


def test_what_was_on_a_garment_that_is_gone_is_armed_and_all_else_acts_on(desk):
    sticky(desk, ("skirt", "shirt"))
    skirt = Worn(garments=("skirt",))
    settle(desk, skirt)
    assert last(desk, "wind").state == "active"
    assert last(desk, "adhesion").state == "armed"
    assert "no piece shirt/front" in last(desk, "adhesion").why
    assert skirt.bound == 1
    assert [event for event in desk.told if isinstance(event, EffectRefused)] == []


def test_what_was_on_a_garment_that_comes_back_acts_again_and_says_so(desk):
    sticky(desk, ("skirt", "shirt"))
    settle(desk, Worn(garments=("skirt",)))
    assert last(desk, "adhesion").state == "armed"
    both = Worn(garments=("skirt", "shirt"))
    settle(desk, both)
    assert (last(desk, "adhesion").state, last(desk, "adhesion").why) == ("active", "asked for")
    assert both.asked["adhesion"]["panels"] == ["shirt/front"]
    desk.take(ChangeEffect(9, "adhesion", "armed"))
    settle(desk, both)
    settle(desk, Worn(garments=("shirt", "skirt")))
    assert last(desk, "adhesion").state == "armed", "as it was asked for"


def test_a_scene_that_is_half_made_gives_way_to_another_one(desk):
    worn = Worn(garments=("shirt",))
    settle(desk, worn)
    desk.take(ChangeEffect(1, "wind", "active", {"velocity": [0, 0, 2]}))
    desk.go_on(worn, 0.0, False)
    settle(desk, worn, busy=True)
    assert worn.bound == 0
    assert "wind" not in worn.asked
    other = Worn(garments=("shirt", "skirt"))
    settle(desk, other)
    assert (worn.bound, other.bound) == (0, 1)
    assert last(desk, "wind").state == "active"


def lines(desk):
    return {row["along"][0]["panel"]: row["ratio"] for row in last(desk, "elastic").parameters["lines"]}


def test_lists_have_the_lines_of_the_garments_that_are_worn(desk):
    """Of one that is put on later what its pattern has, of one that is taken off none any more."""
    settle(desk, Lined(("shirt",)))
    ask(desk, desk._worn, elastic={"lines": [line("front", 0.5)]})
    assert lines(desk) == {"front": 0.5}
    both = Lined(("skirt", "shirt"))
    settle(desk, both)
    assert lines(desk) == {"shirt/front": 0.5, "skirt/flounce": 0.9}
    assert both.asked["elastic"]["lines"] == last(desk, "elastic").parameters["lines"]
    ask(desk, both, elastic={"lines": [line("shirt/front", 0.5), line("skirt/flounce", 0.7)]})
    shirt = Lined(("shirt",))
    settle(desk, shirt)
    assert last(desk, "elastic").state == "active"
    assert lines(desk) == {"shirt/front": 0.5}
    settle(desk, Lined(("skirt", "shirt")))
    assert lines(desk)["skirt/flounce"] == 0.9, "what was asked of it before it was taken off is forgotten"
    skirt = Lined(("skirt",))
    settle(desk, skirt)
    assert lines(desk) == {"skirt/flounce": 0.9}
    settle(desk, Lined(("cap",)))
    assert last(desk, "elastic").state == "absent"
    assert last(desk, "elastic").why == "without lines of skirt, which was taken off"
    assert "elastic" not in desk.wishes.get("effects", {})
    ask(desk, desk._worn, elastic={"lines": [line("brim", 0.5)]})
    assert last(desk, "elastic").why == "asked for"


def test_what_was_on_a_garment_alone_that_is_taken_off_is_told_beside_what_the_others_patterns_have(desk):
    settle(desk, Lined(("skirt", "shirt")))
    ask(desk, desk._worn, elastic={"lines": [line("shirt/front", 0.5)]})
    settle(desk, Lined(("skirt",)))
    assert lines(desk) == {"skirt/flounce": 0.9}
    assert last(desk, "elastic").why == "the pattern has it; without lines of shirt, which was taken off"


def test_friction_between_pieces_that_are_gone_is_as_usual(desk):
    settle(desk, Lined(("skirt", "shirt")))
    pair = {"first": "shirt/front", "second": "skirt/flounce", "static": 0.9}
    ask(desk, desk._worn, friction={"body": 0.4, "cloth": 0.3, "pairs": [pair]})
    shirt = Lined(("shirt",))
    settle(desk, shirt)
    assert shirt.asked["friction"]["pairs"] == []
    assert shirt.asked["friction"]["body"] == 0.4
    assert last(desk, "friction").why == "asked for; without pairs of skirt, which was taken off"
    settle(desk, Lined(("shirt", "cap")))
    assert last(desk, "friction").why == "asked for"


class Fading(Worn):
    """What is to go needs some frames for it, which come as long as there is an entry in `left`."""

    left = ()

    def fade(self, wanted):
        if not set(self.asked) - set(wanted):
            return 0.0
        if len(self.left) > 1:
            self.left = self.left[1:]
        return self.left[0]


@pytest.mark.parametrize(("left", "looks"), [((0.1, 0.05, 0.02, 0.0), 3), ((0.1,), 50)])
def test_what_goes_is_bound_no_more_once_it_has_gone_or_nothing_moves(left, looks):
    """Ten looks take 0.2 s: after a second of standing still the fifty-first goes on."""
    now = [0.0]
    told = []
    desk = EffectDesk(told.append, Ready(), lambda: now[0], {})
    desk.told = told
    worn = Fading(garments=("shirt",))
    settle(desk, worn)
    ask(desk, worn, wind={"velocity": [0, 0, 2]})
    worn.left = (0.2, *left)
    bound = worn.bound
    desk.take(ChangeEffect(9, "wind", "absent"))
    for _ in range(looks - 1):
        desk.go_on(worn, 0.0, False)
        now[0] += 0.02
        assert "wind" in worn.asked
    for _ in range(15):
        desk.go_on(worn, 0.0, False)
        now[0] += 0.02
    assert "wind" not in worn.asked
    assert worn.bound == bound + 1


def test_a_wish_that_was_kept_before_its_effect_had_a_parameter_has_it_by_default():
    kept = {"effects": {"wind": {"state": "active", "parameters": {"velocity": [0.0, 0.0, 2.0]}, "why": "asked for"}}}
    desk = EffectDesk(lambda _event: None, Ready(), lambda: 0.0, kept)
    parameters = desk.wishes["effects"]["wind"]["parameters"]
    assert parameters["velocity"] == [0.0, 0.0, 2.0]
    assert parameters["ramp"] == 0.1


def test_a_wish_that_was_kept_in_other_words_is_armed_by_default_and_says_why():
    kept = {"effects": {"adhesion": {"state": "active", "parameters": {"kind": "glue"}, "why": "asked for"}}}
    wish = EffectDesk(lambda _event: None, Ready(), lambda: 0.0, kept).wishes["effects"]["adhesion"]
    assert wish["state"] == "armed"
    assert wish["parameters"] == word_of("adhesion").parameters()
    assert "not known any more" in wish["why"]
    assert "kind" in wish["why"] or "glue" in wish["why"]


@pytest.mark.parametrize(
    ("name", "state", "parameters"),
    [("elastic", "absent", None), ("gravity", "active", None), ("air_drag", "active", {"coefficient": 1.7})],
)
def test_what_is_as_it_is_asked_for_is_answered_while_another_effect_is_compiled(name, state, parameters):
    """Taking off what never acted waited for seconds, for another effect's kernels."""
    told, worn = [], Worn(garments=("shirt",))
    desk = EffectDesk(told.append, AtWind(), lambda: 0.0, {})
    settle(desk, worn)
    desk.take(ChangeEffect(1, "wind", "armed"))
    desk.take(ChangeEffect(2, "auto", "absent"))
    settle(desk, worn)
    desk.take(ChangeEffect(3, name, state, parameters))
    desk.go_on(worn, 0.0, False)
    assert [event.answers for event in told if event.answers] == [(3,)]
    assert (worn.bound, worn.written) == (0, 0)


def test_what_was_answered_stays_where_another_effect_can_not_be_bound(desk):
    worn = sticky(desk)
    desk.take(ChangeEffect(8, "pressure", "active", {"pressure": 666}))
    desk.go_on(worn, 0.0, False)
    desk.take(ChangeEffect(9, "sleep", "active", None))
    settle(desk, worn)
    assert [event.ticket for event in desk.told if isinstance(event, EffectRefused)] == [8]
    assert desk.wishes["effects"]["sleep"]["state"] == "active"
    assert "pressure" not in desk.wishes["effects"]
