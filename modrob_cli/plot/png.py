"""Pictures as PNG, drawn with matplotlib."""

from pathlib import Path
from typing import Any

from modrob_cli.plot.scene import Disc, Picture, Shape, Stroke

_POINTS_PER_PIXEL = 0.72  # 72 points per inch at 100 pixels per inch


def save_png(picture: Picture, path: Path) -> None:
    """Write a picture as PNG at twice its size in pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(picture.width / 100.0, picture.height / 100.0), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, picture.width)
    axes.set_ylim(picture.height, 0.0)
    axes.axis("off")
    _write(axes, 16.0, 28.0, picture.title, "#111111", 18.0)
    for k, note in enumerate(picture.notes):
        _write(axes, 16.0, 47.0 + 16.0 * k, note, "#555555", 11.0)
    order = 1
    for panel in picture.panels:
        axes.add_patch(_frame(panel.left, panel.top, panel.width, panel.height, order))
        _write(axes, panel.left + 10.0, panel.top + 18.0, panel.title, "#777777", 11.0)
        for shape in panel.sorted_shapes():
            order += 1
            _draw(axes, shape, order)
    figure.savefig(path, format="png", dpi=200)


def _frame(left: float, top: float, width: float, height: float, order: int) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((left, top), width, height, facecolor="#fafafa", edgecolor="#dddddd", zorder=order)


def _draw(axes: Any, shape: Shape, order: int) -> None:
    from matplotlib.patches import Circle

    if isinstance(shape, Stroke):
        width = shape.width * _POINTS_PER_PIXEL
        x, y = shape.points.T
        axes.plot(x, y, color=shape.color, linewidth=width, solid_capstyle="round", zorder=order)
    elif isinstance(shape, Disc):
        centre = (float(shape.centre[0]), float(shape.centre[1]))
        axes.add_patch(Circle(centre, shape.radius, facecolor=shape.fill, edgecolor=shape.edge, zorder=order))
    else:
        x, y = float(shape.anchor[0]) + shape.offset[0], float(shape.anchor[1]) + shape.offset[1]
        _write(axes, x, y, shape.text, shape.color, shape.size, order)


def _write(axes: Any, x: float, y: float, text: str, color: str, size: float, order: int = 10_000) -> None:
    """Put plain text (no markup) with its baseline start at (x, y)."""
    from matplotlib.patheffects import withStroke

    halo = withStroke(linewidth=2.0, foreground="#ffffffcc")
    size *= _POINTS_PER_PIXEL
    axes.text(x, y, text, color=color, fontsize=size, zorder=order, parse_math=False, path_effects=[halo])
