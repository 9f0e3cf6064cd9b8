"""`python tests/precision`: one step of the solver in float32 against the same step in float64, as a table.

The solver runs in float32. From its states the same step is taken by the solver and by its twin, the same source with
every number in float64 (in_float64.py): told is how far the cloth's vertices are apart after it, and where in the step
they come apart. Beside it, how far apart two steps in float64 are whose starts are the same in float32: what rounding
of the state alone does to such a step. And the same with contact passes, which go on until a step has converged. 1 when
the RMS over the cloth is over the limit: over all steps of a case as they are, or in a single one that converged.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OURS = ("tests/precision", "tests/hard_cases", "tests/proof/support", "tests/support", "solver", "server", "protocol")
sys.path[:0] = [str(ROOT / folder) for folder in OURS]  # this checkout is judged, whatever is installed

from compared import PLACES, Apart, Compared, compared_steps, rms  # noqa: E402
from precision_cases import CASES, Case  # noqa: E402

LIMIT = 0.05e-3  # m
STEPS, CONVERGED = 30, 6  # about so many of a case are compared, and so many of these with contact passes
COLUMNS = (
    "scene",
    "vertices",
    "steps",
    "RMS: all / half of the steps / worst [mm]",
    "largest [mm]",
    "largest after the cycles / first Newton move [mm]",
    "other counts",
    "float64, starts alike in float32: RMS all / worst [mm]",
    "contact passes: converged",
    "their RMS worst / largest [mm]",
)


@dataclass(frozen=True)
class Figures:
    """Of one case."""

    case: Case
    steps: list[Compared]

    @property
    def plain(self) -> list[Apart]:
        """Float32 against float64, at the case's settings."""
        return [step.precisions for step in self.steps]

    @property
    def passes(self) -> list[Apart]:
        """The same with contact passes."""
        return [step.converged for step in self.steps if step.converged is not None]

    @property
    def converged(self) -> list[Apart]:
        """Those of them that ended below the correction's tolerance in both precisions."""
        least = self.case.settings.correction_tolerance
        return [s for s in self.passes if max(s.one.report.residual, s.other.report.residual) < least]

    @property
    def broken(self) -> list[str]:
        """What is over the limit."""
        over_all, worst = all_of(self.plain), max((step.rms for step in self.converged), default=0.0)
        said = {
            f"all steps {1e3 * over_all:.4f} mm": over_all > LIMIT,
            f"a converged step {1e3 * worst:.4f} mm": worst > LIMIT,
        }
        return [f"{self.case.name}: {text}" for text, is_over in said.items() if is_over]

    def row(self) -> str:
        """Of the table."""
        plain, starts = self.plain, [step.starts for step in self.steps]
        ends = [step.rms for step in plain]
        after = [1e3 * max(step.at[place].max() for step in plain) for place in ("cycles", "first move")]
        converged = [1e3 * max((f(step) for step in self.converged), default=np.nan) for f in FIGURES]
        cells = (
            self.case.name,
            len(plain[0].at["end"]),
            len(plain),
            f"{1e3 * all_of(plain):.5f} / {1e3 * np.median(ends):.5f} / {1e3 * max(ends):.5f}",
            f"{1e3 * max(step.largest for step in plain):.4f}",
            " / ".join(f"{figure:.4f}" for figure in after),
            sum(not step.same_counts for step in plain),
            f"{1e3 * all_of(starts):.5f} / {1e3 * max(step.rms for step in starts):.5f}",
            f"{len(self.converged)} of {len(self.passes)}",
            f"{converged[0]:.5f} / {converged[1]:.4f}",
        )
        return f"| {' | '.join(map(str, cells))} |"

    def far_steps(self) -> list[str]:
        """The steps whose RMS is over the limit, place by place."""
        kinds = (("", self.plain), (", contact passes", self.passes))
        return [f"{self.case.name}{kind}, {told(step)}" for kind, all_ in kinds for step in all_ if step.rms > LIMIT]


FIGURES = (lambda step: step.rms, lambda step: step.largest)


def all_of(steps: list[Apart]) -> float:
    """RMS over steps and vertices [m]."""
    return rms(np.concatenate([step.at["end"] for step in steps]))


def told(step: Apart) -> str:
    """One step in words: RMS and largest [mm] by place, and of both precisions counts and the last Newton move."""
    one, other = step.one.report, step.other.report
    places = "; ".join(f"{p} {1e3 * rms(step.at[p]):.4f} / {1e3 * step.at[p].max():.4f}" for p in PLACES)
    return (
        f"step {step.number}: {places}; Newton {one.newton_iterations} and {other.newton_iterations}, "
        f"last move {1e3 * one.residual:.3f} and {1e3 * other.residual:.3f} mm/s, pairs {one.pairs} and {other.pairs}"
    )


def measured(case: Case) -> Figures:
    """A case's figures."""
    every = max(1, (case.last - case.first + 1) // STEPS)
    return Figures(case, list(compared_steps(case, every, max(1, STEPS // CONVERGED))))


def main() -> int:
    """The command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python tests/precision", description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "precision.md", help="where the table goes")
    options = parser.parse_args()
    begun = time.monotonic()
    rows, far, broken = [f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|"], [], []
    for key in options.cases:
        figures = measured(CASES[key]())
        rows.append(figures.row())
        far += figures.far_steps()
        broken += figures.broken
        print(rows[-1], flush=True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text("\n".join([*rows, "", *far]) + "\n")
    print("\n".join([*far, *broken, f"{time.monotonic() - begun:.0f} s; {options.out}"]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
