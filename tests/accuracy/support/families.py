"""What is measured of a case, in families that are measured apart: presets, sweeps of `live`, other solvers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from accuracy_case import AccuracyCase, presets
from methods import Method, ours

from tryon_solver.settings import PRESETS

LIVE = PRESETS["live"]
WITHOUT_CYCLES = {"outer_iterations": 1, "reduced_iterations": 0, "smoothing_sweeps": 0}
NEWTON = (1, 2, 4, 8, 16, 32)
GRADIENTS = (10, 30, 60, 120)
ACCURACIES = (5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)  # mm
DEADLINES = (30.0, 100.0, 300.0)  # ms
PEERS_ITERATIONS = (2, 5, 20, 80)
VBD_GAPS = {27e-3: PEERS_ITERATIONS, 57e-3: PEERS_ITERATIONS, 116e-3: (5,)}
"""VBD's iterations by its gap [m]: in a step of 1/60 s it moves vertices by up to 0.75, 1.5 and 3 m/s with these."""
REDUCED, SMOOTHING = (0, 2, 4), (0, 5, 10)


def preset_family(case: AccuracyCase) -> Mapping[str, Method]:
    """All, in the case's steps."""
    return {name: ours(settings) for name, settings in presets(case.dt).items()}


def accuracy_family(case: AccuracyCase) -> Mapping[str, Method]:
    """`live`, and `draft`, their correction going on until the estimated error is small enough."""
    draft = replace(PRESETS["draft"], largest_step=case.dt)
    return {
        **{f"to {mm:g} mm": changed(case, {"accuracy": 1e-3 * mm}, accuracy=mm) for mm in ACCURACIES},
        **{
            f"draft to {mm:g} mm": ours(replace(draft, accuracy=1e-3 * mm), accuracy=mm, from_draft=1)
            for mm in ACCURACIES
        },
    }


def deadline_family(case: AccuracyCase) -> Mapping[str, Method]:
    """`live`, and `draft`, their correction going on while there is time."""
    draft = replace(PRESETS["draft"], largest_step=case.dt)
    return {
        **{f"in {ms:g} ms": changed(case, {"deadline": 1e-3 * ms}, deadline=ms) for ms in DEADLINES},
        **{
            f"draft in {ms:g} ms": ours(replace(draft, deadline=1e-3 * ms), deadline=ms, from_draft=1)
            for ms in DEADLINES
        },
    }


def newton_family(case: AccuracyCase) -> Mapping[str, Method]:
    """`live` with other budgets of its correction, conjugate gradients each."""
    return {
        f"Newton {n} x {pcg}": changed(case, budget(n, pcg), newton=n, gradients=pcg)
        for n in NEWTON
        for pcg in GRADIENTS
    }


def cycle_family(case: AccuracyCase) -> Mapping[str, Method]:
    """`live` with one thing changed of its cycles: how many, what is in them, which subspace, which scheme."""
    return {
        **{f"cycles {n}": changed(case, {"outer_iterations": n}, cycles=n) for n in (1, 2, 8, 16)},
        **{
            f"reduced {r}, smoothing {s}": changed(case, {"reduced_iterations": r, "smoothing_sweeps": s})
            for r in REDUCED
            for s in SMOOTHING
            if (r, s) != (LIVE.reduced_iterations, LIVE.smoothing_sweeps)
        },
        **{f"splines every {s:g} edges": changed(case, {"subspace_spacing": s}) for s in (2.0, 8.0, 16.0)},
        **{
            f"exact coarse level, {n} cycles": changed(case, {"scheme": "contact_coarse", "outer_iterations": n})
            for n in (1, 4, 8)
        },
        "Newton-PCG alone": changed(case, WITHOUT_CYCLES),
    }


