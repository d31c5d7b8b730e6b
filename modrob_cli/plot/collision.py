"""Measured torque in its band over time, with events and known contacts; and the contact force that is surely found."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.svg_figure import FAINT, INK, ink, svg_text
from modrob_cli.plot.thinning import thin

MEASURED, BAND, WIDER, EVENT, CONTACT = "#1a1a1a", "#8ab4f8", "#d9dce0", "#d93025", "#fbbc04"
_POINTS = 2400
_PAGE_POINTS = 1200
_MOST_FORCE = 1e4
"""Forces beyond [N], near singular positions, are not worth the scale."""


@dataclass(frozen=True)
class CollisionPicture:
    """What is drawn; N samples, n joints.

    Attributes
    ----------
    measured, lower, upper : filtered, shape (N, n); measured is None for a planned motion
    wider : lower and upper end of the other kind of bands, shape (N, n) each; None for none
    legends : of the measurement, the band and the wider band
    events : start, end and index of the joint
    contacts : start and end of known contacts
    outside : per joint, times and values of samples outside the band, shape (K, 2)
    """

    title: str
    subtitle: str
    t: Array
    measured: Array | None
    lower: Array
    upper: Array
    wider: tuple[Array, Array] | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    legends: tuple[str, str, str]
    events: Sequence[tuple[float, float, int]] = ()
    contacts: Sequence[tuple[float, float]] = ()
    outside: Sequence[Array] = ()


def draw_collision(picture: CollisionPicture, path: Path) -> None:
    """Write the picture as PNG: one row per joint."""
    figure = _figure(picture, _POINTS)
    figure.savefig(path, format="png", dpi=110, facecolor="white", metadata={"Software": None})


def collision_svg(picture: CollisionPicture, name: str) -> str:
    """SVG of the same for a page; ``name`` is unique on it."""
    return svg_text(_figure(picture, _PAGE_POINTS), name)


def _figure(picture: CollisionPicture, points: int) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = len(picture.names)
    height = 1.5 * n + 1.2
    figure = Figure(figsize=(11.5, height))
    FigureCanvasAgg(figure)
    axes = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
    for j, axis in enumerate(axes):
        ink(axis)
        _draw_joint(axis, picture, j, points)
    axes[-1].set_xlabel("time [s]", fontsize=9, color=INK)
    top = 1.0 - 0.75 / height
    figure.subplots_adjust(left=0.075, right=0.99, top=top, bottom=0.5 / height, hspace=0.45)
    figure.text(0.01, 1.0 - 0.26 / height, _plain(picture.title), fontsize=12, fontweight="bold", color=INK)
    figure.text(0.01, 1.0 - 0.47 / height, _plain(picture.subtitle), fontsize=8.5, color=FAINT)
    _legend(figure, picture)
    return figure


def _draw_joint(axis: Any, picture: CollisionPicture, j: int, points: int) -> None:
    t = picture.t
    for start, end in picture.contacts:
        axis.axvspan(start, end, color=CONTACT, alpha=0.25, zorder=0, linewidth=0)
    if picture.wider is not None:
        _band(axis, t, picture.wider[0][:, j], picture.wider[1][:, j], WIDER, points)
    _band(axis, t, picture.lower[:, j], picture.upper[:, j], BAND, points)
    if picture.measured is not None:
        axis.plot(*thin(t, picture.measured[:, j], points), color=INK, linewidth=0.7, zorder=4)
    if picture.outside and len(picture.outside[j]):
        axis.plot(*picture.outside[j].T, ".", color=EVENT, markersize=2.2, zorder=5, rasterized=True)
    own = [(start, end) for start, end, joint in picture.events if joint == j]
    for start, end in _visible(own, 2e-3 * float(t[-1] - t[0])):
        axis.axvspan(start, end, color=EVENT, alpha=0.2, zorder=1, linewidth=0)
    axis.set_title(_plain(picture.names[j]), loc="left", y=1.0, fontsize=9, fontweight="bold", color=INK)
    axis.set_ylabel(f"[{picture.units[j]}]", fontsize=9)
    axis.set_xlim(float(t[0]), float(t[-1]) if len(t) > 1 else float(t[0]) + 1.0)


def _visible(events: Sequence[tuple[float, float]], least: float) -> list[tuple[float, float]]:
    """Spans to draw: each at least ``least`` wide, those that touch as one, so that any number of events fits."""
    spans: list[tuple[float, float]] = []
    for start, end in sorted(events):
        wide = max(end, start + least)
        if spans and start <= spans[-1][1]:
            spans[-1] = (spans[-1][0], max(wide, spans[-1][1]))
        else:
            spans.append((start, wide))
    return spans


def _band(axis: Any, t: Array, lower: Array, upper: Array, color: str, points: int) -> None:
    """Fill between the lowest and the highest value of runs of samples, so that no peak is lost."""
    size = max(1, len(t) // points)
    starts = np.arange(0, len(t), size)
    low, high = np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)
    axis.fill_between(t[starts], low, high, color=color, linewidth=0.3, step=None, zorder=2)


def _legend(figure: Any, picture: CollisionPicture) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    if picture.measured is not None:
        handles += [Line2D([], [], color=INK, linewidth=1.0, label=picture.legends[0])]
    handles += [Patch(color=BAND, label=picture.legends[1])]
    handles += [Patch(color=WIDER, label=picture.legends[2])] if picture.wider is not None else []
    handles += [Patch(color=EVENT, alpha=0.4, label="event")] if picture.events else []
    handles += [Patch(color=CONTACT, alpha=0.4, label="known contact")] if picture.contacts else []
    legend = figure.legend(
        handles=handles, loc="upper right", bbox_to_anchor=(0.995, 1.0), ncols=5, frameon=False, fontsize=8.5
    )
    for text in legend.get_texts():
        text.set_color(INK)


@dataclass(frozen=True)
class ForceCurves:
    """Smallest contact force that is certain to be found at one point, [N], over times (K,)."""

    label: str
    t: Array
    axes: Array
    easiest: Array
    hardest: Array


def force_svg(curves: ForceCurves, name: str) -> str:
    """SVG of forces over time, logarithmic; ``name`` is unique on the page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 2.9))
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    ink(axis)
    known = np.minimum(curves.hardest, 1e9)  # far above the picture
    axis.fill_between(curves.t, curves.easiest, known, color=BAND, alpha=0.35, linewidth=0, label="best to worst")
    for k, color in enumerate(("#d93025", "#188038", "#1a73e8")):
        axis.plot(curves.t, np.where(np.isfinite(curves.axes[:, k]), curves.axes[:, k], np.nan), color=color,
                  linewidth=1.0, label=f"along {'xyz'[k]} of the base")  # fmt: skip
    axis.set_yscale("log")
    lowest = float(np.nanmin(curves.easiest)) if np.isfinite(curves.easiest).any() else 1.0
    axis.set_ylim(0.5 * lowest, max(_MOST_FORCE, 2.0 * lowest))
    axis.set_xlabel("time [s]", fontsize=9)
    axis.set_ylabel("force [N]", fontsize=9)
    legend = axis.legend(fontsize=8, frameon=False, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 0.98))
    for text in legend.get_texts():
        text.set_color(INK)
    axis.set_title(_plain(curves.label), loc="left", y=1.0, fontsize=10, fontweight="bold", color=INK)
    figure.subplots_adjust(left=0.075, right=0.99, top=0.88, bottom=0.16)
    return svg_text(figure, name)


def _plain(text: str) -> str:
    """Names come from files: $ would start a formula."""
    return text.replace("$", r"\$")
