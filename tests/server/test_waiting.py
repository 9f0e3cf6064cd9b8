"""Commands and changes that wait."""

from tryon_server.runtime.waiting import newest_held
from tryon_server.sessions.commands import ChangePattern, Run


def held(by):
    return ChangePattern("edit", 0, {"kind": "lengthen", "panel": "front", "edge": 0, "by": by}, hold=True)


def test_of_edits_that_are_held_only_the_newest_is_worked_out():
    """All that is to be kept is, and in its place."""
    kept, undo = ChangePattern("edit", 3, {"kind": "remove_piece", "panel": "front"}), ChangePattern("undo", 4)
    assert newest_held([held(1), Run(True), held(2), kept, held(3), undo]) == [Run(True), kept, held(3), undo]
    assert newest_held([kept, undo]) == [kept, undo]
    assert newest_held([held(1)]) == [held(1)]
    assert newest_held([]) == []
