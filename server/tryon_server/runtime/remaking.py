"""Another garment made while the one before is worn: the pattern's next cut; where it can't be put on from where that
is worn, as it hung when it was worn before, and dressed anew where it never was, both brought to where the body is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from tryon_server.runtime.beside import Beside, Made, NotMade, Task, Told
from tryon_server.runtime.catching_up import CatchingUp, caught_up
from tryon_server.runtime.drape import BuildDrape, Drape, Packed, Progress, Stance
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.tightness import UnfitError, refuse_what_is_too_tight
from tryon_server.runtime.worn_before import WornBefore
from tryon_server.sessions.events import Doing
from tryon_server.wording import in_parameters
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Edit

PUTTING_ON = Told("Putting it on anew", None)
JUMP = 0.03  # m that cloth goes at most in the frame in which another cut is put on where one is worn: what would go
# further, as the sides of a seam that is closed over a gap, is drawn there first (tryon_solver/drawn.py)


@dataclass(frozen=True, eq=False)
class Dressing:
    """Dresses as ordered. Call it in any process."""

    build: BuildDrape
    order: DrapeOrder

    def __call__(self) -> Packed:
        """Raises ProblemError when the garment can't be put on."""
        return self._dressed(lambda _stage, _share: None)

    def telling(self, tell: Progress) -> Task:
        """The same, which tells how far it is."""
        return partial(self._dressed, tell)

    def _dressed(self, progress: Progress) -> Packed:
        return self.build(self.order, progress).packed()


@dataclass(frozen=True)
class Remade:
    """The garment that was asked for: put on where the old one was worn; or in another stance, and brought to where
    that is in `seconds` of simulated time since. Or, `meanwhile`, what is worn without some of its garments until it is
    there, which are worn again then."""

    drape: Drape
    seconds: float | None = None
    meanwhile: bool = False


