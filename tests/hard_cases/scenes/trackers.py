"""What trackers send: noise, gaps, late poses, leaps, sides mixed up. The poses go the server's way into the solver."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from harness.kit import FRAME, ramp
from harness.scene import Ask, HardScene, Run
from harness.stream import Sent, streamed
from harness.wearer import BODY, REST, mirrored, posed
from scipy.spatial.transform import Rotation

from tryon_solver.body.pose import Pose
from tryon_solver.scene import LIVE

Stream = Callable[[Ask], list[Sent]]
SETTLES = 0.35  # of the time of a case that comes to rest; the others' wearers never stand


def frames(ask: Ask) -> np.ndarray:
    """Capture times of a tracker of 60 Hz [s]."""
    return FRAME * np.arange(1, round(ask.seconds / FRAME) + 1)


def shaken(pose: Pose, place: np.ndarray, turns: np.ndarray) -> Pose:
    """A pose off by `place` (3,) m and by `turns` (J, 3) rad."""
    rotations = (Rotation.from_rotvec(turns) * Rotation.from_quat(pose.rotations)).as_quat()
    return Pose(pose.root + place, rotations)


def noisy(place: float, degrees: float, seed: int = 7) -> Stream:
    """White noise of each coordinate of the root [m] and of each joint's turn."""

    def poses(ask: Ask) -> list[Sent]:
        rng = np.random.default_rng(seed)
        return [
            Sent(t, t, shaken(REST, *noise(rng, place, degrees))) for t in frames(ask)
        ]

    return poses


