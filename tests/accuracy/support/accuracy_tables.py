"""Tables of the page: errors of the presets and of the sweep, what steps up cost, what the guarantee costs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from accuracy_data import CPU, Found, Measured, Row, digits, front, geometric_mean, ratios, table
from accuracy_limits import OTHERS, WITHIN, beyond_ours, title, within
from accuracy_plots import CHAINS, at_scale, chain, scale_ms
from discretisation_rest import STILL

from tryon_solver.settings import PRESETS

HEAD = (
    "scene",
    "settings",
    "steps",
    "RMS p50 / p90 / max [mm]",
    "largest p50 / max [mm]",
    "strain RMS [%]",
    "normal RMS [degrees]",
    "energy [mJ]",
    "ms p50",
    "void",
    "spent",
    "crossed",
    *(f"within x{times:g}" for times, _ in WITHIN),
)
BY_BUDGET = "draft by its budget"  # in earlier runs, before it ended where it is near enough to balance
AT_SCALE = ("draft", BY_BUDGET, "live", "fit", "reference")  # presets, in the order of what they cost
SPEED = "speed [m/s]"
CHAIN_STEPS = ("accuracy", "newton", "passes", "cycles", "iterations", "substeps")


def preset_table(found: Found) -> list[str]:
    """Of the single steps at presets."""
    return table(HEAD, [preset_row(m, name) for m in found.presets for name in m.presets])


def preset_row(measured: Measured, name: str) -> list[object]:
    """Of that table."""
    rows = measured.rows[name]
    errors = [row["error"] for row in rows]
    energies = [row["energy"] for row in rows if row["energy"] is not None]
    p50, p90 = np.percentile(errors, (50, 90))
    return [
        measured.name + " (held out)" * measured.case.held_out,
        name,
        len(rows) if len(rows) == measured.case.states else f"{len(rows)} of {measured.case.states}",
        f"{digits(p50)} / {digits(p90)} / {digits(max(errors))}",
        f"{digits(median(rows, 'largest'))} / {digits(max(row['largest'] for row in rows))}",
        digits(median(rows, "strain")),
        digits(median(rows, "normal")),
        digits(float(np.median(energies)) if energies else None),
        digits(median(rows, "ms")),
        sum(row["void"] for row in rows),
        spent(name, rows),
        sum(row["crossed"] > 0 for row in rows),
        *(f"{100 * within(rows, t):.0f} % ({100 * within(rows, t, 0.0):.0f})" for t, _ in WITHIN),
    ]


def spent(preset: str, rows: Sequence[Row]) -> object:
    """How many made all the iterations of all passes that the preset has; a dash where it has one pass."""
    settings = PRESETS.get(preset)
    if settings is None or settings.contact_passes == 1:
        return "-"
    return sum(row["newton"] >= settings.contact_passes * settings.correction_iterations for row in rows)


def left_out_lines(found: Found) -> list[str]:
    """Of each case at presets the states that there is no step from."""
    said = []
    for measured in found.presets:
        there = set.union(*map(measured.states, measured.presets))
        gone = sorted(set(range(1, measured.case.states + 1)) - there)
        if gone:
            end = max(there)
            numbers = [str(state) for state in gone if state < end]
            if end < measured.case.states:
                numbers.append(f"{spanned(end + 1, measured.case.states)} (at its end)")
            said.append(f"  - {measured.name}, {len(gone)} of {measured.case.states}: {', '.join(numbers)}")
    whole = f"- Left out are these states, of {sum(m.case.states for m in found.presets)} in all:"
    return [whole, *said] if said else []


def spanned(first: int, last: int) -> str:
    """Numbers that follow each other."""
    return str(first) if first == last else f"{first} to {last}"


def median(rows: Sequence[Row], figure: str) -> float:
    """Of the steps."""
    return float(np.median([row[figure] for row in rows]))


def price_table(found: Found) -> list[str]:
    """What each step up in accuracy costs: from each preset to the next, and along each chain of the sweep."""
    rows = []
    groups: dict[tuple[str, str], list[Measured]] = {}
    for measured in found.presets:
        for one, other in pairwise(measured.presets):
            groups.setdefault((one, other), []).append(measured)
    for measured in found.errors:
        for solver, varied, same in CHAINS.values():
            names = chain(measured, solver, varied, same)
            for one, other in pairwise(names):
                if solver in ("ours", "trial") and varied in CHAIN_STEPS:
                    groups.setdefault((one, other), []).append(measured)
    for (one, other), cases in groups.items():
        cells: list[object] = []
        compared = False
        for on_gpu in (False, True):
            of = [measured for measured in cases if measured.on_gpu == on_gpu]
            time = ratios(of, one, other, lambda m, name: m.median(name, "ms"))
            error = ratios(of, one, other, lambda m, name: m.median(name, "error"))
            compared = compared or bool(time and error)
            cells += [len(time), times_said(geometric_mean(time) if time else None)]
            cells.append(times_said(scale_ratio(found, "cuda:0" if on_gpu else CPU, one, other)))
            cells.append(f"/{digits(1 / geometric_mean(error), 2)}" if error else "-")
        if compared:
            rows.append((one, other, *cells))
    head = ["from", "to"]
    for where in ("CPU", "GPU"):
        head += [f"cases, {where}", f"time, small, {where}", f"time at scale, {where}", f"error, {where}"]
    return table(head, rows)


def times_said(ratio: float | None) -> str:
    """A ratio of times; a dash for none."""
    return f"x{digits(ratio, 2)}" if ratio else "-"


def scale_ratio(found: Found, device: str, one: str, other: str) -> float | None:
    """Of the times at a garment's scale on that device, a mean over the scenes."""
    of_device = [times for times in found.times if times.device == device]
    times = ratios(of_device, one, other, scale_ms)
    return geometric_mean(times) if times else None


