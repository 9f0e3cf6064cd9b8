"""Whether a stream's poses have the body upside down, lying or off the floor for longer than people do: in other axes,
or from another origin, than a session's; or its joints turned as nobody's are, by quaternions that begin with w. It may
be meant all the same, so it is told, and the poses are followed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tryon_protocol import CONVENTIONS, ProtocolError
from tryon_server.sessions.commands import UseTrackedPose
from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose, world_from_joint

LOOK_SECONDS = 0.2  # between looks
UPSIDE_DOWN = 0.3  # of the body's height by which its highest joint is below its lowest one: who only lies is not
LYING = 0.2  # of the body's height by which these two, and the highest one and the root, differ at most
SUNK = 0.4  # m under the floor: the feet of a child of 1 m, whose hips are where they were tracked, are less
AFLOAT = 0.5  # m over it: chairs are lower, and so are the feet of a giant
# A body on its feet where Z is up: a foot is the lowest joint along z, near z = 0 [m]; along z it extends by this share
# of its height at least, head and feet differ by no more in y, and the trunk points up in y by no more than this of it.
Z_UP_FLOOR, Z_UP_FOOT = 0.3, 0.2
Z_UP_LEAST, Z_UP_LEVEL, Z_UP_TRUNK = 0.5, 0.4, 0.3
CONTORTED = 100.0  # degrees that joints are turned by on average; of who crouches with folded arms it is about 50
UNFOLDED = 0.5  # times that, or less, as quaternions that begin with w: then they do
# On the sender's clock: who does a cartwheel, or dives, is the right way up again by then, who jumps is down again.
SECONDS = {"contorted": 1.0, "upside_down": 2.0, "z_up": 2.0, "off_floor": 3.0, "lying": 10.0}
NO_TURNS = np.empty((0, 4))
ROOT = "Send the root where it is over the floor y = 0: in root-relative poses it isn't"
LOCAL_FLOOR = "Ask WebXR for the space 'local-floor': in 'local' the origin is where the head was"
FLOORS = {  # what puts a convention's poses on the floor
    "smpl": ROOT,
    "bvh": ROOT,
    "webxr": LOCAL_FLOOR,
    "head-hands": LOCAL_FLOOR,
    "mediapipe": "Send world landmarks in the frame 'mediapipe-world', or places in a room whose floor is y = 0",
}


class Posture:
    """Looks at the poses of one body, and says of every sender, once each, what lasts for too long."""

    def __init__(self, body: BodyModel) -> None:
        heights = body.rest_joints[:, 1]
        self._body = body
        self._top, self._bottom = int(heights.argmax()), int(heights.argmin())
        self._height = float(np.ptp(heights))
        self._stream: int | None = None
        self._next_look = -np.inf
        self._since: dict[str, float] = {}
        self._said: set[str] = set()

    def told(
        self, stream: int, t: float, pose: Pose, convention: str, sent: npt.NDArray[np.float64] = NO_TURNS
    ) -> ProtocolError | None:
        """What is to be told at this pose, of the time t [s] on its sender's clock.

        ``stream`` is the sender. With a ``convention`` of the body's own joints, which `FLOORS` does not name, a pose
        may only not be upside down or contorted for long: its sender knows the body. ``sent`` are the sender's own
        quaternions, as of ``local_turns``.
        """
        if stream != self._stream:
            self._stream, self._next_look, self._since, self._said = stream, t, {}, set()
        if t < self._next_look:
            return None
        self._next_look = t + LOOK_SECONDS
        joints = world_from_joint(self._body, pose)[:, :3, 3]
        lowest = float(joints[:, 1].min() - self._body.rest_joints[self._bottom, 1])
        turned = _mean_turn(sent)
        states = ["contorted"] if turned > CONTORTED else self._states(joints, lowest, convention in FLOORS)
        self._since = {state: self._since.get(state, t) for state in states}
        for state in states:
            if state not in self._said and t - self._since[state] >= SECONDS[state]:
                self._said |= {state, "lying"} if state == "z_up" else {state}
                return _contorted(sent) if state == "contorted" else _fault(state, lowest, convention)
        return None

    def _states(self, joints: npt.NDArray[np.float64], lowest: float, tracked: bool) -> list[str]:
        """In which of the states of `SECONDS` joints at these places (J, 3) [m] are, the one that says most first."""
        up = joints[self._top] - joints[self._bottom]
        if up[1] < -UPSIDE_DOWN * self._height:
            return ["upside_down"]
        if not tracked:
            return []
        trunk = joints[self._top] - joints[0]
        lies = abs(up[1]) < LYING * self._height and abs(trunk[1]) < LYING * self._height
        z = joints[:, 2]
        stands = abs(up[1]) < Z_UP_LEVEL * self._height and np.ptp(z) > Z_UP_LEAST * self._height
        stands = stands and abs(z.min()) < Z_UP_FLOOR and z[self._bottom] - z.min() < Z_UP_FOOT
        stands = stands and trunk[1] < Z_UP_TRUNK * self._height
        if stands or lies:
            return [state for state, is_so in (("z_up", stands), ("lying", lies)) if is_so]
        return [] if -SUNK <= lowest <= AFLOAT else ["off_floor"]


def local_turns(command: UseTrackedPose) -> npt.NDArray[np.float64]:
    """(K, 4): the quaternions of a tracker's joints relative to their parents, the root's first; none of a convention
    whose turns are the world's."""
    pose = command.pose
    if pose.rotations is None or CONVENTIONS[command.skeleton.convention].positions:
        return NO_TURNS
    return pose.rotations[pose.tracked]


