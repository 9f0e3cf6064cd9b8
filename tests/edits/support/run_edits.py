"""Play one case in this process: dress, walk, edit, judge; then take all back and hold it to what it was."""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from edit_case import EditCase, mean_edge
from edit_steps import EditSteps
from edited_session import EditedSession, Script, Shown
from frames_after import FrameWatch
from gone_on import Going, fastest_gone_on
from levels import grown
from undone import ELSEWHERE, UNDER_WAY, Undone, other_than_from_scratch
from worn_frames import WornFrames
from worn_on import fastest_worn_on

from tryon_server.runtime.memory import own_bytes
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.solver_drape import PackedDrape
from tryon_server.sessions.commands import ChangePattern, Command
from tryon_server.sessions.events import EditMade, EditRefused
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.redesign.fabrics import made_of

UNEDITED = 90  # frames of the motion before the first edit: several steps of a walk
AFTER = 8  # frames after a change before the next: the ramp, and five that it is over
SCRATCH = 4  # of so many changes of mesh one is held to what is built from scratch
TELL_EVERY = 10  # changes
ASKED_MOST = 60  # times as many as there are to be made: of some kinds few that are drawn are possible
CRASHED = "the edit failed"
NEW_MESH = ("carried", "anew", "as before")  # ways in which a change is made in a mesh that was made for it
HOWS = ("value", *NEW_MESH)

Tell = Callable[[str], None]
Keep = Callable[[dict[str, Any]], None]


def kept_by_nobody(_figures: dict[str, Any]) -> None:
    """Figures that only who ran it wants."""


