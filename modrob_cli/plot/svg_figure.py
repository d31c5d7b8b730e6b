"""Matplotlib figures as SVG text for pages: text stays text, ink follows the page's colour."""

import io
from typing import Any

INK = "#010203"
"""Draw with this colour what shall have the colour of the page's text, light or dark."""
FAINT = "#808183"
"""Grid and other quiet lines: seen on white and on black."""


def svg_text(figure: Any, name: str) -> str:
    """SVG of a figure; ``name`` keeps identifiers of several figures on one page apart. Same input, same text."""
    import matplotlib as mpl

    out = io.StringIO()
    style: Any = {"svg.hashsalt": name, "svg.fonttype": "none", "font.family": ["sans-serif"]}
    with mpl.rc_context(style):
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    return out.getvalue().replace(INK, "currentColor")


def ink(axis: Any) -> None:
    """Give frame, ticks, labels and title of axes the colour of the page's text, and a faint grid."""
    axis.grid(True, color=FAINT, linewidth=0.5, alpha=0.35)
    axis.tick_params(colors=INK, labelsize=8)
    for spine in axis.spines.values():
        spine.set_color(INK)
    axis.spines[["top", "right"]].set_visible(False)
    for part in (axis.xaxis.label, axis.yaxis.label, axis.title):
        part.set_color(INK)
