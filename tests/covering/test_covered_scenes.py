"""A few of the array's scenes, their first half second; `python tests/covering` plays all."""

import subprocess
import sys
from pathlib import Path

import covered_run
import numpy as np
import pytest
import warp as wp
from covered_run import crosses, play
from covered_scene import OUTER, make_scene
from covering_page import of_run, page
from effect_factors import TWO, rows
from frame_judge import FrameVerdict

from tryon_solver.materials.fabric import FABRICS

SECONDS = 0.5
REPEATED = 20  # frames


def of(**levels):
    """The first row that has these two; the array has every pair that may be, and few triples."""
    return next(row for row in rows() if levels.items() <= row.items())


@pytest.mark.parametrize(
    "levels",
    [
        {"cloth": "balloon", "garments": "one", "pressure": "gas"},
        {"cloth": "strip", "air": "gusts"},
        {"cloth": "skirt", "preset": "draft"},
        {"cloth": "strip", "garments": TWO[0]},
        pytest.param({"cloth": "strip", "garments": TWO[1]}, marks=pytest.mark.long),
    ],
)
def test_effects_together_penetrate_nothing(levels):
    figures = play(of(**levels), SECONDS)
    assert figures["broken"] == []
    assert figures["judged"] >= 8
    assert figures["fastest"] > 1e-3


def test_outer_garment_has_a_thickness_and_friction_of_its_own():
    row = of(cloth="strip", garments=TWO[1]) | {"friction": "fabric", "attached": "none"}
    scene = make_scene(row)
    inner, outer = FABRICS[row["fabric"]], FABRICS[OUTER[row["fabric"]]]
    assert inner.thickness != outer.thickness
    assert len({inner.mu_self, outer.mu_self, (inner.mu_self * outer.mu_self) ** 0.5}) == 3
    assert scene.sim.scene.fabric_of_garments() == [inner, outer]
    assert len(scene.sim.cloth_positions()) == 2 * scene.cloth.garment.vertex_count
    alike = make_scene(row | {"garments": TWO[0]})
    assert alike.sim.scene.fabric_of_garments() == [inner, inner]


def test_nothing_that_flies_freely_is_blown_faster_than_is_judged():
    """The impulse of p sin(pi t) in a second is 2 p/pi: over the lightest fabric's mass, half of FASTEST."""
    row = of(pressure="blown", air="none", cloth="sheet") | {"fabric": "silk_charmeuse", "attached": "none"}
    scene = make_scene(row)
    assert 2 * scene.blown / np.pi / FABRICS["silk_charmeuse"].areal_density == pytest.approx(covered_run.FASTEST / 2)
    assert make_scene(row | {"air": "still"}).blown > 10 * scene.blown


def test_what_is_stretched_is_told_with_what_acts_there_and_limits_are_in_the_page():
    row = of(pins="led", fasteners="closed", cloth="strip", garments="one")
    scene = make_scene(row)
    corner, button = scene.cloth.corners[0], scene.cloth.buttons[0, 0]
    assert "pins" in scene.acting_on(np.array([corner, corner, corner]))
    assert "fasteners" in scene.acting_on(np.array([button, button, button]))
    beyond = scene.cloth.garment.vertex_count
    assert scene.acting_on(np.array([beyond, beyond + 1, beyond + 2])) == ["outer"]

    figures = play(row, 0.1)
    result = {"scene": 0, "row": row, "about": {"commit": "c", "machine": "m"}, **figures}
    pulled = result | {"stretch": 1.6, "stretched_at": ["pins"], "fastest": 5.5, "usual": 5.25}
    text = page({"cpu": [pulled], "cuda": [{k: v for k, v in pulled.items() if k not in ("stretched_at", "usual")}]})
    assert "faster than 10 m/s and no triangle is stretched to more than 3 times" in text
    assert "- 1 scenes hold in all, 0 of them within 5 m/s and 1.5 times, too" in text
    assert "stretched to 1.60: at pins, led\n" in text
    assert "half of its vertices go at 5.25 m/s or more then" in text
    assert "stretched to 1.60: at pins, led (as another run found)" in text
    assert "1 of them within" in page({"cpu": [result]})


