"""What the server asks of a simulated garment. The solver's simulation satisfies it through production.py; so does any
other drape that the tests or a later placement bring along."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from tryon_server.runtime.beside import Task
from tryon_server.runtime.order import DrapeOrder
from tryon_server.sessions.commands import MotionFile
from tryon_solver.body.mesh_sequence import MeshSequence, Moment
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import Pose
from tryon_solver.effect_words.rules import Parameters
from tryon_solver.geometry.garment import Layer

Stance = Pose | Moment
"""How a body stands: a pose of one that is posed, a moment of one that moves by itself."""

Progress = Callable[[str, float | None], None]
"""Told what is being done, in words for people, and the fraction of it that is done, None when that is not known."""


@dataclass(frozen=True)
class GarmentPart:
    """One garment of what is worn: the name of its fabric; `layer`: its own, and which vertices, triangles and panels
    are its."""

    fabric: str
    layer: Layer


@dataclass(frozen=True, eq=False)
class Outfit:
    """What stays as it is while what is worn moves.

    Attributes:
        vertex_count: N, vertices of the cloth.
        faces: (F, 3) int32, triangles of the cloth, counter-clockwise from outside.
        uv: (F, 3, 2) pattern coordinates of every corner of every triangle [m].
        panel_of_face: (F,) index into ``panel_names`` of every triangle.
        panel_names: names of the pattern's pieces.
        body: the body that wears it.
        fit: what there is to say about its fit, a sentence for people; "" where it fits.
        fitting_size: the size of its pattern that would fit, over its own; None where no other one would fit better.
        notes: how garment and body were read from files that say little, and what was mended, for people.
        size: in which its pattern is worn, over its own; None for a mesh.
        garments: what is worn, from the innermost outwards; () where that has no name.
    """

    vertex_count: int
    faces: npt.NDArray[np.int32]
    uv: npt.NDArray[np.floating[Any]]
    panel_of_face: npt.NDArray[np.integer[Any]]
    panel_names: tuple[str, ...]
    body: BodyModel
    fit: str = ""
    fitting_size: float | None = None
    notes: tuple[str, ...] = ()
    size: float | None = None
    garments: tuple[GarmentPart, ...] = ()


class StepFacts(Protocol):
    """What a drape reports of one ``advance``; units and meaning as in the solver's StepReport."""

    @property
    def iterations(self) -> int: ...
    @property
    def residual(self) -> float: ...
    @property
    def error(self) -> float: ...
    @property
    def min_gap(self) -> float: ...
    @property
    def gap_offset(self) -> float: ...
    @property
    def max_stretch(self) -> float: ...
    @property
    def body_lag(self) -> float: ...
    @property
    def pairs(self) -> int: ...
    @property
    def retries(self) -> int: ...
    @property
    def times_ms(self) -> Mapping[str, float]: ...
    @property
    def late(self) -> float: ...
    @property
    def asleep(self) -> bool: ...
    @property
    def advice(self) -> str: ...
    def to_dict(self) -> Mapping[str, Any]: ...


CLOSE = 0.015
"""m: cloth that is nearer to a vertex of the body lies on it, where their edges are as long."""


@dataclass(frozen=True)
class Character:
    """What a garment and its motion are like, from which is told which effects they may call for.

    Attributes:
        speed: of the fastest tenth of the cloth, at least [m/s].
        off_body: how far off the body the tenth hangs that is farthest from it, at least [m].
        close: share of the cloth that lies on the body, within CLOSE.
        stretch: largest principal stretch of the tenth that is stretched most, at least.
        limit: the fabric's largest stretch.
        weight: of the lightest garment [N/m^2].
        layered: a piece lies on another.
        closed: it has no opening.
    """

    speed: float
    off_body: float
    close: float
    stretch: float
    limit: float
    weight: float
    layered: bool
    closed: bool


Asked = Mapping[str, Parameters]
"""Effects by name, each with all its parameters (tryon_solver/effect_words)."""


@dataclass(frozen=True)
class EffectTimes:
    """ms of a call by stage, and of a frame: by how often the last one before had them called."""

    stages: Mapping[str, float]
    frame: float