def of_estimate(ms: float, whole: float) -> str:
    """Its share of the time. A GPU that ends steps by itself has none of it: there it is a part of the correction's."""
    return f"{100 * ms / whole:.0f} %" if ms else "in that"


def presets_at_scale(times: Measured) -> list[str]:
    """In the order of what they cost."""
    return [name for name in AT_SCALE if name in times.rows]


def scale_table(found: Found) -> list[str]:
    """Times at a garment's scale of the presets."""
    head = ("scene", "vertices", "settings", "ms p50", "ms max", "correction and check", "estimate", "pairs")
    rows = []
    for times in found.times:
        for name in presets_at_scale(times):
            row = times.rows[name][0]
            ms = scale_ms(times, name)
            rows.append(
                (
                    times.name,
                    row["cloth_vertices"],
                    name,
                    digits(ms),
                    digits(max(row["ms"])),
                    f"{100 * (row['ms_correction'] + row['ms_check']) / np.mean(row['ms']):.0f} %",
                    of_estimate(row["ms_estimate"], float(np.mean(row["ms"]))),
                    f"{row['pairs']:.0f}",
                )
            )
    return table(head, rows)


def guarantee_table(found: Found) -> list[str]:
    """What the correction and the check cost, and where a step would end without them."""
    head = (
        "scene",
        "correction and check of `live`",
        "estimate",
        "`live` [ms]",
        "error [mm]",
        "crossed",
        "PD alone [ms]",
        "error [mm]",
        "crossed",
        "PD alone, most cycles [ms]",
        "error [mm]",
        "crossed",
    )
    rows = []
    for measured in found.errors:
        trials = chain(measured, "trial", "cycles", {})
        if "live" not in measured.rows or not trials:
            continue
        live = measured.rows["live"]
        whole = sum(row["ms"] for row in live)
        cells: list[object] = [
            measured.name,
            f"{100 * sum(row['ms_correction'] + row['ms_check'] for row in live) / whole:.0f} %",
            of_estimate(sum(row["ms_estimate"] for row in live), whole),
        ]
        alike = [name for name in trials if measured.about[name]["at"]["cycles"] == 4]
        for name in ("live", *alike, trials[-1]):
            of = measured.rows[name]
            crossed = f"{sum(row['crossed'] > 0 for row in of)} of {len(of)}"
            cells += [digits(measured.median(name, "ms")), digits(measured.median(name, "error")), crossed]
        rows.append(cells)
    return table(head, rows)


def sweep_table(measured: Measured) -> list[str]:
    """Every method of a case, by time."""
    points = {name: measured.point(name) for name in measured.rows}
    ours = front({name: points[name] for name in measured.ours_over(measured.shared)})
    errors = ("RMS p50 [mm]", "largest p50 [mm]", "strain [%]", "normal [degrees]")
    head = ("settings", "ms p50", *errors, "crossed", "on our front")
    rows = []
    for name in sorted(points, key=lambda n: points[n]):
        of = measured.rows[name]
        figures = [digits(measured.median(name, f)) for f in ("error", "largest", "strain", "normal")]
        crossed = f"{sum(row['crossed'] > 0 for row in of)} of {len(of)}"
        rows.append((name, digits(points[name][0]), *figures, crossed, "yes" if name in ours else ""))
    return table(head, rows)


