"""Charts as SVG: lines over two logarithmic axes, and bars that are divided into parts.

Written by hand so that the bench needs no plotting library. Text and lines have classes, and the file's own style gives
them colours for a light and for a dark page; nothing refers to anything outside of the file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

LIGHT = ("#2a78d6", "#eb6834", "#1baf7a", "#eda100", "#e87ba4", "#008300", "#4a3aa7", "#e34948")
DARK = ("#3987e5", "#d95926", "#199e70", "#c98500", "#d55181", "#2f9e2f", "#9085e9", "#e66767")
"""Told apart from their neighbours with any colour vision, each set on its own ground."""

WIDTH, LEFT, TOP, BELOW, LEGEND = 760, 62, 44, 46, 18  # px; LEGEND: of a line of it
PLOT_WIDTH, PLOT_HEIGHT = 660, 300
BAR, GAP = 18, 26  # px: of a bar, and from one case to the next
FIRST = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class Line:
    """Points (x, y), all above 0; lines of one colour belong together, one of them dashed."""

    name: str
    points: Sequence[tuple[float, float]]
    colour: int
    dashed: bool = False


@dataclass(frozen=True)
class Bar:
    """`parts`: size and colour of each, from the left; `said` stands behind them."""

    name: str
    parts: Sequence[tuple[float, int]]
    said: str


def log_ticks(values: Sequence[float]) -> list[float]:
    """1, 2 and 5 times powers of ten, from the last that is at or under all values to the first at or over them."""
    low, high = min(values), max(values)
    if not (low > 0 and math.isfinite(high)):
        raise ValueError(f"a logarithmic axis has finite values above 0, not {low:g} to {high:g}")
    exponents = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 2)
    ticks = [float(f"{first:g}e{exponent}") for exponent in exponents for first in FIRST]
    begin = max(k for k, tick in enumerate(ticks) if tick <= low)
    end = min(k for k, tick in enumerate(ticks) if tick >= high)
    return ticks[begin : max(end, begin + 1) + 1]


def short(value: float) -> str:
    """2500 as 2.5k."""
    return f"{value / 1000:g}k" if value >= 1000 else f"{value:g}"


def line_chart(
    title: str, x_name: str, y_name: str, lines: Sequence[Line], marks: Sequence[tuple[float, str]] = ()
) -> str:
    """Both axes logarithmic; `marks` are values of y that are lined across the chart, with what they are."""
    x_ticks = log_ticks([x for line in lines for x, _ in line.points])
    y_ticks = log_ticks([*(y for line in lines for _, y in line.points), *(y for y, _ in marks)])

    def across(x: float) -> float:
        return LEFT + PLOT_WIDTH * share(x, x_ticks)

    def down(y: float) -> float:
        return TOP + PLOT_HEIGHT * (1 - share(y, y_ticks))

    bottom = TOP + PLOT_HEIGHT
    drawn = []
    for tick in x_ticks:
        drawn.append(f'<line class="grid" x1="{across(tick):.1f}" x2="{across(tick):.1f}" y1="{TOP}" y2="{bottom}"/>')
        drawn.append(text(across(tick), bottom + 17, short(tick), "middle"))
    for tick in y_ticks:
        right = LEFT + PLOT_WIDTH
        drawn.append(f'<line class="grid" x1="{LEFT}" x2="{right}" y1="{down(tick):.1f}" y2="{down(tick):.1f}"/>')
        drawn.append(text(LEFT - 8, down(tick) + 4, short(tick), "end"))
    drawn.append(text(LEFT + PLOT_WIDTH / 2, bottom + 36, x_name, "middle"))
    drawn.append(text(LEFT, TOP - 8, y_name, "start"))
    for y, said in marks:
        drawn.append(f'<line class="mark" x1="{LEFT}" x2="{LEFT + PLOT_WIDTH}" y1="{down(y):.1f}" y2="{down(y):.1f}"/>')
        drawn.append(text(LEFT + PLOT_WIDTH - 4, down(y) - 5, said, "end"))
    for line in lines:
        places = [(across(x), down(y)) for x, y in sorted(line.points)]
        way = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        colour = line.colour % len(LIGHT)
        drawn.append(f'<polyline class="line s{colour}{" dashed" * line.dashed}" points="{way}"/>')
        radius = 3 if line.dashed else 4
        drawn += [f'<circle class="f{colour}" cx="{x:.1f}" cy="{y:.1f}" r="{radius}"/>' for x, y in places]
    keys = [(line.name, f"s{line.colour % len(LIGHT)}{' dashed' * line.dashed}") for line in lines]
    return page(title, drawn, bottom + BELOW, keys)


def bar_chart(title: str, x_name: str, bars: Sequence[Bar], names: Sequence[str]) -> str:
    """Bars from the left with one linear axis, whole numbers of it; `names` are what the colours stand for."""
    longest = max(sum(size for size, _ in bar.parts) for bar in bars)
    step = next(s for k in range(-3, 9) for s in (10.0**k, 2 * 10.0**k, 5 * 10.0**k) if 6 * s >= longest)
    end = step * math.ceil(longest / step)
    bottom = TOP + GAP + len(bars) * (BAR + GAP)
    width = PLOT_WIDTH - 80  # what is said behind a bar needs room
    drawn = []
    for k in range(round(end / step) + 1):
        x = LEFT + width * k * step / end
        drawn.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{bottom}"/>')
        drawn.append(text(x, bottom + 17, short(k * step), "middle"))
    drawn.append(text(LEFT + width / 2, bottom + 36, x_name, "middle"))
    for k, bar in enumerate(bars):
        y, x = TOP + GAP + k * (BAR + GAP), float(LEFT)
        drawn.append(text(LEFT, y - 5, bar.name, "start"))
        for size, colour in bar.parts:
            long = width * size / end
            drawn.append(
                f'<rect class="f{colour % len(LIGHT)} part" x="{x:.1f}" y="{y}" width="{long:.1f}" height="{BAR}">'
                f"<title>{escape(names[colour])}</title></rect>"
            )
            x += long
        drawn.append(text(x + 6, y + BAR - 5, bar.said, "start"))
    return page(title, drawn, bottom + BELOW, [(name, f"s{k % len(LIGHT)} wide") for k, name in enumerate(names)])


def share(value: float, ticks: Sequence[float]) -> float:
    """Where on a logarithmic axis a value is, from 0 to 1."""
    return math.log(value / ticks[0]) / math.log(ticks[-1] / ticks[0])


def text(x: float, y: float, said: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(said)}</text>'


def page(title: str, drawn: Sequence[str], bottom: float, keys: Sequence[tuple[str, str]]) -> str:
    """The whole file: what is drawn, and below it what the colours mean, two to a line."""
    height = bottom + LEGEND * math.ceil(len(keys) / 2) + 10
    legend = []
    for k, (name, kind) in enumerate(keys):
        x, y = LEFT + PLOT_WIDTH / 2 * (k % 2), bottom + LEGEND * (k // 2) + 10
        legend.append(f'<line class="line {kind}" x1="{x:.1f}" x2="{x + 24:.1f}" y1="{y - 4:.1f}" y2="{y - 4:.1f}"/>')
        legend.append(text(x + 32, y, name, "start"))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height:.0f}" '
        f'viewBox="0 0 {WIDTH} {height:.0f}" role="img" aria-label="{escape(title, quote=True)}">',
        f"<style>{style()}</style>",
        f'<rect class="ground" width="{WIDTH}" height="{height:.0f}"/>',
        f'<text class="title" x="{LEFT}" y="18">{escape(title)}</text>',
        *drawn,
        *legend,
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def style() -> str:
    """Colours on a light page, and in their place those on a dark one."""

    def colours(ground: str, words: str, grid: str, series: Sequence[str]) -> str:
        own = "".join(f".s{k}{{stroke:{c}}}.f{k}{{fill:{c}}}" for k, c in enumerate(series))
        plain = f".ground{{fill:{ground}}}text{{fill:{words}}}.grid{{stroke:{grid}}}.mark{{stroke:{words}}}"
        return f"{plain}.part{{stroke:{ground}}}{own}"

    return (
        "text{font:12px system-ui,sans-serif}.title{font-size:14px;font-weight:600}.grid{stroke-width:1}"
        ".mark{stroke-width:1.5;stroke-dasharray:2 3}.line{fill:none;stroke-width:2}.dashed{stroke-dasharray:6 4}"
        f".wide{{stroke-width:10}}.part{{stroke-width:1}}{colours('#ffffff', '#3a3a38', '#e4e4e0', LIGHT)}"
        f"@media(prefers-color-scheme:dark){{{colours('#161615', '#c9c9c4', '#33332f', DARK)}}}"
    )
