"""`python tests/reference`: the solver against full Newton in float64, scene by scene, as a table; 1 on a broken limit.

One step from each of the reference's states, at the preset `live` and with contact passes; then the drapes that both
reach from the same start, and the force on the body against the weight. At `live` a drape tells how steps' errors add
up where friction keeps them; with contact passes there are next to none. The reference's states are kept in .cache and
take most of the time when they are missing. The limit for `live` is on the RMS over all steps and vertices; the worst
step is told. With contact passes it is on every step. A step may have several balances: where the solver is over a
limit, the reference solves the step once more from where the solver ended; if it stays there within the limit, the step
counts as one in another balance, and has a column for that.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("tests/support", "solver")]  # this checkout, whatever is installed

from against_reference import force_on_body, off_balance, one_step, reference_steps, rms, simulation_at  # noqa: E402
from contact_scenes import DT, SCENES, ContactScene  # noqa: E402

from tryon_solver.settings import PRESETS  # noqa: E402
from tryon_solver.simulation import Simulation  # noqa: E402

G = 9.81
LIVE = PRESETS["live"]
CONVERGED = replace(LIVE, contact_passes=20)
ONE_STEP, PASSES, DRAPE, FORCE = 0.5e-3, 0.05e-3, 3e-3, 0.01  # m, m, m, share of the weight
DRAPE_PASSES = 1e-3  # m
# steps of 1/60 s until the scene has come to rest; the strip above the threshold never does
LENGTHS = {"square": 60, "damped square": 60, "strip below mu": 40, "strip above mu": 40, "sleeve": 50, "sheets": 40}
SLIDES = ("strip above mu",)


@dataclass(frozen=True)
class Figures:
    """Of one scene: RMS distances [m] from the reference, over all steps that did not end in another balance and in the
    worst of these, and at the end; the force on the body against the weight, None where nothing is at rest."""

    name: str
    vertices: int
    live_all: float
    live: float
    passes: float
    elsewhere: tuple[int, int]  # steps in another balance, at `live` and with contact passes
    steps: int
    drape: float  # at `live`
    drape_passes: float
    force: float | None
    speed: float  # m/s, RMS at the end of the reference

    @property
    def broken(self) -> list[str]:
        """What is over its limit."""
        over = {
            f"one step {1e3 * self.live_all:.3f} mm": self.live_all > ONE_STEP,
            f"with contact passes {1e3 * self.passes:.4f} mm": self.passes > PASSES,
            f"drape {1e3 * self.drape:.3f} mm": self.drape > DRAPE,
            f"drape with contact passes {1e3 * self.drape_passes:.3f} mm": self.drape_passes > DRAPE_PASSES,
            f"force off the weight by {100 * (self.force or 0):.2f} %": self.force is not None and self.force > FORCE,
        }
        return [text for text, is_over in over.items() if is_over]

    def row(self) -> str:
        """Of the table."""
        force = "slides" if self.force is None else f"{100 * self.force:.3f} %"
        return (
            f"| {self.name} | {self.vertices} | {1e3 * self.live_all:.4f} / {1e3 * self.live:.4f} | "
            f"{1e3 * self.passes:.4f} | "
            f"{self.elsewhere[0]}, {self.elsewhere[1]} of {self.steps} | "
            f"{1e3 * self.drape:.4f}, {1e3 * self.drape_passes:.4f} | {force} | {1e3 * self.speed:.2f} |"
        )


def measured(key: str, case: ContactScene, count: int) -> Figures:
    """The figures of one scene over so many steps."""
    errors: dict[float, list[float]] = {ONE_STEP: [], PASSES: []}
    elsewhere, going = {ONE_STEP: 0, PASSES: 0}, list[Simulation]()
    for step in reference_steps(case, count):
        n = len(step.before.v)
        for limit, settings in ((ONE_STEP, LIVE), (PASSES, CONVERGED)):
            x = one_step(case, step, settings)
            error = rms(x[:n] - step.after.x[:n])
            if error > limit and off_balance(case, step, x) <= limit:
                elsewhere[limit] += 1
            else:
                errors[limit].append(error)
        going = going or [simulation_at(case, step.before, settings) for settings in (LIVE, CONVERGED)]
        for sim in going:
            sim.advance(case.pose_at(step.number), step.number * DT)
    force, weight = None, G * going[0].mass.sum()
    if key not in SLIDES:
        force = float(np.linalg.norm(force_on_body(going[0]) + np.array([0, weight, 0])) / weight)
    drapes = [rms(sim.cloth_positions() - step.after.x[:n]) for sim in going]
    live = float(np.sqrt(np.mean(np.square(errors[ONE_STEP]))))
    largest = live, max(errors[ONE_STEP]), max(errors[PASSES])
    others = elsewhere[ONE_STEP], elsewhere[PASSES]
    return Figures(case.name, n, *largest, others, count, drapes[0], drapes[1], force, rms(step.after.v))


def main() -> int:
    """The command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python tests/reference", description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "reference.md", help="where the table goes")
    options = parser.parse_args()
    columns = (
        "scene",
        "vertices",
        "one step, live: all, worst [mm]",
        "one step, contact passes: worst [mm]",
        "in another balance",
        "drape, live and with contact passes [mm]",
        "force off the weight",
        "speed at the end [mm/s]",
    )
    head = f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|"
    begun, rows, broken = time.monotonic(), [head], []
    for key in options.scenes:
        figures = measured(key, SCENES[key](), LENGTHS[key])
        rows.append(figures.row())
        broken += [f"{figures.name}: {text}" for text in figures.broken]
        print(figures.row(), flush=True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text("\n".join(rows) + "\n")
    print("\n".join([*rows, *broken, f"{time.monotonic() - begun:.0f} s; {options.out}"]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
