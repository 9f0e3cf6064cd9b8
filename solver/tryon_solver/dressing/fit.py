"""Does the garment fit? What dressing refuses, with the words for whether size, fabric or pattern is at fault."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import numpy as np

from tryon_solver.advice import allowed, percent
from tryon_solver.dressing.opening import WORTH_SAYING, Opening
from tryon_solver.geometry.garment import GarmentError
from tryon_solver.geometry.located_error import LocatedError
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.weld import WeldedMesh
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.simulation import Simulation

CLOSED = 2e-3  # m, a seam further open than this can't be welded
GAPING = 10e-3  # m, a seam further open than tightness alone would explain
MOST_STRETCH = 1.1  # times the fabric's limit, at rest on a still body
HALVINGS = 40  # of an interval, to far below any length that is told
MOST_SQUEEZED = 10e-3  # m that a garment at rest may press the skin in
TAUT = 0.5  # of the stretch that a fabric bears: one that is stretched by less is not what makes a garment tight


LIMB = 0.05  # m, about the radius of an arm, the narrowest that cloth goes around


class DressingError(LocatedError):
    """The garment could not be put on: what happened, at which piece, and what to try."""


class CrumpledError(DressingError):
    """The seams are closed, or all but, and other fabric was caught between or beside their sides."""


class TightError(DressingError):
    """The garment is too small for this body."""


class TautSeamError(CrumpledError, TightError):
    """Both: the seams are all but closed, and their fabric, stretched as far as it bears, lies on other fabric."""


class StanceError(DressingError):
    """The body is held so that the garment does not go on, in any size: arms on the trunk, legs together, a seat."""


class CrowdedError(DressingError):
    """The garment is held by what lies in its way, not by tightness: its fabric is hardly stretched."""


@contextlib.contextmanager
def unforeseen_refused(what: str) -> Iterator[None]:
    """Whatever fails within, of numbers that no garment and no standing body has, as a DressingError of `what`."""
    try:
        yield
    except (LocatedError, GarmentError):
        raise
    except (ValueError, LookupError, ArithmeticError, RuntimeError) as error:
        raise DressingError(
            f"{what} ({type(error).__name__}: {error})",
            "garment",
            "Try another edge length, fabric or body; if it fails with each, report it with garment and body",
        ) from error


def close_seams(
    panels: PanelMesh, joined: WeldedMesh, fabric: Fabric, stretch: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, CrumpledError | None]:
    """(N, 3) m: each welded vertex at the mean of the vertices it joins, from x (V, 3) m of the unsewn pieces; and
    what is wrong where a seam is a little too far open to be welded, and nothing draws it.

    `stretch` (F,) is the larger principal stretch of each triangle there.

    Raises DressingError naming the pieces of the seam that stayed widest open, and how far they are stretched; a
    TightError where that is further than the fabric bears.
    """
    mean = joined.mean_of_vertices(x)
    open_by, pieces, pulled = _widest_seam(panels, joined, stretch, x)
    if open_by <= CLOSED:
        return mean, None
    names = [panels.panel_names[piece] for piece in pieces]
    what = f"the seam between {' and '.join(names)} stays {2e3 * open_by:.1f} mm open"
    if len(names) == 1:
        what = f"the seam of {names[0]} with itself stays {2e3 * open_by:.1f} mm open"
    if pulled < fabric.strain_limit:
        told = (
            f"{what}: the body or other fabric is between its sides, or its pieces start on the wrong side of each "
            "other",
            f"panels.{names[0]}",
            "Move the pieces so that what is sewn faces each other around the body; where the body is between, enlarge "
            "them; where fabric is, choose a smaller size",
        )
        if open_by > GAPING:
            raise DressingError(*told)
        return mean, CrumpledError(*told)
    cause = "the garment is too tight for this body"
    if open_by > GAPING:
        cause += ", or its pieces start on the wrong sides of each other or of a limb"
    raise TightError(
        f"{what}, though the fabric is stretched by {percent(pulled)} there: {allowed(fabric)}; {cause}",
        f"panels.{names[0]}",
        looser(pulled, names),
    )


def weld_blocked(
    panels: PanelMesh, joined: WeldedMesh, fabric: Fabric, stretch: np.ndarray, x: np.ndarray
) -> CrumpledError:
    """Why seams that are closed, to what welding moves them by, can't be moved by that; arguments as close_seams()."""
    what = "the closed seams could not be welded without touching other fabric"
    open_by, pieces, pulled = _widest_seam(panels, joined, stretch, x)
    if pulled < fabric.strain_limit:
        remedy = "Use a shorter edge length, or a pattern that lies smoother there"
        return CrumpledError(f"{what}: it is crumpled where it is sewn", "garment", remedy)
    names = [panels.panel_names[piece] for piece in pieces]
    return TautSeamError(
        f"{what}; the widest, of {' and '.join(names)}, stays {2e3 * open_by:.1f} mm open, though the fabric is "
        f"stretched by {percent(pulled)} there: {allowed(fabric)}; the garment is too tight for this body",
        f"panels.{names[0]}",
        looser(pulled, names),
    )


