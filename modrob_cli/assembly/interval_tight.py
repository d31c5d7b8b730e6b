"""Tight interval parameters of links: the range of each parameter over the bodies' boxes."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.inertia_range import inertia_range
from modrob_cli.assembly.link_parameters import LinkIntervals, placed_in
from modrob_cli.assembly.rounding import ROUNDING, exact_link
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody
from modrob_cli.model.robot import Robot


def tight_intervals(robot: Robot, frames: Array) -> LinkIntervals:
    """Range of mass, centre of mass and central inertia of each link in link-fixed frames (n, 4, 4).

    The mass is a sum; each coordinate of the centre of mass a ratio of linear forms, largest and smallest at a vertex
    of the masses; the inertia see :mod:`modrob_cli.assembly.inertia_range`. Each single range is attained (the
    inertia up to the stated tolerance); together they form a box around a set that is smaller. All end points are
    rounded outward.
    """
    links = [_link(bodies) for bodies in placed_in(robot, frames)]
    mass, com, inertia = ([link[k] for link in links] for k in range(3))
    return LinkIntervals(*(Interval([p.inf for p in part], [p.sup for p in part]) for part in (mass, com, inertia)))


def _link(bodies: list[PlacedBody]) -> tuple[Interval, Interval, Interval]:
    bodies = [placed for placed in bodies if not placed.body.is_massless]
    known = exact_link(bodies)
    if known is not None:
        return known
    mass = Interval(0.0)
    for placed in bodies:
        mass = mass + placed.body.mass.interval
    return mass, _com_range(bodies), inertia_range(bodies)


def _com_range(bodies: list[PlacedBody]) -> Interval:
    """Range of each coordinate of the centre of mass, shape (3,)."""
    points = [_points(placed) for placed in bodies]
    if len(bodies) == 1:
        return points[0]
    m_low = np.array([placed.body.mass.interval.inf for placed in bodies])
    m_high = np.array([placed.body.mass.interval.sup for placed in bodies])
    low, high = np.stack([point.inf for point in points]), np.stack([point.sup for point in points])
    inf = [-_largest_ratio(-low[:, k], m_low, m_high) for k in range(3)]
    sup = [_largest_ratio(high[:, k], m_low, m_high) for k in range(3)]
    return Interval(np.minimum(inf, sup), sup).widen(ROUNDING * max(np.abs(low).max(), np.abs(high).max()))


def _points(placed: PlacedBody) -> Interval:
    """Range of the body's centre of mass in the link's frame, shape (3,)."""
    R, t = placed.pose[:3, :3], placed.pose[:3, 3]
    com = placed.body.com.interval
    return ((R @ com[:, None])[:, 0] + t).widen(ROUNDING * (np.abs(R) @ com.mag + np.abs(t)))


def _largest_ratio(x: Array, m_low: Array, m_high: Array) -> float:
    """Largest sum(m x) / sum(m) over the box of masses.

    With x sorted downwards, the best masses are largest for the first j bodies and smallest for the others.
    """
    order = np.argsort(-x, kind="stable")
    x, m_low, m_high = x[order], m_low[order], m_high[order]
    first = np.tri(len(x), dtype=bool)
    m = np.where(first, m_high, m_low)
    total = m.sum(axis=1)
    usable = total > 0.0
    return float(((m @ x)[usable] / total[usable]).max()) if usable.any() else 0.0
