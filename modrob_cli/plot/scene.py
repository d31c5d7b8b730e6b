"""A picture as a list of flat shapes, farthest first, so that SVG and PNG show the same."""

from dataclasses import dataclass, field

from modrob_cli.arrays import Array


@dataclass(frozen=True)
class Stroke:
    """A polyline with round ends; points (k, 2) in panel units, width in pixels."""

    points: Array
    width: float
    color: str
    depth: float = 0.0


@dataclass(frozen=True)
class Disc:
    """A filled circle; centre (2,) in panel units, radius in pixels."""

    centre: Array
    radius: float
    fill: str
    edge: str
    depth: float = 0.0


@dataclass(frozen=True)
class Label:
    """Text beside a point; offset in pixels."""

    anchor: Array
    text: str
    offset: tuple[float, float] = (6.0, -6.0)
    color: str = "#333333"
    size: float = 11.0
    depth: float = 1e9


Shape = Stroke | Disc | Label


@dataclass
class Panel:
    """One view: where it sits (left, top, width, height in pixels), its title and its shapes."""

    left: float
    top: float
    width: float
    height: float
    title: str
    shapes: list[Shape] = field(default_factory=list)

    def sorted_shapes(self) -> list[Shape]:
        """Shapes from back to front; equal depths keep their order."""
        return sorted(self.shapes, key=lambda shape: shape.depth)


@dataclass
class Picture:
    """A title, notes below it, and panels on a canvas in pixels."""

    width: float
    height: float
    title: str
    notes: list[str]
    panels: list[Panel]
