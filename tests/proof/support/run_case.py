"""Run one case in this process: dress, play, publish, decode, judge."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import limits
import numpy as np
from case import Case, stem
from contact_state import contact_gradient
from frame_figures import FrameFigures, FrameMeter
from over_time import trembling
from pinched_skin import PinchedSkin
from timeline import Timeline
from verdict import broken_by_frames, broken_by_share, broken_by_weight, figures_of_frames, hem_travel, late
from wire import Wire
from worn_pattern import worn_pattern

from tryon_protocol import DecodedFrame, ProtocolError
from tryon_server.runtime.drape import Drape
from tryon_server.runtime.motions import load_motion
from tryon_server.runtime.sources import leap_towards, moved
from tryon_solver.body.model import default_body
from tryon_solver.body.pose import Pose
from tryon_solver.contact import pairs
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.simulation import Simulation

GRAVITY = 9.81
AT_REST = 0.5  # s at the end of standing in which the contact force is compared with the weight
SHORTEST_SWING = 1.0  # s of a motion before its hem is asked to have moved

Tell = Callable[[str], None]


@dataclass
class Played:
    """What a run leaves to be judged, a list entry per frame; frame 0, as dressed, has figures but no step."""

    figures: list[FrameFigures] = field(default_factory=list)
    retries: list[int] = field(default_factory=list)
    solver_ms: list[float] = field(default_factory=list)
    wire_error: list[float] = field(default_factory=list)  # m, decoded against simulated cloth and surface
    pose_error: list[float] = field(default_factory=list)  # decoded against asked pose: m, and 1 of a quaternion
    simulated: list[np.ndarray] = field(default_factory=list)  # m, cloth from the frame in which the body stops
    decoded: list[np.ndarray] = field(default_factory=list)
    force: list[float] = field(default_factory=list)  # on the body downwards, over the garment's weight
    failure: str = ""

    def add(self, frame: DecodedFrame, figures: FrameFigures, drape: Drape, pose: Pose) -> None:
        """A decoded frame, its figures, and the state and pose that it was to show."""
        cloth, surface = drape.cloth_positions() + drape.origin, drape.body_positions() + drape.origin
        turned = np.abs(np.abs((frame.rotations * pose.rotations).sum(1)) - 1).max()
        self.figures.append(figures)
        self.wire_error.append(float(max(np.abs(frame.cloth - cloth).max(), np.abs(frame.body - surface).max())))
        self.pose_error.append(float(max(np.abs(frame.root - pose.root).max(), turned)))


def run_case(case: Case, wardrobe: Path, tell: Tell, keep: Path | None = None) -> dict[str, Any]:
    """The case's figures and the limits it broke, ready for JSON; `keep` is an .npz for the decoded frames.

    Garments that a case has dressed hang in the folder `wardrobe` for those in other motions.
    """
    body, fabric = default_body(), FABRICS[case.fabric]
    motion = load_motion(case.motion, body)
    worn = worn_pattern(case, body, wardrobe, tell)
    sim, start = worn.simulation, Pose.rest(body)
    wire = Wire(worn.drape)
    leap = leap_towards(start, motion.pose(0))
    timeline = Timeline.build(moved(start, leap), motion, case)
    sizes = sim.contact.sizes
    first = wire.dressed()
    meter = FrameMeter(wire.topology, first, PinchedSkin.reach(sizes.xi_body, sizes.d_hat))
    frames, played = [first], Played()
    played.add(first, meter.measure(first, intersections=True), wire.drape, start)
    wire.drape.leap(leap)
    play(played, case, timeline, sim, wire, meter, frames if keep else None, tell)
    if keep:
        save(keep, frames, wire, case.fps)
    return {
        "case": case.plain(),
        "dressing_s": worn.seconds,
        "size": worn.size,
        "fit": worn.fit,
        "cloth_vertices": sim.cloth_count,
        "triangles": len(meter.state.faces),
        "loops": len(meter.state.loops.loops),
        "strain_limit": fabric.strain_limit,
        "wire_bytes": wire.bytes,
        **judged(case, timeline, played, fabric.strain_limit),
    }


def play(
    played: Played,
    case: Case,
    timeline: Timeline,
    sim: Simulation,
    wire: Wire,
    meter: FrameMeter,
    frames: list[DecodedFrame] | None,
    tell: Tell,
) -> None:
    """Run the timeline into `played`; `frames` receives every decoded frame."""
    dt = 1.0 / case.fps
    weight = float(sim.mass.sum()) * GRAVITY
    resting = timeline.frame_count - round(AT_REST * case.fps)
    for k in range(1, timeline.frame_count + 1):
        pose = timeline.pose(k)
        begun = time.perf_counter()
        report = wire.drape.advance(pose, k * dt)
        played.solver_ms.append(1e3 * (time.perf_counter() - begun))
        played.retries.append(report.retries)
        try:
            frame = wire.frame(pose, k * dt, dt)
        except ProtocolError as error:
            played.failure = f"frame {k} can't be published: {error.message}"
            break
        asked = k % case.every == 0 or k == timeline.frame_count
        played.add(frame, meter.measure(frame, asked), wire.drape, pose)
        if k >= timeline.last_moving:
            played.simulated.append(wire.drape.cloth_positions() + wire.drape.origin)
            played.decoded.append(frame.cloth)
        if k > max(resting, timeline.last_moving):
            played.force.append(force_on_body(sim) / weight)
        if frames is not None:
            frames.append(frame)
        if k % round(case.fps) == 0:
            tell(f"{k} of {timeline.frame_count} frames, {np.median(played.solver_ms[-round(case.fps) :]):.0f} ms each")


def force_on_body(sim: Simulation) -> float:
    """N downwards: barrier and friction summed over the collision surface; the gradient there is minus the force."""
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    return float(contact_gradient(sim, friction=True)[sim.cloth_count :, 1].sum())


def judged(case: Case, timeline: Timeline, played: Played, strain_limit: float) -> dict[str, Any]:
    """Figures, series and broken limits."""
    figures, numbers = played.figures, range(len(played.figures))
    result = figures_of_frames(figures)
    hem = hem_travel(figures[timeline.first_moving : timeline.last_moving + 1])
    shaken = trembling(np.array(played.simulated), case.fps) if played.simulated else None
    shaken_decoded = trembling(np.array(played.decoded), case.fps) if played.decoded else None
    behind = late(figures, timeline.last_moving - timeline.first_moving + 1)
    allowed = limits.late_share(stem(case.motion))
    swings = stem(case.motion) == "walk" and timeline.moving >= SHORTEST_SWING
    broken = [
        *broken_by_frames(figures, strain_limit, allowed),
        *broken_by_share(behind["late_share"], allowed),
        *limits.over("decoded against simulated [m]", numbers, played.wire_error, limits.WIRE),
        *limits.over("decoded against asked pose", numbers, played.pose_error, limits.POSE),
        *limits.run_under("hem travel [m]", hem["hem_travel_median"] if swings else None, limits.HEM_TRAVEL),
        *limits.run_over("trembling [m/s]", shaken, limits.TREMBLING),
        *broken_by_weight(played.force),
    ]
    result["series"] |= {"retries": played.retries, "force": played.force, "solver_ms": played.solver_ms}
    return {
        **result,
        **hem,
        **behind,
        "late_allowed": allowed,
        "failure": played.failure,
        "trembling": shaken,
        "trembling_decoded": shaken_decoded,
        "speed_at_rest": speed_at_end(played.simulated, case.fps),
        "force_over_weight": float(np.mean(played.force)) if played.force else None,
        "force_off_most": max((abs(f - 1) for f in played.force), default=None),
        "simulated_over_wall": 1e3 * len(played.solver_ms) / case.fps / max(sum(played.solver_ms), 1e-9),
        "void_steps": sum(played.retries),
        "wire_error": max(played.wire_error, default=math.nan),
        "pose_error": max(played.pose_error, default=math.nan),
        "ms_a_frame": float(np.median(played.solver_ms)) if played.solver_ms else None,
        "broken": [b.plain() for b in broken],
    }


def speed_at_end(cloth: list[np.ndarray], fps: float) -> float | None:
    """RMS speed [m/s] over the time in which the contact force is measured."""
    steps = round(AT_REST * fps)
    if len(cloth) <= steps:
        return None
    velocity = np.diff(np.array(cloth[-steps - 1 :], np.float64), axis=0) * fps
    return float(np.sqrt((velocity**2).sum(-1).mean()))


def save(path: Path, frames: list[DecodedFrame], wire: Wire, fps: float) -> None:
    """Decoded frames as .npz: cloth (T, N, 3) and body (T, B, 3) m, their faces, dt s."""
    np.savez_compressed(
        path,
        cloth=np.stack([f.cloth for f in frames]).astype(np.float32),
        cloth_faces=wire.topology.faces.astype(np.int32),
        body=np.stack([f.body for f in frames]).astype(np.float32),
        body_faces=wire.topology.body.faces.astype(np.int32),
        dt=1.0 / fps,
    )
