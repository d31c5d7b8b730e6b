"""Friction of each joint over its velocity: what was recorded, the fitted curve, and how sure it is."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.svg_figure import INK, ink, svg_text

FITTED, HELD_OUT, CURVE, BAND = "#9aa0a6", "#e8710a", "#0b57d0", "#a8c7fa"
MAX_POINTS = 3000
"""Of longer series evenly picked samples are drawn."""


@dataclass(frozen=True)
class FrictionPanel:
    """One joint.

    Attributes
    ----------
    name, unit, velocity_unit, captions : texts; the captions are lines in a corner
    fitted, held_out : velocity and torque that rigid bodies and rotor leave, each of shape (N, 2)
    dq, curve, half_width : fitted curve and half-width of its confidence band, shape (G,)
    spread : RMS of the residual
    """

    name: str
    unit: str
    velocity_unit: str
    captions: tuple[str, ...]
    fitted: Array
    held_out: Array
    dq: Array
    curve: Array
    half_width: Array
    spread: float


def draw_friction(title: str, subtitle: str, panels: list[FrictionPanel], path: Path) -> None:
    """Write the picture as PNG, two joints in a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    height = 3.1 * rows + 1.25
    figure = Figure(figsize=(6.4 * columns, height), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis, panel in zip(axes.flat, panels, strict=False):
        _draw_panel(axis, panel)
    for axis in list(axes.flat)[len(panels) :]:
        axis.set_visible(False)
    figure.subplots_adjust(
        left=0.5 / 6.4 / columns + 0.02, right=0.985, top=1.0 - 1.2 / height, bottom=0.5 / height,
        hspace=0.48, wspace=0.16,
    )  # fmt: skip
    figure.text(0.02, 1.0 - 0.3 / height, _plain(title), fontsize=13, fontweight="bold")
    figure.text(0.02, 1.0 - 0.53 / height, _plain(subtitle), fontsize=9, color="#5f6368")
    figure.legend(
        handles=_handles(any(len(panel.held_out) for panel in panels)), loc="upper left", ncols=5, frameon=False,
        bbox_to_anchor=(0.01, 1.0 - 0.56 / height), fontsize=9,
    )  # fmt: skip
    figure.savefig(path, format="png", metadata={"Software": None})


def friction_svg(panel: FrictionPanel, name: str) -> str:
    """SVG of one joint for a page; ``name`` is unique on it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4))
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    ink(axis)
    _draw_series(axis, panel)
    axis.title.set_color(INK)
    legend = axis.legend(
        handles=_handles(len(panel.held_out) > 0), loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, fontsize=8,
        frameon=False,
    )  # fmt: skip
    for text in legend.get_texts():
        text.set_color(INK)
    figure.subplots_adjust(left=0.075, right=0.99, top=0.85, bottom=0.14)
    return svg_text(figure, name)


def _draw_panel(axis: Any, panel: FrictionPanel) -> None:
    from matplotlib.ticker import MaxNLocator

    _draw_series(axis, panel)
    # Friction grows with the velocity, so the lower right corner is free.
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.5}
    place = {"transform": axis.transAxes, "ha": "right", "va": "bottom", "linespacing": 1.35}
    axis.text(0.985, 0.03, _plain("\n".join(panel.captions)), fontsize=8, bbox=box, zorder=5, **place)
    axis.grid(True, color="#e3e3e3", linewidth=0.6)
    axis.yaxis.set_major_locator(MaxNLocator(6))
    axis.spines[["top", "right"]].set_visible(False)


def _draw_series(axis: Any, panel: FrictionPanel) -> None:
    """Samples, curve, bands, labels."""
    for points, color in ((panel.fitted, FITTED), (panel.held_out, HELD_OUT)):
        picked = points[:: -(-len(points) // MAX_POINTS) or 1]
        axis.scatter(picked[:, 0], picked[:, 1], s=3, color=color, alpha=0.45, linewidths=0, zorder=2, rasterized=True)
    for sign in (-1.0, 1.0):
        edge = panel.curve + sign * 2.0 * panel.spread
        axis.plot(panel.dq, edge, color=CURVE, linewidth=0.8, linestyle=(0, (4, 3)), zorder=3)
    low, high = panel.curve - panel.half_width, panel.curve + panel.half_width
    axis.fill_between(panel.dq, low, high, color=BAND, alpha=0.8, linewidth=0, zorder=3)
    axis.plot(panel.dq, panel.curve, color=CURVE, linewidth=1.5, zorder=4)
    axis.set_title(_plain(panel.name), loc="left", y=1.0, fontsize=10, fontweight="bold")
    axis.set_xlabel(f"velocity [{panel.velocity_unit}]")
    axis.set_ylabel(f"{'torque' if panel.unit == 'N m' else 'force'} [{panel.unit}]")
    axis.axhline(0.0, color="#80868b", linewidth=0.6)
    axis.axvline(0.0, color="#80868b", linewidth=0.6)
    axis.margins(x=0.02)
    shown = np.concatenate([panel.fitted[:, 1], panel.held_out[:, 1], panel.curve])
    if len(shown) and np.ptp(shown) > 0.0:
        # A few wild samples must not flatten the curve; what lies beyond is cut off.
        low, high = np.percentile(shown, [0.1, 99.9])
        margin = 0.12 * (high - low)
        axis.set_ylim(low - margin, high + margin)


def _handles(held_out: bool) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def dots(color: str, label: str) -> Line2D:
        return Line2D([], [], color=color, marker="o", markersize=4, linestyle="", label=label)

    found: list[Any] = [dots(FITTED, "fitted part")]
    if held_out:
        found.append(dots(HELD_OUT, "held-out part"))
    found.append(Line2D([], [], color=CURVE, linewidth=1.5, label="fitted friction and offset"))
    found.append(Patch(color=BAND, label="confidence band of the curve"))
    found.append(Line2D([], [], color=CURVE, linewidth=0.8, linestyle=(0, (4, 3)), label="+-2 RMS of the residual"))
    return found


def _plain(text: str) -> str:
    """Names come from files: $ would start a formula."""
    return text.replace("$", r"\$")
