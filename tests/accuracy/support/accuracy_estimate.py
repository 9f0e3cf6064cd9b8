"""Tables of the estimate: how often it is right, where it is furthest from the error, and what the dial came to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from accuracy_data import BOUGHT, CPU, Found, Measured, Row, digits, table
from accuracy_limits import WITHIN, is_within, preset_rows, within

BEGUN_WITH = ("live", "draft")  # the presets that are dialled


def estimate_table(found: Found) -> list[str]:
    """How many estimates are right, by preset and length of step, of what was held out and of the rest."""
    rows = []
    for held_out, said in ((True, "held out"), (False, "fitted to")):
        for dt, name in dict.fromkeys((m.case.dt, name) for m in found.presets for name in m.presets):
            of = [m for m in found.presets if (m.case.held_out, m.case.dt, m.device) == (held_out, dt, CPU)]
            steps = [row for m in of for row in m.rows.get(name, ()) if row["error"] is not None]
            if steps:
                rows.append((said, f"1/{1 / dt:.0f} s", name, *right(steps)))
        for dt, begun_with in dict.fromkeys((m.case.dt, name) for m in found.errors for name in BEGUN_WITH):
            for what, called in BOUGHT.items():
                steps = bought_steps([m for m in found.errors if m.case.dt == dt], what, begun_with, held_out)
                if steps:
                    rows.append((said, f"1/{1 / dt:.0f} s", f"{called} at `{begun_with}`", *right(steps)))
    head = ("scenes", "step", "settings", "steps", *(f"within x{t:g}" for t, _ in WITHIN), "of the others too low")
    return table(head, rows)


def right(steps: Sequence[Row]) -> tuple[object, ...]:
    """How many steps, the shares of them whose estimates are right, and of the others those that are too low."""
    shares = (f"{100 * within(steps, t):.0f} % ({100 * within(steps, t, 0.0):.0f})" for t, _ in WITHIN)
    return len(steps), *shares, too_low(steps)


def too_low(steps: Sequence[Row]) -> int:
    """How many estimates are under their error and not right."""
    return sum(row["estimate"] < row["error"] for row in steps if not is_within(row, WITHIN[-1][0]))


def bought(measured: Measured, what: str, from_draft: bool) -> dict[float, list[Row]]:
    """Steps that ended by an `accuracy` or a `deadline`, by what was asked for [mm or ms]."""
    at = {name: about["at"] for name, about in measured.about.items()}
    asked = [name for name in at if what in at[name] and ("from_draft" in at[name]) == from_draft]
    return {at[name][what]: [row for row in measured.rows[name] if row["error"] is not None] for name in asked}


def bought_steps(
    cases: Sequence[Measured], what: str, begun_with: str, held_out: bool, on_gpu: bool = False
) -> list[Row]:
    """All such steps on the CPU, or on a GPU, whatever they were asked for, of what was held out or of the rest."""
    of = [measured for measured in cases if (measured.case.held_out, measured.on_gpu) == (held_out, on_gpu)]
    return [row for m in of for steps in bought(m, what, begun_with == "draft").values() for row in steps]


def asked_steps(found: Found, begun_with: str) -> dict[float, list[Row]]:
    """Steps of all scenes on the CPU by the accuracy that was asked for [mm], the largest first."""
    steps: dict[float, list[Row]] = {}
    for measured in found.errors:
        if measured.device == CPU:
            for mm, of in bought(measured, "accuracy", begun_with == "draft").items():
                steps.setdefault(mm, []).extend(of)
    return {mm: steps[mm] for mm in sorted(steps, reverse=True) if steps[mm]}


def asked_table(found: Found) -> list[str]:
    """What was asked for, and what was had."""
    rows = [
        (begun_with, digits(mm), *had(mm, steps))
        for begun_with in BEGUN_WITH
        for mm, steps in asked_steps(found, begun_with).items()
    ]
    head = ("begun with", "asked [mm]", "steps", "error p50 [mm]", "error p90 [mm]")
    return table((*head, "within x2 of what was asked", "further off than x2", "ms p50"), rows)


def had(asked: float, steps: Sequence[Row]) -> list[object]:
    """Of steps that were asked to be so near [mm]."""
    errors = np.array([row["error"] for row in steps])
    near = (errors >= asked / 2) & (errors <= 2 * asked)
    return [
        len(steps),
        *(digits(float(np.percentile(errors, p))) for p in (50, 90)),
        f"{100 * near.mean():.0f} %",
        f"{100 * (errors > 2 * asked).mean():.0f} %",
        digits(float(np.median([row["ms"] for row in steps]))),
    ]


def estimate_lines(found: Found) -> list[str]:
    """How many estimates are right, and the steps where they are furthest from it."""
    lines = []
    for held_out, said in ((True, "held out"), (False, "fitted to")):
        rows = [row for _, _, row in preset_rows(found, held_out)]
        if rows:
            shares = " and ".join(f"x{t:g} for {100 * within(rows, t):.1f} %" for t, _ in WITHIN)
            strict = " and ".join(f"x{t:g} for {100 * within(rows, t, 0.0):.1f} %" for t, _ in WITHIN)
            lines.append(f"- Scenes {said}, {len(rows)} steps: within {shares}; without what is negligible, {strict}.")
    far = [(m, name, row) for m, name, row in preset_rows(found) if not is_within(row, WITHIN[-1][0])]
    if not far:
        return lines
    own = [own_row(row) for _, _, row in preset_rows(found, held_out=True)]
    if own:
        shares = " and ".join(f"x{t:g} for {100 * within(own, t):.1f} %" for t, _ in WITHIN)
        lines.append(f"- Held out, of the balance that Newton finds from where the step ended: within {shares}.")
        lines += ONE_SIDED
    said = [
        f"Not within x{WITHIN[-1][0]:g} are these. A step of slack cloth has several balances: where float64 Newton",
        "moves an end by little and leaves it far from the reference, it is in another fold.",
    ]
    return [*lines, "", *said, "", *far_table(far)]


ONE_SIDED = [
    f"  This is one-sided: such a balance is looked for only where the estimate is not within x{WITHIN[-1][0]:g} of",
    "  the error, and counts only where it is nearer than the reference. So these shares can be no lower than those",
    "  above; ends in another fold whose estimates are within it by chance were not asked.",
]


def far_table(far: Sequence[tuple[Measured, str, Row]]) -> list[str]:
    """Steps with their estimates, and how far they are from a balance of their own."""
    rows = []
    for measured, name, row in far:
        figures = [digits(row.get(figure)) for figure in ("error", "largest", "own_balance", "estimate")]
        rows.append(
            (measured.name, name, row["state"], *figures, digits(row["estimate"] / row["error"]), row["newton"])
        )
    head = ("scene", "settings", "state", "error [mm]", "largest [mm]", "from its own balance [mm]", "estimate [mm]")
    return table((*head, "estimate / error", "Newton"), rows)


def own_row(row: Row) -> Row:
    """The same, its error being how far it is from its own balance where that is known."""
    own = row.get("own_balance")
    return row if own is None else {**row, "error": min(own, row["error"])}
