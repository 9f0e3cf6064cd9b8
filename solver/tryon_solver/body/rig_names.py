"""Which joint of a rig is which part of a human, by the words of common conventions and where they put the side.

A name is a word and, of a limb, a side: `LeftForeArm`, `ForeArm.L`, `lForeArm`, `ELBOW_LEFT`. It is compared without
name space (`mixamorig:Hips`), capitals, underscores, dots, dashes and blanks, without what rigs put before or behind it
(`Bip01 L Thigh`, `J_Bip_L_Hand`, `l_leg_JNT`), and, where that does not find everybody, without what all names begin
with, or nearly all (`Character1_Hips`). Arms and legs are named after their bones or after their joints; the words of
the two are kept apart, since a shoulder is a clavicle among bones and an upper arm among joints. A rig says one word,
and puts the side at one place, on both sides. What two joints are called is nobody's.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

SIDES = ("left", "right")
ARM = ("upper_arm", "forearm", "hand")
LEG = ("thigh", "shin", "foot", "toes")
LIMB_PARTS = (*ARM, *LEG)
NEARLY_ALL = 0.8  # of the joints begin with what is taken for a prefix; the others are an armature's or a prop's
BEFORE = re.compile(r"^((valvebiped[. _])?bip\d+[ _.-]|j_bip_(c_)?|cc_base_)")  # 3ds Max, VRM, Character Creator
BEHIND = re.compile(r"[ _.-](jnt|jt|joint|bone)$")
LAYERS = ("def-", "org-")  # Blender's Rigify exports what deforms, what it was made from, and its handles, in one file
SIDED = (("left{}", "right{}"), ("{}left", "{}right"), ("l{}", "r{}"), ("{}l", "{}r"))  # of plain words

PELVIS = ("Hips", "Pelvis", "Hip", "SpineBase", "HipCenter", "HipsCenter", "MidHip")
HEAD = ("Head", "Spine.006", "Head_M", "Head.x")

# Part -> words, the plainer one first; each of these a way to name arms, or legs.
ARMS: tuple[dict[str, tuple[str, ...]], ...] = (
    {  # MotionBuilder, Mixamo, Unity, Unreal, Biovision, OptiTrack, Poser, DAZ, ASF, MakeHuman, Auto-Rig Pro, Theia
        "upper_arm": (
            *("UpperArm", "UpArm", "UArm", "Shldr", "ShldrBend", "Humerus", "UpperArm01", "ArmStretch", "Arm"),
        ),
        "forearm": (
            *("ForeArm", "LowerArm", "LowArm", "FArm", "LArm", "ForeArmBend", "Radius", "LowerArm01"),
            *("ForeArmStretch", "Elbow"),
        ),
        "hand": ("Hand", "Wrist"),
    },
    {  # SMPL, Xsens, 100STYLE, Kinect, OpenNI, Advanced Skeleton
        "upper_arm": ("Shoulder",),
        "forearm": ("Elbow",),
        "hand": ("Wrist", "Hand"),
    },
)
LEGS: tuple[dict[str, tuple[str, ...]], ...] = (
    {
        "thigh": ("UpLeg", "UpperLeg", "Thigh", "ThighBend", "Femur", "UpperLeg01", "ThighStretch"),
        "shin": ("LowerLeg", "LowLeg", "Shin", "Calf", "Shank", "Tibia", "LowerLeg01", "LegStretch", "Leg"),
        "foot": ("Foot", "Ankle"),
        "toes": ("ToeBase", "Toes", "Toe", "Toe0", "Ball", "Toes01"),
    },
    {
        "thigh": ("Hip",),
        "shin": ("Knee",),
        "foot": ("Ankle", "Foot"),
        "toes": ("Toe", "Toes", "ToeBase", "Ball", "Foot"),
    },
    {  # MikuMikuDance's, translated
        "thigh": ("Leg",),
        "shin": ("Knee",),
        "foot": ("Ankle",),
        "toes": ("Toe",),
    },
)


@dataclass(frozen=True)
class Named:
    """Which joints were found by their names.

    joints: part ("head", "left_forearm", ...) -> joint. expected: part of those -> a name that was looked for.
    pelvis: joints that are called like one, the likeliest first. twice: part -> joints that are all called so.
    """

    joints: dict[str, int] = field(default_factory=dict)
    expected: dict[str, str] = field(default_factory=dict)
    pelvis: tuple[int, ...] = ()
    twice: dict[str, tuple[int, ...]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """How many parts were found."""
        return len(self.joints) + bool(self.pelvis)


def find_named(joint_names: Sequence[str]) -> Named:
    """Who is found by the names: by the way to read them by which most are, the first of equals."""
    best = Named()
    for k, called in enumerate(_readings(joint_names)):
        found = _read(called)
        if not k or found.count > best.count:
            best = found
    return best


def _readings(joint_names: Sequence[str]) -> Iterator[dict[str, list[int]]]:
    """Plain name -> joints: of each layer of a rig, of the names as they are, and without a prefix that is shared."""
    for layer in LAYERS:
        called = _called(name[len(layer) :] if name.lower().startswith(layer) else "" for name in joint_names)
        if called:
            yield called
    yield _called(joint_names)
    for prefix in _shared_prefixes(joint_names):
        yield _called(name.removeprefix(prefix) for name in joint_names)


def _called(names: Iterator[str] | Sequence[str]) -> dict[str, list[int]]:
    called: dict[str, list[int]] = defaultdict(list)
    for joint, name in enumerate(names):
        if name:
            called[_plain(name)].append(joint)
    return dict(called)


def _read(called: Mapping[str, list[int]]) -> Named:
    """Who is found in one reading of the names: arms and legs each by the way to name them by which most are."""
    found = Named(
        expected={"head": HEAD[0]}, pelvis=tuple(joint for word in PELVIS for joint in called.get(_plain(word), ()))
    )
    head = next((called[_plain(word)] for word in HEAD if _plain(word) in called), [])
    if len(head) == 1:
        found.joints["head"] = head[0]
    elif head:
        found.twice["head"] = tuple(head)
    for vocabularies in (ARMS, LEGS):
        limbs = [_limbs(called, words, sided) for words in vocabularies for sided in SIDED]
        best = max(limbs, key=lambda limb: (limb.count, len(limb.twice)))  # the first of equals
        found.joints.update(best.joints)
        found.expected.update(best.expected)
        found.twice.update(best.twice)
    return found


def _limbs(called: Mapping[str, list[int]], words: Mapping[str, tuple[str, ...]], sided: tuple[str, str]) -> Named:
    """Arms or legs that say these words, with the side there: of each part the first word that either side says."""
    found = Named()
    for part, options in words.items():
        word = options[0]
        both: list[list[int]] = [[], []]
        for option in options:
            said = [called.get(side.format(_plain(option)), []) for side in sided]
            if any(said) and not {joint for joints in said for joint in joints} & set(found.joints.values()):
                word, both = option, said  # what is a foot already are not the toes
                break
        for name, side, joints in zip(SIDES, sided, both, strict=True):
            found.expected[f"{name}_{part}"] = _written(word, name, side)
            if len(joints) == 1:
                found.joints[f"{name}_{part}"] = joints[0]
            elif joints:
                found.twice[f"{name}_{part}"] = tuple(joints)
    return found


def _written(word: str, name: str, side: str) -> str:
    """A name as it would be looked for: "LeftForeArm", "ElbowLeft", "L_Thigh", "Hand_L"."""
    own = name.capitalize() if name in side else f"{name[0].upper()}_" if side.endswith("{}") else f"_{name[0].upper()}"
    return own + word if side.endswith("{}") else word + own


def _shared_prefixes(joint_names: Sequence[str]) -> list[str]:
    """What all names begin with, or nearly all up to a separator; the shortest first."""
    shared = Counter(name[: k + 1] for name in joint_names for k, letter in enumerate(name[:-1]) if letter in "_.:- ")
    prefixes = {prefix for prefix, count in shared.items() if count >= NEARLY_ALL * len(joint_names)}
    alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*joint_names))
    prefixes.add("".join(letters[0] for letters in alike))
    return sorted(prefixes - {""}, key=len)


def _plain(name: str) -> str:
    bare = BEHIND.sub("", BEFORE.sub("", name.rsplit(":", 1)[-1].lower()))
    return re.sub(r"[^a-z0-9]", "", bare)
