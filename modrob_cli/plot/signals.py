"""What the low-pass did: spectra before and after, and a look at the fastest change."""

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.thinning import thin

RAW, FILTERED, CUTOFF = "#9aa0a6", "#0b57d0", "#c5221f"


@dataclass(frozen=True)
class SignalPanel:
    """One joint; N samples in the zoom, F frequencies.

    Attributes
    ----------
    name, unit : of the joint and of its velocity
    frequency : shape (F,), [Hz];  raw_density, density : spectra of the velocity, in the square of the unit per Hz
    t : shape (N,), [s];  raw, filtered : velocity;  raw_torque, torque : joint torque, all of shape (N,)
    torque_unit : of the torque
    """

    name: str
    unit: str
    frequency: Array
    raw_density: Array
    density: Array
    t: Array
    raw: Array
    filtered: Array
    raw_torque: Array
    torque: Array
    torque_unit: str


def draw_signals(title: str, subtitle: str, cutoff: float, panels: list[SignalPanel], path: Path) -> None:
    """Write the picture as PNG: a row per joint; spectrum of the velocity, zoom of velocity and of torque."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height = 1.75 * len(panels) + 1.5
    figure = Figure(figsize=(13.0, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(panels), 3, squeeze=False)
    for row, panel in zip(axes, panels, strict=True):
        _draw_spectrum(row[0], panel, cutoff)
        _draw_zoom(row[1], panel.t, panel.raw, panel.filtered, f"velocity [{panel.unit}]")
        _draw_zoom(row[2], panel.t, panel.raw_torque, panel.torque, f"[{panel.torque_unit}]")
        row[0].set_title(_plain(panel.name), loc="left", y=1.0, fontsize=10, fontweight="bold")
    axes[0, 1].set_title("velocity around its fastest change", loc="right", y=1.0, fontsize=9)
    axes[0, 2].set_title("torque at the same time", loc="right", y=1.0, fontsize=9)
    axes[-1, 0].set_xlabel("frequency [Hz]")
    for axis in axes[-1, 1:]:
        axis.set_xlabel("time [s]")
    figure.align_ylabels(axes)
    figure.subplots_adjust(
        left=0.065, right=0.985, top=1.0 - 1.1 / height, bottom=0.5 / height, hspace=0.5, wspace=0.22
    )
    figure.text(0.02, 1.0 - 0.3 / height, _plain(title), fontsize=13, fontweight="bold")
    lines = textwrap.fill(_plain(subtitle), 185)
    figure.text(0.02, 1.0 - 0.42 / height, lines, fontsize=9, color="#5f6368", va="top", linespacing=1.3)
    handles = [*axes[0, 0].get_lines()[:2], axes[0, 0].get_lines()[2]]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(0.99, 1.0), ncols=3, frameon=False, fontsize=9)
    figure.savefig(path, format="png", metadata={"Software": None})


def _draw_spectrum(axis: Any, panel: SignalPanel, cutoff: float) -> None:
    shown = panel.frequency > 0.0
    frequency = panel.frequency[shown]
    for density, color, label in (
        (panel.raw_density, RAW, "recorded"),
        (panel.density, FILTERED, "low-passed"),
    ):
        # What the filter takes out ends far below any floor: a view over ten decades shows all that matters.
        floor = max(float(panel.raw_density[shown].max()), np.finfo(float).tiny) * 1e-11
        axis.loglog(frequency, np.maximum(density[shown], floor), color=color, linewidth=1.1, label=label)
    axis.axvline(cutoff, color=CUTOFF, linewidth=1.0, linestyle=(0, (5, 3)), label="cut-off")
    axis.set_ylabel("density of dq")
    _style(axis)


def _draw_zoom(axis: Any, t: Array, raw: Array, filtered: Array, label: str) -> None:
    axis.plot(*thin(t, raw), color=RAW, linewidth=1.0)
    axis.plot(*thin(t, filtered), color=FILTERED, linewidth=1.4)
    axis.set_ylabel(label)
    axis.margins(x=0.0)
    _style(axis)


def _style(axis: Any) -> None:
    axis.set_axisbelow(True)
    axis.grid(True, color="#e3e3e3", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)


def _plain(text: str) -> str:
    """Names come from files: $ would start a formula."""
    return text.replace("$", r"\$")
