"""One kinematic sub-step: cloth and surface go along one field, as far as that is proven free of contact.

A GPU is told to search, and to look how far the motion is free, before anybody waits for it: what it counted, and what
it saw, is read at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.contact import bounds, candidates, deflect, found
from tryon_solver.linalg.device_loop import keeps_graphs
from tryon_solver.linalg.read_back import Reading, read
from tryon_solver.stepping.record import as_one
from tryon_solver.stepping.search import (
    begin_search,
    end_search,
    end_search_further,
    follow,
    found_of,
    launch_search_along,
    launch_search_further,
    list_holds,
    many,
    search_along,
)
from tryon_solver.stepping.take import move

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

FILTER_ROUNDS = 4  # of turning a motion aside and searching further, before it is shortened for good
HELD_GAP = 0.3  # share of the activation distance that the carried motion leaves: room to slide for cloth in a fold


@dataclass(frozen=True)
class Sight:
    """What was seen of the motion in `direction`: the passes that shortened something, how many vertices leave the
    region by what is left of it, which is in `alpha`, and whether any piece flies in this step."""

    held: int
    leaving: int
    flying: bool


def looks_ahead(sim: Simulation) -> bool:
    """Can a search be followed by launches that do not know what it finds? Not where there was nothing before it."""
    return keeps_graphs(sim.device) and bool(sim.touching) and sim.candidates.size > 0


def look_ahead(sim: Simulation, share: float) -> Sight | None:
    """Search along `direction` from x, by `share` of what the solve moved last, and see how far it is free. None: there
    was too little room for what was found, or nothing was."""
    begin_search(sim)
    as_one(sim, f"look_ahead_{share:g}", lambda: launch_search_and_look(sim, share))
    return seen(sim, Reading(*what_is_seen(sim)).end())


def set_out_and_go(
    sim: Simulation, set_out: Callable[[], None], go_on: Callable[[], None]
) -> tuple[Sight | None, bool, float]:
    """Launch what sets out, and look ahead along the `direction` that it leaves. Where all of that motion is free, and
    `largest_out` holds no more than a sub-step's travel, the device takes it and goes on by itself, while the host
    still reads: did it, and what does that hold [m]?"""

    def look() -> None:
        set_out()
        launch_search_and_look(sim, share=1.0)
        lists, passes, hits = sim.candidates, sim.filtering.passes, sim.work.hits
        bounds.find_clear(passes, hits, lists, sim.largest_out, sim.settings.substep_travel, sim.clear)

    def take() -> None:
        go(sim)
        go_on()

    begin_search(sim)
    as_one(sim, "set_out_and_look_ahead", look)
    reading = Reading(*what_is_seen(sim), sim.clear, sim.largest_out)
    as_one(sim, "go_on", lambda: wp.capture_if(sim.clear, take))
    *told, clear, travel = reading.end()
    return seen(sim, told), bool(clear[0]), float(travel[0])


def launch_search_and_look(sim: Simulation, share: float) -> None:
    """For who waits later: search along `direction`, and see how far it is free."""
    sim.work.alpha.fill_(1.0)
    launch_search_along(sim, sim.state.x, sim.work.direction, share)
    launch_look(sim)


def where_told(sim: Simulation) -> list[wp.array]:
    """Where it is told what a look saw."""
    return [sim.filtering.passes.state, sim.work.hits, *([] if sim.flight is None else [sim.flight.any])]


def what_is_seen(sim: Simulation) -> list[wp.array]:
    """The same of a search and a look."""
    return [*where_told(sim), *(one.counts for one in found_of(sim))]


def sight_of(sim: Simulation, told: Sequence[np.ndarray]) -> Sight:
    """What a look saw, of what has been read of it."""
    state, leaving, *flying = told
    return Sight(sim.filtering.passes.number_in(state), int(leaving[0]), any(some[0] for some in flying))


def seen(
    sim: Simulation, told: Sequence[np.ndarray], end: Callable[[Simulation, list[found.Counts]], bool] = end_search
) -> Sight | None:
    """What has been read of both; the search has ended, as `end` ends it. None: there was too little room for what was
    found, or nothing was."""
    looks = len(where_told(sim))
    fitted = end(sim, [found.counts_of(each) for each in told[looks:]])
    return sight_of(sim, told[:looks]) if fitted and sim.candidates.size > 0 else None


def carry_once(sim: Simulation, last: bool, sight: Sight | None) -> None:
    """One kinematic sub-step along `direction`; `sight` is of it if it was searched along already, as `look_ahead`
    does. The search of the last one is for the rest of the step as well."""
    state, work = sim.state, sim.work
    if not sim.touching:
        work.alpha.fill_(1.0)
    else:
        share = 1.0 if last else 0.0
        if sight is None and not list_holds(sim, state.x, work.direction):
            if looks_ahead(sim):
                sight = look_ahead(sim, share)
            else:
                search_along(sim, state.x, work.direction, share)
        if sim.candidates.size:
            filter_motion(sim, stop_short(sim, sight, share), share)
        else:
            work.alpha.fill_(1.0)
    as_one(sim, "go", lambda: go(sim))


def go(sim: Simulation) -> None:
    """Take `alpha` of the motion, which is free."""
    body = sim.body
    move(sim, sim.work.direction)
    if sim.touching:
        follow(sim, near=False)
    if body is not None:
        wp.copy(body.skin_now, body.skin_next)


def stop_short(sim: Simulation, sight: Sight | None, share: float) -> Sight | None:
    """Let what flies stop short of what it meets, and then what meets that; `share` as of `look_ahead`. Returns what is
    seen of the motion as it is then, None if nobody has looked."""
    flight = sim.flight
    if flight is None:
        return sight
    for _ in range(flight.pieces):
        sight = sight or look(sim)
        if not sight.held or not sight.flying:
            return sight
        sight = None
        if not flight.stop_short(sim):
            return None
        search_along(sim, sim.state.x, sim.work.direction, share)
    return None


def filter_motion(sim: Simulation, sight: Sight | None, share: float) -> None:
    """Make the motion in `direction` free of contact: turn it aside where it would close a gap, shorten what is left.

    Who is held back falls behind its anchor. Where many fall out of the region, as of cloth pinched between limbs, the
    search is made anew around where they come to, by `share` as of `look_ahead`: balls that reach there from where
    they were expected would list all that lies in the fold with all else in it. Of the few who are left it goes
    further, and the motion is looked at again; in the end it is shortened alone, by what each search finds.
    """
    seen = sight or look(sim)
    if many(sim, seen.leaving):
        turn_aside(sim)
        seen = search_and(sim, as_far(share), turn_aside)
    for _ in range(FILTER_ROUNDS):
        if seen.leaving:
            seen = search_and(sim, FURTHER, turn_aside)
        elif seen.held:
            turn_aside(sim)
            seen = what_was_seen(sim)
        else:
            return
    while seen.leaving:
        seen = search_and(sim, FURTHER, launch_look)


@dataclass(frozen=True)
class Search:
    """What begins a search, launches it, and ends it once what was counted has been read: was there room for that?"""

    name: str
    begin: Callable[[Simulation], None]
    launch: Callable[[Simulation], None]
    end: Callable[[Simulation, list[found.Counts]], bool]


def as_far(share: float) -> Search:
    """Along all of the motion that `alpha` leaves; `share` as of `look_ahead`."""

    def launch(sim: Simulation) -> None:
        bounds.find_allowed(sim.work.direction, sim.work.alpha, sim.work.total)
        launch_search_along(sim, sim.state.x, sim.work.total, share)

    return Search(f"search_as_far_{share:g}", begin_search, launch, end_search)


def keep_list(_sim: Simulation) -> None:
    """A search that goes further begins with what has been found."""


def launch_further(sim: Simulation) -> None:
    """Search for those whom what `alpha` leaves of the motion takes out of the region, too."""
    launch_search_further(sim, sim.work.direction, sim.work.alpha)


FURTHER = Search("search_further", keep_list, launch_further, end_search_further)


def search_and(sim: Simulation, search: Search, look_at: Callable[[Simulation], None]) -> Sight:
    """Search, and have the motion looked at by what `look_at` launches: a GPU's host waits once for both. Where there
    was no room for what was found, the device leaves the motion as it is, and it is looked at once there is."""
    sight, together = None, looks_ahead(sim)

    def both() -> None:
        search.launch(sim)
        wp.capture_if(sim.candidates.fits, lambda: look_at(sim))

    search.begin(sim)
    if together:
        as_one(sim, f"{search.name}_and_{look_at.__name__}", both)
        sight = seen(sim, Reading(*what_is_seen(sim)).end(), search.end)
    else:
        search.launch(sim)
        search.end(sim, found.counted(found_of(sim)))
    if sight is None:
        look_at(sim)
        sight = what_was_seen(sim)
    return sight


def turn_aside(sim: Simulation) -> None:
    """Turn the motion aside where it could close a gap, and look how far what is left of it is free, for who waits
    later."""

    def deflect_and_look() -> None:
        deflect_motion(sim)
        sim.work.alpha.fill_(1.0)
        launch_look(sim)

    as_one(sim, "turn_aside", deflect_and_look)


def deflect_motion(sim: Simulation) -> None:
    """Deflect `direction` where it could close a gap; who cannot collide has no say in it."""
    sizes = sim.contact.sizes
    candidates.list_closing(sim.candidates, sim.work.direction, max(sizes.xi_body, sizes.xi_self))
    deflect.deflect(
        sim.candidates,
        True,
        sim.cloth_count,
        sizes,
        sim.state.x,
        sim.work.direction,
        sim.filtering.changed,
        sim.deflection,
        sim.filtering.passes,
        sim.settings.deflection_passes,
        HELD_GAP * sim.settings.d_hat,
    )


def look(sim: Simulation) -> Sight:
    """Shrink `alpha`, from all of the motion, until it is proven free. Waits for the device."""
    sim.work.alpha.fill_(1.0)
    launch_look(sim)
    return what_was_seen(sim)


def what_was_seen(sim: Simulation) -> Sight:
    """By the last look. Waits for the device."""
    return sight_of(sim, read(*where_told(sim)))


def launch_look(sim: Simulation) -> None:
    """Shrink `alpha` from what it is until the motion is proven free, for who waits later."""
    state, work = sim.state, sim.work

    def shorten_and_count() -> None:
        shorten(sim)
        bounds.count_leaving(state.x, work.direction, work.alpha, sim.region, work.hits)

    as_one(sim, "look", shorten_and_count)


def shorten(sim: Simulation, before: wp.array | None = None, level: Callable[[], None] | None = None) -> None:
    """Shrink `alpha` until the motion is proven free; `before`, if it is told, and `level` as of `bounds.shorten`."""
    work = sim.work
    bounds.shorten(
        sim.candidates,
        False,
        sim.cloth_count,
        sim.contact.sizes,
        sim.state.x,
        work.direction,
        work.alpha,
        sim.filtering.alpha_before if before is None else before,
        sim.filtering.changed,
        sim.filtering.passes,
        level,
    )
