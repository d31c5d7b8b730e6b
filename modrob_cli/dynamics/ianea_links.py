"""Interval parameters of links, as the published interval algorithm takes them."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.dynamics.interval_vectors import Range
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.uncertain import Uncertain


@dataclass(frozen=True)
class LinkBoxes:
    """Interval parameters of links 1..n, one rigid body each.

    Attributes
    ----------
    mass : shape (n,), [kg];  com : shape (n, 3), [m]
    inertia_com : tensor entries xx, xy, xz, yy, yz, zz about the centre of mass, shape (n, 6), [kg m^2]
    frames : the frames in which these are given, in the frames of the links, shape (n, 4, 4): identity for the
        links' own frames; the published algorithm uses D-H frames. Width depends on this choice, because the centre
        of mass counts from the frame's origin.
    """

    mass: Interval
    com: Interval
    inertia_com: Interval
    frames: Array

    def __post_init__(self) -> None:
        """Check the shapes, and that all is bounded and no mass negative."""
        n = len(self.frames)
        object.__setattr__(self, "frames", frozen(self.frames, (n, 4, 4)))
        shapes = (self.mass.shape, self.com.shape, self.inertia_com.shape)
        if shapes != ((n,), (n, 3), (n, 6)):
            raise ShapeError(f"link parameters of shapes {shapes}, expected ({n},), ({n}, 3), ({n}, 6)")
        for part in (self.mass, self.com, self.inertia_com):
            if not np.isfinite(part.mag).all():
                raise NumericalError("a link parameter is unbounded; its range does not bound any torque")
        if (self.mass.inf < 0.0).any():
            raise NumericalError("the range of a link's mass reaches below zero")

    def bodies(self) -> tuple[PlacedBody, ...]:
        """The same boxes as bodies fixed to the links; nominal values are midpoints."""
        parts = []
        for i, pose in enumerate(self.frames):
            mass, com, inertia = (_centred(part[i]) for part in (self.mass, self.com, self.inertia_com))
            parts.append(PlacedBody(i + 1, pose, RigidBody(f"link {i + 1}", mass, com, inertia)))
        return tuple(parts)


def _centred(box: Interval) -> Uncertain:
    return Uncertain(frozen(box.mid, box.shape), box)


@dataclass(frozen=True)
class LinkBox:
    """Parameters of one link as plain numbers, (lower, upper) each, in its frame at R (3, 3), t (3,) in the link's."""

    mass: Range
    com: list[Range]
    inertia: list[Range]
    R: Array
    t: Array

    @property
    def is_massless(self) -> bool:
        """True if the link asks for no force and no moment."""
        return self.mass == (0.0, 0.0) and all(ends == (0.0, 0.0) for ends in self.inertia)

    @property
    def is_moved(self) -> bool:
        """True if the frame is not the link's own."""
        return bool(np.any(np.eye(3) != self.R) or np.any(self.t != 0.0))


def link_boxes(links: LinkBoxes) -> list[LinkBox]:
    """Parameters link by link."""

    def ends(part: Interval, i: int) -> list[Range]:
        return list(zip(part.inf[i].tolist(), part.sup[i].tolist(), strict=True))

    return [
        LinkBox(
            mass=(float(links.mass.inf[i]), float(links.mass.sup[i])),
            com=ends(links.com, i),
            inertia=ends(links.inertia_com, i),
            R=pose[:3, :3],
            t=pose[:3, 3],
        )
        for i, pose in enumerate(links.frames)
    ]
