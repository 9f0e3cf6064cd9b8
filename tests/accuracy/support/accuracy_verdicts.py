"""Promises that errors of single steps are held to: the estimate, the presets' order, preset `reference`; of others'
fronts accuracy_fronts.py tells."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from accuracy_data import BOUGHT, Found, Measured, Row, digits, table
from accuracy_estimate import BEGUN_WITH, asked_steps, bought_steps, too_low
from accuracy_fronts import fronts_chapter
from accuracy_limits import (
    AGREEMENT,
    NEGLIGIBLE,
    REFERENCE,
    ROUNDING,
    WITHIN,
    preset_rows,
    within,
)
from accuracy_plots import scale_ms
from accuracy_promises import Chapter, Verdict
from accuracy_tables import presets_at_scale, spent

Far = tuple[Measured, list[Row], float]  # a case, its steps at the preset, and their error [mm], RMS over all


def error_chapters(found: Found) -> list[Chapter]:
    """All, in the order of the page."""
    return [estimate_chapter(found), order_chapter(found), reference_chapter(found), fronts_chapter(found)]


def estimate_chapter(found: Found) -> Chapter:
    """The estimate, on what was held out: at presets, and of the dial."""
    of: dict[str, list[Row]] = {}
    for on_gpu, where in ((False, ""), (True, " on a GPU")):
        judged = preset_rows(found, True, on_gpu)
        names = dict.fromkeys(f"`{name}`" for _, name, _ in judged)
        of[f"at {' and '.join(names)}{where}"] = [row for _, _, row in judged]
        for what, called in BOUGHT.items():
            for name in BEGUN_WITH:
                for dt in dict.fromkeys(measured.case.dt for measured in found.errors):
                    said = f"{called} at `{name}` in steps of 1/{1 / dt:.0f} s{where}"
                    cases = [measured for measured in found.errors if measured.case.dt == dt]
                    of[said] = bought_steps(cases, what, name, True, on_gpu)
    of = {said: rows for said, rows in of.items() if rows}
    verdicts = []
    for times, share in WITHIN:
        verdicts.append(
            Verdict(
                f"the estimate is within x{times:g} of a step's true error for {100 * share:g} % of the steps held out",
                "; ".join(f"{right(rows, times)} of {len(rows)} {said}" for said, rows in of.items()),
                [within(rows, times, least) >= share for rows in of.values() for least in (NEGLIGIBLE, 0.0)],
            )
        )
    told = (
        [*presets_told(found), *dial_told(of), *asked_told(found)]
        if any(verdict.missed for verdict in verdicts)
        else []
    )
    return Chapter("The estimate", verdicts, told)


def right(rows: Sequence[Row], times: float) -> str:
    """Share of the steps whose estimate is right, and in brackets with none that is right for being negligible."""
    return f"{100 * within(rows, times):.1f} % ({100 * within(rows, times, 0.0):.1f})"


def presets_told(found: Found) -> list[str]:
    """How often the estimate is right where the error is one that counts."""
    steps: dict[str, list[Row]] = {}
    for _, name, row in preset_rows(found, held_out=True):
        steps.setdefault(f"At `{name}`", []).append(row)
    steps["At all of these"] = [row for rows in steps.values() for row in rows]
    told = []
    for where, rows in steps.items():
        counted = [row for row in rows if row["error"] > NEGLIGIBLE]
        if counted:
            shares = " and ".join(f"x{t:g} for {100 * within(counted, t, 0.0):.0f} %" for t, _ in WITHIN)
            told.append(
                f"- {where} {len(counted)} of {len(rows)} steps held out are further off than {NEGLIGIBLE:g} mm. "
                f"There the estimate is within {shares}; too low by more than that are {too_low(counted)}."
            )
    return told


def dial_told(of: dict[str, list[Row]]) -> list[str]:
    """Where estimates of what was asked for an accuracy or a deadline are right too seldom."""
    times, share = WITHIN[0]
    called = tuple(BOUGHT.values())
    few = {said: rows for said, rows in of.items() if said.startswith(called) and within(rows, times) < share}
    shares = " and ".join(f"{right(rows, times)} of {len(rows)} steps {said}" for said, rows in few.items())
    return [f"- Within x{times:g} are {shares}."] if few else []


def asked_told(found: Found) -> list[str]:
    """How often what was asked for is what was had."""
    told = []
    for begun_with in BEGUN_WITH:
        pairs = [(mm, row["error"]) for mm, rows in asked_steps(found, begun_with).items() for row in rows]
        near = sum(mm / 2 <= error <= 2 * mm for mm, error in pairs)
        far = sum(error > 2 * mm for mm, error in pairs)
        if near < WITHIN[0][1] * len(pairs):
            told.append(
                f"- At `{begun_with}` {near} of {len(pairs)} dialled steps of all scenes are within x2 of the error "
                f"that was asked for; {far} are further off, the rest nearer."
            )
    return told


def order_chapter(found: Found) -> Chapter:
    """Each preset is nearer than the one before it and takes longer, in the middle of its steps."""
    cases = [measured for measured in found.presets if len(measured.presets) > 1]
    near = [steps_back(medians(m, "error"), rising=False, alike=ROUNDING) for m in cases]
    strict = [steps_back(medians(m, "error"), rising=False) for m in cases]
    slow = [steps_back(medians(m, "ms"), rising=True) for m in cases]
    scaled = [times for times in found.times if presets_at_scale(times)[:1] == ["draft"]]  # older runs have it else
    scales = [steps_back({n: scale_ms(t, n) for n in presets_at_scale(t)}, rising=True) for t in scaled]
    times = f"in {sum(not back for back in slow)} of {len(cases)} cases"
    if scales:
        times += f", and in {sum(not back for back in scales)} of {len(scales)} at a garment's scale"
    verdicts = [
        Verdict(
            "medians along the presets are monotone: less error with each",
            f"in {sum(not back for back in near)} of {len(cases)} cases; in {sum(not back for back in strict)} if "
            f"medians under {ROUNDING:g} mm are not taken as alike",
            [not back for back in near],
        ),
        Verdict(
            "medians along the presets are monotone: more time with each", times, [not back for back in slow + scales]
        ),
    ]
    told = [
        f"- {m.name}: {' and '.join(f'{said} [{unit}]' for said in back)}"
        for unit, backs, of in (("mm", near, cases), ("ms", slow, cases), ("ms", scales, scaled))
        for m, back in zip(of, backs, strict=True)
        if back
    ]
    beside = rms_told(cases)
    return Chapter("The presets' order", verdicts, [*told, *([""] if told and beside else []), *beside])


def medians(measured: Measured, figure: str) -> dict[str, float]:
    """Of all steps at each preset."""
    return {name: float(np.median([row[figure] for row in measured.rows[name]])) for name in measured.presets}


def steps_back(figures: dict[str, float], rising: bool, alike: float = 0.0) -> list[str]:
    """In words, each that is not in order with the one before; what is under `alike` is as good as anything."""
    return [
        f"{other} has {digits(figures[other])} after {one}'s {digits(figures[one])}"
        for one, other in pairwise(figures)
        if (figures[other] < figures[one] if rising else figures[other] > max(figures[one], alike))
    ]


def rms_told(cases: Sequence[Measured]) -> list[str]:
    """Where errors over all steps are not in order."""
    rms = {m.name: {name: root_mean_square(m.rows[name]) for name in m.presets} for m in cases}
    back = {scene: figures for scene, figures in rms.items() if steps_back(figures, rising=False)}
    if not back:
        return []
    names = list(dict.fromkeys(name for figures in back.values() for name in figures))
    rows = [(scene, *(digits(figures.get(name)) for name in names)) for scene, figures in back.items()]
    said = [
        f"Promised are medians, and medians under {ROUNDING:g} mm are taken as alike. A root mean square over all",
        f"steps, which few decide that end far off, is not in order in {len(back)} of {len(cases)} cases [mm]:",
    ]
    return [*said, "", *table(("scene", *names), rows)]


def root_mean_square(rows: Sequence[Row]) -> float:
    """Error over all steps [mm]."""
    return float(np.sqrt(np.mean([row["error"] ** 2 for row in rows])))


def reference_chapter(found: Found) -> Chapter:
    """The preset that claims it is Newton's equal, over all steps of each case."""
    cases = [(m, m.rows[REFERENCE], root_mean_square(m.rows[REFERENCE])) for m in found.presets if REFERENCE in m.rows]
    promise = f"preset `{REFERENCE}` is within {AGREEMENT:g} mm of Newton IPC, RMS over all steps of a case"
    if not cases:
        return Chapter("Preset `reference`", [Verdict(promise, "not measured", [False])], [])
    agree = {}
    for measured, _, off in cases:
        agree.setdefault(measured.step, []).append(off <= AGREEMENT)
    counts = "; ".join(f"{sum(held)} of {len(held)} cases in steps of {step}" for step, held in agree.items())
    furthest = max(off for _, _, off in cases)
    parts = [held for of in agree.values() for held in of]
    verdict = Verdict(promise, f"{counts}; the furthest is {digits(furthest)} mm off", parts)
    far = reference_told([case for case in cases if case[2] > AGREEMENT])
    return Chapter("Preset `reference`", [verdict], [*far, *unexplained(cases)] if far else [])