def front_table(found: Found) -> list[str]:
    """Along our front in each case: what each step up costs there, and at scale."""
    rows = []
    for measured in found.errors:
        points = {name: measured.point(name) for name in measured.ours_over(measured.shared)}
        if len(points) <= len(measured.presets):
            continue
        names, before = front(points), None
        times = {t.device: at_scale(found, t) for t in found.times if t.case.scene == measured.case.scene}
        for name in names:
            ms, error = points[name]
            step = ("", "") if before is None else (f"x{digits(ms / before[0], 2)}", f"/{digits(before[1] / error, 2)}")
            scale = [digits(times.get(device, {}).get(name, (np.inf, 0))[0]) for device in ("cpu", "cuda:0")]
            case = f"{measured.name} ({len(measured.shared)} states)"
            rows.append((case, name, digits(ms), *scale, digits(error), *step))
            before = ms, error
    head = ("scene", "settings", "ms, small", "ms at scale, CPU", "ms at scale, GPU", "RMS [mm]", "time", "error")
    return table(head, rows)


def others_table(found: Found) -> list[str]:
    """Other solvers' steps, and how near ours are in no more time."""
    rows = []
    for measured in found.errors:
        beyond = {name for name, *_ in beyond_ours(measured)}
        for name in measured.of_solver(*OTHERS):
            states = measured.shared & measured.states(name)
            ours = {own: measured.point(own, states) for own in measured.ours_over(states)}
            ms, error = measured.point(name, states)
            of = measured.rows[name]
            best = min((e for m, e in ours.values() if m <= ms), default=np.inf)
            faster = min((m for m, e in ours.values() if e <= error), default=np.inf)
            rows.append(
                (
                    measured.name,
                    f"{title(measured, name)}: {name}",
                    len(states),
                    digits(ms),
                    digits(error),
                    f"{sum(row['crossed'] > 0 for row in of)} of {len(of)}",
                    digits(best),
                    digits(faster),
                    "no" if name in beyond else "yes",
                )
            )
    head = (
        "scene",
        "solver",
        "states",
        "ms p50",
        "RMS p50 [mm]",
        "crossed",
        "ours in no more time [mm]",
        "ours as near [ms]",
        "ours on or below",
    )
    return table(head, rows)


def trajectory_table(found: Found) -> list[str]:
    """How far ways that began together are apart."""
    tenths = (0.1, 0.2, 0.3, 0.4, 0.5)
    rows = []
    for measured in found.trajectories:
        for name, of in measured.rows.items():
            by_state = {row["state"]: row for row in of}
            numbers = [round(t / measured.case.dt) for t in tenths]
            cells = [digits(by_state[k]["error"]) if k in by_state else "-" for k in numbers]
            rows.append((measured.name, name, *cells, sum(row["crossed"] > 0 for row in of)))
    return table(("scene", "settings", *(f"after {t:g} s" for t in tenths), "crossed"), rows)


def tailor_cell(name: str, value: Any) -> str:
    """Of a figure beside a measure; cloth that had not come to rest is said to move."""
    said = digits(value) if isinstance(value, float | int) else str(value)
    return f"{said}, moves" if name == "speed" and value > STILL else said


def tailor_tables(rows: Sequence[Row]) -> list[str]:
    """By measure and by what was varied; changes are to the finest."""
    lines: list[str] = []
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["measure"], row["varied"]), []).append(row)
    for (measure, varied), of in sorted(groups.items()):
        of = sorted(of, key=lambda row: row["at"], reverse=varied.startswith("edge"))
        known = ("measure", "unit", "varied", "value", "at", "exact", "vertices")
        more = list(dict.fromkeys(name for row in of for name in row if name not in known))
        counted = () if varied == "vertices" else ("vertices",)
        titles = (SPEED if name == "speed" else name for name in more)
        head = (varied, *counted, f"{measure} [{of[0]['unit']}]", "held to", "from the last", *titles)
        cells = [
            (
                digits(row["at"]),
                *(row[name] for name in counted),
                digits(row["value"], 4),
                digits(row["exact"], 4),
                f"{100 * (row['value'] / of[-1]['value'] - 1):+.1f} %",
                *(tailor_cell(name, row.get(name, "-")) for name in more),
            )
            for row in of
        ]
        lines += [f"### {measure.capitalize()}, by {varied}", "", *table(head, cells), ""]
    return lines
