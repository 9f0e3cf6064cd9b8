"""The JSON of the REST side. Lengths in metres, areas in square metres, times in seconds (dates since 1970)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    StrictBool,
    ValidationError,
    ValidatorFunctionWrapHandler,
    field_validator,
)
from pydantic_core import PydanticCustomError

Name = Annotated[str, Field(pattern="^[^\\x00]*$")]  # a database's text can't hold the character 0

KeptAs = Annotated[
    str | None,
    Field(description="of an upload: the name under which the same file is kept already, where another was told"),
]

Size = Annotated[float, Field(ge=0.5, le=2.0)] | Literal["fit"]


class Model(BaseModel):
    """A frozen value; unknown fields in requests are errors, so that a misspelt one is not ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True)


class ProblemReply(Model):
    """What is wrong, where, and what to do about it."""

    code: str
    place: str
    message: str
    remedy: str


class HealthReply(Model):
    """That the server is up."""

    status: str
    version: str
    sessions: int = Field(description="live sessions")


class GarmentReply(Model):
    """A stored garment; vertices and triangles are those of the mesh that checked it, sessions choose their own."""

    id: str
    name: str
    panel_count: int
    seam_count: int
    vertex_count: int
    triangle_count: int
    area: float = Field(description="of fabric, m^2")
    created: float
    notes: list[str] = Field(description="of a mesh: units, axes and rest shape as found, and what was mended")
    built_in: bool = Field(description="it came with the server and can't be removed")
    kept_as: KeptAs = None


class MotionFindings(Model):
    """What was found out about an uploaded motion."""

    fps: float = Field(description="frames a second")
    frame_count: int
    units: str = Field(description="what its lengths are in")
    up: str = Field(description="the axis that is up in its poses: Y, Z, -Y, ...")
    joints_mapped: dict[str, str] = Field(description="part of the body -> joint of the file that moves it")
    joints_unused: list[str] = Field(description="joints of the file that move nothing")
    notes: list[str] = Field(description="all of this, and what was done about it, for people")


class MotionReply(Model):
    """A motion that the server can play. ``name`` is what sessions call it, ``title`` what people do."""

    name: str
    seconds: float
    title: str
    found: MotionFindings | None = Field(description="of an uploaded motion; null: it came with the server")
    kept_as: KeptAs = None


class BodyReply(Model):
    """An uploaded body, which moves by itself, or stands still if it has one frame only."""

    id: str
    name: str
    seconds: float = Field(description="how long its frames last")
    frame_count: int
    vertex_count: int = Field(description="of its surface, after repair and remeshing")
    created: float
    notes: list[str] = Field(description="how it was read, what was mended, whether it passes through itself")
    kept_as: KeptAs = None


def kept_as(known: str, told: str) -> str | None:
    """What an upload's reply says of the name that it was told: None where it is the one that is `known`."""
    return None if known == told.strip() else known


Colour = tuple[float, float, float]


class LookReply(Model):
    """How a fabric looks: pictures of one tile of its weave, which repeats over the pattern."""

    weave: str = Field(description="plain, twill, satin or knit")
    colour: Colour = Field(description="mean of the face, linear RGB, 0 to 1")
    tile: tuple[float, float] = Field(description="length of a tile along the pattern's u and v, m")
    sheen: Colour = Field(description="soft shine at grazing angles, linear RGB, its strength included")
    sheen_roughness: float
    colour_map: str = Field(description="path of a PNG, sRGB; ?dye=RRGGBB dyes the warp in another colour")
    normal_map: str = Field(description="path of a PNG as glTF has it: x along u, y along v, which goes up in it")
    roughness_map: str = Field(
        description="path of a PNG as glTF has it: green is roughness, blue metal, which stands for filaments' lustre"
    )


class FabricReply(Model):
    """A fabric to choose."""

    name: str
    areal_density: float = Field(description="kg/m^2")
    thickness: float = Field(description="m")
    strain_limit: float = Field(description="largest stretch; 1.1 is ten per cent longer than the pattern")
    bending: float = Field(description="bending stiffness, N m")
    source: str = Field(description="what these numbers follow, and which are estimated")
    drape: tuple[float, float] | None = Field(
        description="Cusick's drape coefficient as published for such cloth, least and most, 0 to 1; null: none found"
    )
    look: LookReply


class PrintReply(Model):
    """A picture that repeats over a garment in place of its fabric's colour."""

    id: str
    name: str
    kind: str = Field(description="image/png or image/jpeg")
    pixels: tuple[int, int] = Field(description="along its width and height")
    size: tuple[float, float] = Field(description="width and height on the cloth, m")
    image: str = Field(description="path of the file")
    created: float
    kept_as: KeptAs = None


