"""Garments dressed by the solver as a session orders them."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from tryon_protocol import GRID, check_grid
from tryon_server.problems import problem_error
from tryon_server.runtime.bodies import does_not_stand, how_read, load_body, load_moving_mesh, one_joint_body
from tryon_server.runtime.devices import choose_device
from tryon_server.runtime.drape import Progress
from tryon_server.runtime.edited_while_worn import put_on_or_edited
from tryon_server.runtime.effect_binding import cut_of, own_of
from tryon_server.runtime.interface import AUTOMATIC
from tryon_server.runtime.order import DrapeOrder, GarmentOrder
from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.wardrobe import Wardrobe, wardrobe_key
from tryon_server.runtime.worn_garment import WornGarment, alone
from tryon_server.runtime.worn_pattern import WornPattern
from tryon_solver.body.model import BodyModel
from tryon_solver.body.on_device import WornBody
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.dress import Dressed, dress
from tryon_solver.dressing.dress_mesh import dress_mesh
from tryon_solver.dressing.fit import DressingError, StanceError
from tryon_solver.dressing.fitting_room import FittingRoom
from tryon_solver.dressing.holding import holding
from tryon_solver.dressing.opening import Opening
from tryon_solver.dressing.outfit import Outfit as Together
from tryon_solver.dressing.outfit import Worn, WornOutfit
from tryon_solver.dressing.put_over import put_over
from tryon_solver.dressing.stance import Covered
from tryon_solver.dressing.stitching_on import stitched_on
from tryon_solver.dressing.to_fit import OWN, TRY_SIZES, Fitted, dress_to_fit, told_by_height
from tryon_solver.effect_words.table import live
from tryon_solver.files.convention import Told
from tryon_solver.files.garment_file import is_mesh, read_garment
from tryon_solver.files.mesh_body import MeshBody
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.standing import facing
from tryon_solver.geometry.garment import Garment, GarmentError
from tryon_solver.geometry.named_lines import Cut
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import Pattern, PatternError, parse_pattern_bytes, read_pattern_file
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.geometry.size import mesh_in_size
from tryon_solver.geometry.wearable import check_wearable
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.redesign.fabrics import made_of
from tryon_solver.scene import LIVE, Effect, Scene
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import Simulation, build
from tryon_solver.worn_effects import effects_of

logger = logging.getLogger(__name__)

EDGE_LENGTHS = {"draft": 0.017, "live": 0.0085, "fit": 0.006, "reference": 0.006}
"""Length of the mesh's edges [m] by preset: a T-shirt has about 2.5, 10 and 20 thousand vertices."""

STAGES = {
    "looking": "Looking for a frame to dress in",
    "placing": "Placing the pieces around the body",
    "freeing": "Freeing the garment of the body and of itself",
    "sewing": "Sewing the seams",
    "settling": "Letting the garment settle",
    "as before": "Dressing as before",
    "dressed": "Dressed",
    "placing over": "Placing the next garment's pieces around what is worn",
    "sewing over": "Sewing the next garment over what is worn",
    "taking in over": "Taking it in over what is worn",
    "settling over": "Letting all that is worn settle",
    "dressed over": "Dressed",
    "as before over": "Dressing as before",
}

A_WHOLE_BODY = "Export all of the person, from head to feet: by the height is told where a pattern belongs on a body"
TRY_ANOTHER_MESH = "Remesh the garment with longer edges, or choose a thinner fabric."
TRY_ANOTHER = "Correct the pattern, or choose a longer edge length or another fabric."

Named = TypeVar("Named")


def build_drape(order: DrapeOrder, progress: Progress) -> SolverDrape:
    """Mesh the patterns, load the body and dress it, one garment over the other.

    Raises:
        ProblemError: something in the order does not fit, or a garment can't be put on; says what to try.
    """
    return put_on_or_edited(order, lambda ordered: put_on_as_ordered(ordered, progress), progress)


def put_on_as_ordered(order: DrapeOrder, progress: Progress) -> SolverDrape:
    """All of it put on in its patterns. Raises ProblemError."""
    drape = build_innermost(order, progress)
    for garment in order.over:
        drape = put_on_over(drape, garment, order, progress)
    drape.edited = order.of_edited.worn_as
    return drape


