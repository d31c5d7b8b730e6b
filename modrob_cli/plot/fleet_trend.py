"""Values of many logs over their dates: dots with intervals, medians of groups, a robust line with its interval."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.plot.fleet import DOT, DPI, LIMIT, MOST_VECTOR, OUTLIER, dot_size, plain
from modrob_cli.plot.svg_figure import INK, ink, svg_text

LINE, QUIET = "#e8710a", "#8a8f94"
_COLUMNS = 3
_GROUPS = 12
_GROUP_OF = 5
"""Logs that a group holds at least; fewer have no median worth drawing."""
_REACH = 4.0
_TAIL = 0.025
"""The axis covers so many robust standard deviations on either side, and all but a small share of the logs, and half
as much again; what lies beyond is drawn at the edge."""
_MANY = 10
_CROWD = 300
_DAYS, _MINUTES = 4 * 86400.0, 600.0
_LEAST = 0.005
"""Half the axis covers at least this part of the median: less is rounding, not drift."""


@dataclass(frozen=True)
class Line:
    """Slope with its interval through a point; sure: drawn as a claim."""

    t: float
    y: float
    slope: float
    lower: float
    upper: float
    sure: bool


@dataclass(frozen=True)
class TrendPanel:
    """One joint.

    Attributes
    ----------
    title : its name;  subtitle : what the trend is, in few words
    y : a value for each log, nan where there is none, shape (N,)
    lower, upper : its interval; None if it has none, nan where a log has none
    marked : outliers
    line : None if there is no trend to draw
    """

    title: str
    subtitle: str
    y: Array
    lower: Array | None
    upper: Array | None
    marked: NDArray[np.bool_]
    line: Line | None


@dataclass(frozen=True)
class TimeAxis:
    """Times of the logs: [s] since 1970 if dated, else numbers; nan where a log has none; shape (N,)."""

    t: Array
    dated: bool
    label: str


def trend_figure(
    axis: TimeAxis, panels: Sequence[TrendPanel], label: str, name: str, limit: float | None = None
) -> str:
    """SVG with a panel for each joint; ``label`` is that of the values, ``name`` is unique on the page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    height = 0.75 + 2.05 * rows
    figure = Figure(figsize=(11.5, height), dpi=DPI)
    FigureCanvasAgg(figure)
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    bitmap = len(axis.t) * len(panels) > MOST_VECTOR
    for k, place in enumerate(grid.flat):
        if k >= len(panels):
            place.set_visible(False)
            continue
        ink(place)
        _draw(place, axis, panels[k], bitmap, limit)
        if k + columns >= len(panels):  # nothing below it
            place.tick_params(labelbottom=True)
        if k % columns == 0:
            place.set_ylabel(label, fontsize=9)
    _dates(grid[0, 0], axis)
    figure.supxlabel(axis.label, fontsize=9, color=INK, y=0.1 / height)
    edges = {"left": 0.07, "right": 0.985, "top": 1.0 - 0.42 / height, "bottom": 0.62 / height}
    figure.subplots_adjust(**edges, hspace=0.42, wspace=0.2)
    return svg_text(figure, name)


def _dates(place: Any, axis: TimeAxis) -> None:
    """Ends of the common axis, ticks at dates."""
    known = axis.t[np.isfinite(axis.t)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    wide = 0.03 * (high - low) or 0.5
    place.set_xlim(_day(axis, low - wide), _day(axis, high + wide))
    if axis.dated:
        from matplotlib.dates import UTC, AutoDateLocator, DateFormatter

        style = "%Y-%m-%d" if high - low >= _DAYS else "%m-%d %H:%M" if high - low >= _MINUTES else "%H:%M:%S"
        place.xaxis.set_major_locator(AutoDateLocator(tz=UTC, minticks=2, maxticks=4))
        place.xaxis.set_major_formatter(DateFormatter(style, tz=UTC))
    else:
        from matplotlib.ticker import MaxNLocator

        place.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True))


def _day(axis: TimeAxis, t: Any) -> Any:
    """Matplotlib's dates are days since 1970."""
    return t / 86400.0 if axis.dated else t


