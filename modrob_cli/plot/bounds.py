"""Torque bounds over time: the band around the nominal torque, the limits, and the band by itself."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.envelope import Band, Envelope

NOMINAL, BAND, LIMIT, BEYOND = "#0b57d0", "#9ec0f7", "#b3261e", "#e8453c"
MAX_RUNS = 1500
"""More runs of samples than the picture has pixels would not show."""
LIMIT_IN_VIEW = 0.5
"""A limit is part of the scale if the torque comes this close to it; a far one would make the band too thin."""


@dataclass(frozen=True)
class BoundsLabels:
    """Words of the picture, and torque limits (lower, upper) where known; the last five per joint."""

    title: str
    subtitle: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    widths: tuple[str, ...]
    limit_notes: tuple[str, ...]
    limits: tuple[tuple[float, float] | None, ...]


class BoundsCurves:
    """Nominal torque and bounds of a motion that comes in pieces, as far as a picture shows them."""

    def __init__(self, joints: int) -> None:
        self._envelope = Envelope(5, joints, MAX_RUNS)

    def add(self, t: Array, nominal: Array, lower: Array, upper: Array) -> None:
        """Take the next samples: times (T,), torques (T, n)."""
        self._envelope.add(t, np.stack([nominal, lower, upper, lower - nominal, upper - nominal], axis=1))

    def draw(self, labels: BoundsLabels, path: Path) -> None:
        """Write the picture as PNG: one row per joint, torque on the left, bounds minus nominal on the right."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        n = len(labels.names)
        height = 1.55 * n + 1.5
        figure = Figure(figsize=(12.5, height), dpi=110)
        FigureCanvasAgg(figure)
        axes = figure.subplots(n, 2, sharex=True, squeeze=False, width_ratios=(1.7, 1.0))
        t, (nominal, lower, upper, below, above) = self._envelope.bands()
        for j, (left, right) in enumerate(axes):
            torque = "torque" if labels.units[j] == "N m" else "force"
            left.set_ylabel(f"{torque} [{labels.units[j]}]")
            _draw_torque(left, t, [_of(part, j) for part in (nominal, lower, upper)], labels.limits[j])
            _fill(right, t, below.low[:, j], above.high[:, j], BAND)
            right.axhline(0.0, color=NOMINAL, linewidth=1.0)
            # Names come from files: $ would start a formula. With y given, Matplotlib skips a slow search for a place.
            left.set_title(_plain(labels.names[j]), loc="left", y=1.0, fontsize=10, fontweight="bold")
            left.set_title(_plain(labels.limit_notes[j]), loc="right", y=1.0, fontsize=9)
            right.set_title(_plain(labels.widths[j]), loc="right", y=1.0, fontsize=9)
            for axis in (left, right):
                _style(axis, t)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
        figure.align_ylabels(axes[:, 0])
        _head(figure, labels, height)
        figure.savefig(path, format="png", metadata={"Software": None})


def _of(band: Band, j: int) -> Band:
    return Band(band.low[:, j], band.high[:, j])


def _draw_torque(axis: Any, t: Array, series: list[Band], limits: tuple[float, float] | None) -> None:
    """Band, nominal torque, and limits that are near; what lies beyond a limit in red."""
    nominal, lower, upper = series
    _fill(axis, t, lower.low, upper.high, BAND)
    _fill(axis, t, nominal.low, nominal.high, NOMINAL, linewidth=1.0)
    for limit, sign in zip(limits or (), (-1.0, 1.0), strict=False):
        edge = upper.high if sign > 0.0 else lower.low
        if (sign * edge).max() < LIMIT_IN_VIEW * sign * limit:
            continue
        axis.axhline(limit, color=LIMIT, linewidth=1.1, linestyle=(0, (5, 3)))
        beyond = sign * edge > sign * limit
        if beyond.any():
            axis.fill_between(t, limit, edge, where=beyond, color=BEYOND, linewidth=1.0, interpolate=True)


def _fill(axis: Any, t: Array, low: Array, high: Array, color: str, linewidth: float = 0.6) -> None:
    """Fill between two curves; its edge shows where they meet."""
    if len(t) == 1:
        axis.vlines(t, low, high, color=color, linewidth=6.0)
        axis.plot(t, 0.5 * (low + high), marker="_", color=color, markersize=12.0)
    else:
        axis.fill_between(t, low, high, color=color, linewidth=linewidth)


def _style(axis: Any, t: Array) -> None:
    from matplotlib.ticker import MaxNLocator

    axis.set_axisbelow(True)
    axis.grid(True, color="#e3e3e3", linewidth=0.6)
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.ticklabel_format(axis="y", scilimits=(-2, 4))
    axis.margins(x=0.0 if len(t) > 1 else 0.5)
    axis.spines[["top", "right"]].set_visible(False)


def _head(figure: Any, labels: BoundsLabels, height: float) -> None:
    """Title, subtitle and legend above the rows."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure.subplots_adjust(
        left=0.07, right=0.985, top=1.0 - 0.95 / height, bottom=0.5 / height, hspace=0.42, wspace=0.1
    )
    figure.text(0.07, 1.0 - 0.3 / height, _plain(labels.title), fontsize=13, fontweight="bold")
    figure.text(0.07, 1.0 - 0.53 / height, _plain(labels.subtitle), fontsize=9, color="#5f6368")
    handles = [
        Line2D([], [], color=NOMINAL, linewidth=1.4, label="nominal"),
        Patch(color=BAND, label="lower to upper"),
        Line2D([], [], color=LIMIT, linestyle=(0, (5, 3)), label="torque limit, if near"),
    ]
    shown = handles if any(labels.limits) else handles[:2]
    figure.legend(handles=shown, loc="upper right", bbox_to_anchor=(0.99, 1.0), ncols=3, frameon=False, fontsize=9)
    figure.text(0.985, 1.0 - 0.53 / height, "right: bounds minus nominal", fontsize=9, color="#5f6368", ha="right")


def _plain(text: str) -> str:
    return text.replace("$", r"\$")