def put_on_over(drape: SolverDrape, garment: GarmentOrder, order: DrapeOrder, progress: Progress) -> SolverDrape:
    """The garment put on over what the drape has on, which is as it was dressed. Raises ProblemError."""
    named, place = garment.garment_name or garment.worn_as, f"garments.{garment.worn_as}"
    what = f"{named} can't be put on over {drape.names[-1]}"
    if is_mesh_file(garment.pattern):
        remedy = "Wear it innermost, or choose a sewing pattern"
        raise problem_error("garment.unfit", f"{what}: it is a mesh", remedy, place=place, status=422)
    fabric = _named(FABRICS, "fabric", garment.fabric)
    preset = choose_preset(order.preset, drape.simulation.device)
    edge_length, size = order.edge_length or EDGE_LENGTHS[preset], garment.size or OWN
    tell = _worded(progress)
    try:
        told = garment.specification
        content = read_pattern_file(garment.pattern) if told is None else canonical(told)
        pattern = parse_pattern_bytes(content)
        check_wearable(pattern)
        panels = mesh_in_size(pattern, edge_length, size)
        own = WornPattern(made_of(json.loads(content), fabric.name), panels, size, edge_length)
        outermost = WornGarment(Worn.of_pattern(garment.worn_as, panels, weld(panels), fabric), own)
        garments = (*drape.garments, outermost)
        effects = worn_with(garments)
        worn = put_over_as_before(
            drape.worn_outfit(), garments, effects, order.wardrobe, lambda stage, share: tell(f"{stage} over", share)
        )
    except (PatternError, PlacementError, DressingError) as error:
        message = f"{what}: {error.message}"
        raise problem_error("garment.unfit", message, error.remedy, place=place, status=422) from error
    except GarmentError as error:
        raise problem_error("garment.unfit", f"{what}: {error}", TRY_ANOTHER, place=place, status=422) from error
    old = drape.outfit
    over = SolverDrape(worn.simulation, worn.pose, garments, old.body, old.notes, size=old.size)
    over.outfit = replace(over.outfit, fit=old.fit, fitting_size=old.fitting_size)
    over.own_motion, over.origin = drape.own_motion, drape.origin
    return over


def put_over_as_before(
    worn: WornOutfit,
    garments: Sequence[WornGarment],
    effects: tuple[Effect, ...],
    folder: Path | None,
    tell: Callable[[str, float], None],
) -> WornOutfit:
    """The last of these garments over the others, which are worn: as all of them hung when they were put on so the last
    time, or put on and kept in the folder for the next time. Raises as put_over."""
    outermost, before = garments[-1].worn, worn.simulation
    body, settings = before.scene.body, before.settings.by_budget()
    patterns = [one.pattern for one in garments if one.pattern is not None]
    kept = folder is not None and isinstance(body, BodyModel) and len(patterns) == len(garments)
    assert outermost.panels is not None
    if not kept:
        return put_over(worn, outermost.name, outermost.panels, outermost.fabric, effects, progress=tell)
    assert folder is not None
    assert isinstance(body, BodyModel)
    content = b"\n".join(canonical(pattern.specification) for pattern in patterns)
    choices = [(pattern.edge_length, pattern.size, one.worn.fabric) for pattern, one in zip(patterns, garments)]
    key, wardrobe = wardrobe_key(content, body, (*choices, settings)), Wardrobe(folder)
    outfit = Together(tuple(one.worn for one in garments))
    count = outfit.garment.vertex_count
    hung = wardrobe.recall(key, count + len(body.rest_vertices))
    if hung is None:
        over = put_over(worn, outermost.name, outermost.panels, outermost.fabric, effects, progress=tell)
        wardrobe.keep(key, np.vstack([over.simulation.cloth_positions(), over.simulation.body_positions()]))
        return over
    tell("as before", 1.0)
    cloth, surface = np.split(hung.astype(np.float64), [count])
    scene = outfit.scene(cloth, body, effects)
    return WornOutfit(outfit, build(scene, settings, before.device, worn.pose, surface), worn.pose)


