"""Every effect has a scene to look at, and its picture is in the documents."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import effect_pictures
from effect_demos import DEMOS

from tryon_solver import scene

ROOT = Path(__file__).parents[2]
UNSEEN = {"Sleep"}


def test_every_effect_is_shown():
    kinds = {
        name
        for name, kind in vars(scene).items()
        if isinstance(kind, type) and issubclass(kind, scene.EffectSpec) and kind is not scene.EffectSpec
    }
    assert len(kinds) > 15
    assert kinds - UNSEEN == {demo.name.partition(",")[0] for demo in DEMOS}
    told = (ROOT / "docs" / "effects.md").read_text()
    for demo in DEMOS:
        name = effect_pictures.file_of(demo)
        assert (ROOT / "docs" / "effects" / name).exists()
        assert f"(effects/{name})" in told


def test_picture_shows_both_halves():
    demo = replace(next(demo for demo in DEMOS if demo.name == "BodyContact"), seconds=0.05)
    drawn = ElementTree.fromstring(effect_pictures.picture(demo))
    svg = "{http://www.w3.org/2000/svg}"
    kinds = [path.get("class")[0] for path in drawn.iter(f"{svg}path")]
    faces = 2 * 12 * 12
    assert kinds.count("c") == 2 * faces
    assert faces < kinds.count("b") < 2 * 320
    assert [text.text for text in drawn.iter(f"{svg}text")] == ["without", "with"]
