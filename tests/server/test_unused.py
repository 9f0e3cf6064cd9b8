"""What an upload is told and has no use for is noted."""

import patterns
import trimesh

from tryon_server.garments.check import check_garment
from tryon_server.unused import USES, note_unused, unused
from tryon_server.uploads.check import Telling, check
from tryon_solver.body import default_body


def test_units_told_of_a_pattern_are_noted():
    content = patterns.as_bytes(patterns.tube())
    assert check_garment(content, None, None).facts.notes == ()
    (note,) = check_garment(content, "cm", "y").facts.notes
    assert note == "units, up said nothing: the garment is a sewing pattern, which says its lengths and has no axes"


def test_a_rate_told_of_a_scene_is_noted():
    body = default_body()
    content = trimesh.Trimesh(body.rest_vertices, body.faces, process=False).export(file_type="glb")
    notes = check(content, Telling(kind="body", name="one", fps=24.0)).body.notes
    assert notes[-1] == "fps said nothing: the body is a .glb, whose animation says its times"
    assert not any("said nothing" in note for note in check(content, Telling(kind="body", name="one")).body.notes)


def test_of_a_kind_that_is_not_known_nothing_is_said():
    for subject, told in USES.items():
        assert note_unused(subject, None, dict.fromkeys(told, "x")) == ()
        assert unused(subject, "other", dict.fromkeys(told))[0] == []