class EditRun:
    """One case as it is played."""

    def __init__(self, case: EditCase, wardrobe: Path, tell: Tell, keep: Keep = kept_by_nobody) -> None:
        """`keep` is given the figures when all is taken back; what is compared then takes minutes."""
        self.case, self.tell, self.keep, self.begun = case, tell, keep, time.monotonic()
        mesh = mesh_with_vertices(load_pattern(case.pattern), case.vertices, case.size)
        self.order = DrapeOrder(
            case.pattern,
            case.fabric,
            case.preset,
            case.device,
            edge_length=mean_edge(mesh),
            size=case.size,
            wardrobe=wardrobe,
        )
        self.watch = FrameWatch()
        self.made: Counter[str] = Counter()  # by step, or kind, and what it took
        self.refused: Counter[str] = Counter()  # by kind and reason
        self.asked: Counter[str] = Counter()
        self.broken: list[str] = []
        self.seconds: dict[str, list[float]] = {how: [] for how in HOWS}
        self.worn_frames = WornFrames()
        self.rebuilt = 0  # times that another mesh's simulation was held to one built from scratch
        self.left_out: Counter[str] = Counter()  # why not, or not the whole of it
        self.stretch = 0.0
        self.memory: list[int] = []
        self.worn: PackedDrape | None = None  # as it was after the last change that was looked at
        self.going: Going | None = None  # on from there
        self.without: Going | None = None  # on from when the last change was asked for, without it
        self.undone = Undone(self.order, case.motion, case.continued)

    def run(self) -> dict[str, Any]:
        """The case's figures and what it broke, ready for JSON."""
        self.tell("dressing")
        self.undone.hang_up()
        session = EditedSession(self.order, self.case.motion, self.script)
        session.run()
        self.broken += [f"the session was in trouble: {trouble}" for trouble in session.troubles]
        return self.figures(*self.undone.broken)

    def figures(self, *broken_undone: str) -> dict[str, Any]:
        """What was counted so far, ready for JSON, and what of it is a fault."""
        faults = self.watch.faults
        broken = [*self.broken, *broken_undone, *(said for said in [grown(self.memory)] if said)]
        for found, what in ((faults.crossing, "crosses"), (faults.not_numbers, "is no number"), (faults.too_fast, "")):
            broken += [f"{what} in {each}".strip() for each in found]
        return {
            "case": self.case.plain(),
            "edge_length": self.order.edge_length,
            "vertices": self.undone.vertices,
            "asked": dict(self.asked),
            "made": dict(self.made),
            "refused": dict(self.refused),
            "faults": faults.plain(),
            "rebuilt": self.rebuilt,
            "left_out": dict(self.left_out),
            "stretch": self.stretch,
            "seconds": {how: spread(taken) for how, taken in self.seconds.items()},
            "memory": self.memory,
            "undone": self.undone.plain(),
            "broken": broken,
        }

    def script(self, session: EditedSession) -> Script:
        """What is done with the garment."""
        case = self.case
        steps = EditSteps(session_pattern(self.order), case.kind, case.deepest, case.seed)
        first = [steps.next()] if case.at_once else []
        shown = yield from session.start(*first)
        self.see(shown)
        if first:
            self.take(steps, first[0], (yield from session.answer()))
        else:
            self.set_out(session, (yield from self.look(session, UNEDITED))[-1])
        self.tell("edited")
        while self.edits_made() < case.edits and not self.time_is_up():
            if sum(self.asked.values()) > ASKED_MOST * case.edits:
                self.broken.append(f"of {sum(self.asked.values())} changes only {self.edits_made()} edits were made")
                break
            yield from self.step(session, steps, steps.next())
        while steps.history.done and (yield from self.step(session, steps, steps.undo())):
            pass
        if not steps.history.done:
            self.tell("all taken back")
            self.keep(self.figures("it was ended before it was compared with one that was never edited"))
            worn = self.worn_frames.at(self.watch.faults.frames)
            yield from self.undone.compare(session, steps.history, self.see, worn)
            self.clear_up()

    def time_is_up(self) -> bool:
        """Is no edit begun any more?"""
        return 0.0 < 60.0 * self.case.minutes < time.monotonic() - self.begun

    def edits_made(self) -> int:
        """Edits, without those taken back and made again."""
        return sum(count for what, count in self.made.items() if not what.startswith(("undo", "redo")))

    def step(
        self, session: EditedSession, steps: EditSteps, command: ChangePattern
    ) -> Generator[Sequence[Command], None, bool]:
        """Ask for a change; if it is made, look at the frames that follow. Was it?"""
        answer = yield from session.change(command)
        for each in answer.before:
            self.see(each)
        self.clear_up()
        before = steps.history.specification
        if not self.take(steps, command, answer.event, answer.put_on):
            return False
        how = answer.put_on or ("carried" if changed_mesh(answer.event) else "value")
        self.watch.changed(described(command), carried=how == "carried")
        self.without = self.going
        shown = yield from session.frame()
        if how in NEW_MESH:
            self.worn_frames.replaced(how, before, steps.history.specification, self.watch.faults.frames)
        self.seconds[how].append(shown.came - answer.asked)
        self.see(shown)
        looked_at = yield from self.look(session, AFTER - 1)
        if how in NEW_MESH and sum(len(self.seconds[each]) for each in NEW_MESH) % SCRATCH == 1:
            other, left_out = other_than_from_scratch(session.drape, self.order)
            self.rebuilt += left_out not in (ELSEWHERE, UNDER_WAY)
            self.left_out.update([left_out] if left_out else [])
            self.broken += [f"after {described(command)}, other than built from scratch: {name}" for name in other]
        self.set_out(session, looked_at[-1])
        self.clear_up()
        self.stretch = max(self.stretch, float(session.drape.simulation.stretches().max()))
        self.memory.append(own_bytes(os.getpid()))
        count = sum(self.made.values())
        if count % TELL_EVERY == 0:
            self.tell(f"{count} changes, {self.edits_made()} edits; {len(steps.history.done)} deep")
        return True

    def clear_up(self) -> None:
        """Ask of frames that were too fast whether the garment is so by itself: without the last change, or worn on as
        it is since."""

        def gone_on(speed: float) -> float:
            return 0.0 if self.without is None else fastest_gone_on(self.without, speed)

        def worn_on(speed: float) -> float:
            assert self.worn is not None
            return fastest_worn_on(self.worn, self.case.motion, AFTER, speed)

        self.watch.clear_up(("gone on without the change", gone_on), ("worn on with no edit", worn_on))

    def take(
        self, steps: EditSteps, command: ChangePattern, event: EditMade | EditRefused, put_on: str = ""
    ) -> bool:
        """Count an answer; was it made?"""
        kind = command.step if command.edit is None else str(command.edit["kind"])
        self.asked[kind] += 1
        if isinstance(event, EditRefused):
            self.refused[f"{kind}: {reason(event.message)}"] += 1
            if command.edit is None:
                self.broken.append(f"{described(command)} is refused: {event.message}")
            elif event.message.startswith(CRASHED):
                self.broken.append(f"{dict(command.edit)}: {event.message}")
            return False
        how = f"put on {put_on}" if put_on else event.change
        self.made[f"{kind} ({how})"] += 1
        steps.made(event)
        return True

    def look(self, session: EditedSession, frames: int) -> Generator[Sequence[Command], None, list[Shown]]:
        """Look at so many frames."""
        seen = []
        for _ in range(frames):
            seen.append((yield from session.frame()))
            self.see(seen[-1])
        return seen

    def see(self, shown: Shown) -> None:
        """The next frame."""
        self.watch.see(shown)
        for going in (self.going, self.without):
            if going is not None:
                going.frames.append(shown)

    def set_out(self, session: EditedSession, shown: Shown) -> None:
        """Keep what is worn as it goes in this frame, which is the last one."""
        self.worn = session.drape.packed()
        self.going = Going.of(session.drape, self.worn, shown)


def session_pattern(order: DrapeOrder) -> Any:
    """The pattern's specification as a session has it."""
    return made_of(json.loads(order.pattern.read_text()), order.fabric)


def changed_mesh(event: EditMade | EditRefused) -> bool:
    """Did a change take other triangles?"""
    return isinstance(event, EditMade) and event.change == "topology"


def described(command: ChangePattern) -> str:
    """The change in a few words."""
    if command.edit is None:
        return f"change {command.ticket} ({command.step})"
    both = " on both sides" if command.mirror else ""
    return f"change {command.ticket} ({dict(command.edit)}{both})"


def reason(message: str) -> str:
    """A refusal without what is particular to its place: names and numbers."""
    words = ["..." if any(c.isdigit() or c == "'" for c in word) else word for word in message.split()]
    return " ".join(words)[:90]


def spread(seconds: Sequence[float]) -> dict[str, float]:
    """How many, and what half and 99 of 100 of them do not exceed [s]."""
    if not seconds:
        return {"count": 0}
    return {
        "count": len(seconds),
        "p50": float(np.percentile(seconds, 50)),
        "p99": float(np.percentile(seconds, 99)),
    }
