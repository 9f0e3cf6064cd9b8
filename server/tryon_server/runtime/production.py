"""The real drape: the solver's simulation behind the server's interface."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from tryon_protocol import GRID, check_grid
from tryon_server.problems import problem_error
from tryon_server.runtime.bodies import does_not_stand, how_read, load_body, load_moving_mesh, one_joint_body
from tryon_server.runtime.cutting import Cut, Cutting
from tryon_server.runtime.devices import AUTOMATIC, choose_device
from tryon_server.runtime.drape import Outfit, Progress
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.wardrobe import Wardrobe, wardrobe_key
from tryon_solver.body.mesh_sequence import MeshSequence
from tryon_solver.body.model import BodyModel
from tryon_solver.body.on_device import WornBody
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.carry_over import CarryError, prepare, put_on
from tryon_solver.dressing.dress import Dressed, dress
from tryon_solver.dressing.dress_mesh import dress_mesh
from tryon_solver.dressing.fit import DressingError, StanceError
from tryon_solver.dressing.fitting_room import FittingRoom
from tryon_solver.dressing.opening import Opening
from tryon_solver.dressing.stance import Covered
from tryon_solver.dressing.stitching_on import stitched_on
from tryon_solver.dressing.to_fit import OWN, TRY_SIZES, Fitted, dress_to_fit, told_by_height
from tryon_solver.files.convention import Told
from tryon_solver.files.garment_file import is_mesh, read_garment
from tryon_solver.files.mesh_body import MeshBody
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.standing import facing
from tryon_solver.geometry.garment import Garment, GarmentError
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import PatternError, parse_pattern_bytes, read_pattern_file
from tryon_solver.geometry.piece_meshes import keep, kept
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.geometry.size import in_size, mesh_in_size
from tryon_solver.geometry.wearable import check_wearable
from tryon_solver.geometry.weld import weld
from tryon_solver.live_edit import LiveEdit
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.redesign.drag import Drag, drag_in_parts
from tryon_solver.redesign.fabrics import made_of
from tryon_solver.redesign.parsed import parsed
from tryon_solver.redesign.structure import difference
from tryon_solver.reshape import OtherStructureError
from tryon_solver.results import StepReport
from tryon_solver.scene import LIVE, Scene
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import Simulation, build

logger = logging.getLogger(__name__)

EDGE_LENGTHS = {"draft": 0.017, "live": 0.0085, "fit": 0.006}
"""Length of the mesh's edges [m] by preset: a T-shirt has about 2.5, 10 and 20 thousand vertices."""

FARTHEST = 8.0
"""Where the solver's origin is moved along [m]: a root this far from it along an axis. METHOD.md section 13."""

STAGES = {
    "looking": "Looking for a frame to dress in",
    "placing": "Placing the pieces around the body",
    "freeing": "Freeing the garment of the body and of itself",
    "sewing": "Sewing the seams",
    "settling": "Letting the garment settle",
    "as before": "Dressing as before",
    "dressed": "Dressed",
}

A_WHOLE_BODY = "Export all of the person, from head to feet: by the height is told where a pattern belongs on a body"
TRY_ANOTHER_MESH = "Remesh the garment with longer edges, or choose a thinner fabric."
TRY_ANOTHER = "Correct the pattern, or choose a longer edge length or another fabric."

Named = TypeVar("Named")


@dataclass(frozen=True)
class WornPattern:
    """A sewing pattern as it is worn: plain JSON, meshed in `size` times its own by edges of `edge_length` m."""

    specification: Mapping[str, Any]
    panels: PanelMesh
    size: float
    edge_length: float

    def drag_in_parts(self, thickness: float) -> Iterator[Drag | None]:
        """Make it ready to take on other shapes in the same mesh; `thickness` m is the worn fabric's. None after each
        part but the last."""
        own = in_size(self.panels, 1.0 / self.size)
        return drag_in_parts(own, parsed(self.specification), thickness / self.size)