class DrapeEffects(Protocol):
    """The effects of what is worn.

    Attributes:
        asked: which it is worn with; another value where they have changed.
        own: those that its patterns call for.
        garments: names of what is worn, from the innermost outwards.
    """

    asked: Asked
    own: Asked

    @property
    def garments(self) -> tuple[str, ...]: ...

    @property
    def caveats(self) -> Mapping[str, str]:
        """Of effects by name, what is not brought out of them as the cloth is solved now, and what helps; for
        people."""

    def under_garments(self, name: str, parameters: Parameters) -> Parameters:
        """The effect's parameters with each piece called by its garment's name and its own, which hold for whatever is
        worn with that garment, too."""

    def check(self, asked: Asked) -> None:
        """Raises EffectError where it can't be worn with these."""

    def write(self, asked: Asked) -> None:
        """Be worn with these from the next ``advance`` on, which differ by values alone (same_but_values)."""

    def fade(self, wanted: Asked) -> float:
        """Have go gently what is not to act any more once it is worn with ``wanted``, and what was to go and is wanted
        again come back; for how many simulated seconds some of it is still on its way."""

    def rebind(self, asked: Asked) -> Iterator[None]:
        """Come to be worn with these, in parts, between which the garment may be advanced; it is once they are done.

        Raises EffectError, and then nothing has changed.
        """

    def times(self) -> Iterator[tuple[str, EffectTimes]]:
        """What each part of the scene takes, by its name; measured as it is asked for."""

    def plan(self, times: Mapping[str, Mapping[str, float]]) -> str:
        """The stages of a step and who takes part in each, with those times, for people."""

    def character(self) -> Character:
        """What garment and motion are like now."""