def noise(rng: np.random.Generator, place: float, degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """(3,) m and (J, 3) rad."""
    return place * rng.standard_normal(3), np.radians(degrees) * rng.standard_normal((BODY.joint_count, 3))


def drifting(ask: Ask) -> list[Sent]:
    """The origin wanders by 3 cm in five seconds, the joints by 2 degrees."""
    way, turns = noise(np.random.default_rng(3), 0.03, 2.0)
    return [Sent(t, t, shaken(REST, np.sin(1.3 * t) * way, np.sin(1.1 * t) * turns)) for t in frames(ask)]


def quantised(ask: Ask) -> list[Sent]:
    """A slow sway of 4 cm, told in steps of 5 mm."""
    found = []
    for t in frames(ask):
        place = np.round(0.04 * np.sin(1.5 * t) * np.array([1.0, 0, 0.5]) / 5e-3) * 5e-3
        found.append(Sent(t, t, Pose(REST.root + place, REST.rotations)))
    return found


def swaying(t: float) -> Pose:
    """A slow to and fro of the arms and of the body, 30 degrees and 10 cm."""
    lifted = posed(mirrored({"left_upper_arm": (0, 0, 30)}), (0.1, 0, 0))
    return Pose.interpolate(REST, lifted, 0.5 - 0.5 * np.cos(2 * np.pi * 0.5 * t))


def gaps(ask: Ask) -> list[Sent]:
    """Nothing for 0.1, 0.3, 1 and 2 s, as far as the time reaches."""
    silent = [(0.8, 0.9), (1.2, 1.5), (1.9, 2.9), (3.2, 5.2)]
    return [Sent(t, t, swaying(t)) for t in frames(ask) if not any(a < t < b for a, b in silent)]


def late(ask: Ask) -> list[Sent]:
    """Every so often the poses of 0.25 s arrive all at once."""
    found = []
    for t in frames(ask):
        held = 0.25 if (t % 1.0) > 0.75 else 0.0
        found.append(Sent(t, np.floor(t) + 1.0 if held else t, swaying(t)))
    return found


def now_and_then(ask: Ask) -> list[Sent]:
    """Ten seconds of swaying in each minute, and two of no poses at all in each fifth; for the rest a stand.

    It sways from the stand and back to it, so that nothing leaps.
    """
    found = []
    for t in frames(ask):
        minute, second = divmod(t, 60.0)
        if minute % 5 == 4 and 4.0 < second < 6.0:
            continue
        found.append(Sent(t, t, swaying(second) if second < 10.0 else REST))
    return found


def elsewhere(place: tuple[float, float, float]) -> Stream:
    """The same sway `place` m from where the garment was put on, and from SETTLES of the time on a stand."""

    def poses(ask: Ask) -> list[Sent]:
        seen = [(t, swaying(min(t, SETTLES * ask.seconds))) for t in frames(ask)]
        return [Sent(t, t, Pose(pose.root + place, pose.rotations)) for t, pose in seen]

    return poses


def suddenly(pose: Pose, begin: float = 0.2, end: float = SETTLES) -> Stream:
    """Another pose from one frame to the next, and back later; `begin`, `end` as shares of the time."""

    def poses(ask: Ask) -> list[Sent]:
        inside = (begin * ask.seconds, end * ask.seconds)
        return [Sent(t, t, pose if inside[0] < t < inside[1] else REST) for t in frames(ask)]

    return poses


def facing_away() -> Pose:
    """The rest pose turned by 180 degrees about the vertical."""
    rotations = REST.rotations.copy()
    rotations[0] = Rotation.from_euler("y", 180, degrees=True).as_quat()
    return Pose(REST.root, rotations)


def sides_swapped() -> Pose:
    """A pose with one arm up and one leg out, told with left and right mixed up."""
    return posed({"right_upper_arm": (0, 0, -70), "left_upper_arm": (-40, 0, -30), "right_thigh": (0, 0, -12)})


def asymmetric() -> Pose:
    """The same, told rightly."""
    return posed({"left_upper_arm": (0, 0, 70), "right_upper_arm": (-40, 0, 30), "left_thigh": (0, 0, 12)})


def swapping(ask: Ask) -> list[Sent]:
    """Left and right change places three times a second, for a second."""
    begin = SETTLES * ask.seconds - 1.0
    found = []
    for t in frames(ask):
        led = Pose.interpolate(REST, asymmetric(), ramp(t, 0.0, 0.8 * begin))
        swapped = begin < t < begin + 1.0 and int(6 * (t - begin)) % 2 == 0
        found.append(Sent(t, t, sides_swapped() if swapped else led))
    return found


def slipping(ask: Ask) -> list[Sent]:
    """Every quarter of a second another place: a tracker takes the wearer for where he is not, and finds him again."""
    begin = 0.2 * ask.seconds
    aside = posed({}, (0.15, 0, 0))

    def told(t: float) -> Pose:
        return aside if begin < t < begin + 2.0 and int(4 * (t - begin)) % 2 == 0 else REST

    return [Sent(t, t, told(t)) for t in frames(ask)]


BROKEN = posed(
    mirrored(
        {
            "left_forearm": (100, 0, 0),
            "left_thigh": (-70, 0, 25),
            "left_shin": (-60, 0, 0),
            "left_upper_arm": (120, 40, 0),
        }
    )
    | {"spine_3": (0, 70, 0), "neck_1": (0, 120, 0)}
)


def tracked(garment: str, stream: Stream, stops: float = 1.0, **more: object) -> Callable[[Ask], Run]:
    """The garment on a body that follows the stream; after this share of the time the tracker stands still."""
    return lambda ask: streamed(ask, garment, stream(ask), stops * ask.seconds, **more)  # type: ignore[arg-type]


SCENES = (
    HardScene(
        "noise_white",
        "a body that stands, told with white noise of 3 mm and 0.5 degrees at 60 Hz",
        tracked("tshirt", noisy(3e-3, 0.5), rests=False, noise=True),
        vertices=600,
        seconds=60.0,
    ),
    HardScene("noise_drifting", "a body that stands, told with a drift", tracked("tshirt", drifting, rests=False)),
    HardScene(
        "noise_quantised", "a slow sway told in steps of 5 mm", tracked("tshirt", quantised, rests=False)
    ),
    *(
        HardScene(
            f"tracked_at_{name}",
            f"a sway {name} from the origin, told in float64: figures as at 0 m",
            tracked("tshirt", elsewhere((far, 0.0, -far)), SETTLES),
            seconds=9.0,
            same_as="tracked_at_0m" if far else "",
        )
        for name, far in (("0m", 0.0), ("100m", 100.0), ("10km", 10_000.0))
    ),
    HardScene(
        "stream_1h",
        "an hour of a stream that moves ten seconds in each minute and now and then falls silent; asleep in between",
        tracked("tshirt", now_and_then, rests=False, effects=LIVE),
        vertices=300,
        seconds=3600.0,
        apart=True,
    ),
    HardScene("dropouts", "no poses for 0.1 to 2 s", tracked("tshirt", gaps, rests=False), seconds=6.0),
    HardScene("latency_spikes", "poses of a quarter of a second at once", tracked("tshirt", late, rests=False)),
    HardScene(
        "teleport_2m",
        "the wearer is told 2 m away from one frame to the next, and back",
        tracked("tshirt", suddenly(posed({}, (2.0, 0, 0))), SETTLES),
        seconds=9.0,
    ),
    HardScene(
        "tracker_slips",
        "the wearer is told 15 cm to the side and back four times within two seconds",
        tracked("tshirt", slipping, SETTLES),
        seconds=9.0,
    ),
    HardScene(
        "flip_180",
        "the wearer is told facing away from one frame to the next, and back",
        tracked("tshirt", suddenly(facing_away()), SETTLES),
        seconds=9.0,
    ),
    HardScene(
        "left_right_swapped",
        "sides mixed up six times within a second; the pose that stays holds cloth squeezed in an armpit",
        tracked("tshirt", swapping, SETTLES, squeezed=True),
        seconds=9.0,
    ),
    HardScene(
        "joint_limits_broken",
        "elbows and knees bent backwards, neck and spine wrung, from one frame to the next",
        tracked("tshirt", suddenly(BROKEN), SETTLES),
        seconds=9.0,
    ),
)
