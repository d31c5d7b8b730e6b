"""Runs of controllers that bound their perturbation: error, torque, and the perturbation within its bounds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.thinning import thin

BAND, TRUE, ERROR, TORQUE, BOUND = "#aecbfa", "#202124", "#c5221f", "#0b57d0", "#5f6368"


@dataclass(frozen=True)
class PerturbationPicture:
    """What the picture shows: K samples, n joints.

    Attributes
    ----------
    t : shape (K,), [s];  error, torque : norms, shape (K,)
    perturbation, lower, upper : shape (K, n)
    precision : norm of the error that is asked for; None where nothing is
    """

    title: str
    subtitle: str
    t: Array
    error: Array
    torque: Array
    perturbation: Array
    lower: Array
    upper: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    precision: float | None


def draw_perturbation(picture: PerturbationPicture, path: Path) -> None:
    """Write the picture as PNG: norms of error and torque above, one axes for each joint below, two in a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = 1 + (len(picture.names) + 1) // 2
    height = 2.1 * rows + 0.9
    figure = Figure(figsize=(11.0, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False)
    for axis in axes.flat:
        axis.grid(True, color="#e3e3e3", linewidth=0.6)
        axis.margins(x=0.0)
        axis.spines[["top", "right"]].set_visible(False)
    _draw_norms(axes[0], picture)
    for j, axis in enumerate(axes[1:].flat):
        if j == len(picture.names):
            axis.set_visible(False)
            break
        _draw_joint(axis, picture, j)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.subplots_adjust(
        left=0.075, right=0.985, top=1.0 - 0.95 / height, bottom=0.5 / height, hspace=0.38, wspace=0.17
    )
    for text, y, size, color in ((picture.title, 0.3, 13, "#202124"), (picture.subtitle, 0.53, 9, BOUND)):
        figure.text(0.06, 1.0 - y / height, text.replace("$", r"\$"), fontsize=size, color=color)
    handles, labels = axes[1, 0].get_legend_handles_labels()
    place = (0.99, 1.0 - 0.1 / height)
    figure.legend(handles, labels, fontsize=9, frameon=False, ncols=2, loc="upper right", bbox_to_anchor=place)
    figure.savefig(path, format="png", metadata={"Software": None})


def _draw_norms(axes: Any, picture: PerturbationPicture) -> None:
    axes[0].plot(*thin(picture.t, 1e3 * picture.error), color=ERROR, linewidth=0.9)
    axes[0].set_title("norm of the tracking error [mrad, mm]", loc="left", y=1.0, fontsize=10)
    axes[0].set_ylim(bottom=0.0)
    if picture.precision is not None:
        axes[0].axhline(1e3 * picture.precision, color=BOUND, linewidth=0.9, linestyle=(0, (5, 3)))
    axes[1].plot(*thin(picture.t, picture.torque), color=TORQUE, linewidth=0.8)
    axes[1].set_title("norm of the commanded torque [N m, N]", loc="left", y=1.0, fontsize=10)


def _draw_joint(axis: Any, picture: PerturbationPicture, j: int) -> None:
    low, high = (thin(picture.t, values[:, j]) for values in (picture.lower, picture.upper))
    axis.fill_between(*high, np.interp(high[0], *low), color=BAND, linewidth=0.0, label="bounds")
    axis.plot(*thin(picture.t, picture.perturbation[:, j]), color=TRUE, linewidth=0.9, label="true perturbation")
    title = f"{picture.names[j]}: perturbation [{picture.units[j]}]".replace("$", r"\$")
    axis.set_title(title, loc="left", y=1.0, fontsize=10)