def _mean_turn(rotations: npt.NDArray[np.float64]) -> float:
    """Degrees by which joints with these quaternions (K, 4) are turned on average, the first left out: the root of who
    faces the other way, or of who has Z up, is turned by any angle. 0 without any."""
    return float(np.degrees(quaternions.angle_of(rotations[1:]).mean())) if len(rotations) > 1 else 0.0


def _contorted(sent: npt.NDArray[np.float64]) -> ProtocolError:
    turned, w_first = _mean_turn(sent), _mean_turn(np.roll(sent, -1, axis=1))
    what = f"The joints have been turned by {turned:.0f} degrees on average for {SECONDS['contorted']:g} s"
    if w_first < UNFOLDED * turned:
        what += f", but by {w_first:.0f} if the quaternions are w, x, y, z; they are followed as x, y, z, w."
        return ProtocolError("contorted", "$.rotations", what, "Send x, y, z, w: the identity is 0, 0, 0, 1.")
    remedy = "Send the turn of each joint relative to its parent and to the rest pose, as x, y, z, w."
    return ProtocolError("contorted", "$.rotations", f"{what}, as nobody's are; they are followed.", remedy)


def _fault(state: str, lowest: float, convention: str) -> ProtocolError:
    lasts = f"for {SECONDS[state]:g} s"
    match state:
        case "upside_down":
            what = f"The body has been upside down {lasts}, feet above the head; it is followed."
            remedy = "Send Y up, or put the tracker upright; who stands on the hands need do nothing."
            return ProtocolError("upside_down", "$", what, remedy)
        case "off_floor":
            way = "under" if lowest < 0.0 else "over"
            what = f"The body's lowest joint has been {abs(lowest):.2g} m {way} the floor {lasts}; it is followed."
            remedy = f"{FLOORS[convention]}; who is {way} the floor need do nothing."
            return ProtocolError("off_floor", "$", what, remedy)
    how = "along +Z with the feet at z = 0, as who stands where Z is up" if state == "z_up" else "level"
    what = f"The body has been lying {lasts}, {how}; it is followed."
    return ProtocolError(
        "lying", "$", what, "Send Y up: of a place where Z is up, (x, z, -y); who lies need do nothing."
    )
