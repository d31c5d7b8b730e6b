"""Values of many logs per joint: every log a dot, median and quartiles, outliers; from one log to thousands."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.plot.svg_figure import INK, ink, svg_text

DOT, OUTLIER, LIMIT = "#3b82f6", "#d93025", "#d93025"
MOST_VECTOR = 2000
"""Dots of a figure that are drawn as shapes; more become a bitmap, or the page would grow with the logs."""
DPI = 120

_BINS = 90
"""Columns in which dots of a row may stand on one another."""
_HALF = 0.36
_APART = 0.09
_SMALLEST = 1e-12
_TICKS = 9


@dataclass(frozen=True)
class SpreadPanel:
    """One measure, for all joints.

    Attributes
    ----------
    label : of the axis, with its unit
    values : per joint, of each log; nan where there is none
    marked : per joint, the outliers among them
    logarithmic : for ratios
    limit : drawn as a line; None for none
    """

    label: str
    values: tuple[Array, ...]
    marked: tuple[NDArray[np.bool_], ...]
    logarithmic: bool = False
    limit: float | None = None


def spread_figure(names: Sequence[str], panels: Sequence[SpreadPanel], name: str) -> str:
    """SVG: a row for each joint, a panel for each measure; ``name`` is unique on the page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height = 0.75 + 0.48 * len(names)
    figure = Figure(figsize=(11.5, height), dpi=DPI)
    FigureCanvasAgg(figure)
    axes = np.atleast_1d(figure.subplots(1, len(panels), sharey=True))
    dots = sum(len(values) for panel in panels for values in panel.values)
    for axis, panel in zip(axes, panels, strict=True):
        ink(axis)
        _draw(axis, panel, dots > MOST_VECTOR)
    axes[0].set_yticks(range(len(names)), [plain(text) for text in names])
    axes[0].set_ylim(len(names) - 0.5, -0.5)  # the first joint on top
    for axis in axes:
        axis.tick_params(axis="y", length=0)
    left = min(0.3, 0.02 + 0.0062 * max(len(text) for text in names))
    figure.subplots_adjust(left=left, right=0.985, top=1.0 - 0.1 / height, bottom=0.6 / height, wspace=0.06)
    return svg_text(figure, name)


def plain(text: str) -> str:
    """Names come from files: $ would start a formula; a long one would leave no room."""
    return (text if len(text) <= 32 else text[:31] + "…").replace("$", r"\$")


def dot_size(count: int) -> float:
    """Factor on the size of a dot: few logs are seen from afar."""
    return 1.0 + 0.7 * max(0.0, 1.0 - count / 50.0)


def _draw(axis: Any, panel: SpreadPanel, bitmap: bool) -> None:
    found = np.concatenate([values[np.isfinite(values)] for values in panel.values])
    if panel.logarithmic:
        axis.set_xscale("log")
        found = np.maximum(found, _SMALLEST)
    low, high = _range(found, panel)
    for row, (values, marked) in enumerate(zip(panel.values, panel.marked, strict=True)):
        there = np.isfinite(values)
        x = np.clip(values[there], low, high)
        y = row + swarm(np.log(x) if panel.logarithmic else x, _ends(low, high, panel))
        for chosen, colour, size in ((~marked[there], DOT, 3.4), (marked[there], OUTLIER, 4.2)):
            style = {
                "color": colour,
                "markersize": size * dot_size(len(x)),
                "markeredgewidth": 0.0,
                "rasterized": bitmap,
            }
            axis.plot(x[chosen], y[chosen], "o", alpha=0.6 if colour == DOT else 0.9, **style)
        if len(x) > 1:
            _box(axis, row, x)
    if panel.limit is not None:
        axis.axvline(panel.limit, color=LIMIT, linewidth=1.0, linestyle=(0, (4, 3)))
    axis.set_xlim(low, high)
    axis.margins(x=0.03)
    axis.set_xlabel(panel.label, fontsize=9)
    if panel.logarithmic:
        _ratios(axis, low, high)
    axis.yaxis.grid(False)


def _range(found: Array, panel: SpreadPanel) -> tuple[float, float]:
    """Ends of the axis, with the limit in view."""
    ends = [float(found.min()), float(found.max())] if len(found) else [0.1, 1.0]
    if panel.limit is not None:
        ends += [panel.limit]
    low, high = min(ends), max(ends)
    if panel.logarithmic:
        low = max(low, _SMALLEST)
        wide = (high / low) ** 0.03 * 1.05
        return low / wide, high * wide
    wide = 0.03 * (high - low) or 0.05 * abs(high) or 0.05
    return low - wide, high + wide


def _ratios(axis: Any, low: float, high: float) -> None:
    """Ticks of a logarithmic axis as plain numbers, so many as there is room for."""
    from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    for digits in ((1, 1.5, 2, 3, 5, 7), (1, 2, 5), (1,)):
        ticks = [digit * 10.0**decade for decade in decades for digit in digits]
        ticks = [tick for tick in ticks if low <= tick <= high]
        if len(ticks) <= _TICKS:
            break
    axis.xaxis.set_major_locator(FixedLocator(ticks[:: -(-len(ticks) // _TICKS) or 1]))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))


def _ends(low: float, high: float, panel: SpreadPanel) -> tuple[float, float]:
    return (float(np.log(low)), float(np.log(high))) if panel.logarithmic else (low, high)


def _box(axis: Any, row: int, x: Array) -> None:
    """Quartiles as a frame, the median as a thick line."""
    lower, middle, upper = np.quantile(x, [0.25, 0.5, 0.75])
    outline = ([lower, upper, upper, lower, lower], row + _HALF * np.array([-1.0, -1.0, 1.0, 1.0, -1.0]))
    axis.plot(*outline, color=INK, linewidth=0.8, solid_joinstyle="miter", zorder=3)
    axis.plot([middle, middle], [row - _HALF, row + _HALF], color=INK, linewidth=2.2, solid_capstyle="butt", zorder=3)


def swarm(x: Array, ends: tuple[float, float]) -> Array:
    """Offsets across a row so that dots near one another stand side by side; the fullest place fills the row.

    Parameters
    ----------
    x : places along the row, shape (N,)
    ends : of the row

    Returns
    -------
    offsets : shape (N,), no larger than the half of a row
    """
    width = (ends[1] - ends[0]) or 1.0
    bins = np.floor((x - ends[0]) / width * _BINS).astype(int)
    order = np.lexsort((np.arange(len(x)), x, bins))
    _, starts, sizes = np.unique(bins[order], return_index=True, return_counts=True)
    place = np.arange(len(x)) - np.repeat(starts, sizes)
    step = min(_APART, _HALF / max(int(sizes.max(initial=1)) // 2, 1))
    # 0, +1, -1, +2, -2 ...: a single dot stays on the line.
    side = np.where(place % 2 == 1, 1.0, -1.0) * ((place + 1) // 2)
    offsets = np.empty(len(x))
    offsets[order] = step * side
    return offsets