class Remaking:
    """At most one garment on its way. The mesh, and what is dressed, are made `beside`; what needs the solver's device
    is made here, in parts that each take at most about as long as a frame."""

    def __init__(self, beside: Beside, build: BuildDrape) -> None:
        self._beside = beside
        self._build = build
        self._worn_before = WornBefore()
        self._order: DrapeOrder | None = None
        self._edit: Edit | None = None
        self._why_anew = ""  # why it could not be put on where the one before is worn
        self._news = PUTTING_ON  # the newest of how it is dressed anew
        self._dressing = False
        self._catching_up: CatchingUp | None = None
        self._drawing_over = False
        self._parts: Iterator[Drape | None] | None = None

    @property
    def under_way(self) -> bool:
        """Is something being made?"""
        return self._order is not None

    @property
    def soon(self) -> bool:
        """Is it being put on where the one before is worn, which takes seconds? Dressing anew takes a minute."""
        return self.under_way and not self._dressing and self._catching_up is None

    @property
    def has_parts(self) -> bool:
        """Is there something left to be done here, and nothing to wait for?"""
        return self._parts is not None

    @property
    def drawing(self) -> bool:
        """Is what is worn about to be drawn to where it hangs in the new garment? Then it has to be advanced."""
        return self._catching_up is not None or self._drawing_over

    @property
    def doing(self) -> tuple[Doing, str, float | None]:
        """What is being done, the same for people, and how much of that is done, 0 to 1; None: not known."""
        if self._catching_up is not None:
            return "settling", "Bringing it to where the body is", None
        if self._drawing_over:
            return "settling", "Drawing it to where it hangs in the new mesh", None
        if self._dressing:
            news = self._beside.news() or self._news
            self._news = news
            return "dressing", news.stage, news.share
        if self._parts is not None:
            return "building", "Putting its mesh on where the garment is worn", None
        return "remeshing", "Making the mesh of its pattern", None

    @property
    def so_far(self) -> str:
        """What has come of it until now, for who has waited too long, to be said behind that; "" where nothing has."""
        if not self._why_anew:
            return ""
        _, stage, share = self.doing
        how_far = "" if share is None else f", {100 * share:.0f} %"
        return f": {self._why_anew}, so it is put on anew ({stage}{how_far})"

    def begin(self, drape: Drape, order: DrapeOrder, edit: Edit | None = None) -> None:
        """Make the garment of the order's pattern and fabric while this one is worn, if by a new edit by this one; what
        was being made is dropped."""
        wanted = order.of_edited
        assert wanted.specification is not None
        self.give_up()
        self._order, self._edit, self._why_anew = order, edit, ""
        self._beside.begin(drape.cutting(wanted.specification, wanted.fabric))

    def give_up(self) -> None:
        """Nobody wants any more what is being made."""
        if self.under_way:  # else what is done beside is another's
            self._beside.give_up()
        self._order, self._parts, self._dressing, self._catching_up = None, None, False, None
        self._drawing_over = False

    def keep(self, drape: Drape, specification: Mapping[str, Any]) -> None:
        """Keep this garment of this pattern, the place of which another takes now, for when that is wanted again. One
        that is worn with others is not kept: these may be others then."""
        if len(drape.names) == 1:
            self._worn_before.keep(drape, specification)

    def forget(self) -> None:
        """What was worn before is wanted no more: other garments are worn."""
        self._worn_before = WornBefore()

    def go_on(self, drape: Drape, stance: Callable[[], Stance]) -> Remade | None:
        """Do the next part, between two frames of this garment, which is worn; the new one once it is there. ``stance``
        tells where the body of what is worn is.

        Raises EditError when it can't be put on, and then nothing is under way.
        """
        if self._parts is not None:
            return self._next_part(self._parts, drape, stance)
        outcome = self._beside.outcome()
        if isinstance(outcome, NotMade):
            self._not_made(outcome, drape, stance)
        elif isinstance(outcome, Made) and self._dressing:
            self._catch_up(outcome.value.solved_as(drape.preset).unpacking(), drape, stance)
        elif isinstance(outcome, Made):
            self._parts = self._put_on_where_worn(outcome.value, drape, stance)
        return None

    def _put_on_where_worn(
        self, cut: Any, drape: Drape, stance: Callable[[], Stance]
    ) -> Iterator[Drape | None]:
        """The parts of this cut put on from where the drape is worn, and drawn there where it would jump."""
        for made in drape.recut(cut, self._hung()):
            if made is not None and made.went > JUMP:
                self._drawing_over = True
                yield from drape.come_to(made, caught_up(made, drape, stance))
            yield made

    def _next_part(
        self, parts: Iterator[Drape | None], drape: Drape, stance: Callable[[], Stance]
    ) -> Remade | None:
        try:
            made = next(parts)
        except StopIteration:
            self._parts, self._why_anew = None, drape.not_carried
            self._put_on_anew(drape, stance)
            return None
        if made is None:
            return None
        seconds = None if self._catching_up is None else made.seconds
        self.give_up()
        return Remade(made, seconds)

    def _not_made(self, outcome: NotMade, drape: Drape, stance: Callable[[], Stance]) -> None:
        """What can't be meshed is refused by dressing in the words of that."""
        if not self._dressing:
            self._put_on_anew(drape, stance)
            return
        self.give_up()
        fault = in_parameters(outcome.problem)
        kind = UnfitError if outcome.problem.code == "garment.unfit" else EditError
        raise kind(f"so it can't be worn: {self._and_why(fault.message)}", fault.place, fault.remedy)

    def _and_why(self, anew: str) -> str:
        """Why it can be worn in neither way, of which `anew` tells the second."""
        return f"{self._why_anew}; and {anew}" if self._why_anew else anew

    def _put_on_anew(self, drape: Drape, stance: Callable[[], Stance]) -> None:
        """As it hung when it was worn before, or from the start. Raises UnfitError where that is of no use."""
        assert self._order is not None
        hung = self._hung()
        if hung is not None:
            as_now = hung.solved_as(drape.preset)
            self._catch_up(as_now.unpacking(self._order.of_edited.specification), drape, stance)
            return
        try:
            refuse_what_is_too_tight(self._edit, drape.overstretched)
        except UnfitError as error:
            self.give_up()
            what = f"so it can't be worn: {self._and_why(error.message)}"
            raise UnfitError(what, error.place, error.remedy) from error
        else:
            self._dressing, self._news = True, PUTTING_ON
            self._beside.begin(Dressing(self._build, self._order))

    def _hung(self) -> Packed | None:
        """The pattern that is ordered as it was worn last, where that was so, and alone."""
        assert self._order is not None
        wanted = self._order.of_edited.specification
        assert wanted is not None
        return None if self._order.over else self._worn_before.recall(wanted)

    def _catch_up(self, unpacking: Iterator[Drape | None], drape: Drape, stance: Callable[[], Stance]) -> None:
        """Put on what is unpacked, and bring it to where the body of the drape that is worn is."""
        self._catching_up = CatchingUp(unpacking, stance, drape)
        self._parts = self._catching_up.parts()