class SolverDrape:
    """A garment dressed by the solver, as the server's worker drives it."""

    def __init__(
        self,
        simulation: Simulation,
        pose: Any,
        panel_names: tuple[str, ...],
        body: BodyModel,
        notes: tuple[str, ...] = (),
        opening: Opening | None = None,
        size: float | None = None,
        worn: WornPattern | None = None,
    ) -> None:
        """`pose` is the stance in which it was dressed; `body` the body as told to clients; `notes` and `size` as in
        Outfit; `opening` the one by which the garment hangs, where it hangs by one; `worn` the pattern, if there is
        one."""
        self.simulation = simulation
        self._dressed_at = simulation.state.time
        garment = simulation.scene.garment
        fit = "" if opening is None else opening.advice
        self.outfit = Outfit(
            vertex_count=garment.vertex_count,
            faces=garment.faces,
            uv=garment.uv_corners if garment.spline_corners is None else garment.spline_corners,
            panel_of_face=garment.panel_of_face,
            panel_names=panel_names,
            body=body,
            fit=fit,
            fitting_size=None if opening is None else opening.advised_size,
            notes=notes,
            size=size,
        )
        self.pose = pose
        self.own_motion: MeshSequence | None = None
        self.origin = np.zeros(3)
        self.specification = None if worn is None else worn.specification
        self.outgrown = ""
        self._worn = worn
        self._drag: Drag | None = None  # made ready with the garment, or not
        self._edit: LiveEdit | None = None
        self._stance, self._time = pose, 0.0  # of the last advance

    @property
    def notes(self) -> tuple[str, ...]:
        """How garment and body were read, and what there is to say of the fit, for people."""
        outfit = self.outfit
        return (*outfit.notes, f"fit: {outfit.fit}") if outfit.fit else outfit.notes

    def reshape(self, specification: Mapping[str, Any]) -> str:
        """Take on the pattern's shape; why that needs another mesh, or ""."""
        assert self._worn is not None
        self.outgrown = ""
        pattern = parsed(specification)
        if self._edit is None:
            structure = difference(parsed(self._worn.specification), pattern)
            if structure is not None:  # told without what a drag begins with, which takes longer than a frame
                return structure.message
            drag = self._drag
            if drag is None:
                *_, drag = self._worn.drag_in_parts(self.simulation.scene.fabric.thickness)
            assert drag is not None
            self._edit = LiveEdit(self.simulation, drag, self._worn.size)
        remesh = self._edit.want(pattern)
        return "" if remesh is None else remesh.message

    def cutting(self, specification: Mapping[str, Any], fabric: str) -> Cutting:
        """What makes the pattern's mesh, beside the simulation, to be worn of this fabric."""
        worn = self._worn
        assert worn is not None
        before = worn.panels if self._edit is None else in_size(self._edit.wanted, worn.size)
        spacing = self.simulation.settings.subspace_spacing
        return Cutting(specification, before, worn.edge_length, worn.size, spacing, fabric, kept())

    def recut(self, cut: Cut) -> Iterator[SolverDrape | None]:
        """That mesh put on from where this garment is worn, in parts; none where it can't be."""
        worn = self._worn
        assert worn is not None
        keep(cut.pieces)
        panels, fabric = cut.made.mesh, FABRICS[cut.fabric]
        drag: list[Drag | None] = [None]
        own = replace(worn, specification=cut.specification, panels=panels)

        def made_ready() -> Iterator[None]:
            for drag[0] in own.drag_in_parts(fabric.thickness):
                yield None

        try:
            prepared = None
            for made in prepare(self.simulation, cut.made, fabric, made_ready()):
                prepared = made
                yield None
            assert prepared is not None
            before = worn.panels if self._edit is None else in_size(self._edit.now, worn.size)
            carried = put_on(prepared, self.simulation, before)
        except (CarryError, GarmentError) as error:
            logger.info("the garment is dressed anew: %s", error)
            return
        old, names = self.outfit, panels.panel_names
        drape = SolverDrape(carried.simulation, self._stance, names, old.body, old.notes, size=old.size, worn=own)
        drape.outfit = replace(drape.outfit, fit=old.fit, fitting_size=old.fitting_size)
        drape.own_motion, drape.origin = self.own_motion, self.origin
        drape._dressed_at, drape._time, drape._drag = -self._time, self._time, drag[0]
        yield drape

    def packed(self) -> PackedDrape:
        """Itself, as it was dressed and hangs."""
        sim = self.simulation
        assert sim.body is not None
        scene = replace(sim.scene, x_start=sim.cloth_positions().astype(np.float64))
        pose, surface = sim.body.pose, sim.body_positions().astype(np.float64)
        return PackedDrape(scene, sim.settings, sim.device, pose, surface, self.outfit, self.own_motion, self._worn)

    def leap(self, by: npt.NDArray[np.float64]) -> None:
        """Be elsewhere by (3,) whole metres: nothing changes but where the solver's origin lies."""
        self.origin = self.origin + by

    def advance(self, pose: Any, t: float, longest_step: float = 0.0) -> StepReport:
        """Simulate from the last pose's time to ``pose`` at time ``t`` [s], counted from the dressing."""
        assert self.simulation.body is not None
        moving = self.simulation.body.moving
        place = moving.place(pose) - self.origin
        far = np.abs(place) > FARTHEST
        if far.any():
            by = np.where(far, np.round(place), 0.0)
            self.simulation.move_origin(by)
            self.origin = self.origin + by
        if self._edit is not None and not self.outgrown:
            try:
                self._edit.before_frame(self._dressed_at + t)
            except (GarmentError, OtherStructureError) as error:
                self.outgrown = str(error)
        report = self.simulation.advance(moving.moved(pose, -self.origin), self._dressed_at + t, longest_step)
        self._stance, self._time = pose, t
        return report

    def cloth_positions(self) -> npt.NDArray[np.float32]:
        """(N, 3) positions of the cloth [m], from ``origin``."""
        return self.simulation.cloth_positions()

    def body_positions(self) -> npt.NDArray[np.float32]:
        """(B, 3) positions of the body's simulated surface [m], from ``origin``."""
        return self.simulation.body_positions()


