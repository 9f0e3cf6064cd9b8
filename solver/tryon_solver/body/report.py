"""What a motion asks of the solver: `python -m tryon_solver.body.report FILE.bvh ...`.

Prints per motion its length, its fastest joint (and how far that moves in a frame), in how many frames the posed body
cuts through itself (ipctk), and which parts do: creases within a part are harmless, an arm in the trunk pinches cloth.
Needs ipctk, a development dependency.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tryon_solver.body.bvh import CENTIMETRES, decode_bvh, parse_bvh
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.making.checks import self_intersections
from tryon_solver.body.model import BodyModel, default_body
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import skin
from tryon_solver.body.retarget import ARM_CLEARANCE_DEGREES, retarget

ARM = ("upper_arm", "upper_arm_twist", "forearm", "forearm_twist", "hand", "fingers")
LEG = ("thigh", "thigh_twist", "shin", "shin_twist", "foot", "toes")


@dataclass(frozen=True)
class MotionReport:
    """What one motion asks."""

    name: str
    frames: int
    duration: float  # s
    fastest_joint: str
    largest_speed: float  # m/s
    largest_step: float  # m, of the fastest joint between two frames
    frames_looked_at: int
    frames_crossing: int  # frames with any self-intersection, by ipctk
    crossings: dict[str, int]  # "left arm - trunk" -> frames in which these parts cross


def report_motion(model: BodyModel, motion: Motion, every: int = 1) -> MotionReport:
    """Measure a motion on a body; every `every`-th frame is looked at for self-intersections."""
    positions, _ = world_tracks(model, motion)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=2)
    fastest = int(steps.max(axis=0).argmax()) if len(steps) else 0
    largest = float(steps.max()) if len(steps) else 0.0
    crossing_frames, parts = 0, Counter[str]()
    looked_at = range(0, motion.frame_count, every)
    for frame in looked_at:
        crossing = crossing_parts(model, skin(model, motion.pose(frame)))
        crossing_frames += bool(crossing)
        parts.update(crossing)
    return MotionReport(
        motion.name,
        motion.frame_count,
        motion.duration,
        model.joint_names[fastest],
        largest / motion.dt,
        largest,
        len(looked_at),
        crossing_frames,
        dict(parts.most_common()),
    )


def crossing_parts(model: BodyModel, vertices: np.ndarray) -> set[str]:
    """Pairs of body parts whose surfaces cross at `vertices` (B, 3) m; a single name is a part that cuts itself."""
    import ipctk

    edges = ipctk.edges(model.faces)
    mesh = ipctk.CollisionMesh(np.asfortranarray(vertices), edges, model.faces)
    if not ipctk.has_intersections(mesh, vertices):
        return set()
    part_of = np.array([_part(model.joint_names[k]) for k in model.skin_joints[:, 0]])
    corners = np.concatenate([model.faces[:, [0, 1]], model.faces[:, [1, 2]], model.faces[:, [2, 0]]])
    edges = np.unique(np.sort(corners, axis=1), axis=0)
    return {
        " - ".join(sorted({str(part_of[edges[e, 0]]), str(part_of[model.faces[f, 0]])}))
        for e, f in self_intersections(vertices, model.faces)
    }


def _part(joint: str) -> str:
    side, _, rest = joint.partition("_")
    if rest in ARM:
        return f"{side} arm"
    if rest in LEG:
        return f"{side} leg"
    return "head" if joint.startswith(("head", "neck")) else "trunk"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, help="BVH files")
    parser.add_argument("--every", type=int, default=4, help="look at every N-th frame (default: %(default)s)")
    parser.add_argument("--units-per-metre", type=float, default=CENTIMETRES, help="default: %(default)s, centimetres")
    parser.add_argument("--arm-clearance", type=float, default=ARM_CLEARANCE_DEGREES, help="degrees, see retarget()")
    arguments = parser.parse_args()
    model = default_body()
    for path in arguments.files:
        clip = parse_bvh(decode_bvh(path.read_bytes()), arguments.units_per_metre, path.stem)
        found = report_motion(model, retarget(clip, model, arguments.arm_clearance), arguments.every)
        print(
            f"{found.name}: {found.frames} frames, {found.duration:.2f} s; fastest {found.fastest_joint} "
            f"{found.largest_speed:.2f} m/s ({1000 * found.largest_step:.0f} mm a frame); "
            f"{found.frames_crossing} of {found.frames_looked_at} frames looked at cut through themselves"
        )
        for parts, count in found.crossings.items():
            print(f"    {parts}: {count}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