def _draw(place: Any, axis: TimeAxis, panel: TrendPanel, bitmap: bool, limit: float | None) -> None:
    there = np.isfinite(axis.t) & np.isfinite(panel.y)
    place.set_title(plain(panel.title), loc="left", y=1.0, fontsize=10, fontweight="bold", color=INK)
    place.set_title(panel.subtitle, loc="right", y=1.0, fontsize=8, color=INK)
    if not there.any():
        place.text(0.5, 0.5, "no log tells it", transform=place.transAxes, ha="center", color=INK, fontsize=9)
        place.set_yticks([])
        return
    t, y, marked = _day(axis, axis.t[there]), panel.y[there], panel.marked[there]
    low, high = view(y, limit)
    if panel.lower is not None and panel.upper is not None:
        lower, upper = panel.lower[there], panel.upper[there]
        _bars(place, t, lower, upper, bitmap)
        half = float(np.nanmedian(upper - lower)) / 2.0 if np.isfinite(upper - lower).any() else 0.0
        low, high = low - half, high + half  # room for most of the bars
    inside = (y >= low) & (y <= high)
    for chosen, colour, size in ((inside & ~marked, DOT, 3.4), (inside & marked, OUTLIER, 4.2)):
        style = {"color": colour, "markersize": size * dot_size(len(t)), "markeredgewidth": 0.0, "rasterized": bitmap}
        alpha = 0.85 if colour == OUTLIER else 0.45 if len(t) > _CROWD else 0.75
        place.plot(t[chosen], y[chosen], "o", alpha=alpha, **style)
    edge = 0.02 * (high - low)
    for chosen, sign, at in ((y > high, "^", high - edge), (y < low, "v", low + edge)):
        place.plot(t[chosen], np.full(int(chosen.sum()), at), sign, color=OUTLIER, markersize=4.5, rasterized=bitmap)
    _groups(place, t, y)
    if panel.line is not None:
        _line(place, axis, panel.line, t)
    if limit is not None:
        place.axhline(limit, color=LIMIT, linewidth=1.0, linestyle=(0, (4, 3)))
    place.set_ylim(low, high)
    place.ticklabel_format(axis="y", useOffset=False)


def view(y: Array, limit: float | None = None) -> tuple[float, float]:
    """Ends of the axis: all values unless a few lie so far out that the others would be a line; the limit if near."""
    middle, inner = float(np.median(y)), y
    if len(y) >= _MANY:
        reach = _REACH * 1.4826 * float(np.median(np.abs(y - middle)))
        first, last = np.quantile(y, [_TAIL, 1.0 - _TAIL])
        first, last = min(first, middle - reach), max(last, middle + reach)
        more = (last - first) / 2.0
        inner = y[(y >= first - more) & (y <= last + more)]
    low, high = float(inner.min()), float(inner.max())
    if limit is not None and low - (high - low) <= limit <= high + (high - low):
        low, high = min(low, limit), max(high, limit)
    wide = max(0.08 * (high - low), _LEAST * abs(middle) - (high - low) / 2.0) or 0.05
    return low - wide, high + wide


def _bars(place: Any, t: Array, lower: Array, upper: Array, bitmap: bool) -> None:
    """All intervals as one path."""
    nothing = np.full(len(t), np.nan)
    x, y = np.stack([t, t, nothing], axis=1).ravel(), np.stack([lower, upper, nothing], axis=1).ravel()
    place.plot(x, y, color=DOT, linewidth=0.9, alpha=0.25 if len(t) > _CROWD else 0.5, rasterized=bitmap)


def _groups(place: Any, t: Array, y: Array) -> None:
    """Medians of groups of as many logs, in the order of their times."""
    if len(t) < 2 * _GROUP_OF:
        return
    order = np.argsort(t, kind="stable")
    parts = np.array_split(order, min(_GROUPS, len(t) // _GROUP_OF))
    x, middle = [np.median(t[part]) for part in parts], [np.median(y[part]) for part in parts]
    place.plot(x, middle, "-s", color=INK, markersize=3.2, linewidth=0.9, alpha=0.85)


def _line(place: Any, axis: TimeAxis, line: Line, t: Array) -> None:
    """The line and what its interval admits, all through one point; dashed and grey where nothing is claimed."""
    x = np.linspace(t.min(), t.max(), 30)
    steps = (x - _day(axis, line.t)) * (86400.0 if axis.dated else 1.0)
    one, other = line.y + line.lower * steps, line.y + line.upper * steps
    colour = LINE if line.sure else QUIET
    place.fill_between(x, np.minimum(one, other), np.maximum(one, other), color=colour, alpha=0.18, linewidth=0)
    place.plot(x, line.y + line.slope * steps, color=colour, linewidth=1.8, linestyle="-" if line.sure else (0, (4, 2)))