class FinishChoice(Model):
    """What takes the place of the fabric's own colour in a session; null: not that."""

    dye: Name | None = Field(None, description="colour of the warp in sRGB, RRGGBB")
    print: Name | None = Field(None, description="id of a print")


class DeviceReply(Model):
    """Something that this server can simulate on."""

    name: str
    description: str
    memory: int | None = Field(description="bytes")


class SessionRequest(Model):
    """What a new session is to be."""

    garment: Name = Field(description="id of a garment")
    motion: Name | None = Field(None, description="name of a motion; null: a client streams the poses")
    fabric: Name | None = Field(
        None, description="name of a fabric; null: the pattern's own, else the first of GET /api/fabrics"
    )
    preset: Name | None = Field(None, description="draft, live, fit, reference or auto; null: the server's choice")
    size: Size = Field(1.0, description="of a sewing pattern, over its own; fit: the one that fits, by trying some on")
    body: Name | None = Field(None, description="id of an uploaded body, which brings its motion; null: the default")

    continues: Name | None = Field(
        None,
        description="id of a session of this garment, live or ended: wear its pattern as it was edited, with its "
        "effects and all that was worn over it",
    )

    @field_validator("size", mode="wrap")
    @classmethod
    def _is_a_size(cls, value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        """One fault of one field, where a choice of two types would tell two of none."""
        fault = PydanticCustomError("size", 'a size is a number from 0.5 to 2, or "fit"')
        if isinstance(value, bool) or (isinstance(value, str) and value != "fit"):
            raise fault
        try:
            return handler(value)
        except ValidationError as error:
            raise fault from error


class AccuracyRequest(Model):
    """How accurately a session's frames are to be solved, in what time, and by which preset otherwise; null: as the
    preset has it, no limit, and the preset that the session was opened with."""

    accuracy: Annotated[float, Field(ge=1e-6, le=0.1, strict=True, allow_inf_nan=False)] | None = Field(
        None, description="m: the estimated RMS error that a frame is solved down to"
    )
    deadline_ms: Annotated[float, Field(ge=1, le=10_000, strict=True, allow_inf_nan=False)] | None = Field(
        None, description="ms of wall time that solving a frame may take; accuracy gives way to it"
    )
    preset: Name | None = Field(
        None,
        description="draft, live, fit or reference, built beside what is worn and taken up between two frames; null: "
        "the one that the session was opened with. The mesh stays as it is",
    )


class ChangeReply(Model):
    """A change of the pattern that was asked for and is not worn yet, as in the protocol's status."""

    step: Literal["edit", "undo", "redo"]
    kind: str = Field(description="of the edit; empty of undo and redo")
    panel: str
    garment: str
    seconds: float = Field(description="since it was asked for")
    doing: Literal["waiting", "remeshing", "building", "dressing", "settling", "refused"]
    detail: str = Field(description="the same, for people; of one that was refused: why, and what to do about it")
    progress: float | None


class JobReply(Model):
    """A change of a session that takes longer than who asked for it waited."""

    job: str = Field(description="names it")
    step: Literal["put_on", "take_off", "reorder", "edit", "undo", "redo", "effect"]
    garment: str = Field(description="of which; empty: the edited one, or all of them")
    state: Literal["running", "done", "refused", "cancelled"]
    doing: str = Field(
        description="waiting: others are made first; of an edit as in `changes` of the session; of other garments "
        "dressing, which they are in whichever way, and keeping; of an effect binding; else its state"
    )
    detail: str = Field(description="the same, for people; of one that was refused: why, and what to do about it")
    progress: float | None = Field(description="share done of what `doing` says, 0 to 1; null: not known")
    seconds: float = Field(description="since it was asked for, up to its end")
    cancelling: bool = Field(description="it was asked to stop")
    location: str = Field(description="its path: reading it answers 202 until it is done, DELETE cancels it")


class SessionReply(Model):
    """A session. ``stream`` is the path of its websocket; ``state``, ``detail``, ``fit``, ``fitting_size``,
    ``notes`` and ``worn_size`` as in the protocol's status."""

    id: str
    garment: str
    motion: str | None
    fabric: str
    preset: str = Field(description="that it was opened with")
    created: float
    size: Size = Field(description="as it was asked for; the size that fit stands for is in worn_size")
    body: str | None
    state: str
    detail: str
    fit: str
    fitting_size: float | None = Field(description="the size that fit advises; null: none")
    notes: list[str]
    worn_size: float | None = Field(
        description="of the pattern, over its own; null: it is not dressed yet or not any more, or a mesh"
    )
    accuracy: float | None = Field(description="m, as chosen by PUT /api/sessions/{id}/accuracy or `set_accuracy`")
    deadline_ms: float | None = Field(description="ms, likewise")
    chosen_preset: str | None = Field(description="likewise, by `preset`; null: the one that it was opened with")
    preset_in_force: str = Field(description="that frames are solved with; empty: none are yet, or not any more")
    preset_pending: bool = Field(description="the one that was chosen is not in force yet: it is built beside")
    changes: list[ChangeReply] = Field(description="of the pattern, that are not worn yet, in their order")
    kept_effects: list[KeptEffectReply] = Field(description="asked for before the garment was worn, not made so yet")
    viewers: int
    stream: str


class EffectWordReply(Model):
    """An effect that sessions can be asked for."""

    name: str
    title: str
    about: str
    kept: bool = Field(description="it can't be taken off: that nothing penetrates rests on it")
    lined: bool = Field(description="it is nothing without an entry in one of its lists")
    fields: list[dict[str, Any]] = Field(
        description="its parameters: name, about, unit, kind, default; live: a running scene takes it up at once; "
        "needed: it has to be told; and what that kind has besides, such as low and high"
    )


class EffectRequest(Model):
    """What an effect of a session is to be."""

    parameters: dict[str, Any] | None = Field(
        None, description="by name, those left out as they are by default; null: all as they stand"
    )
    state: Literal["active", "armed"] = Field("active", description="armed: its kernels compiled, and nothing else")


class EffectReply(Model):
    """An effect of a session, as in the protocol's `effects`."""

    name: str
    state: Literal["absent", "armed", "active"]
    pending: Literal["", "compiling", "binding"] = Field(description="what is under way to what was asked for")
    parameters: dict[str, Any]
    why: str = Field(description="for people")
    ms: float | None = Field(description="a frame's calls of its stages; null: not measured")
    stages: dict[str, float] = Field(description="ms of a call of each stage")


class KeptEffectReply(Model):
    """An effect that was asked for before the garment was worn, as in the protocol's `effects`."""

    name: str
    state: Literal["absent", "armed", "active"] = Field(description="what it is to be once the garment is worn")
    parameters: dict[str, Any] | None = Field(description="that it was asked for with; null: as they will stand")
    refused: str = Field(description="why the garment can't have it, and what to do about it; empty: it waits")


class EffectsReply(Model):
    """The effects of a session."""

    effects: list[EffectReply] = Field(description="none while the garment is put on first")
    auto: bool = Field(description="what garment and motion may call for is armed by itself")
    kept: list[KeptEffectReply] = Field(description="asked for before the garment was worn, and not made so yet")
    plan: str = Field(description="the stages of a step and who takes part in each, with ms where measured")
class WearRequest(Model):
    """A garment to be put on over others, or under them."""

    garment: Name = Field(description="id of a garment")
    fabric: Name | None = Field(None, description="name of a fabric; null: the pattern's own, else the first one")
    size: Annotated[float, Field(ge=0.5, le=2.0, strict=True)] = Field(1.0, description="of its pattern, over its own")
    position: Annotated[int, Field(ge=0, strict=True)] | None = Field(
        None, description="from the innermost, 0; null: outermost, or where the one was that it replaces"
    )
    replaces: Name | None = Field(None, description="name of a worn garment that it takes the place of")


class OutfitRequest(Model):
    """Another order of what is worn, or another garment to edit; null: as it is."""

    order: list[Name] | None = Field(None, description="names of all that is worn, from the innermost outwards")
    edited: Name | None = Field(None, description="name of the garment that edits are of")


class WornReply(Model):
    """A garment of what a session wears."""

    name: str = Field(description="its name there, as edits name it")
    garment: str
    fabric: str
    size: Size = Field(description="as it was asked for")
    edited: bool = Field(description="edits that name none are of this one")
    again: bool = Field(False, description="it was taken off and put on again for this change")


class EditRequest(Model):
    """An edit of the pattern that a session wears."""

    garment: Name = Field("", description="name of a worn garment, edited from now on; empty: the edited one")

    edit: dict[str, Any] = Field(description="kind, and that kind's fields; see PROTOCOL.md section 3.2")
    mirror: StrictBool = Field(False, description="do the same on the symmetric piece, or side")


class EditReply(Model):
    """An edit that is kept."""

    id: int
    edit: dict[str, Any]
    mirror: bool
    made: float
    undone: bool = Field(description="it was taken back, and can be made again")
    can_be_undone: bool = Field(description="by this session or one that continues it, those behind it first")
    worn: bool | None = Field(
        description="the garment has taken it on, or, taken back, let go of it; false: it is kept, and worn as soon as "
        "its shape is come to, which takes a moment, or waits until the session plays; null: the session has ended"
    )


class EditedReply(Model):
    """What became of a change of the pattern."""

    id: int = Field(description="of the edit that was made, taken back or made again")
    last: int = Field(description="of the edit that is the last one now; 0: none is left")
    change: Literal["value", "topology"] = Field(description="value: the same triangles in another shape")
    notes: list[str] = Field(description="what happened besides, and by how much edges differ that are sewn together")
