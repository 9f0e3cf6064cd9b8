"""A piece of trousers taken back while somebody walks: the legs have changed places since, and no stance but that in
which it hung has room for it. What is worn in between and afterwards is judged by ipctk."""

from __future__ import annotations

from pathlib import Path

import pytest
from frame_judge import FrameJudge

from tryon_server.runtime import coming_by, production
from tryon_server.runtime.catching_up import caught_up
from tryon_server.runtime.order import DrapeOrder
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.motion import blend_in
from tryon_solver.body.retarget import retarget
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.plain import parse_edit

DEMO = Path(production.__file__).parents[1] / "demo"
FRAME = 1 / 30  # s
REMOVED, BACK = 2.0, 2.8  # s of the walk: most of a step lies between them


class Walker:
    """A drape on a body that walks, each frame of which is judged."""

    def __init__(self, drape, walk):
        self.drape, self.t, self.walk, self.into = drape, 0.0, walk, blend_in(drape.pose, walk, seconds=1.0)
        self.judge = self._judge()
        self.crossing = 0

    def _judge(self):
        outfit = self.drape.outfit
        return FrameJudge(outfit.faces, outfit.body.faces, self.drape.cloth_positions(), self.drape.body_positions())

    def wear(self, drape):
        self.drape = drape
        self.judge = self._judge()
        self._look()

    def _look(self):
        self.crossing += not self.judge.judge(self.drape.cloth_positions(), self.drape.body_positions()).clean

    def frame(self):
        self.t += FRAME
        stance = self.into.sample(self.t) if self.t < 1.0 else self.walk.sample(self.t - 1.0)
        self.drape.advance(stance, self.drape.seconds + FRAME)

    def until(self, t):
        while self.t < t:
            self.frame()
            if self.t > REMOVED:
                self._look()


@pytest.fixture
def walking(tmp_path):
    order = DrapeOrder(
        DEMO / "patterns/trousers.json", "cotton_jersey", "draft", "cpu", 0.06, worn_as="trousers", wardrobe=tmp_path
    )
    drape = production.build_drape(order, lambda *_: None)
    walker = Walker(drape, retarget(parse_bvh((DEMO / "motions/walk.bvh").read_text()), drape.outfit.body))
    walker.until(REMOVED)
    return walker


def without(walker, panel):
    """Wear them without this piece; how they hung, and the cut that has it back."""
    drape = walker.drape
    before, hung = drape.specification, drape.packed()
    fewer = apply(before, parse_edit({"kind": "remove_piece", "panel": panel})).specification
    *_, bare = drape.recut(drape.cutting(fewer, "cotton_jersey")())
    walker.wear(bare)
    walker.until(BACK)
    return hung, bare.cutting(before, "cotton_jersey")()


@pytest.mark.long
def test_a_piece_of_trousers_comes_back_when_the_body_comes_by_where_it_hung(walking):
    hung, cut = without(walking, "front_left")
    bare, back, begun = walking.drape, None, walking.t
    for made in bare.recut(cut, hung):
        if bare.waiting:
            walking.until(walking.t + FRAME)
        back = back or made
    assert back is not None, bare.not_carried
    assert not bare.waiting
    assert FRAME < walking.t - begun < coming_by.LONGEST, "not at once: the other leg was in front"
    for _ in bare.come_to(back, caught_up(back, bare, lambda: bare.stance)):
        walking.until(walking.t + FRAME)
    walking.wear(back)
    walking.until(walking.t + 0.4)
    assert walking.crossing == 0


def test_a_body_that_is_held_comes_by_nowhere(walking, monkeypatch):
    monkeypatch.setattr(coming_by, "HELD", 0.05)
    hung, cut = without(walking, "front_left")
    bare = walking.drape
    assert [made for made in bare.recut(cut, hung) if made is not None] == []
    assert "triangles" in bare.not_carried
    assert not bare.waiting
