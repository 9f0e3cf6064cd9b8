"""What contact costs where nothing can touch: `python idle_costs.py [--vertices 17 --frames 90 --preset live --blown]`.

A square hangs by its upper edge with a ball far from it, or without a body; scenes of a kind differ in their contact
alone. All of a kind are played in one process, a frame of each in turn, by the processor's time. Prints the medians of
the frames [ms] and of their ratios to the first of the kind, launches of kernels a frame, Newton iterations and
candidates at the end.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from typing import Any

import numpy as np
import warp as wp
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

import tryon_solver.linalg.launch as launching
from tryon_solver.scene import (
    Adhesion,
    BodyContact,
    Effect,
    Friction,
    Gravity,
    Gusts,
    Pins,
    Scene,
    SelfContact,
    StrainLimit,
    Wind,
)
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import Simulation, build

DT = 1 / 60
EDGE = 0.02  # m, of a cell
AWAY = 3.8  # m, of the ball's middle
HANGING = (Gravity(), StrainLimit())
BLOWN = (Wind((0.0, 0.0, 4.0), Gusts()),)
ALONE: tuple[tuple[str, tuple[Effect, ...]], ...] = (("no contact", ()), ("self", (SelfContact(),)))
BESIDE: tuple[tuple[str, tuple[Effect, ...]], ...] = (
    ("no contact", ()),
    ("body", (BodyContact(),)),
    ("body, friction, adhesion", (BodyContact(), Friction(), Adhesion(100.0, 0.005))),
    ("body, self", (BodyContact(), SelfContact())),
    ("self", (SelfContact(),)),
)


def hung(n: int, with_ball: bool, effects: tuple[Effect, ...]) -> Scene:
    """A square of n by n vertices, 2 cm from each other, with or without a ball 3.8 m away."""
    garment, flat = sheet(n, n, EDGE * (n - 1), EDGE * (n - 1))
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0.01 * np.sin(20 * flat[:, 0])])
    top = np.arange(n * (n - 1), n * n, dtype=np.int32)
    ball, faces = icosphere(0.1, 3)
    body = rigid_body(ball + np.array([AWAY, 0.0, 0.0]), faces) if with_ball else None
    return Scene(garment, x, body, fabric(), (*HANGING, *effects, Pins(top)))


def counted(launches: Counter[str]) -> None:
    """Count every launch under the name of the kernel, wherever it is made from."""
    once = launching._Packed.launch

    def recorded(self: Any, *arguments: Any) -> None:
        launches[self.command.kernel.key] += 1
        once(self, *arguments)

    launching._Packed.launch = recorded  # type: ignore[method-assign]


def measure(asked: argparse.Namespace, with_ball: bool, kind: tuple[tuple[str, tuple[Effect, ...]], ...]) -> None:
    """Play the scenes of a kind in turn, and print a line of each."""
    launches: Counter[str] = Counter()
    counted(launches)
    pose = STILL if with_ball else None
    moved: tuple[Effect, ...] = BLOWN if asked.blown else ()
    sims: list[Simulation] = [
        build(hung(asked.vertices, with_ball, moved + effects), PRESETS[asked.preset], "cpu", pose)
        for _, effects in kind
    ]
    spent = np.zeros((asked.frames, len(kind)))
    made = [Counter[str]() for _ in kind]
    iterations = np.zeros(len(kind))
    for k in range(asked.frames):
        for j, sim in enumerate(sims):
            launches.clear()
            begun = time.process_time()
            report = sim.advance(pose, (k + 1) * DT)
            spent[k, j] = 1e3 * (time.process_time() - begun)
            if k >= asked.frames // 3:
                made[j].update(launches)
                iterations[j] += report.newton_iterations
    spent = spent[asked.frames // 3 :]
    for j, (name, _) in enumerate(kind):
        ratio = float(np.median(spent[:, j] / spent[:, 0]))
        frames = len(spent)
        print(
            f"{'ball away' if with_ball else 'no body'}, {name}: {np.median(spent[:, j]):.1f} ms, {ratio:.3f} times,"
            f" {sum(made[j].values()) / frames:.0f} launches, {iterations[j] / frames:.1f} iterations,"
            f" {sims[j].candidates.size} candidates"
        )
        more = {key: round(count / frames, 1) for key, count in (made[j] - made[0]).items()}
        if asked.launches and j:
            print("   ", dict(sorted(more.items(), key=lambda item: -item[1])))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=17, help="to a side of the square")
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--preset", default="live", choices=list(PRESETS))
    parser.add_argument("--blown", action="store_true", help="in gusts, not at rest")
    parser.add_argument("--launches", action="store_true", help="say which kernels are launched beside the first's")
    asked = parser.parse_args()
    measure(asked, True, BESIDE)
    measure(asked, False, ALONE)


if __name__ == "__main__":
    wp.config.quiet = True
    main()
