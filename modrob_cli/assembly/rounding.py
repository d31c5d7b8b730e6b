"""What rounding costs where link parameters are computed in round-to-nearest."""

import numpy as np

from modrob_cli.dynamics.link_inertia import joined
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, tensor_entries

ROUNDING = 2e-14
"""Relative allowance for rounding outside interval operations, 180 units of 2^-53. A product of rotations and
translations adds at most 6 units per factor to an entry; a link of ten modules has some 20 factors that round."""


def reach(bodies: list[PlacedBody]) -> float:
    """Bound of the distance of any centre of mass from the origin, over all boxes; 0 for no bodies."""
    points = [np.abs(p.pose[:3, 3]) + np.abs(p.pose[:3, :3]) @ p.body.com.interval.mag for p in bodies]
    return max((float(np.linalg.norm(point)) for point in points), default=0.0)


def inertia_magnitude(bodies: list[PlacedBody]) -> float:
    """At least four times the sum of absolute values of all terms of any entry of the link's tensor."""
    mass = sum(float(placed.body.mass.interval.sup) for placed in bodies)
    own = sum(float(placed.body.inertia.interval.mag.sum()) * 3.0 for placed in bodies)
    return float(mass * (2.0 * reach(bodies)) ** 2 + own)


def exact_link(bodies: list[PlacedBody]) -> tuple[Interval, Interval, Interval] | None:
    """Mass (), com (3,) and central inertia (6,) of a link without any uncertainty; None if there is some.

    The values are computed once in round-to-nearest; all but a mass that is not summed are widened for that.
    """
    for placed in bodies:
        body = placed.body
        if not (body.mass.is_exact and body.com.is_exact and body.inertia.is_exact):
            return None
    mass = Interval(0.0)
    for placed in bodies:
        mass = mass + placed.body.mass.interval
    _, com, inertia = joined(bodies).central()
    size, moment = reach(bodies), inertia_magnitude(bodies)
    return mass, Interval(com).widen(ROUNDING * size), Interval(tensor_entries(inertia)).widen(ROUNDING * moment)
