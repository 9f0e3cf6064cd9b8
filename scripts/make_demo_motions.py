#!/usr/bin/env python3
"""Write the demo's motions - walk, squat, jumping_jack, turn - as BVH files. They are ours: made of formulas alone.

Each loops: its last frame is its first. Feet that stand do not slide: legs are solved from the ankles, which are
planted. The proportions of a gait (stance 62 % of a stride, pelvis and trunk turning against each other, two bobs a
stride) are those of any textbook on walking, for example M. Whittle, "Gait Analysis: An Introduction".
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from motion_kit import ANKLE, BALL, HEEL, SIDES, Performance, X, Y, Z, chain, hermite, turn

from tryon_solver.body import quaternions
from tryon_solver.body.motion import ease

MOTIONS = Path(__file__).resolve().parents[1] / "server" / "tryon_server" / "demo" / "motions"
STANCE = 0.62  # of a stride, how long a foot is on the floor
PASSING = 0.45  # of a stance, when the hips pass over the foot
TAU = 2.0 * np.pi


@dataclass(frozen=True)
class Gait:
    """Walking on a circle to the left, once round; with radius 0 it is turning on the spot."""

    duration: float  # s
    strides: int
    radius: float  # m
    half_width: float  # m, of a foot from the path
    hips: float  # m, mean height of the hips
    bob: float  # m
    sway: float  # m, of the hips towards the standing foot
    pelvis_turn: float  # rad, about the vertical
    pelvis_list: float  # rad, the hip of the swinging leg drops
    heel_strike: float  # rad, toes up when the heel touches
    toe_off: float  # rad, heel up when the toes leave
    lift: float  # m, of the swinging ankle, besides the roll of the foot
    arm_out: float  # rad
    arm_swing: float  # rad

    def heading(self, t: np.ndarray) -> np.ndarray:
        return TAU * t / self.duration

    def path(self, t: np.ndarray, left: np.ndarray | float = 0.0) -> np.ndarray:
        """Points on the floor (T, 3) at time t, `left` metres left of the path; at t = 0 the origin, going to +z."""
        h = self.heading(t)
        r = self.radius - left
        return np.stack([self.radius - r * np.cos(h), np.zeros_like(h), r * np.sin(h)], axis=-1)

    def perform(self) -> Performance:
        body = Performance(self.duration)
        t = body.time
        stride = self.strides * t / self.duration
        heading = turn(Y, self.heading(t))
        middle = TAU * (stride - 0.5 * STANCE)  # 0 when the left foot stands under the hips
        lean = -np.arctan((TAU / self.duration) ** 2 * self.radius / 9.81)

        body.hips = self.path(t, self.sway * np.cos(middle))
        body.hips[:, 1] = self.hips + self.bob * np.cos(2.0 * middle)
        yaw = -self.pelvis_turn * np.cos(TAU * stride)
        drop = self.pelvis_list * np.cos(middle + 0.11 * TAU)
        level = np.full_like(t, 0.05)
        pelvis = chain(heading, turn(Y, yaw), turn(Z, drop + 0.4 * lean), turn(X, level))
        chest = chain(heading, turn(Y, -0.9 * yaw), turn(Z, -0.5 * drop + lean), turn(X, 0.3 * level))
        head = chain(heading, turn(Y, 0.1 * yaw + 0.06), turn(Z, 0.5 * np.full_like(t, lean)))
        body.trunk(pelvis, chest, head)
        for side, sign in SIDES.items():
            phase = stride if sign > 0 else stride + 0.5
            swing = -np.cos(TAU * (phase - 0.02))
            elbow = 0.32 + 0.9 * self.arm_swing * (0.5 - 0.5 * np.cos(TAU * (phase - 0.08)))
            body.arm(side, np.full_like(t, self.arm_out), 0.06 + self.arm_swing * swing, elbow)
            self._leg(body, side, phase)
        return body

    def _leg(self, body: Performance, side: str, phase: np.ndarray) -> None:
        sign = SIDES[side]
        step = np.floor(phase)
        within = phase - step
        offset = 0.0 if sign > 0 else -0.5

        def planted(k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Ankle over the flat foot of step k, and its heading: the hips pass over it during the stance."""
            t = (k + offset + PASSING * STANCE) * self.duration / self.strides
            return self.path(t, sign * self.half_width) + ANKLE * Y, self.heading(t)

        def rolled(share: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Ankle and pitch (toes up positive) at a share of step k's stance: on the heel, flat, over the ball."""
            place, heading = planted(k)
            off = np.clip((share - 0.55) / 0.45, 0.0, None)
            pitch = self.heel_strike * (1.0 - ease(share / 0.18)) - self.toe_off * off**2
            pivot = np.where(pitch[:, None] > 0.0, HEEL, BALL)
            rolled_pivot = quaternions.rotate(turn(X, -pitch), pivot)
            return place + quaternions.rotate(turn(Y, heading), pivot - rolled_pivot), pitch

        share = within / STANCE
        ankle, pitch = rolled(np.minimum(share, 1.0), step)
        swinging = within > STANCE
        u = np.where(swinging, (within - STANCE) / (1.0 - STANCE), 0.0)
        per_swing = (1.0 - STANCE) / STANCE  # slopes per share of stance -> per share of swing
        small, one, zero = 1e-4, np.ones_like(u), np.zeros_like(u)
        (a0, p0), (b0, q0) = rolled(one, step), rolled(one - small, step)
        (a1, p1), (b1, q1) = rolled(zero, step + 1), rolled(zero + small, step + 1)
        ankle_slopes = ((a0 - b0) / small * per_swing, (b1 - a1) / small * per_swing)
        pitch_slopes = ((p0 - q0) / small * per_swing, (q1 - p1) / small * per_swing)
        column = u[:, None]
        flight = hermite(column, a0, ankle_slopes[0], a1, ankle_slopes[1])
        flight[:, 1] += self.lift * np.sin(np.pi * u) ** 2
        ankle = np.where(swinging[:, None], flight, ankle)
        pitch = np.where(swinging, hermite(u, p0, pitch_slopes[0], p1, pitch_slopes[1]), pitch)

        heading = planted(step)[1] + (planted(step + 1)[1] - planted(step)[1]) * ease(u)
        flat = turn(Y, heading)
        foot = chain(flat, turn(X, -pitch))
        bent = np.minimum(pitch, 0.0) * (1.0 - ease(u / 0.8))
        toes = chain(foot, turn(X, bent))
        ahead = quaternions.rotate(turn(Y, 0.5 * (heading + self.heading(body.time))), np.broadcast_to(Z, ankle.shape))
        body.leg(side, ankle, foot, toes, ahead)


def walk() -> Performance:
    """An easy walk on a circle of 0.9 m radius."""
    return Gait(
        duration=7.0,
        strides=6,
        radius=0.9,
        half_width=0.095,
        hips=0.89,
        bob=0.014,
        sway=0.022,
        pelvis_turn=0.08,
        pelvis_list=0.05,
        heel_strike=0.22,
        toe_off=0.75,
        lift=0.06,
        arm_out=0.33,
        arm_swing=0.36,
    ).perform()


def turn_on_the_spot() -> Performance:
    """Once round on the spot in eight small steps."""
    return Gait(
        duration=6.0,
        strides=4,
        radius=0.0,
        half_width=0.11,
        hips=0.915,
        bob=0.006,
        sway=0.03,
        pelvis_turn=0.05,
        pelvis_list=0.04,
        heel_strike=0.0,
        toe_off=0.35,
        lift=0.05,
        arm_out=0.42,
        arm_swing=0.10,
    ).perform()


def squat() -> Performance:
    """Two squats, thighs to the horizontal, arms forward for balance."""
    body = Performance(6.0)
    t = body.time
    cycle = t % 3.0
    depth = ease(cycle / 1.25) - ease((cycle - 1.45) / 1.25)
    body.hips = np.stack([np.zeros_like(t), 0.92 - 0.385 * depth, -0.21 * depth], axis=1)
    breath = 0.012 * np.sin(TAU * t / 3.0)
    pelvis = turn(X, 0.05 + 0.50 * depth)
    chest = turn(X, 0.02 + 0.62 * depth + breath)
    head = turn(X, 0.02 + 0.12 * depth)
    body.trunk(pelvis, chest, head)
    for side, sign in SIDES.items():
        body.arm(side, 0.34 + 0.10 * depth, 0.05 + 1.85 * depth, 0.30 + 0.10 * depth)
        outward = sign * 0.26
        ankle = np.tile([sign * 0.17, ANKLE, 0.0], (len(t), 1))
        foot = turn(Y, np.full_like(t, outward))
        ahead = quaternions.rotate(turn(Y, outward + sign * 0.12 * depth), np.broadcast_to(Z, ankle.shape))
        body.leg(side, ankle, foot, foot, ahead)
    return body


def jumping_jack() -> Performance:
    """Four jumping jacks: legs apart and arms up in one hop, back in the next."""
    period, flight, height = 1.25, 0.25, 0.05  # s for two hops, s off the floor, m
    body = Performance(4 * period)
    t = body.time
    hop = 0.5 * period
    nearest = np.round(t / hop)  # standing deepest at whole hops
    since = t - nearest * hop
    on_floor = hop - flight
    flying = np.clip(((t % hop) - 0.5 * on_floor) / flight, 0.0, 1.0)
    rise = 4.0 * height * flying * (1.0 - flying)
    push = 4.0 * height / flight * on_floor / np.pi  # m: a half wave that leaves the floor with the speed of the flight
    grounded = np.abs(since) < 0.5 * on_floor
    dip = np.where(grounded, push * np.cos(np.pi * since / on_floor), 0.0)

    opening = np.floor(t / hop) % 2 == 0
    spread = ease(flying)
    apart = np.where(opening, spread, 1.0 - spread)
    swing = ease(((t % hop) / hop - 0.06) / 0.88)
    raised = np.where(opening, swing, 1.0 - swing)
    half_width = 0.10 + 0.21 * apart
    body.hips[:, 1] = 0.918 - 0.030 * apart - dip + rise
    lean = 0.03 + 1.2 * dip
    body.trunk(turn(X, lean), turn(X, 0.9 * lean), turn(X, 0.4 * lean))
    for side, sign in SIDES.items():
        elbow = 0.25 + 0.25 * np.sin(np.pi * raised)
        body.arm(side, 0.36 + 2.14 * raised, 0.08 + 0.06 * np.sin(np.pi * raised), elbow)
        foot = chain(turn(Y, np.full_like(t, 0.15 * sign)), turn(X, 0.2 * rise / height))  # tips stay off the floor
        ankle = np.stack([sign * half_width, ANKLE + rise, np.zeros_like(t)], axis=1)
        body.leg(side, ankle, foot, foot, np.broadcast_to(Z + 0.15 * sign * X, ankle.shape))
    return body


DEMO: dict[str, Callable[[], Performance]] = {
    "walk": walk,
    "squat": squat,
    "jumping_jack": jumping_jack,
    "turn": turn_on_the_spot,
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=MOTIONS, help="folder to write into (default: %(default)s)")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in DEMO.items():
        path = folder / f"{name}.bvh"
        make().write(path)
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