def build_innermost(order: DrapeOrder, progress: Progress) -> SolverDrape:
    """The innermost garment of the order, dressed. Raises ProblemError."""
    device = choose_device(order.device)
    preset = choose_preset(order.preset, device)
    fabric = _named(FABRICS, "fabric", order.fabric)
    settings = PRESETS[preset]
    garment_is_mesh = is_mesh_file(order.pattern)
    if garment_is_mesh:
        _refuse_for_mesh(order)
    progress("Reading the body", None)
    moving = load_moving_mesh(order.body, order.body_reading, order.body_name)
    body: WornBody = load_body(order.body) if moving is None else moving.sequence
    if garment_is_mesh:
        return build_mesh_drape(order, body, moving, fabric, settings, device, progress)
    notes: tuple[str, ...] = ()
    try:
        progress("Meshing the pattern", None)
        edge_length = order.edge_length or EDGE_LENGTHS[preset]
        content = read_pattern_file(order.pattern) if order.specification is None else canonical(order.specification)
        pattern = parse_pattern_bytes(content)
        check_wearable(pattern)
        check_grid(GRID, min(fabric.thickness, settings.body_offset))

        own = mesh_in_size(pattern, edge_length, order.size or OWN)
        room = FittingRoom(body, Covered.by(own), moving, _worded(progress))

        def put_on(size: float) -> Dressed:
            panels = own if size == (order.size or OWN) else mesh_in_size(pattern, edge_length, size)
            tell = _worded(progress, size if order.size is None else None)

            effects = pattern_effects(pattern, panels)

            def wear(body: WornBody) -> Dressed:
                if order.wardrobe is None or not isinstance(body, BodyModel):
                    return dress(panels, body, fabric, settings, device, effects, progress=tell)
                as_worn = canonical(made_of(json.loads(content), fabric.name))  # the same from a file or a history
                key = wardrobe_key(as_worn, body, (fabric, settings, edge_length, size))
                wardrobe = Wardrobe(order.wardrobe)
                return _dress_as_before(panels, body, fabric, effects, settings, device, tell, wardrobe, key)

            return room.put_on(wear)

        if order.size is None:
            room.look_ahead()
            held = holding(pattern_effects(pattern, own), weld(own).garment(), fabric)
            fitted = dress_to_fit(put_on, own, room.body, held)
            notes = (f"garment: {fitted.describe()}",)
        else:
            fitted = Fitted(put_on(order.size), order.size)
        body, moving = room.body, room.moving
    except MeshFileError as error:
        assert moving is not None
        raise does_not_stand(moving, error) from error
    except PatternError as error:
        raise problem_error("pattern.invalid", error.message, error.remedy, place=error.place, status=422) from error
    except (PlacementError, DressingError) as error:
        message, remedy, place = error.message, error.remedy, error.place
        if moving is not None and moving.cut_off:
            message, remedy, place = f"of the body, {moving.cut_off}; as it is, {message}", A_WHOLE_BODY, "body"
        elif order.size == OWN and not isinstance(error, StanceError) and (height := _other_height(room)):
            message, remedy = f"{message}; {height}", f"{remedy}; or {TRY_SIZES}"
        message = f"the garment can't be put on: {message}"
        raise problem_error("garment.unfit", message, remedy, place=place, status=422) from error
    except GarmentError as error:
        message = f"the garment can't be put on: {error}"
        raise problem_error("garment.unfit", message, TRY_ANOTHER, place="garment", status=422) from error
    dressed, opening = fitted.dressed, fitted.upper_opening()
    if room.note:
        notes = (f"body: {room.note}", *notes)
    names, size = dressed.panels.panel_names, fitted.size
    worn = WornPattern(made_of(json.loads(content), fabric.name), dressed.panels, size, edge_length)
    told = how_read(order.body)
    innermost = alone(dressed.simulation, names, worn, order.worn_as)
    return _drape(dressed.simulation, dressed.pose, innermost, body, moving, told, notes, opening, size)


def pattern_effects(pattern: Pattern, panels: PanelMesh) -> tuple[Effect, ...]:
    """What a garment of this pattern and mesh is worn with: the usual, and what its edges call for."""
    own = pattern.effects
    if not own:
        return LIVE
    welded, counts = weld(panels), tuple(len(panel.edges) for panel in pattern.panels)
    return effects_of({**live(), **own}, Cut.of_pattern(welded.garment(), panels, welded, counts))


def worn_with(garments: Sequence[WornGarment]) -> tuple[Effect, ...]:
    """The same of garments that are worn together."""
    own = own_of(garments)
    return effects_of({**live(), **own}, cut_of(garments)) if own else LIVE


def canonical(specification: Mapping[str, Any]) -> bytes:
    """A pattern as the bytes of a file."""
    return json.dumps(specification).encode()


def _other_height(room: FittingRoom) -> str:
    """What there is to say of the height of who is in that room; "" for what is no person: has no feet, and was not
    read as one."""
    x, faces = room.body.surface(room.body.start()), np.asarray(room.body.faces)
    return told_by_height(x) if room.moving is not None or facing(x, faces) is not None else ""


def _refuse_for_mesh(order: DrapeOrder) -> None:
    """Raises ProblemError when something is ordered that only a sewing pattern can have."""
    if order.size != 1.0:
        message = "a garment that is a mesh is worn in the size it comes in"
        raise problem_error("size.of_mesh", message, "Leave the size out", place="size", status=422)
    if order.edge_length is not None:
        message = "a garment that is a mesh is simulated with the edges it comes with"
        remedy = "Leave the edge length out, or remesh the garment before"
        raise problem_error("edge_length.of_mesh", message, remedy, place="edge_length", status=422)


