"""Simulated runs: positions, tracking errors and torques over time; errors of many runs in one picture."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.thinning import thin

TRUE, DESIRED, ERROR, LIMIT, CONTACT = "#0b57d0", "#9aa0a6", "#c5221f", "#b3261e", "#fce8b2"
LIMIT_IN_VIEW = 0.6
"""A torque limit is drawn if the torque comes this close to it; a far one would make the curve too flat."""


@dataclass(frozen=True)
class SimulationPicture:
    """What the picture shows: K samples, n joints.

    Attributes
    ----------
    t : shape (K,), [s];  q, desired, torque : shape (K, n)
    limits : lower and upper torque limit, shape (2, n), not finite where there is none
    revolute : per joint; others are prismatic
    contacts : start and end of each, [s]
    """

    title: str
    subtitle: str
    t: Array
    q: Array
    desired: Array
    torque: Array
    limits: Array
    names: tuple[str, ...]
    revolute: tuple[bool, ...]
    contacts: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SweepPicture:
    """Norm of the tracking error over time of many runs; times and norms per run."""

    title: str
    times: tuple[Array, ...]
    norms: tuple[Array, ...]


def draw_simulation(picture: SimulationPicture, path: Path) -> None:
    """Write the picture as PNG: one row per joint with position, tracking error and motor torque."""
    n = len(picture.names)
    height = 1.5 * n + 1.5
    figure, axes = _figure(n, 3, 13.5, height)
    columns = ("position", "error", "motor torque")
    for j, row in enumerate(axes):
        revolute = picture.revolute[j]
        units = ("rad" if revolute else "m", "mrad" if revolute else "mm", "N m" if revolute else "N")
        error = 1e3 * (picture.q[:, j] - picture.desired[:, j])
        row[0].plot(*thin(picture.t, picture.desired[:, j]), color=DESIRED, linewidth=2.2, label="desired")
        row[0].plot(*thin(picture.t, picture.q[:, j]), color=TRUE, linewidth=1.0, label="simulated")
        row[1].plot(*thin(picture.t, error), color=ERROR, linewidth=0.9, label="simulated - desired")
        row[2].plot(*thin(picture.t, picture.torque[:, j]), color=TRUE, linewidth=0.9)
        _draw_limits(row[2], picture.limits[:, j], picture.torque[:, j])
        for axis, unit in zip(row, units, strict=True):
            for start, end in picture.contacts:
                # A hit is shorter than a pixel; the edge keeps it in sight.
                axis.axvspan(start, end, facecolor=CONTACT, edgecolor=CONTACT, zorder=0, linewidth=1.5)
            axis.set_ylabel(unit, fontsize=9)
        row[0].set_title(_plain(picture.names[j]), loc="left", y=1.0, fontsize=10, fontweight="bold")
        largest = np.abs(error).max(initial=0.0)
        row[1].set_title(f"largest {largest:.3g} {units[1]}", loc="right", y=1.0, fontsize=9)
    for axis, text in zip(axes[0], columns, strict=True):
        axis.set_title(text, loc="center", y=1.0, fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
        if len(picture.t) > 1:
            axis.set_xlim(picture.t[0], picture.t[-1])
    figure.align_ylabels(axes)
    figure.subplots_adjust(
        left=0.06, right=0.985, top=1.0 - 0.95 / height, bottom=0.5 / height, hspace=0.42, wspace=0.2
    )
    figure.text(0.06, 1.0 - 0.3 / height, _plain(picture.title), fontsize=13, fontweight="bold")
    figure.text(0.06, 1.0 - 0.53 / height, _plain(picture.subtitle), fontsize=9, color="#5f6368")
    handles = [*axes[0, 0].get_lines()[:2]]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(0.99, 1.0), ncols=2, frameon=False, fontsize=9)
    figure.savefig(path, format="png", metadata={"Software": None})


def draw_sweep(picture: SweepPicture, path: Path) -> None:
    """Write the picture as PNG: the error norm of each run on a logarithmic scale, the worst run in red."""
    figure, axes = _figure(1, 1, 11.0, 5.0)
    axis = axes[0, 0]
    worst = int(np.argmax([np.max(norm, initial=0.0) for norm in picture.norms]))
    for k, (t, norm) in enumerate(zip(picture.times, picture.norms, strict=True)):
        color, width, order, alpha = (ERROR, 1.2, 3, 1.0) if k == worst else (TRUE, 0.6, 2, 0.5)
        floor = np.maximum(norm, 1e-9)  # a logarithm of zero has no place
        axis.plot(*thin(t, floor), color=color, linewidth=width, zorder=order, alpha=alpha)
    axis.set_yscale("log")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("norm of the tracking error [rad, m]")
    axis.set_title(_plain(picture.title), loc="left", y=1.0, fontsize=11, fontweight="bold")
    axis.set_title(f"worst run: {worst + 1}", loc="right", y=1.0, fontsize=9, color=ERROR)
    figure.subplots_adjust(left=0.09, right=0.98, top=0.91, bottom=0.12)
    figure.savefig(path, format="png", metadata={"Software": None})


def _figure(rows: int, columns: int, width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for axis in axes.flat:
        axis.grid(True, color="#e3e3e3", linewidth=0.6)
        axis.margins(x=0.0)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _draw_limits(axis: Any, limits: Array, torque: Array) -> None:
    largest = np.abs(torque).max(initial=0.0)
    for limit in limits:
        if np.isfinite(limit) and largest >= LIMIT_IN_VIEW * abs(limit):
            axis.axhline(limit, color=LIMIT, linewidth=0.9, linestyle=(0, (5, 3)))


def _plain(text: str) -> str:
    """Text from files: $ would start a formula."""
    return text.replace("$", r"\$")
