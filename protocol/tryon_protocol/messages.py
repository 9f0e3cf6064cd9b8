"""The control messages: MessagePack maps told apart by their field "type". PROTOCOL.md sections 3 to 5 are their prose.

Every field carries its meaning, unit and shape as a `Meta` description; the TypeScript interfaces are generated from
these types (`python -m tryon_protocol.generate_ts`). Unknown fields are ignored by every reader, so a field may be
added within one major version if it has a default; a field is never removed, renamed or given another meaning.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Union

from msgspec import Meta, Struct

from .effect_messages import EffectsMessage, MeasureEffectsMessage, RemoveEffectMessage, SetEffectMessage
from .message_base import U32, Message, Name, Number, Request, Text
from .outfit_messages import OutfitMessage, PutOnMessage, ReorderMessage, TakeOffMessage
from .report_messages import ReportMessage

SUBPROTOCOL = "tryon.v1"
MAJOR_VERSION = 1
MAX_CLIENT_MESSAGE_BYTES = 65536
"""A client message longer than this many bytes is refused."""
POSE_CONVENTION = "model-local"
POSE_FRAME = "session"
POSE_CLOCK = "sender"
POSE_CLOCKS = (POSE_CLOCK, "server")
POSE_SMOOTHINGS = ("one-euro", "none")
MAX_JOINTS = 1024
"""A pose or skeleton with more joints than this is refused."""

WhichGarment = Annotated[
    str, Meta(max_length=200, description='a name of `topology.cloth.garments`, edited from now on; "": the edited one')
]
Vector = tuple[float, float, float]
Point = tuple[float, float]
Quaternion = tuple[float, float, float, float]
DType = Literal["uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"]
SessionState = Literal["preparing", "dressing", "running", "paused", "waiting", "failed", "closed"]


class ArrayData(Struct, frozen=True, kw_only=True):
    """An array as bytes: never without its dtype and its shape."""

    dtype: Annotated[DType, Meta(description="type of one element, little-endian")]
    shape: Annotated[
        tuple[Annotated[int, Meta(ge=0, le=2**31 - 1)], ...],
        Meta(description="extent of each axis, the last one varies fastest (C order)"),
    ]
    codec: Annotated[Literal["none", "zstd"], Meta(description="how `data` is compressed")]
    data: Annotated[bytes, Meta(description="elements in C order; product of shape times element size bytes inflated")]


class GarmentTopology(Struct, frozen=True, kw_only=True):
    """One garment of what is worn: which vertices, triangles and pattern pieces of the cloth are its own. They lie one
    after the other."""

    name: Annotated[str, Meta(description="its name among what is worn, as edits name it")]
    fabric: Annotated[str, Meta(description="what it is made of")]
    vertices: Annotated[tuple[U32, U32], Meta(description="its first vertex and how many it has")]
    faces: Annotated[tuple[U32, U32], Meta(description="its first triangle and how many it has")]
    panels: Annotated[tuple[U32, U32], Meta(description="its first pattern piece and how many it has")]


class ClothTopology(Struct, frozen=True, kw_only=True):
    """What does not change from frame to frame about what is worn."""

    vertex_count: Annotated[int, Meta(ge=1, le=2**31 - 1, description="number N of welded cloth vertices in a frame")]
    faces: Annotated[
        ArrayData, Meta(description="uint32 (F,3): vertex numbers of each triangle, counter-clockwise from outside")
    ]
    uv: Annotated[
        ArrayData | None,
        Meta(description="float32 (F,3,2) m: pattern coordinates of each triangle corner, discontinuous at seams"),
    ] = None
    panel_of_face: Annotated[
        ArrayData | None, Meta(description="uint16 (F,): index into `panel_names` of each triangle's pattern piece")
    ] = None
    panel_names: Annotated[tuple[str, ...], Meta(description="names of the pattern pieces; empty: not told")] = ()
    garments: Annotated[
        tuple[GarmentTopology, ...],
        Meta(description="what is worn, from the innermost outwards; empty: one garment, of which nothing is told"),
    ] = ()


class BodyTopology(Struct, frozen=True, kw_only=True):
    """The body model of the session: a surface of B vertices bound to J joints, posed by PROTOCOL.md section 8."""

    rest_vertices: Annotated[ArrayData, Meta(description="float32 (B,3) m: surface in the rest pose, Y up, facing +Z")]
    faces: Annotated[ArrayData, Meta(description="uint32 (F,3): closed triangles, counter-clockwise from outside")]
    joint_names: Annotated[tuple[str, ...], Meta(description="J names, the order of a pose's rotations")]
    parents: Annotated[
        ArrayData, Meta(description="int32 (J,): parent of each joint; -1 for joint 0, parents precede children")
    ]
    rest_joints: Annotated[ArrayData, Meta(description="float32 (J,3) m: joint centres in the rest pose")]
    skin_joints: Annotated[ArrayData, Meta(description="uint16 (B,K): joints that move each vertex")]
    skin_weights: Annotated[ArrayData, Meta(description="float32 (B,K): their weights, each row sums to 1")]


# From the client to the server ------------------------------------------------------------------------------------


class HelloMessage(Message, tag="hello", frozen=True, kw_only=True):
    """First message of a client. The server answers with `welcome`, or with a fatal `error`."""

    versions: Annotated[
        tuple[Annotated[int, Meta(ge=1, le=2**31 - 1)], ...],
        Meta(min_length=1, max_length=16, description="major protocol versions the client speaks"),
    ]
    client: Annotated[Name, Meta(description="name and version of the client program, for logs")]
    codecs: Annotated[
        tuple[str, ...],
        Meta(max_length=16, description='frame compression the client can inflate: "zstd"; uncompressed needs no name'),
    ] = ("zstd",)
    resume: Annotated[
        Text | None, Meta(description="token from an earlier `welcome`, to be known again; null: new")
    ] = None


class SkeletonMessage(Message, tag="skeleton", frozen=True, kw_only=True):
    """What a tracker's poses consist of: its joints, in the order of the poses' arrays, and its own rest pose.

    Sent before the first pose of another convention than "model-local", and again when any of it changes. The rest pose
    stands upright, in metres, Y up, facing +Z.
    """

    subject: Annotated[Name, Meta(description="whose body this is, a subject listed in `welcome`")]
    convention: Annotated[
        Name, Meta(description='"webxr", "head-hands", "mediapipe", "smpl" or "bvh": whose names and numbers these are')
    ]
    joint_names: Annotated[
        tuple[Name, ...],
        Meta(
            min_length=1, max_length=MAX_JOINTS, description="[K]: the convention's names of the joints that are sent"
        ),
    ]
    parents: Annotated[
        tuple[Annotated[int, Meta(ge=-1, le=MAX_JOINTS)], ...],
        Meta(
            max_length=MAX_JOINTS, description='[K]: parent of each joint, -1 for joint 0; "bvh" needs it; []: not told'
        ),
    ] = ()
    rest_positions: Annotated[
        tuple[Vector, ...],
        Meta(max_length=MAX_JOINTS, description='[K][3] m: joints in the rest pose; "bvh" needs it; []: not told'),
    ] = ()
    rest_rotations: Annotated[
        tuple[Quaternion, ...],
        Meta(
            max_length=MAX_JOINTS,
            description="[K][4]: x, y, z, w of each joint's axes in the rest pose, for conventions whose poses hold "
            "world rotations; []: not told",
        ),
    ] = ()
    request: Request = None


class PoseMessage(Message, tag="pose", frozen=True, kw_only=True):
    """One tracked pose of one body. The newest one wins; older ones that were not used yet are dropped."""

    subject: Annotated[Name, Meta(description="whose body this is, a subject listed in `welcome`")]
    convention: Annotated[
        Name,
        Meta(
            description='what the arrays mean: "model-local", the rotation of each joint of the session\'s body '
            "relative to its parent and to the rest pose, or the convention of an earlier `skeleton`"
        ),
    ]
    frame: Annotated[
        Name,
        Meta(
            description='coordinate system of the positions: "session", right-handed, metres, Y up, floor at 0; '
            '"mediapipe-world", as MediaPipe gives its world landmarks'
        ),
    ]
    t: Annotated[float, Meta(description="s, when the pose was captured, on the clock named by `clock`")]
    seq: Annotated[Number, Meta(description="number of this pose, growing; frames name the pose they were solved for")]
    root: Annotated[
        Vector | None,
        Meta(description='m, float64 [3]: position of joint 0, for "model-local", "smpl" and "bvh"; null: none'),
    ] = None
    rotations: Annotated[
        tuple[Quaternion, ...],
        Meta(
            max_length=MAX_JOINTS,
            description="[J][4]: unit quaternion x, y, z, w of each joint: local, in the order of the topology or of "
            '`skeleton`; in the world for "webxr" and "head-hands"; [] for "mediapipe"',
        ),
    ] = ()
    positions: Annotated[
        tuple[Vector, ...],
        Meta(
            max_length=MAX_JOINTS,
            description='m, [K][3]: place of each joint of `skeleton`, for "webxr", "head-hands", "mediapipe"; else []',
        ),
    ] = ()
    confidence: Annotated[
        tuple[Annotated[float, Meta(ge=0, le=1)], ...],
        Meta(
            max_length=MAX_JOINTS,
            description="[K]: how surely each joint is seen, 0 to 1; below 0.5 its numbers are not used; []: all are",
        ),
    ] = ()
    clock: Annotated[
        Name,
        Meta(description='whose steady clock `t` is on: "sender", or "server" for one who has converted it by `ping`'),
    ] = POSE_CLOCK
    smoothing: Annotated[
        Name | None,
        Meta(
            description='how the server filters this stream: "one-euro" or "none"; null: "none" for "model-local", '
            '"one-euro" for trackers'
        ),
    ] = None
    ack: Annotated[U32, Meta(description="newest frame seq the client has decoded; 0: none yet")] = 0


class AckMessage(Message, tag="ack", frozen=True, kw_only=True):
    """Acknowledges frames when no pose is being sent. At most `welcome.credit` frames travel unacknowledged."""

    seq: Annotated[Number, Meta(description="newest frame seq the client has decoded")]


class KeyframeRequestMessage(Message, tag="keyframe_request", frozen=True, kw_only=True):
    """The client can't decode what comes next (it lacks the base): the next frame shall stand alone."""

    reason: Annotated[Text, Meta(description="for logs")] = ""


