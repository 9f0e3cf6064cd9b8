"""Does a session come back to its memory? A worn T-shirt is changed a thousand times over by one of the server's own
processes; what that has taken is looked at after each change, and no frame is judged.
"""

from __future__ import annotations

import json
import queue
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from typing import Any

from edit_case import DEMO, MIXED, mean_edge
from edit_steps import EditSteps
from edit_table import row
from edited_session import ALL, KEYFRAME_SECONDS
from levels import GROWTH, grown

from tryon_server.runtime.local_processes import LocalProcess, LocalProcesses
from tryon_server.runtime.memory import own_bytes
from tryon_server.runtime.order import DrapeOrder, WorkOrder, Workshop
from tryon_server.sessions.commands import AllowFrame, Run
from tryon_server.sessions.events import EditMade, EditRefused, Event, PhaseChanged
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.redesign.fabrics import made_of

DEEPEST = 6  # edits that are made before any is taken back for certain
MEMORY = 32 * 2**30  # bytes that the session may take
DRESSED = 600.0  # s in which the garment has to be dressed, and as long a change may take
KEPT = f"The last tenth's most is no more than {GROWTH:g} times that of the first three"
PARTS = 10  # of the changes, of each of which the levels are told
TELL_EVERY = 50  # edits


def memory_levels(
    edits: int, vertices: int, preset: str, device: str, wardrobe: Path, seed: int, tell: Callable[[str], None]
) -> dict[str, Any]:
    """What the session's processes have taken after each change, until so many edits were made, those taken back and
    made again not counted.

    Raises RuntimeError when the garment can't be dressed or a change is not answered.
    """
    path = DEMO / "patterns" / "tshirt.json"
    edge = mean_edge(mesh_with_vertices(load_pattern(path), vertices))
    order = DrapeOrder(path, "cotton_jersey", preset, device, edge_length=edge, wardrobe=wardrobe)
    told: queue.SimpleQueue[EditMade | EditRefused | PhaseChanged] = queue.SimpleQueue()

    def take(event: Event) -> None:
        if isinstance(event, EditMade | EditRefused) or _is_end(event):
            told.put(event)

    placement = LocalProcesses(Workshop(), MEMORY)
    session = placement.place(WorkOrder(order, "walk", 30.0, KEYFRAME_SECONDS), take)
    steps = EditSteps(made_of(json.loads(path.read_text()), order.fabric), MIXED, DEEPEST, seed)
    taken, made, refused, meshes = [], 0, 0, 0
    begun = time.monotonic()
    try:
        session.order(AllowFrame(ALL, keyframe=False, standalone=False, plain=False, again=False))
        session.order(Run(running=True))
        _dressed(told.get(timeout=DRESSED))
        while made < edits:
            event = _changed(session, steps, told)
            if isinstance(event, EditRefused):
                refused += 1
                continue
            made += event.step == "edit"
            meshes += event.change == "topology"
            assert session.pid is not None
            taken.append(own_bytes(session.pid))
            if event.step == "edit" and made % TELL_EVERY == 0:
                tell(f"{made} edits, {len(taken)} changes, {taken[-1] / 1e6:.0f} MB")
    finally:
        placement.close()
    return {
        "vertices": vertices,
        "edits": made,
        "changes": len(taken),
        "meshes": meshes,
        "refused": refused,
        "minutes": round((time.monotonic() - begun) / 60, 1),
        "taken": taken,
        "grown": grown(taken),
    }


def _is_end(event: Event) -> bool:
    return isinstance(event, PhaseChanged) and event.phase in ("ready", "failed")


def _dressed(event: EditMade | EditRefused | PhaseChanged) -> None:
    if not isinstance(event, PhaseChanged) or event.phase == "failed":
        raise RuntimeError(f"the garment is not dressed: {event}")


def _changed(
    session: LocalProcess, steps: EditSteps, told: queue.SimpleQueue[EditMade | EditRefused | PhaseChanged]
) -> EditMade | EditRefused:
    """Ask for the next change, and wait for its answer; one that is dressed anew tells that it is ready, too."""
    command = steps.next()
    session.order(command)
    try:
        while isinstance(event := told.get(timeout=DRESSED), PhaseChanged):
            if event.phase == "failed":
                raise RuntimeError(f"the session failed at change {command.ticket}: {event.detail}")
    except queue.Empty:
        raise RuntimeError(f"change {command.ticket} is not answered: {command}") from None
    if isinstance(event, EditMade):
        steps.made(event)
    return event


def table(made: Mapping[str, Any]) -> str:
    """The section of the page."""
    about, r = made["about"], made["row"]
    taken, size = r["taken"], max(1, -(-len(r["taken"]) // PARTS))
    lines = ["", "## Memory", ""]
    lines += [
        f"Commit {about['commit']}; {about['machine']}; preset {about['preset']}. A walking T-shirt of about "
        f"{r['vertices']} vertices in a session's own processes: {r['edits']} edits and what was taken back and made "
        f"again between them, {r['changes']} changes, {r['meshes']} of them other meshes, in {r['minutes']} minutes; "
        f"{r['refused']} were refused (`tests/edits --levels {r['edits']} --vertices {r['vertices']}`). "
        f"{r['grown'] or KEPT}.",
        "",
        row(["after changes", "least taken among them [MB]", "median", "most"]),
        row(["---"] * 4),
    ]
    for begin in range(0, len(taken), size):
        part = taken[begin : begin + size]
        levels = (f"{taken_so / 1e6:.0f}" for taken_so in (min(part), median(part), max(part)))
        lines.append(row([f"{begin + 1} to {begin + len(part)}", *levels]))
    return "\n".join([*lines, ""])
