"""Bounded-error identification: what the rigid bodies leave against velocity with its band, and torque over time."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.plot.envelope import Envelope

BAND, EDGE, SAMPLE, ACTIVE, LEFT_OUT = "#c6dafc", "#0b57d0", "#5f6368", "#e37400", "#b3261e"
MAX_RUNS = 1500
MOST_STARTS = 20
"""Where more logs than this begin is not marked; the lines would hide the curves."""

MAX_POINTS = 5000
"""Of more samples, evenly picked ones are drawn, and all that are marked."""


@dataclass(frozen=True)
class JointPicture:
    """One row: N samples.

    Attributes
    ----------
    name, unit, prismatic : of the joint
    left_note, right_note : figures above the two panels
    velocity : shape (N,), [rad/s] or [m/s]
    rest_low, rest_high : what the rigid bodies and the rotor leave of the recorded torque at most and at least, (N,)
    grid, band_low, band_high : velocities and the band of friction and disturbance there
    active, left_out : indices of samples that decide, and of those that were left out
    """

    name: str
    unit: str
    prismatic: bool
    left_note: str
    right_note: str
    velocity: Array
    rest_low: Array
    rest_high: Array
    grid: Array
    band_low: Array
    band_high: Array
    active: Indices
    left_out: Indices


@dataclass(frozen=True)
class BoundedPicture:
    """Words and series of the picture: N samples, n joints.

    Attributes
    ----------
    t : shape (N,), [s], the logs one after the other;  starts : where a log begins, without the first
    tau, lower, upper : recorded torque and bounds, shape (N, n)
    """

    title: str
    subtitle: str
    joints: tuple[JointPicture, ...]
    t: Array
    starts: Array
    tau: Array
    lower: Array
    upper: Array


def draw_bounded(picture: BoundedPicture, path: Path) -> None:
    """Write the picture as PNG: one row per joint."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = len(picture.joints)
    height = 1.9 * n + 1.6
    figure = Figure(figsize=(12.5, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(n, 2, squeeze=False, width_ratios=(1.0, 1.35))
    envelope = Envelope(3, n, MAX_RUNS)
    envelope.add(picture.t, np.stack([picture.tau, picture.lower, picture.upper], axis=1))
    t, (tau, lower, upper) = envelope.bands()
    for j, (left, right) in enumerate(axes):
        joint = picture.joints[j]
        _draw_rest(left, joint)
        right.fill_between(t, lower.low[:, j], upper.high[:, j], color=BAND, linewidth=0.6)
        right.fill_between(t, tau.low[:, j], tau.high[:, j], color=SAMPLE, linewidth=0.9)
        _mark_time(right, picture, joint, j)
        torque = "force" if joint.prismatic else "torque"
        left.set_ylabel(f"{torque} [{joint.unit}]")
        # Names come from files: $ would start a formula. With y given, Matplotlib skips a slow search for a place.
        left.set_title(_plain(joint.name), loc="left", y=1.0, fontsize=10, fontweight="bold")
        left.set_title(_plain(joint.left_note), loc="right", y=1.0, fontsize=9)
        right.set_title(_plain(joint.right_note), loc="right", y=1.0, fontsize=9)
        for axis in (left, right):
            _style(axis)
        left.set_xlabel(f"velocity [{'m/s' if joint.prismatic else 'rad/s'}]", fontsize=9, labelpad=1.0)
    axes[-1, 1].set_xlabel("time [s]", fontsize=9, labelpad=1.0)
    _head(figure, picture, height)
    figure.savefig(path, format="png", metadata={"Software": None})


def _draw_rest(axis: Any, joint: JointPicture) -> None:
    """Band over velocity; each sample is a bar, or a dot where the rigid bodies are known."""
    axis.fill_between(joint.grid, joint.band_low, joint.band_high, color=BAND, linewidth=0.0)
    for edge in (joint.band_low, joint.band_high):
        axis.plot(joint.grid, edge, color=EDGE, linewidth=1.0)
    marked = np.concatenate([joint.active, joint.left_out])
    shown = np.union1d(np.linspace(0, len(joint.velocity) - 1, MAX_POINTS).astype(np.intp), marked)
    at, low, high = (x[shown] for x in (joint.velocity, joint.rest_low, joint.rest_high))
    axis.vlines(at, low, high, color=SAMPLE, linewidth=0.5, alpha=0.5)
    axis.plot(at, 0.5 * (low + high), ".", color=SAMPLE, markersize=1.2)
    for chosen, mark, color in ((joint.active, "o", ACTIVE), (joint.left_out, "x", LEFT_OUT)):
        middle = 0.5 * (joint.rest_low[chosen] + joint.rest_high[chosen])
        axis.plot(joint.velocity[chosen], middle, mark, color=color, markersize=5.0, fillstyle="none", zorder=5)


def _mark_time(axis: Any, picture: BoundedPicture, joint: JointPicture, j: int) -> None:
    for start in picture.starts if len(picture.starts) <= MOST_STARTS else ():
        axis.axvline(start, color="#bdc1c6", linewidth=0.8, linestyle=(0, (2, 2)))
    for chosen, mark, color in ((joint.active, "o", ACTIVE), (joint.left_out, "x", LEFT_OUT)):
        axis.plot(
            picture.t[chosen], picture.tau[chosen, j], mark, color=color, markersize=5.0, fillstyle="none", zorder=5
        )


def _style(axis: Any) -> None:
    from matplotlib.ticker import MaxNLocator

    axis.set_axisbelow(True)
    axis.grid(True, color="#e3e3e3", linewidth=0.6)
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.tick_params(labelsize=8.5)
    axis.margins(x=0.01)
    axis.spines[["top", "right"]].set_visible(False)


def _head(figure: Any, picture: BoundedPicture, height: float) -> None:
    """Title, subtitle and legend above the rows."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure.subplots_adjust(
        left=0.07, right=0.985, top=1.0 - 1.05 / height, bottom=0.5 / height, hspace=0.62, wspace=0.11
    )
    figure.align_ylabels(figure.axes[::2])
    figure.text(0.07, 1.0 - 0.3 / height, _plain(picture.title), fontsize=13, fontweight="bold")
    figure.text(0.07, 1.0 - 0.53 / height, _plain(picture.subtitle), fontsize=9, color="#5f6368")
    text = (
        "left: recorded torque minus rigid bodies and rotor, with the band found; right: recorded torque in its bounds"
    )
    figure.text(0.07, 1.0 - 0.72 / height, text, fontsize=9, color="#5f6368")
    handles = [
        Patch(facecolor=BAND, edgecolor=EDGE, label="band found"),
        Line2D([], [], color=SAMPLE, marker=".", linestyle="", label="samples"),
        Line2D([], [], color=ACTIVE, marker="o", fillstyle="none", linestyle="", label="decide the band"),
    ]
    if any(len(joint.left_out) for joint in picture.joints):
        handles.append(Line2D([], [], color=LEFT_OUT, marker="x", linestyle="", label="left out"))
    place = {"loc": "upper right", "bbox_to_anchor": (0.99, 1.0), "frameon": False, "fontsize": 9}
    figure.legend(handles=handles, ncols=len(handles), **place)


def _plain(text: str) -> str:
    return text.replace("$", r"\$")