def test_frames_without_contact_are_not_judged():
    row = of(**{"body contact": "off", "self contact": "off"})
    figures = play(row, 0.1)
    assert figures["judged"] == 0
    assert figures["free"] >= 2
    said = "\n".join(of_run([{"scene": 0, "row": row, "about": {"commit": "c", "machine": "m"}, **figures}]))
    assert "- 0 frames judged" in said
    assert f"- {figures['free']} frames more were looked at in scenes without contact" in said


def test_what_crosses_is_told_only_of_what_the_scene_keeps_apart():
    of_itself, of_body, inside = (FrameVerdict(True, *flags) for flags in ((True, False, 0), (0, True, 0), (0, 0, 3)))
    assert crosses(of_itself, cloth=True, body=False)
    assert not crosses(of_itself, cloth=False, body=True)
    for verdict in (of_body, inside):
        assert crosses(verdict, cloth=False, body=True)
        assert not crosses(verdict, cloth=True, body=False)


def test_a_run_that_goes_wrong_is_told(monkeypatch):
    """A state that crosses, and one that is no number, each with its frame."""
    row = of(cloth="sheet", garments="one", **{"body contact": "on"})
    made = covered_run.make_scene

    def spoilt(at_frame, spoil):
        def make(row, device):
            scene = made(row, device)
            positions, frame = scene.sim.cloth_positions, iter(range(100))

            def cloth_positions():
                x = positions()
                return spoil(x) if next(frame) >= at_frame else x

            scene.sim.cloth_positions = cloth_positions
            return scene

        monkeypatch.setattr(covered_run, "make_scene", make)
        return play(row, 0.1)

    crossing = spoilt(2, lambda x: x * [1, 1, -0.01] - [0, 0.05, 0])
    assert crossing["crossing"]
    assert any("body_intersecting=True" in said for said in crossing["broken"])
    lost = spoilt(2, lambda x: np.where(np.arange(len(x))[:, None] == 4, np.nan, x))
    assert lost["broken"] == ["frame 2: a position is not a finite number"]


def test_command_goes_on_where_it_was_cut_off(tmp_path):
    """A scene that is kept is not played again, a line that was cut off is; the page is made of what is kept."""
    number = rows().index(of(cloth="strip", preset="draft"))
    command = [sys.executable, str(Path(__file__).parent), "--scenes", str(number), "--seconds", "0.05", "--out"]
    for _ in range(2):
        done = subprocess.run([*command, str(tmp_path)], capture_output=True, text=True, check=False, timeout=200)
        assert done.returncode == 0, done.stderr[-2000:]
    kept = tmp_path / "scenes.jsonl"
    assert len(kept.read_text().splitlines()) == 1
    with kept.open("a") as lines:
        lines.write('{"scene": 1, "row"')
    page = tmp_path / "page.md"
    made = [*command[:2], "--document", str(page), "--of", str(kept)]
    assert subprocess.run(made, capture_output=True, check=False, timeout=100).returncode == 0
    text = page.read_text()
    assert "- 1 scenes hold in all" in text
    missing = [k for k in range(len(rows())) if f"- scene {k}: not played to its end" in text]
    assert missing == [k for k in range(len(rows())) if k != number]
    assert "All holds." not in text


@pytest.mark.gpu
@pytest.mark.parametrize("number", range(len(rows())))
def test_each_repeats_bit_for_bit_on_a_gpu(number):
    """Every effect's sums come to the same in whatever order its threads add."""
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    runs = []
    for _ in range(2):
        scene = make_scene(rows()[number], "cuda:0", deterministic=True)
        start = scene.sim.cloth_positions()
        frames = []
        for k in range(1, REPEATED + 1):
            at = k / scene.rate
            scene.write(at)
            scene.sim.advance(scene.stance(at), at)
            frames.append(scene.sim.cloth_positions())
        runs.append(np.array(frames))
    assert np.isfinite(runs[0]).all()
    assert np.abs(runs[0][-1] - start).max() > 1e-5
    differing = (runs[0] != runs[1]).any((1, 2))
    assert not differing.any(), f"frame {int(differing.argmax()) + 1} of {len(differing)}"