@dataclass(frozen=True, eq=False)
class PackedDrape:
    """A dressed garment as plain values: what its simulation is built of, `surface` (B, 3) m that of the body, and what
    the drape has besides."""

    scene: Scene
    settings: Settings
    device: str
    pose: Any
    surface: npt.NDArray[np.float64]
    outfit: Outfit
    own_motion: MeshSequence | None
    worn: WornPattern | None

    def unpacked(self) -> SolverDrape:
        """The garment, at rest. Raises GarmentError as `build`."""
        simulation = build(self.scene, self.settings, self.device, self.pose, self.surface)
        drape = SolverDrape(simulation, self.pose, self.outfit.panel_names, self.outfit.body, worn=self.worn)
        drape.outfit, drape.own_motion = self.outfit, self.own_motion
        return drape


def build_drape(order: DrapeOrder, progress: Progress) -> SolverDrape:
    """Mesh the pattern, load the body and dress it.

    Raises:
        ProblemError: something in the order does not fit, or the garment can't be put on; says what to try.
    """
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

            def wear(body: WornBody) -> Dressed:
                if order.wardrobe is None or not isinstance(body, BodyModel):
                    return dress(panels, body, fabric, settings, device, LIVE, progress=tell)
                key = wardrobe_key(content, body, (fabric, settings, edge_length, size))
                return _dress_as_before(panels, body, fabric, settings, device, tell, Wardrobe(order.wardrobe), key)

            return room.put_on(wear)

        if order.size is None:
            room.look_ahead()
            fitted = dress_to_fit(put_on, own, room.body)
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
    return _drape(dressed.simulation, dressed.pose, names, body, moving, told, notes, opening, size, worn)


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
    return _drape(dressed.simulation, dressed.pose, dressed.piece_names, body, moving, how_read(order.body), notes)


def _drape(
    simulation: Simulation,
    pose: Any,
    piece_names: tuple[str, ...],
    body: WornBody,
    moving: MeshBody | None,
    standing_notes: tuple[str, ...],
    garment_notes: tuple[str, ...],
    opening: Opening | None = None,
    size: float | None = None,
    worn: WornPattern | None = None,
) -> SolverDrape:
    """The drape of a dressed garment, with what was found out about body and garment."""
    told = standing_notes if moving is None else moving.notes
    notes = [*(f"body: {note}" for note in told), *garment_notes]
    shown = body if isinstance(body, BodyModel) else one_joint_body(body.rest_vertices, body.faces)
    drape = SolverDrape(simulation, pose, piece_names, shown, tuple(notes), opening, size, worn)
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
        dressed = dress(panels, body, fabric, settings, device, LIVE, progress=tell)
        simulation = dressed.simulation
        wardrobe.keep(key, np.vstack([simulation.cloth_positions(), simulation.body_positions()]))
        return dressed
    tell("as before", 1.0)
    garment = Garment(welded.vertex_of_corner, welded.uv_corners, welded.panel_of_face, welded.vertex_count)
    pose = Pose.rest(body)
    cloth, surface = np.split(hung.astype(np.float64), [count])
    effects = (*LIVE, *stitched_on(panels, welded.welded_of_vertex, fabric))
    simulation = build(Scene(garment, cloth, body, fabric, effects), settings, device, pose, surface)
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