class PlayMessage(Message, tag="play", frozen=True, kw_only=True):
    """Let the session's time run on, from where `pause` stopped it."""

    request: Request = None


class PauseMessage(Message, tag="pause", frozen=True, kw_only=True):
    """Stop the session's time: body and cloth stand still as they are, and nothing is simulated until `play`."""

    request: Request = None


class SetMotionMessage(Message, tag="set_motion", frozen=True, kw_only=True):
    """Choose what moves the body: a motion the server plays, or the poses clients send."""

    motion: Annotated[Name | None, Meta(description="a name of `welcome.motions`; null: poses sent by a client")]
    request: Request = None


class SetFabricMessage(Message, tag="set_fabric", frozen=True, kw_only=True):
    """Choose the fabric of the garment."""

    fabric: Annotated[Name, Meta(description="a name of `welcome.fabrics`")]
    request: Request = None


class SetAccuracyMessage(Message, tag="set_accuracy", frozen=True, kw_only=True):
    """Choose how accurately the session's frames are solved from the next one on, and what each may take; and, once it
    is built beside what is worn, by which preset. Nothing is dressed anew. Whatever is chosen, no frame penetrates.
    """

    accuracy: Annotated[
        Annotated[float, Meta(ge=1e-6, le=0.1)] | None,
        Meta(description="m, 1e-6 to 0.1: `report.error` that a frame is solved down to; null: as the preset has it"),
    ] = None
    deadline_ms: Annotated[
        Annotated[float, Meta(ge=1, le=10_000)] | None,
        Meta(description="ms, 1 to 10 000: wall time that solving a frame may take; null: what it takes"),
    ] = None
    preset: Annotated[
        Name | None, Meta(description="draft, live, fit or reference; null: that which the session was opened with")
    ] = None
    request: Request = None