def build_mesh_drape(
    order: DrapeOrder,
    body: WornBody,
    moving: MeshBody | None,
    fabric: Fabric,
    settings: Settings,
    device: str,
    progress: Progress,
) -> SolverDrape:
    """Dress a garment that is a mesh, where it lies on the body. Raises ProblemError."""
    told = Told(order.reading.units, order.reading.up)
    try:
        progress("Reading the garment", None)
        garment = read_garment(
            order.pattern.read_bytes(),
            order.garment_name or order.pattern.name,
            body.rest_vertices,
            told,
            None if moving is None else moving.convention,
            order.reading.rest_shape,
        )
        check_grid(GRID, min(fabric.thickness, settings.body_offset))
        dressed = dress_mesh(garment, body, body.start(), fabric, settings, device, LIVE, progress=_worded(progress))
    except MeshFileError as error:
        message = f"{error.place}: {error.message}"
        raise problem_error("garment.mesh", message, error.remedy, place="garment", status=422) from error
    except DressingError as error:
        message = f"the garment can't be put on: {error.message}"
        raise problem_error("garment.unfit", message, error.remedy, place=error.place, status=422) from error
    except GarmentError as error:
        message = f"the garment can't be put on: {error}"
        raise problem_error("garment.unfit", message, TRY_ANOTHER_MESH, place="garment", status=422) from error
    notes = tuple(f"garment: {note}" for note in dressed.notes)
    own = alone(dressed.simulation, dressed.piece_names, None, order.worn_as)
    return _drape(dressed.simulation, dressed.pose, own, body, moving, how_read(order.body), notes)


def _drape(
    simulation: Simulation,
    pose: Any,
    own: WornGarment,
    body: WornBody,
    moving: MeshBody | None,
    standing_notes: tuple[str, ...],
    garment_notes: tuple[str, ...],
    opening: Opening | None = None,
    size: float | None = None,
) -> SolverDrape:
    """The drape of a dressed garment, with what was found out about body and garment."""
    told = standing_notes if moving is None else moving.notes
    notes = [*(f"body: {note}" for note in told), *garment_notes]
    shown = body if isinstance(body, BodyModel) else one_joint_body(body.rest_vertices, body.faces)
    drape = SolverDrape(simulation, pose, (own,), shown, tuple(notes), opening, size)
    drape.own_motion = None if moving is None else moving.sequence
    return drape


def own_fabric(path: Path) -> str | None:
    """What the pattern file says the garment is made of; None where it says nothing, is a mesh, or no pattern at all,
    which is told when it is dressed."""
    if is_mesh_file(path):
        return None
    try:
        return parse_pattern_bytes(read_pattern_file(path)).fabric
    except PatternError:
        return None


def is_mesh_file(path: Path) -> bool:
    """Whether a garment's file is a mesh; one that can't be read is left to be told by who reads it next."""
    try:
        return is_mesh(path.read_bytes())
    except OSError:
        return False


def _dress_as_before(
    panels: PanelMesh,
    body: BodyModel,
    fabric: Fabric,
    effects: tuple[Effect, ...],
    settings: Settings,
    device: str,
    tell: Callable[[str, float], None],
    wardrobe: Wardrobe,
    key: str,
) -> Dressed:
    """The garment as it hung when it was dressed the last time, or dressed anew and kept for the next time."""
    welded = weld(panels)
    count = welded.vertex_count
    hung = wardrobe.recall(key, count + len(body.rest_vertices))
    if hung is None:
        dressed = dress(panels, body, fabric, settings, device, effects, progress=tell)
        simulation = dressed.simulation
        wardrobe.keep(key, np.vstack([simulation.cloth_positions(), simulation.body_positions()]))
        return dressed
    tell("as before", 1.0)
    garment = Garment(welded.vertex_of_corner, welded.uv_corners, welded.panel_of_face, welded.vertex_count)
    pose = Pose.rest(body)
    cloth, surface = np.split(hung.astype(np.float64), [count])
    worn = (*effects, *stitched_on(panels, welded.welded_of_vertex, fabric))
    simulation = build(Scene(garment, cloth, body, fabric, worn), settings, device, pose, surface)
    return Dressed(simulation, welded, panels, pose)


def choose_preset(name: str, device: str) -> str:
    """The preset of this name; ``auto`` is what the device can do in real time. Raises ProblemError."""
    automatic = "draft" if device == "cpu" else "live"
    return _named({AUTOMATIC: automatic, **{preset: preset for preset in PRESETS}}, "preset", name)


def _named(known: Mapping[str, Named], kind: str, name: str) -> Named:
    if name not in known:
        remedy = f"Choose one of: {', '.join(known)}"
        raise problem_error(f"{kind}.unknown", f"there is no {kind} {name!r}", remedy, place=kind, status=422)
    return known[name]


def _worded(progress: Progress, tried: float | None = None) -> Callable[[str, float], None]:
    """The solver's names of its stages in words for people, with the size `tried` on where one is looked for."""
    where = "" if tried is None else f" in size {tried:g}"
    return lambda stage, share: progress(f"{STAGES.get(stage, stage.capitalize())}{where}", share)