def _widest_seam(
    panels: PanelMesh, joined: WeldedMesh, stretch: np.ndarray, x: np.ndarray
) -> tuple[float, list[int], float]:
    """How far [m] a side of the widest seam is from where it is welded, its pieces, and how far they are stretched."""
    gap = np.linalg.norm(x - joined.mean_of_vertices(x)[joined.welded_of_vertex], axis=1)
    worst = int(np.argmax(gap))
    a, b = next((s for s in panels.stitches if worst in s), (worst, worst))
    pieces = sorted({int(panels.panel_of_vertex[v]) for v in (a, b)})
    return float(gap[worst]), pieces, float(stretch[np.isin(panels.panel_of_face, pieces)].max())


def check_rest(simulation: Simulation, panel_names: tuple[str, ...]) -> None:
    """What is worn has come to rest: is it free of the body and of itself, and within what its fabric can bear?

    Raises TightError naming the piece where it is not; CrowdedError where its fabric is hardly stretched.
    """
    scene, report = simulation.scene, simulation.reported
    stretch, fabrics = simulation.stretches(), scene.fabric_of_face()
    worst = int(np.argmax(stretch / np.array([fabric.strain_limit for fabric in fabrics])))
    name, fabric = panel_names[scene.garment.panel_of_face[worst]], fabrics[worst]
    if stretch[worst] > MOST_STRETCH * fabric.strain_limit:
        raise TightError(
            f"the body stretches {name} by {percent(float(stretch[worst]))}: {allowed(fabric)}; the garment is too "
            "tight for this body",
            f"panels.{name}",
            looser(float(stretch[worst]), [name]),
        )
    if report.body_lag > MOST_SQUEEZED:
        what = f"the garment presses the skin in by {1e3 * report.body_lag:.0f} mm"
    elif report.retries or report.overlapping:
        what = (
            "the garment finds no place to rest: somewhere it stays pressed closer to the body or to itself than its "
            "thickness"
        )
    else:
        return
    pulled = float(stretch[worst])
    what += f"; it is stretched most, by {percent(pulled)}, in {name}: {allowed(fabric)}"
    if pulled - 1 < TAUT * (fabric.strain_limit - 1):
        raise CrowdedError(
            f"{what}, so that it is not too tight: more fabric lies there than there is place for, or it is caught",
            f"panels.{name}",
            "Choose a thinner fabric or another size, or draw less fabric where the garment lies on itself",
        )
    raise TightError(f"{what}; it is too tight for this body", f"panels.{name}", looser(pulled, [name]))


def bent(edge: float) -> float:
    """How far edges of this length [m] stretch cloth that goes around a limb and stays outside of it: an arc of a
    circle of radius `LIMB` against the tangents at its ends, tan(a) / a at half its angle a = edge / (2 `LIMB`)."""
    half = edge / (2.0 * LIMB)
    return float(np.tan(half) / half) if half < 0.5 * np.pi else np.inf


def longest_edge(fabric: Fabric) -> float:
    """The longest edges [m] that bend around a limb without stretching the fabric further than it bears."""
    shortest, longest = 0.0, np.pi * LIMB
    for _ in range(HALVINGS):
        middle = 0.5 * (shortest + longest)
        shortest, longest = (middle, longest) if bent(middle) <= fabric.strain_limit else (shortest, middle)
    return shortest


def with_mesh(error: TightError, fabric: Fabric, edge: float) -> TightError:
    """The same, where edges of this mean length [m] alone stretch the fabric further than it bears: no size mends
    that."""
    fine = longest_edge(fabric)
    if edge <= fine:
        return error
    stretched = f"by {percent(bent(edge))}" if np.isfinite(bent(edge)) else "without bound"
    return type(error)(
        f"{error.message}; its mesh, though, is too coarse for {fabric.name}: edges of {100 * edge:.1f} cm that go "
        f"around an arm stretch it {stretched}",
        error.place,
        f"Choose an edge length of at most {np.floor(1000 * fine) / 10:.1f} cm, or a finer preset; if it is still too "
        f"tight then: {error.remedy}",
    )


def with_opening(error: TightError, opening: Opening | None) -> TightError:
    """The same, where `opening`, as the pattern draws it, is too wide at once: no size mends both."""
    if opening is None or opening.too_wide < WORTH_SAYING or not opening.body_girth:
        return error
    around = " and ".join(opening.pieces)
    return TightError(
        f"{error.message}; its opening of {around}, though, is {100 * opening.too_wide:.1f} cm too wide: narrow in one "
        "place and wide in another, it fits in no size",
        error.place,
        f"Widen the pattern where it is too tight and narrow its opening of {around}; in a larger size it may go on, "
        "but slips",
    )


def looser(stretch: float, names: list[str]) -> str:
    """What to do about pieces that are stretched so far."""
    larger = f"Enlarge {' and '.join(names)} there, or choose a larger size of the garment"
    best = max(FABRICS.values(), key=lambda fabric: fabric.strain_limit)
    if stretch >= best.strain_limit:
        return larger
    return f"{larger}, or a fabric that stretches more ({best.name}: {percent(best.strain_limit)})"