class EditMessage(Message, tag="edit", frozen=True, kw_only=True):
    """Change the garment's pattern while it is worn. The server answers `edited`, or `error` and nothing has changed.

    With `hold` the change is shown and not kept, as while it is dragged: the next `edit` takes its place, and of those
    that come between two frames the newest counts. It is always a change of the pattern that is kept.
    """

    edit: Annotated[
        dict[str, Any] | None,
        Meta(description="`kind` and the fields of that kind, PROTOCOL.md section 3.2; null: show what is kept"),
    ]
    mirror: Annotated[bool, Meta(description="do the same on the symmetric piece, or side")] = False
    hold: Annotated[bool, Meta(description="show it, don't keep it; there is no `edited`")] = False
    garment: WhichGarment = ""
    request: Request = None


class UndoMessage(Message, tag="undo", frozen=True, kw_only=True):
    """Take the last edit back. Answered as `edit`."""

    garment: WhichGarment = ""
    request: Request = None


class RedoMessage(Message, tag="redo", frozen=True, kw_only=True):
    """Make the edit again that was taken back last. Answered as `edit`."""

    garment: WhichGarment = ""
    request: Request = None


class PingMessage(Message, tag="ping", frozen=True, kw_only=True):
    """Asks for a `pong` at once: round trip and clock offset."""

    t: Annotated[float, Meta(description="s, the client's steady clock at sending; repeated in the answer")]


