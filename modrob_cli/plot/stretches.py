"""How well a model predicts a long log over its time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.fleet import plain
from modrob_cli.plot.svg_figure import INK, ink, svg_text


def stretch_figure(edges: Array, values: Array, names: Sequence[str], label: str) -> str:
    """SVG with one line of steps for each joint.

    Parameters
    ----------
    edges : start and end of each stretch, shape (S, 2), [s]
    values : shape (S, n); nan where there is none
    label : of the values
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 3.2))
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    ink(axis)
    t = np.column_stack([edges, edges[:, 1]]).ravel()
    for j, name in enumerate(names):
        # A step for each stretch, and nothing between stretches.
        steps = np.column_stack([values[:, j], values[:, j], np.full(len(values), np.nan)]).ravel()
        axis.plot(t, steps, linewidth=1.4, color=f"C{j % 10}", linestyle="-" if j < 10 else "--", label=plain(name))
    axis.set_xlabel("time [s]", fontsize=9)
    axis.set_ylabel(label, fontsize=9)
    axis.set_ylim(bottom=0.0)
    axis.margins(x=0.0)
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}
    legend = axis.legend(**place, fontsize=8, frameon=False, ncols=min(len(names), 8))
    for text in legend.get_texts():
        text.set_color(INK)
    figure.subplots_adjust(left=0.065, right=0.99, top=0.88, bottom=0.15)
    return svg_text(figure, "stretches")
