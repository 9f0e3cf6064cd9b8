"""A T-shirt that its wearer's edits made too tight for the next one, worn and simulated: which is refused, and why."""

import json

from edit_case import EditCase
from edited_session import EditedSession
from frame_judge import FrameJudge
from run_edits import EditRun

from tryon_server.runtime.tightness import TOO_TIGHT
from tryon_server.sessions.commands import ChangePattern
from tryon_server.sessions.events import EditMade, EditRefused

SIDE_SEAMS = (1, 8)  # edges of the front
TAKEN_IN = [{"kind": "take_in", "panel": "front", "edge": edge, "by": 0.15} for edge in SIDE_SEAMS]
DART = {"kind": "dart", "panel": "front", "edge": 0, "position": 0.5, "width": 0.03, "depth": 0.1}
ON_ITS_WAY = 12  # frames: the ramp, and as long as cloth that is pulled at takes to follow


def test_a_dart_of_a_tshirt_taken_in_by_15_cm_on_either_side_is_refused_and_the_garment_stays(tmp_path):
    answers, worn, shown = [], [], []

    def script(session):
        yield from session.start()
        for ticket, edit in enumerate([*TAKEN_IN, DART], 1):
            worn.append((session.drape.overstretched, session.drape.simulation, json.dumps(session.drape.own.shown)))
            answers.append((yield from session.change(ChangePattern("edit", ticket, edit))).event)
            for _ in range(ON_ITS_WAY):
                shown.append((yield from session.frame()))
        worn.append((session.drape.overstretched, session.drape.simulation, json.dumps(session.drape.own.shown)))

    session = EditedSession(EditRun(EditCase(vertices=200), tmp_path, print).order, "walk", script)
    session.run()
    *made, refused = answers
    assert [(type(event), event.change) for event in made] == 2 * [(EditMade, "value")]
    assert isinstance(refused, EditRefused)
    assert worn[0][0] < TOO_TIGHT < worn[2][0]
    assert refused.message.startswith("so it can't be worn: where the garment is worn, ")
    assert "and it can't be put on anew: " in refused.message
    assert "% of what is worn are stretched by more than the fabric bears already" in refused.message
    assert "(take_in) left" in refused.message
    assert refused.remedy.startswith("Make the garment larger; or take edit ")
    assert worn[3][1:] == worn[2][1:], "the same garment goes on, in the pattern of before"
    assert session.troubles == []
    for each in shown[-ON_ITS_WAY:]:
        judge = FrameJudge(each.topology.faces, each.topology.body.faces, each.frame.cloth, each.frame.body)
        assert judge.judge(each.frame.cloth, each.frame.body).clean