class ByeMessage(Message, tag="bye", frozen=True, kw_only=True):
    """The client leaves; the server closes with code 1000."""

    reason: Annotated[Text, Meta(description="for logs")] = ""


# From the server to the client ------------------------------------------------------------------------------------


class WelcomeMessage(Message, tag="welcome", frozen=True, kw_only=True):
    """Answer to `hello`: what was agreed, and the state of the session."""

    version: Annotated[int, Meta(ge=1, description="major protocol version both sides speak from here on")]
    session: Annotated[str, Meta(description="identifier of the session")]
    epoch: Annotated[str, Meta(description="changes when the server restarts: sequence numbers begin anew")]
    server: Annotated[str, Meta(description="name and version of the server program, for logs")]
    clock: Annotated[float, Meta(description="s, the server's steady clock at sending")]
    credit: Annotated[int, Meta(ge=1, description="most frames that travel unacknowledged to this client")]
    topology_id: Annotated[U32, Meta(description="topology that follows; 0: none yet, the garment is being dressed")]
    subjects: Annotated[tuple[str, ...], Meta(description="bodies of this session that poses may be sent for")]
    motions: Annotated[tuple[str, ...], Meta(description="motions the server can play here")]
    fabrics: Annotated[tuple[str, ...], Meta(description="fabrics to choose from")]
    resume_token: Annotated[str | None, Meta(description="for `hello.resume` after a lost connection")] = None


class TopologyMessage(Message, tag="topology", frozen=True, kw_only=True):
    """Everything that frames refer to. Sent before the first frame, and again with a new id whenever it changes."""

    topology_id: Annotated[Number, Meta(description="number that frames repeat")]
    grid: Annotated[float, Meta(gt=0, le=1e-3, description="m, edge q of the grid that positions are rounded to")]
    cloth: Annotated[ClothTopology, Meta(description="the garment")]
    body: Annotated[BodyTopology, Meta(description="the body model")]


class DesignEdge(Struct, frozen=True, kw_only=True):
    """An edge of a piece."""

    ends: Annotated[tuple[U32, U32], Meta(description="vertices where it starts and ends")]
    shape: Annotated[Literal["line", "quadratic", "cubic", "arc"], Meta(description="what it is drawn as")]
    handles: Annotated[
        tuple[Point, ...],
        Meta(description="m: what `move_handle` moves, in its order; of a line at its thirds, of an arc its middle"),
    ]
    points: Annotated[tuple[Point, ...], Meta(description="m: points along it, ends included, to draw it by")]


class DesignPanel(Struct, frozen=True, kw_only=True):
    """A piece of the pattern, in its own plane."""

    name: Annotated[str, Meta(description="by which edits name it")]
    label: Annotated[str, Meta(description='for people; "": none')]
    vertices: Annotated[tuple[Point, ...], Meta(description="m: its corners, by the numbers that edits use")]
    edges: Annotated[tuple[DesignEdge, ...], Meta(description="around its outline, by the numbers that edits use")]


