"""Can the sewn pieces be worn at all? What no loop of fabric closes falls off whoever it is put around."""

from __future__ import annotations

from collections import Counter

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tryon_solver.geometry.pattern import Pattern, PatternError

SEW_A_LOOP = "Sew it into a loop: front and back along both sides, say, or a piece to itself along two edges"


def check_wearable(pattern: Pattern) -> None:
    """Refuse pieces that hold together in a way that closes around nothing: single ones, and chains of them.

    Pieces are taken as nodes and stitches as the links between them; what is linked needs a closed way through
    different stitches (a dart is one, too: the pieces' shapes are not looked at). What lies on another piece is held by
    that. Raises PatternError naming the pieces.
    """
    count = len(pattern.panels)
    links = np.array([(s.first.panel, s.second.panel) for s in pattern.stitches], np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    groups, group_of_panel = connected_components(graph, directed=False)
    stitches = Counter(group_of_panel[links[:, 0]].tolist())
    held = {int(group_of_panel[patch.panel]) for patch in pattern.patches}
    for group in sorted(set(range(groups)) - held):
        members = [panel.name for panel, of in zip(pattern.panels, group_of_panel) if of == group]
        if stitches[group] >= len(members):
            continue
        if not pattern.stitches:
            message = "the pattern has no stitches: nothing holds its pieces on the body"
            raise PatternError(message, "stitches", SEW_A_LOOP)
        if len(members) == 1:
            what = f"the panel {members[0]!r} is sewn to nothing"
        else:
            what = f"the panels {', '.join(repr(name) for name in members)} are sewn in a row"
        raise PatternError(
            f"{what}: no loop of fabric closes around the body, and it would fall off",
            f"panels.{members[0]}",
            SEW_A_LOOP,
        )
