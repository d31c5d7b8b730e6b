"""Torques before and after scaling, and which factors are safe when."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.svg_figure import INK, ink, svg_text
from modrob_cli.plot.thinning import thin

BAND, NOMINAL, LIMIT, BEYOND, CHOSEN = "#1a73e8", "#1a73e8", "#d93025", "#d93025", "#188038"
_POINTS = 1500
_IN_VIEW = 0.5
"""A limit is part of the scale if the torque comes this close to it."""


@dataclass(frozen=True)
class TorqueCurves:
    """Torque of all joints over time: times (T,), nominal, lower and upper bound (T, n)."""

    t: Array
    nominal: Array
    lower: Array
    upper: Array


@dataclass(frozen=True)
class ScalePicture:
    """What the pictures show.

    Attributes
    ----------
    title, subtitle : first two lines
    names, units : per joint
    low, high : limits of the torque, shape (n,), infinite where there is none
    before, after : the motion as planned, and at the factor
    factor : None if no factor is safe
    """

    title: str
    subtitle: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    low: Array
    high: Array
    before: TorqueCurves
    after: TorqueCurves | None
    factor: float | None


@dataclass(frozen=True)
class FactorMap:
    """How much of its limit the most loaded joint uses: 1 is the limit.

    Attributes
    ----------
    t : instants (T,), [s] of the unscaled motion;  c : factors (C,)
    use : shape (C, T)
    joint : the most loaded joint, shape (C, T)
    """

    t: Array
    c: Array
    use: Array
    joint: Array
    names: tuple[str, ...]
    free: tuple[tuple[float, float], ...]


def draw_torques(picture: ScalePicture, path: Path) -> None:
    """Write the torques as PNG: one row per joint, as planned on the left, at the factor on the right."""
    figure = _torque_figure(picture, dark=False)
    height = figure.get_size_inches()[1]
    figure.text(0.07, 1.0 - 0.3 / height, _plain(picture.title), fontsize=13, fontweight="bold")
    figure.text(0.07, 1.0 - 0.53 / height, _plain(picture.subtitle), fontsize=9, color="#5f6368")
    figure.savefig(path, format="png", metadata={"Software": None}, dpi=110)


def torque_svg(picture: ScalePicture, name: str) -> str:
    """The same as SVG for a page; ``name`` is unique on it."""
    return svg_text(_torque_figure(picture, dark=True), name)


def _torque_figure(picture: ScalePicture, dark: bool) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = len(picture.names)
    head = 0.5 if dark else 0.95
    height = 1.6 * n + 0.55 + head
    figure = Figure(figsize=(12.0, height))
    FigureCanvasAgg(figure)
    columns = [(picture.before, "as planned")]
    if picture.after is not None and picture.factor is not None:
        columns.append((picture.after, f"{picture.factor:.4g} times as fast"))
    axes = figure.subplots(n, len(columns), sharex="col", sharey="row", squeeze=False)
    for j, row in enumerate(axes):
        for (curves, words), axis in zip(columns, row, strict=True):
            ink(axis) if dark else _style(axis)
            _draw_torque(axis, curves, j, picture.low[j], picture.high[j])
            if j == 0:
                axis.set_title(words, loc="right", y=1.0, fontsize=9, color=INK if dark else "black")
        colour = INK if dark else "black"
        # Names come from files: $ would start a formula. With y given, Matplotlib skips a slow search for a place.
        row[0].set_title(_plain(picture.names[j]), loc="left", y=1.0, fontsize=10, fontweight="bold", color=colour)
        row[0].set_ylabel(f"{'torque' if picture.units[j] == 'N m' else 'force'} [{picture.units[j]}]", fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]", fontsize=9)
    figure.subplots_adjust(left=0.07, right=0.99, top=1.0 - head / height, bottom=0.5 / height, hspace=0.4, wspace=0.06)
    figure.align_ylabels(axes[:, 0])
    return figure


def _draw_torque(axis: Any, curves: TorqueCurves, j: int, low: float, high: float) -> None:
    t, lower = thin(curves.t, curves.lower[:, j], _POINTS)
    upper = np.interp(t, *thin(curves.t, curves.upper[:, j], _POINTS))
    axis.fill_between(t, lower, upper, color=BAND, alpha=0.3, linewidth=0.5)
    axis.plot(*thin(curves.t, curves.nominal[:, j], _POINTS), color=NOMINAL, linewidth=0.9)
    for limit, edge, sign in ((low, lower, -1.0), (high, upper, 1.0)):
        if not np.isfinite(limit) or (sign * edge).max() < _IN_VIEW * abs(limit):
            continue
        axis.axhline(limit, color=LIMIT, linewidth=1.0, linestyle=(0, (5, 3)))
        beyond = sign * edge > sign * limit
        if beyond.any():
            axis.fill_between(t, limit, edge, where=beyond, color=BEYOND, linewidth=0.8, interpolate=True)
    axis.margins(x=0.0)


def _style(axis: Any) -> None:
    axis.set_axisbelow(True)
    axis.grid(True, color="#e3e3e3", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)


def draw_factors(factors: FactorMap, factor: float | None, title: str, path: Path) -> None:
    """Write the map of factors over time as PNG."""
    figure = _factor_figure(factors, factor, dark=False)
    figure.text(0.07, 0.955, _plain(title), fontsize=12, fontweight="bold")
    figure.savefig(path, format="png", metadata={"Software": None}, dpi=110)


def factor_svg(factors: FactorMap, factor: float | None, name: str) -> str:
    """The same as SVG for a page; ``name`` is unique on it."""
    return svg_text(_factor_figure(factors, factor, dark=True), name)


def _factor_figure(factors: FactorMap, factor: float | None, dark: bool) -> Any:
    """Colour: how much of its limit the most loaded joint uses; forbidden factors are red."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 4.6))
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    ink(axis) if dark else _style(axis)
    shades = [(0.0, "#f1f6fe"), (0.5, "#8ab4f8"), (0.5, "#f28b82"), (1.0, "#a50e0e")]
    colours = LinearSegmentedColormap.from_list("use", shades)
    mesh = axis.pcolormesh(
        factors.t, factors.c, np.clip(factors.use, 0.0, 2.0), cmap=colours, vmin=0.0, vmax=2.0, rasterized=True,
        shading="nearest",
    )  # fmt: skip
    if np.ptp(factors.use) > 0.0 and factors.use.min() < 1.0 < factors.use.max():
        axis.contour(factors.t, factors.c, factors.use, levels=[1.0], colors=["#a50e0e"], linewidths=1.0)
    for low, high in factors.free:
        axis.plot([factors.t[0]] * 2, [low, min(high, factors.c[-1])], color=CHOSEN, linewidth=6.0, clip_on=False)
    if factor is not None:
        axis.axhline(factor, color=CHOSEN, linewidth=1.4)
    _name_joints(axis, factors)
    axis.set_ylim(factors.c[0], factors.c[-1])
    axis.set_xlabel("time of the planned motion [s]", fontsize=9)
    axis.set_ylabel("factor", fontsize=9)
    bar = figure.colorbar(mesh, ax=axis, pad=0.015, fraction=0.04)
    colour = INK if dark else "black"
    bar.set_label("part of the limit that the most loaded joint may use", fontsize=8, color=colour)
    bar.ax.tick_params(colors=colour, labelsize=8)
    figure.subplots_adjust(left=0.07, right=0.95, top=0.97 if dark else 0.92, bottom=0.11)
    return figure


def _name_joints(axis: Any, factors: FactorMap) -> None:
    """Write at the top which joint is beyond its limit there, for the longer stretches."""
    top = np.where(factors.use[-1] > 1.0, factors.joint[-1], -1)
    edges = np.flatnonzero(np.diff(top)) + 1
    for first, last in zip([0, *edges], [*edges, len(top)], strict=True):
        if top[first] >= 0 and last - first > 0.05 * len(top):
            middle = 0.5 * (factors.t[first] + factors.t[last - 1])
            text = {"ha": "center", "va": "top", "fontsize": 8, "color": "white"}
            axis.text(middle, factors.c[-1], f"\n{_plain(factors.names[int(top[first])])}", **text)


def _plain(text: str) -> str:
    return text.replace("$", r"\$")