class DesignSeam(Struct, frozen=True, kw_only=True):
    """Two edges that are sewn together."""

    first: Annotated[tuple[U32, U32], Meta(description="number of a panel, and of an edge in it")]
    second: Annotated[tuple[U32, U32], Meta(description="what it is sewn to")]
    number: Annotated[
        U32, Meta(description="by which people know it: it stays as other seams come and go; 0: its place in the list")
    ] = 0


class DesignPatch(Struct, frozen=True, kw_only=True):
    """A piece that lies on another and is sewn on it, as a pocket is."""

    panel: Annotated[U32, Meta(description="number of the piece")]
    host: Annotated[U32, Meta(description="number of the panel that it lies on")]
    points: Annotated[tuple[Point, ...], Meta(description="m: its outline there, in that panel's plane")]


class DesignEdit(Struct, frozen=True, kw_only=True):
    """An edit that was made and is kept."""

    id: Annotated[Number, Meta(description="its number in this session; never given twice")]
    kind: Annotated[str, Meta(description="what kind of edit it is")]
    panel: Annotated[str, Meta(description='the piece it names; "": the whole garment')]


class DesignMessage(Message, tag="design", frozen=True, kw_only=True):
    """The edited garment's sewing pattern as it is worn. Sent on joining once it is dressed, and on every change of it.

    A garment that is a mesh has none.
    """

    held: Annotated[bool, Meta(description="true: this shows an edit that is not kept (`edit.hold`)")]
    panels: Annotated[tuple[DesignPanel, ...], Meta(description="the pieces")]
    seams: Annotated[tuple[DesignSeam, ...], Meta(description="how they are sewn")]
    done: Annotated[tuple[DesignEdit, ...], Meta(description="edits that `undo` can take back, oldest first")]
    undone: Annotated[U32, Meta(description="how many edits `redo` can make again")]
    notes: Annotated[
        tuple[str, ...], Meta(description="for people: which pieces followed, which seams fit no longer as they did")
    ] = ()
    patches: Annotated[tuple[DesignPatch, ...], Meta(description="what lies on other pieces, as pockets do")] = ()
    garment: Annotated[str, Meta(description='which of `topology.cloth.garments` it is of; "": it has no name')] = ""


class EditedMessage(Message, tag="edited", frozen=True, kw_only=True):
    """Answer to `edit`, `undo` and `redo`: it is done, and kept whatever happens to the server."""

    id: Annotated[U32, Meta(description="of the edit that is the last one now; 0: none is left")]
    change: Annotated[
        Literal["value", "topology"],
        Meta(description="value: the same triangles in another shape; topology: another mesh, dressed anew"),
    ]
    request: Request = None


class ChangeStatus(Struct, frozen=True, kw_only=True):
    """A change of the pattern that was asked for and is not worn yet."""

    step: Annotated[Literal["edit", "undo", "redo"], Meta(description="what was asked for")]
    kind: Annotated[str, Meta(description="of the edit; empty of undo and redo")]
    panel: Annotated[str, Meta(description="the piece that the edit names; empty where it names none")]
    garment: Annotated[str, Meta(description="the garment that it names; empty: the edited one")]
    since: Annotated[float, Meta(description="s, when it was asked for, server's clock as in `pong`")]
    doing: Annotated[
        Literal["waiting", "remeshing", "building", "dressing", "settling", "refused"],
        Meta(
            description="waiting: others are made first, or the garment is put on; remeshing: its mesh is made; "
            "building: that is put on where the garment is worn; dressing: it is put on anew; settling: it is brought "
            "to where the body is; refused: see detail; of one that was asked for without a connection, lately"
        ),
    ]
    detail: Annotated[str, Meta(description="the same, for people")] = ""
    progress: Annotated[
        Annotated[float, Meta(ge=0, le=1)] | None, Meta(description="share of that done, 0 to 1; null: not known")
    ] = None


