"""Kernels against the roofs of their device as tables in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SAID = (
    "Bytes and operations are the least that the data ask for (`solver/bench/costs.py`), the roofs those of a "
    "streaming copy and of multiply-adds in the same run. What lies in a cache can come faster than a copy streams: "
    "then it is more than 100 %."
)
COLUMNS = ("kernel", "time [us]", "data [MB]", "operations [M]", "GB/s", "GFLOP/s", "lower roof", "share of it")


def section(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """A table a case. Bytes and operations are counted as costs.py says."""
    lines = [SAID]
    for r in results:
        if "failure" in r:
            lines += ["", f"**{r['name']}**: FAILED: {r['failure']}"]
            continue
        roofs = f"{r['bytes_per_s'] / 1e9:.4g} GB/s and {r['operations_per_s'] / 1e9:.4g} GFLOP/s"
        lines += ["", f"**{r['name']}**, {r['cloth_vertices']} vertices on {r['machine']}; roofs {roofs}", ""]
        lines += ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
        lines += [row(kernel) for kernel in r["kernels"]]
    return lines


def row(kernel: Mapping[str, Any]) -> str:
    """One line of the table."""
    k = kernel
    cells = (
        k["kernel"],
        f"{k['us']:.1f}",
        f"{k['bytes'] / 1e6:.3g}",
        f"{k['operations'] / 1e6:.3g}",
        f"{1e-3 * k['bytes'] / k['us']:.3g}",
        f"{1e-3 * k['operations'] / k['us']:.3g}",
        k["roof"],
        f"{k['share']:.0%}",
    )
    return "| " + " | ".join(cells) + " |"
