"""What is drawn: error against time by case, convergence by iterations and by time, error against time at scale."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from accuracy_data import CPU, Found, Measured, front
from methods import TITLES
from svg import Line, line_chart

CHAINS = {  # what is swept alone, by the solver, the number that is varied, and what else is the same in all of a chain
    "ours, Newton iterations": ("ours", "newton", {"gradients": 60}),
    "ours, accuracy": ("ours", "accuracy", {}),
    "ours, accuracy from draft": ("ours", "accuracy", {"from_draft": 1}),
    "ours, contact passes": ("ours", "passes", {}),
    "PD alone, cycles": ("trial", "cycles", {}),
    "Newton IPC": ("newton_ipc", "tolerance", {}),
    "XPBD, iterations": ("xpbd", "iterations", {}),
    "XPBD, sub-steps": ("xpbd", "substeps", {}),
    "Chebyshev-Jacobi PD, iterations": ("chebyshev", "iterations", {}),
    "Newton's VBD, iterations": ("vbd", "iterations", {}),
    "Newton's Style3D, iterations": ("style3d", "iterations", {}),
}


def plots(found: Found) -> dict[str, tuple[str, str]]:
    """File name -> title and SVG."""
    drawn = {}
    for measured in found.errors:
        if len(measured.rows) <= len(measured.presets):
            continue
        for kind, title, x_name, lines in (
            ("pareto", "Error of a step against its time", "ms", solver_lines(measured)),
            ("by-iterations", "Convergence by iterations", "iterations", chain_lines(measured, iterations)),
            ("by-time", "Convergence by time", "ms", chain_lines(measured, milliseconds)),
        ):
            if lines:
                said = f"{title}: {measured.name}"
                drawn[f"{kind}-{measured.place}.svg"] = said, line_chart(said, x_name, "mm", lines)
    for device in dict.fromkeys(times.device for times in found.times):
        lines = scale_lines(found, device)
        if lines:
            where = "CPU" if device == CPU else "GPU"
            said = f"Error of a step at 600 vertices against its time at a garment's scale: {where}"
            drawn[f"scale-{device.replace(':', '')}.svg"] = said, line_chart(said, "ms", "mm", lines)
    return drawn


def drawable(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those that a logarithmic axis has."""
    return [(x, y) for x, y in points if np.isfinite((x, y)).all() and x > 0 and y > 0]


def solver_lines(measured: Measured) -> list[Line]:
    """The front of each solver, and our presets beside."""
    lines = []
    presets = drawable([measured.point(name) for name in measured.presets])
    if presets:
        lines.append(Line("our presets", presets, 0, dashed=True))
    for colour, solver in enumerate(s for s in TITLES if s not in ("float64", "inertia")):
        points = {name: measured.point(name) for name in measured.of_solver(solver)}
        line = drawable([points[name] for name in front(points)])
        if line:
            lines.append(Line(f"{TITLES[solver]}, front", line, colour))
    return lines


def chain(measured: Measured, solver: str, varied: str, same: Mapping[str, float]) -> list[str]:
    """Methods of a chain, the dearest last; what is varied with something else in them is in no chain."""
    names = []
    for name in measured.of_solver(solver):
        at = dict(measured.about[name]["at"])
        if varied in at and {k: v for k, v in at.items() if k != varied} == dict(same):
            names.append(name)
    coarsest_first = varied in ("tolerance", "accuracy")
    return sorted(names, key=lambda name: measured.about[name]["at"][varied], reverse=coarsest_first)


def iterations(measured: Measured, name: str, varied: str) -> float:
    """How many it had: what was varied, or what Newton told where it ends by itself."""
    if varied in ("tolerance", "accuracy"):
        return measured.median(name, "newton")
    return float(measured.about[name]["at"][varied])


def milliseconds(measured: Measured, name: str, _varied: str) -> float:
    """What it took."""
    return measured.median(name, "ms")


def chain_lines(measured: Measured, x_of: Callable[[Measured, str, str], float]) -> list[Line]:
    """Error against x, a line for each chain of two or more."""
    lines = []
    for colour, (said, (solver, varied, same)) in enumerate(CHAINS.items()):
        names = chain(measured, solver, varied, same)
        points = drawable([(x_of(measured, name, varied), measured.median(name, "error")) for name in names])
        if len(points) > 1:
            lines.append(Line(said, points, colour, dashed=colour >= 8))
    return lines


def scale_lines(found: Found, device: str) -> list[Line]:
    """Our front of each scene: time of one mesh, error of another."""
    lines = []
    for number, times in enumerate(t for t in found.times if t.device == device):
        points = at_scale(found, times)
        line = drawable([points[name] for name in front(points)])
        if line:
            said = f"{times.case.scene}, 1/{1 / times.case.dt:.0f} s, {times.case.vertices} vertices"
            lines.append(Line(said, line, number // 2, number % 2 == 1))
    return lines


def at_scale(found: Found, times: Measured) -> dict[str, tuple[float, float]]:
    """Of our methods: ms of the garment at scale, and the error that the same has on the CPU where it was held to the
    reference."""
    case = times.case
    for errors in found.errors:
        same = [getattr(errors.case, k) == getattr(case, k) for k in ("garment", "motion", "dt", "size", "fabric")]
        if all(same) and errors.device == CPU:
            names = [name for name in errors.of_solver("ours") if name in times.rows]
            return {name: (scale_ms(times, name), errors.median(name, "error")) for name in names}
    return {}


def scale_ms(times: Measured, method: str) -> float:
    """Median of the steps."""
    return float(np.median(times.rows[method][0]["ms"]))