def other_family(case: AccuracyCase) -> Mapping[str, Method]:
    """`live` with one of its tolerances, passes, sub-steps or extensions changed."""
    return {
        **{f"tolerance of cycles {t:g}": changed(case, {"tolerance": t}) for t in (0.1, 0.01)},
        **{f"tolerance {t:g}": changed(case, {"correction_tolerance": t}) for t in (1e-2, 1e-3, 1e-5)},
        **{f"tolerance of gradients {t:g}": changed(case, {"correction_pcg_tolerance": t}) for t in (0.1, 1e-3)},
        **{f"passes {n}": changed(case, {"contact_passes": n}, passes=n) for n in (2, 4, 20)},
        "no extensions": changed(case, {"correction_extensions": 0}),
        "no second correction": changed(case, {"second_iterations": 0}),
        **{f"travel {1e3 * t:g} mm": changed(case, {"substep_travel": t}) for t in (4e-3, 16e-3)},
        **{f"{n} sub-steps": changed(case, {"largest_step": case.dt / n}, substeps=n) for n in (2, 4)},
    }


def precision_family(_case: AccuracyCase) -> Mapping[str, Method]:
    """The same steps in float64."""
    return {f"{name} in float64": ours(PRESETS[name], "float64") for name in ("draft", "live")}


def trial_family(case: AccuracyCase) -> Mapping[str, Method]:
    """Projective dynamics with the contacts' proxy, and no correction: what a step costs without the guarantee."""
    return {
        f"PD alone, {n} cycles": Method("trial", replace(LIVE, outer_iterations=n, largest_step=case.dt), {"cycles": n})
        for n in (1, 2, 4, 8, 16, 32)
    }


def baseline_family(_case: AccuracyCase) -> Mapping[str, Method]:
    """The solvers of METHOD.md section 18: numpy, in float64."""
    return {
        **{f"Newton IPC to {t:g} m": Method("newton_ipc", at={"tolerance": t}) for t in (1e-2, 1e-3, 1e-4, 1e-6)},
        **{f"XPBD, {n} iterations": Method("xpbd", at={"iterations": n}) for n in (1, 5, 20, 80)},
        **{f"XPBD, {n} sub-steps": Method("xpbd", at={"substeps": n}) for n in (5, 20, 80)},
        **{f"Chebyshev, {n} iterations": Method("chebyshev", at={"iterations": n}) for n in (10, 40, 160, 640)},
        "Chebyshev, 8 x 40 iterations": Method("chebyshev", at={"substeps": 8, "iterations": 40}),
    }


def inertia_family(_case: AccuracyCase) -> Mapping[str, Method]:
    """No solver: cloth goes on as it went, through whatever is there."""
    return {"inertia alone": Method("inertia")}


def peer_family(_case: AccuracyCase) -> Mapping[str, Method]:
    """NVIDIA's Newton: its VBD and Style3D, in one step and in ten sub-steps."""
    return {
        **{
            f"VBD, {n} iterations, gap {1e3 * gap:g} mm": Method("vbd", at={"iterations": n, "gap": gap})
            for gap, iterations in VBD_GAPS.items()
            for n in iterations
        },
        **{f"Style3D, {n} iterations": Method("style3d", at={"iterations": n}) for n in PEERS_ITERATIONS},
        **{
            f"{title}, 10 x 10 iterations": Method(solver, at={"substeps": 10, "iterations": 10})
            for solver, title in (("vbd", "VBD"), ("style3d", "Style3D"))
        },
    }


FAMILIES = {
    "presets": preset_family,
    "accuracy": accuracy_family,
    "deadline": deadline_family,
    "newton": newton_family,
    "cycles": cycle_family,
    "others": other_family,
    "trial": trial_family,
    "precision": precision_family,
    "baselines": baseline_family,
    "inertia": inertia_family,
    "peers": peer_family,
    "trajectory": preset_family,
}
SWEPT = ("accuracy", "deadline", "newton", "cycles", "others", "trial", "precision")
OF_NUMPY = ("precision", "baselines", "inertia")  # families that run on no GPU
ON_DEVICE = tuple(family for family in FAMILIES if family not in OF_NUMPY)
FREE_RUNNING = ("trajectory",)  # from the first state on, and not from each


def changed(case: AccuracyCase, change: Mapping[str, Any], **at: float) -> Method:
    """`live` in the case's steps, with that change."""
    return ours(replace(LIVE, **{"largest_step": case.dt, **change}), **at)


def budget(iterations: int, pcg: int) -> dict[str, Any]:
    """Of the correction, the second one twice that."""
    return {
        "correction_iterations": iterations,
        "correction_pcg_iterations": pcg,
        "second_iterations": 2 * iterations,
        "second_pcg_iterations": 2 * pcg,
    }
