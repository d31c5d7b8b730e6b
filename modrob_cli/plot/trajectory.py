"""A planned motion over time: position, velocity and acceleration of each joint, with limits that are near."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_extremes import QUANTITIES, Violation

CURVE, POINT, LIMIT, BEYOND = "#0b57d0", "#5f6368", "#b3261e", "#e8453c"
LIMIT_IN_VIEW = 0.5
"""A limit is part of the scale if the curve comes this close to it; a far one would make the curve too flat."""
FLAT = 1e-9
"""A curve that varies by less, relative to 1 + its size, is constant."""
FEWEST, MOST = 2000, 20_000
"""Points of a curve in the picture."""
MOST_MARKS = 60
"""More points of a joint than this would hide the curve; they are not marked then."""

Range = tuple[float, float]


@dataclass(frozen=True)
class TrajectoryLabels:
    """Words of the picture; names and units (rad or m) per joint; limits per joint and quantity, () if unknown."""

    title: str
    subtitle: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    limits: tuple[tuple[Range | None, ...], ...]


def draw_trajectory(
    trajectory: Trajectory, labels: TrajectoryLabels, violations: Sequence[Violation], path: Path
) -> None:
    """Write the picture as PNG: one row per joint; dots where polynomials meet, red where a limit is exceeded."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = trajectory.dof
    height = 1.45 * n + 1.6
    figure = Figure(figsize=(13.5, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(n, 3, sharex=True, squeeze=False)
    t = _times(trajectory)
    values = trajectory.sample(t, 2)
    for j, row in enumerate(axes):
        for k, axis in enumerate(row):
            limit = labels.limits[j][k] if labels.limits else None
            _draw(axis, t, values[:, k, j], limit)
            axis.set_ylabel(f"{labels.units[j]}{('', '/s', '/s²')[k]}", fontsize=9)
            _style(axis)
        knots = trajectory.curves[j].knots
        if 2 < len(knots) <= MOST_MARKS:
            row[0].plot(
                knots, trajectory.curves[j].derivative(knots, 0), ".", color=POINT, markersize=5.0, clip_on=False
            )
        # Names come from files: $ would start a formula. With y given, Matplotlib skips a slow search for a place.
        row[0].set_title(_plain(labels.names[j]), loc="left", y=1.0, fontsize=10, fontweight="bold")
    for violation in violations:
        k = QUANTITIES.index(violation.quantity)
        if k < 3:
            axes[violation.joint][k].plot(violation.time, violation.value, "o", color=BEYOND, markersize=5.0)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.align_ylabels(axes)
    _head(figure, axes[0], labels, height, any(2 < len(curve.knots) <= MOST_MARKS for curve in trajectory.curves))
    figure.savefig(path, format="png", metadata={"Software": None})


def _times(trajectory: Trajectory) -> Array:
    parts = max((len(curve.knots) - 1) * curve.divisions for curve in trajectory.curves)
    even = np.linspace(0.0, trajectory.duration, int(np.clip(parts, FEWEST, MOST)))
    return np.unique(np.concatenate([even, *(curve.knots for curve in trajectory.curves)]))


def _draw(axis: Any, t: Array, values: Array, limit: Range | None) -> None:
    """Curve, and limits that are near; what lies beyond a limit in red."""
    axis.plot(t, values, color=CURVE, linewidth=1.2)
    low, high = float(values.min()), float(values.max())
    if high - low <= FLAT * (1.0 + abs(low) + abs(high)):
        axis.update_datalim([(t[0], low - 1.0), (t[-1], high + 1.0)])  # else the scale would magnify rounding
    for bound, sign in zip(limit or (), (-1.0, 1.0), strict=False):
        if (sign * values).max() < LIMIT_IN_VIEW * sign * bound:
            continue
        axis.axhline(bound, color=LIMIT, linewidth=1.1, linestyle=(0, (5, 3)))
        beyond = sign * values > sign * bound
        if beyond.any():
            axis.fill_between(t, bound, values, where=beyond, color=BEYOND, alpha=0.55, linewidth=0, interpolate=True)


def _style(axis: Any) -> None:
    from matplotlib.ticker import MaxNLocator

    axis.set_axisbelow(True)
    axis.grid(True, color="#e3e3e3", linewidth=0.6)
    axis.yaxis.set_major_locator(MaxNLocator(4))
    axis.ticklabel_format(axis="y", scilimits=(-2, 4))
    axis.yaxis.set_offset_position("right")  # on the left it would hide the joint's name
    axis.margins(x=0.0, y=0.12)
    axis.spines[["top", "right"]].set_visible(False)


def _head(figure: Any, first: Any, labels: TrajectoryLabels, height: float, points: bool) -> None:
    """Title, subtitle, legend and the names of the columns above the rows."""
    from matplotlib.lines import Line2D

    figure.subplots_adjust(
        left=0.075, right=0.985, top=1.0 - 1.05 / height, bottom=0.5 / height, hspace=0.42, wspace=0.24
    )
    figure.text(0.075, 1.0 - 0.3 / height, _plain(labels.title), fontsize=13, fontweight="bold")
    figure.text(0.075, 1.0 - 0.53 / height, _plain(labels.subtitle), fontsize=9, color=POINT)
    for axis, quantity in zip(first, QUANTITIES, strict=False):
        box = axis.get_position()
        middle = 0.5 * (box.x0 + box.x1)
        figure.text(middle, 1.0 - 0.83 / height, quantity, fontsize=10, color="#111111", ha="center")
    handles = [Line2D([], [], color=POINT, marker=".", linestyle="", label="pieces meet")] if points else []
    if labels.limits:
        handles.append(Line2D([], [], color=LIMIT, linestyle=(0, (5, 3)), label="limit, if near"))
        handles.append(Line2D([], [], color=BEYOND, marker="o", linestyle="", label="farthest beyond"))
    if handles:
        figure.legend(
            handles=handles, loc="upper right", bbox_to_anchor=(0.99, 1.0), ncols=3, frameon=False, fontsize=9
        )


def _plain(text: str) -> str:
    return text.replace("$", r"\$")
