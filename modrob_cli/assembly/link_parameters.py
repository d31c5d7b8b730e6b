"""Dynamic parameters of links, composed from the bodies that they carry. [D] 2.4.2 in linear-parameter form."""

from dataclasses import dataclass

from modrob_cli.arrays import Array, frozen
from modrob_cli.dynamics.link_inertia import joined
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, tensor_entries
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import invert


@dataclass(frozen=True)
class LinkParameters:
    """Nominal parameters of n links, each in its own frame.

    Attributes
    ----------
    mass : shape (n,), [kg];  com : shape (n, 3), [m]
    inertia_com : entries xx, xy, xz, yy, yz, zz about the centre of mass, shape (n, 6), [kg m^2]
    """

    mass: Array
    com: Array
    inertia_com: Array


@dataclass(frozen=True)
class LinkIntervals:
    """Bounds of the parameters of n links: mass (n,), com (n, 3), inertia_com (n, 6)."""

    mass: Interval
    com: Interval
    inertia_com: Interval


def placed_in(robot: Robot, frames: Array) -> list[list[PlacedBody]]:
    """Bodies of links 1..n with their poses expressed in given link-fixed frames.

    Parameters
    ----------
    frames : shape (n, 4, 4), e.g. D-H frame i in the frame of link i
    """
    to_frame = invert(frames)
    return [
        [PlacedBody(placed.link, to_frame[i] @ placed.pose, placed.body) for placed in robot.bodies_of(i + 1)]
        for i in range(robot.dof)
    ]


def link_parameters(robot: Robot, frames: Array) -> LinkParameters:
    """Nominal parameters of each link in given link-fixed frames (n, 4, 4).

    Composition in m, m c and I has no special case for massless parts; a link without mass gets com = 0.
    """
    links = [joined(bodies).central() for bodies in placed_in(robot, frames)]
    return LinkParameters(
        mass=frozen([mass for mass, _, _ in links], (robot.dof,)),
        com=frozen([com for _, com, _ in links], (robot.dof, 3)),
        inertia_com=frozen([tensor_entries(inertia) for _, _, inertia in links], (robot.dof, 6)),
    )
