"""The wire of tryon: control messages, topologies and frames. protocol/PROTOCOL.md describes it for other languages."""

from .control import decode_client, decode_server, encode, error_message, is_frame, negotiate, request_of
from .decoder import DecodedFrame, FrameDecoder
from .encoder import KEYFRAME_INTERVAL, FrameEncoder
from .errors import ProtocolError
from .frames import Codec, EncodedFrame, FrameHeader, read_header
from .grid import GRID, check_grid
from .messages import (
    MAJOR_VERSION,
    MAX_CLIENT_MESSAGE_BYTES,
    POSE_CONVENTION,
    POSE_FRAME,
    SUBPROTOCOL,
    AckMessage,
    ByeMessage,
    ClientMessage,
    ErrorMessage,
    GoodbyeMessage,
    HelloMessage,
    KeyframeRequestMessage,
    PauseMessage,
    PingMessage,
    PlayMessage,
    PongMessage,
    PoseMessage,
    ReportMessage,
    ServerMessage,
    SetFabricMessage,
    SetMotionMessage,
    StatusMessage,
    TopologyMessage,
    WelcomeMessage,
)
from .skinning import Skinner
from .topology import BodySurface, Topology
from .validation import validate_pose
from .window import CREDIT, ViewerWindow

__all__ = [
    "CREDIT",
    "GRID",
    "KEYFRAME_INTERVAL",
    "MAJOR_VERSION",
    "MAX_CLIENT_MESSAGE_BYTES",
    "POSE_CONVENTION",
    "POSE_FRAME",
    "SUBPROTOCOL",
    "AckMessage",
    "BodySurface",
    "ByeMessage",
    "ClientMessage",
    "Codec",
    "DecodedFrame",
    "EncodedFrame",
    "ErrorMessage",
    "FrameDecoder",
    "FrameEncoder",
    "FrameHeader",
    "GoodbyeMessage",
    "HelloMessage",
    "KeyframeRequestMessage",
    "PauseMessage",
    "PingMessage",
    "PlayMessage",
    "PongMessage",
    "PoseMessage",
    "ProtocolError",
    "ReportMessage",
    "ServerMessage",
    "SetFabricMessage",
    "SetMotionMessage",
    "Skinner",
    "StatusMessage",
    "Topology",
    "TopologyMessage",
    "ViewerWindow",
    "WelcomeMessage",
    "check_grid",
    "decode_client",
    "decode_server",
    "encode",
    "error_message",
    "is_frame",
    "negotiate",
    "read_header",
    "request_of",
    "validate_pose",
]