class Drape(Protocol):
    """A dressed garment that can be advanced in time.

    Attributes:
        outfit: what stays as it is.
        pose: how it stood when it was dressed.
        own_motion: the body's frames, if it came as a mesh; then it stands only as they show it.
        origin: (3,) m, whole metres: where the origin of the positions lies in the session's space, in which the poses
            are. It follows the body, so that float32 holds the positions.
        names: of the garments that are worn, from the innermost outwards.
        edited: which of them the following speak of: ``specification``, ``reshape``, ``shape_of``, ``cutting`` and
            ``recut``; ``edit_garment`` chooses it.
        specification: the sewing pattern that its mesh was made of, plain JSON that parse_pattern passes; None of a
            garment that has none.
        waiting: is nothing to be done for the next cut before the next frame? It waits for the body to come by.
        not_carried: why the next cut could not be put on where this one is worn, the last time that was so.
        went: how far its cloth went at most when it was put on where another cut was worn [m].
        preset: by which it is solved.
        outgrown: why the shape it was last told to take needs another mesh, found on the way to it; "" as a rule.
        effects: what acts on it besides its fabric.
    """

    outfit: Outfit
    pose: Stance
    own_motion: MeshSequence | None
    origin: npt.NDArray[np.float64]
    outgrown: str
    not_carried: str
    waiting: bool
    went: float

    @property
    def preset(self) -> str: ...
    @property
    def stance(self) -> Stance:
        """Where the body is, as the last ``advance`` had it."""

    @property
    def seconds(self) -> float:
        """Simulated, until the last ``advance``, since it was dressed [s]."""

    @property
    def overstretched(self) -> float:
        """Share of the cloth that is stretched by more than its fabric bears, of the garment that is edited."""

    @property
    def effects(self) -> DrapeEffects: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def edited(self) -> str: ...
    @property
    def specifications(self) -> Mapping[str, Mapping[str, Any] | None]:
        """The pattern that each garment's mesh was made of, by name; None of one that has none."""

    def size_of(self, name: str) -> float | None:
        """In which the pattern of the garment of this name is worn, over its own; None of a mesh."""

    @property
    def specification(self) -> Mapping[str, Any] | None: ...

    def edit_garment(self, name: str) -> None:
        """Edits are of this garment from now on."""

    def take_off(self, *names: str) -> Iterator[Drape | None]:
        """What is worn without the garments of these names, as it is worn then, in parts as those of ``recut``."""

    def reshape(self, specification: Mapping[str, Any], shape: Any = None) -> str:
        """Take on the pattern's shape, from the next ``advance`` on; why that needs another mesh, and then nothing is
        changed, or "". ``shape`` is what ``shape_of`` found for it. Not to be asked of a garment without a pattern."""

    @property
    def on_the_way(self) -> bool:
        """Has a garment yet to come to the shape that it was last told to take on?"""

    @property
    def shape_of(self) -> Callable[[Mapping[str, Any]], Any]:
        """What finds the shape of a pattern in this garment's mesh, in any process, as ``reshape`` does here."""

    def cutting(self, specification: Mapping[str, Any], fabric: str) -> Task:
        """What makes the pattern's mesh, beside the simulation, to be worn of this fabric: for ``recut``."""

    def recut(self, cut: Any, hung: Any = None) -> Iterator[Drape | None]:
        """Put on what ``cutting`` made where the garment is worn, in parts. ``hung`` is what was ``packed`` of a
        garment of that pattern when it was worn before: cloth of which nothing is worn now is put where it hung.

        None comes after each but the last, and this garment may be advanced; the last gives the new one, as this one is
        worn then: its next ``advance`` is this one's. Without one it ends where it has to be dressed anew.
        """

    def come_to(self, other: Any, way: Iterator[None], off: Sequence[str] = ()) -> Iterator[Drape | None]:
        """What this drape and the ``other`` have both is drawn to where that has it, while this one is advanced, in
        parts; both are in the same stance at the same time then. First the other comes its ``way``, in parts, to where
        the body is; from there it is advanced along with this one, which no part but an ``advance`` brings any nearer.
        Where something is to be taken ``off`` before what is left is drawn, one part gives that drape, which is worn in
        place of this one from then on.

        Raises what ``way`` or advancing the other raises, and then what was worn last is worn on.
        """

    def come_at_once(self) -> None:
        """Be with the next part where `come_to` draws it, if it does, however far that is."""

    def packed(self) -> Packed:
        """Itself to be put away or taken to another process, as it is worn."""

    def leap(self, by: npt.NDArray[np.float64]) -> None:
        """Be elsewhere, body and garment as one, by (3,) whole metres, without having moved there."""

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        """Solve so from the next ``advance`` on: down to an estimated error of ``accuracy`` [m], in ``deadline`` [s] of
        wall time; None: as the preset has it, and in what it takes."""

    def solve_as(self, preset: str) -> Iterator[None]:
        """Come to be solved by this preset, in the mesh that it has, in parts, between which it may be advanced; it is
        once they are done. What else it is worn with, and what was bought, stays.

        Whatever is raised: then nothing has changed.
        """

    def come_along(self) -> None:
        """In the next ``advance`` go with the body as if the room moved: nothing of that motion is felt, and in the end
        it has the body's speed."""

    def advance(self, pose: Stance, t: float, longest_step: float = 0.0) -> StepFacts:
        """Simulate from the last pose's time to ``pose`` at time ``t`` [s], counted from the dressing.

        Steps may be ``longest_step`` s long if the settings have them shorter.
        """

    def cloth_positions(self) -> npt.NDArray[np.float32]:
        """(N, 3) positions of the cloth [m], from ``origin``."""

    def body_positions(self) -> npt.NDArray[np.float32]:
        """(B, 3) positions of the body's simulated surface [m], from ``origin``."""


class Packed(Protocol):
    """A garment that was put away: can be pickled."""

    def solved_as(self, preset: str) -> Packed:
        """The same, solved by this preset once it is unpacked."""

    def unpacking(self, specification: Mapping[str, Any] | None = None) -> Iterator[Drape | None]:
        """The garment as it was worn, at rest, in parts, as those of ``recut``; in the shape of this pattern, which it
        has had in its mesh."""


BuildDrape = Callable[[DrapeOrder, Progress], Drape]
"""Dresses the body as ordered, telling its progress; raises ProblemError when the garment can't be put on."""


class LoadMotion(Protocol):
    """Finds a motion."""

    def __call__(self, name: str, body: BodyModel, file: MotionFile | None = None) -> Motion:
        """The motion of this name, in this file if it was uploaded, for this body; raises ProblemError."""
