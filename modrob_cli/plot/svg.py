"""Pictures as SVG text: quick to write, sharp at any size, no plotting library."""

from xml.sax.saxutils import escape, quoteattr

from modrob_cli.arrays import Array
from modrob_cli.plot.scene import Disc, Label, Panel, Picture, Shape, Stroke

_FONT = "Helvetica, Arial, sans-serif"


def svg_text(picture: Picture) -> str:
    """SVG text of a picture; all text is escaped."""
    size = f'width="{picture.width:g}" height="{picture.height:g}" viewBox="0 0 {picture.width:g} {picture.height:g}"'
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{_FONT}">']
    parts.append('<rect width="100%" height="100%" fill="#ffffff"/>')
    parts.append(_text(16.0, 28.0, picture.title, "#111111", 18.0))
    parts += [_text(16.0, 47.0 + 16.0 * k, note, "#555555", 11.0) for k, note in enumerate(picture.notes)]
    for k, panel in enumerate(picture.panels):
        parts += _panel(panel, f"clip{k}")
    parts.append("</svg>")
    return "\n".join(parts) + "\n"


def _panel(panel: Panel, clip: str) -> list[str]:
    box = f'x="{panel.left:g}" y="{panel.top:g}" width="{panel.width:g}" height="{panel.height:g}"'
    parts = [f'<clipPath id="{clip}"><rect {box}/></clipPath>']
    parts.append(f'<rect {box} fill="#fafafa" stroke="#dddddd"/>')
    parts.append(_text(panel.left + 10.0, panel.top + 18.0, panel.title, "#777777", 11.0))
    parts.append(f'<g clip-path="url(#{clip})">')
    parts += [_shape(shape) for shape in panel.sorted_shapes()]
    parts.append("</g>")
    return parts


def _shape(shape: Shape) -> str:
    if isinstance(shape, Stroke):
        line = f'fill="none" stroke="{shape.color}" stroke-width="{shape.width:g}"'
        return f'<polyline points="{_points(shape.points)}" {line} stroke-linecap="round" stroke-linejoin="round"/>'
    if isinstance(shape, Disc):
        where = f'cx="{shape.centre[0]:.2f}" cy="{shape.centre[1]:.2f}" r="{shape.radius:.2f}"'
        fill, alpha = shape.fill[:7], int(shape.fill[7:] or "ff", 16) / 255.0
        return f'<circle {where} fill="{fill}" fill-opacity="{alpha:.2f}" stroke="{shape.edge}" stroke-width="1.2"/>'
    return _label(shape)


def _label(shape: Label) -> str:
    x, y = float(shape.anchor[0]) + shape.offset[0], float(shape.anchor[1]) + shape.offset[1]
    return _text(x, y, shape.text, shape.color, shape.size)


def _points(points: Array) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _text(x: float, y: float, text: str, color: str, size: float) -> str:
    place = f'x="{x:.2f}" y="{y:.2f}" font-size={quoteattr(f"{size:g}")}'
    halo = 'stroke="#ffffff" stroke-width="3" stroke-opacity="0.8" paint-order="stroke"'
    return f'<text {place} fill="{color}" {halo}>{escape(text)}</text>'
