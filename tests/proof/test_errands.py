"""Programs of their own among the cases: what they say is in the table, and their exit status counts."""

import sys

import numpy as np
import pytest
from errand import LONG_RUN, ROOT, Errand, long_determinism, momentum_symmetries_and_closed_forms, reference_scenes
from mesh_case import script, stance_at
from pool import Pool
from table import markdown

from tryon_server.runtime.bodies import load_moving_mesh
from tryon_server.runtime.order import MeshReading
from tryon_solver.body.model import default_body
from tryon_solver.body.pose import skin


def saying(name, text, status):
    """A program that says something and ends."""
    return Errand(name, (sys.executable, "-c", f"import os; print({text}); raise SystemExit({status})"))


def test_errands_run_beside_each_other_and_their_words_are_told(tmp_path):
    quiet = saying("all well", "'Module a.b load on device cpu took 1 ms\\n' + os.environ['GIVEN']", 0)
    quiet = Errand(quiet.name, quiet.command, (("GIVEN", "| a row |"),))
    results = Pool(tmp_path, 2).run([quiet, saying("a limit", "'over by a lot'", 1)])
    assert [result["failure"] for result in results] == ["", "exit status 1: over by a lot"]
    text = markdown(results, {})
    assert "## All well\n\n| a row |" in text
    assert "- a limit: FAILED, exit status 1: over by a lot" in text


def test_an_errand_that_dies_silently_is_told(tmp_path):
    (result,) = Pool(tmp_path, 1).run([Errand("lost", (sys.executable, "-c", "import os; os._exit(3)"))])
    assert result["failure"] == "exit status 3: it said nothing"


def test_the_whole_proof_has_every_scene_of_the_reference_and_the_long_run(tmp_path):
    from contact_scenes import SCENES

    commands = [errand.command for errand in reference_scenes(tmp_path)]
    assert sorted(command[command.index("--scenes") + 1] for command in commands) == sorted(SCENES)
    assert long_determinism().environment == (("TRYON_FRAMES", LONG_RUN),)
    for errand in (long_determinism(), momentum_symmetries_and_closed_forms()):
        files = [word for word in errand.command if word.endswith(".py")]
        assert files
        assert all((ROOT / file).is_file() for file in files)


@pytest.mark.long
def test_a_strangers_body_and_the_bones_that_moved_it_keep_the_same_time(tmp_path):
    """At times of the file's frames and between them: the mesh is the skin over those bones."""
    body = default_body()
    script().write_walk(tmp_path / "walk", body, 0.5)
    moving = load_moving_mesh(tmp_path / "walk", MeshReading())
    motion = script().motion_from_rest(body, "walk", 0.5)
    for t, apart in ((0.0, 1e-6), (0.2, 1e-6), (0.45, 1e-3)):
        stance = stance_at(moving.sequence, motion, t)
        pose = motion.sample(t)
        np.testing.assert_allclose(stance.skin, skin(body, pose), rtol=0, atol=apart)
        assert stance.joints[0] == pytest.approx(pose.root)
    a_frame_before = skin(body, motion.sample(0.45 - 1 / 30))
    assert np.abs(a_frame_before - skin(body, pose)).max() > 5e-3
