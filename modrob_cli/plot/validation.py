"""Recorded against predicted torque over time, with what is left between them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.plot.thinning import thin

RECORDED, PREDICTED, RESIDUAL = "#9aa0a6", "#0b57d0", "#c5221f"


@dataclass(frozen=True)
class TorquePicture:
    """What the picture shows: N samples, n joints.

    Attributes
    ----------
    title, subtitle : first two lines
    t : shape (N,), [s];  recorded, predicted : shape (N, n)
    used : samples that the errors count, shape (N,); the others are shaded
    names, units, captions : per joint
    """

    title: str
    subtitle: str
    t: Array
    recorded: Array
    predicted: Array
    used: NDArray[np.bool_]
    names: tuple[str, ...]
    units: tuple[str, ...]
    captions: tuple[str, ...]


def draw_torques(picture: TorquePicture, path: Path) -> None:
    """Write the picture as PNG: one row per joint, torques on the left, residual on the right, at one scale.

    The time axes are shared, and so is the scale within a row, so that the residual shows in proportion.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    n = len(picture.names)
    height = 1.55 * n + 1.45
    figure = Figure(figsize=(12.5, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(n, 2, sharex=True, sharey="row", squeeze=False, width_ratios=(1.55, 1.0))
    residual = picture.recorded - picture.predicted
    for j, (left, right) in enumerate(axes):
        for series, color, width, label in (
            (picture.recorded[:, j], RECORDED, 1.3, "recorded"),
            (picture.predicted[:, j], PREDICTED, 1.0, "predicted"),
        ):
            left.plot(*thin(picture.t, series), color=color, linewidth=width, label=label)
        right.plot(*thin(picture.t, residual[:, j]), color=RESIDUAL, linewidth=0.9, label="recorded - predicted")
        left.set_ylabel(f"torque [{picture.units[j]}]" if picture.units[j] == "N m" else f"force [{picture.units[j]}]")
        # Names come from files: $ would start a formula. With y given, Matplotlib skips a slow search for a free place.
        left.set_title(picture.names[j].replace("$", r"\$"), loc="left", y=1.0, fontsize=10, fontweight="bold")
        right.set_title(picture.captions[j], loc="right", y=1.0, fontsize=9)
        for axis in (left, right):
            _shade(axis, picture)
            axis.grid(True, color="#e3e3e3", linewidth=0.6)
            axis.axhline(0.0, color="#80868b", linewidth=0.6)
            axis.yaxis.set_major_locator(MaxNLocator(5))
            axis.margins(x=0.0)
            axis.spines[["top", "right"]].set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    top = 1.0 - 0.95 / height
    figure.subplots_adjust(left=0.07, right=0.985, top=top, bottom=0.5 / height, hspace=0.42, wspace=0.07)
    inch = 1.0 / height
    figure.text(0.07, 1.0 - 0.3 * inch, picture.title.replace("$", r"\$"), fontsize=13, fontweight="bold")
    figure.text(0.07, 1.0 - 0.53 * inch, picture.subtitle.replace("$", r"\$"), fontsize=9, color="#5f6368")
    handles = [*axes[0, 0].get_lines()[:2], axes[0, 1].get_lines()[0]]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(0.99, 1.0), ncols=3, frameon=False, fontsize=9)
    figure.savefig(path, format="png", metadata={"Software": None})


def _shade(axis: object, picture: TorquePicture) -> None:
    """Grey the stretches of time that the errors leave out."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], picture.used, [True]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        last = min(end, len(picture.t) - 1)
        axis.axvspan(picture.t[start], picture.t[last], color="#f1f3f4", zorder=0, linewidth=0)  # type: ignore[attr-defined]