def unexplained(cases: Sequence[Far]) -> list[str]:
    """How many steps end far off, and of how many that is neither told by the report nor by their own balance."""
    steps = [row for _, rows, _ in cases for row in rows]
    far = [row for row in steps if row["error"] > AGREEMENT]
    left = [row for row in far if not spent(REFERENCE, [row]) and (row.get("own_balance") or np.inf) >= AGREEMENT]
    errors = " and ".join(digits(row["error"]) for row in sorted(left, key=lambda row: row["error"]))
    said = f"Of all {len(steps)} steps at this preset {len(far)} are over {AGREEMENT:g} mm off; {len(left)} of these"
    return ["", f"{said} neither made all their iterations nor are in a balance of their own: {errors or 'none'} [mm]."]


def reference_told(far: Sequence[Far]) -> list[str]:
    """Of the cases that are further off."""
    if not far:
        return []
    rows = []
    for measured, steps, off in far:
        further = [row for row in steps if row["error"] > AGREEMENT]
        balanced = [row for row in further if (row.get("own_balance") or np.inf) < AGREEMENT]
        lower = sum((row["energy"] or 0.0) < 0 for row in balanced)
        rows.append((measured.name, digits(off), f"{len(further)} of {len(steps)}", len(balanced), lower))
    said = [
        "These cases are off by some steps that end far from Newton IPC's. In a balance of its own is an end that",
        f"float64 Newton moves by less than {AGREEMENT:g} mm: it is in another fold. That was looked for only where",
        f"the estimate is not within x{WITHIN[-1][0]:g} of the error.",
    ]
    head = ("scene", "RMS [mm]", f"steps over {AGREEMENT:g} mm", "of these in a balance of their own")
    return [*said, "", *table((*head, "of these with less energy than Newton's"), rows)]