class StatusMessage(Message, tag="status", frozen=True, kw_only=True):
    """State of the session, sent on joining and on every change."""

    state: Annotated[
        SessionState,
        Meta(
            description="preparing: starting or compiling; dressing; running; paused: held by a client; waiting: no "
            "pose has arrived lately; failed: see detail, the session can't go on; closed"
        ),
    ]
    detail: Annotated[str, Meta(description="one sentence for people")]
    motion: Annotated[str | None, Meta(description="motion being played; null: poses sent by a client")]
    fabric: Annotated[str, Meta(description="fabric in use")]
    playing: Annotated[bool, Meta(description="false while held by `pause`")]
    progress: Annotated[
        Annotated[float, Meta(ge=0, le=1)] | None,
        Meta(description="share done of preparing or dressing, 0 to 1; null: not known"),
    ] = None
    fit: Annotated[
        str, Meta(description='for people: what there is to say about the fit of the dressed garment; "": it fits')
    ] = ""
    fitting_size: Annotated[
        float | None, Meta(description="size of the pattern, over its own, that `fit` advises; null: none")
    ] = None
    notes: Annotated[
        tuple[str, ...],
        Meta(description="for people: how garment and body were read from files that say little, and what was mended"),
    ] = ()
    worn_size: Annotated[
        float | None,
        Meta(description="size in which the dressed pattern is worn, over its own; null: not dressed, or a mesh"),
    ] = None
    accuracy: Annotated[float | None, Meta(description="m, as chosen by `set_accuracy`")] = None
    deadline_ms: Annotated[float | None, Meta(description="ms, as chosen by `set_accuracy`")] = None
    preset: Annotated[str | None, Meta(description="likewise; null: that which the session was opened with")] = None
    preset_in_force: Annotated[str, Meta(description='by which frames are solved; "": none are yet')] = ""
    preset_pending: Annotated[bool, Meta(description="what was chosen is not in force yet: it is built beside")] = False
    changes: Annotated[
        tuple[ChangeStatus, ...], Meta(description="of the pattern, that are not worn yet, in their order")
    ] = ()


class ErrorMessage(Message, tag="error", frozen=True, kw_only=True):
    """Something the client sent, or the session itself, is at fault. Unless `fatal`, the connection goes on."""

    code: Annotated[str, Meta(description="name of the fault, PROTOCOL.md section 6")]
    place: Annotated[str, Meta(description='where it lies, such as "$.rotations[3]"')]
    message: Annotated[str, Meta(description="what is wrong")]
    remedy: Annotated[str, Meta(description="what to change")]
    fatal: Annotated[bool, Meta(description="true: the server closes the connection after this message")] = False
    request: Request = None


class PongMessage(Message, tag="pong", frozen=True, kw_only=True):
    """Answer to `ping`."""

    t: Annotated[float, Meta(description="s, `ping.t` repeated: the client's clock")]
    clock: Annotated[float, Meta(description="s, the server's steady clock at answering")]


class GoodbyeMessage(Message, tag="goodbye", frozen=True, kw_only=True):
    """The server is about to close this connection in good order (it restarts, or the session ends)."""

    reason: Annotated[str, Meta(description="one sentence for people")]
    retry_after: Annotated[
        float | None, Meta(description="s to wait before connecting again; null: don't, the session has ended")
    ] = None


ClientMessage = Union[  # noqa: UP007 - a runtime value that decoders are built from
    HelloMessage,
    SkeletonMessage,
    PoseMessage,
    AckMessage,
    KeyframeRequestMessage,
    PlayMessage,
    PauseMessage,
    SetMotionMessage,
    SetFabricMessage,
    SetAccuracyMessage,
    SetEffectMessage,
    RemoveEffectMessage,
    MeasureEffectsMessage,
    PutOnMessage,
    TakeOffMessage,
    ReorderMessage,
    EditMessage,
    UndoMessage,
    RedoMessage,
    PingMessage,
    ByeMessage,
]
ServerMessage = Union[  # noqa: UP007
    WelcomeMessage,
    TopologyMessage,
    StatusMessage,
    ReportMessage,
    EffectsMessage,
    OutfitMessage,
    DesignMessage,
    EditedMessage,
    ErrorMessage,
    PongMessage,
    GoodbyeMessage,
]
