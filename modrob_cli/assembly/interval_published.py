"""Interval parameters of links as the dissertation publishes them. [D] 3.4.3.

Equations (2.17)-(2.24) evaluated with interval operations, division by [m] included, from connector to connector in
the order of the modules; massless parts take part in it as any other, except where the division would be 0 / 0. The
result encloses the true set, but mass and centre of mass enter several times, so it is far wider than the tight ranges
of :mod:`modrob_cli.assembly.interval_tight`. It is kept for comparison with published figures.

Rounding: interval operations round outward; the transforms between connector frames are doubles, off by a few units
in the last place, for which every result is widened by ``ROUNDING`` times the magnitude of its terms.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.link_parameters import LinkIntervals, placed_in
from modrob_cli.assembly.rounding import ROUNDING, exact_link
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, tensor, tensor_entries
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import invert


@dataclass(frozen=True)
class _Part:
    """An auxiliary distal part: mass (), com (3,), inertia (3, 3) about the origin of its present frame."""

    mass: Interval
    com: Interval
    inertia: Interval


def published_intervals(robot: Robot, frames: Array) -> LinkIntervals:
    """Interval parameters of each link in link-fixed frames (n, 4, 4), by the published recursion.

    A link whose mass may be zero gets unbounded centre of mass and inertia (the recursion divides by [m]).
    """
    links = [_link(bodies) for bodies in placed_in(robot, frames)]
    return LinkIntervals(*(_stack([link[k] for link in links]) for k in range(3)))


def _stack(parts: list[Interval]) -> Interval:
    return Interval(np.stack([part.inf for part in parts]), np.stack([part.sup for part in parts]))


def _link(bodies: list[PlacedBody]) -> tuple[Interval, Interval, Interval]:
    """Mass (), com (3,) and inertia entries (6,) about the centre of mass."""
    known = exact_link(bodies)
    if known is not None:
        return known
    part = _of(bodies[0])
    for before, placed in zip(bodies, bodies[1:], strict=False):
        part = _merge(_move(part, invert(before.pose) @ placed.pose), _of(placed))
    last = bodies[-1].pose
    R = last[:3, :3]
    com = _points(part.com, invert(last))
    about_com = R @ (part.inertia - _steiner(part.mass, part.com)) @ R.T
    entries = Interval(tensor_entries(about_com.inf), tensor_entries(about_com.sup))
    return part.mass, _widen(com, np.abs(last[:3, 3]).sum()), _widen(entries, float(part.inertia.mag.max()))


def _widen(value: Interval, scale: float) -> Interval:
    """Widen intervals (not single points that came through unchanged) for rounded transforms."""
    return value.widen(ROUNDING * (value.mag + scale))


def _of(placed: PlacedBody) -> _Part:
    """The body alone, inertia about the origin of its frame."""
    body = placed.body
    inertia = Interval(tensor(body.inertia.interval.inf), tensor(body.inertia.interval.sup))
    mass, com = body.mass.interval, body.com.interval
    if body.inertia_about == "com":
        inertia = inertia + _steiner(mass, com)
    return _Part(mass, com, inertia)


def _merge(first: _Part, second: _Part) -> _Part:
    """Two parts in one frame become one. [D] (2.17)."""
    if np.all(first.mass.sup == 0.0):
        return _Part(second.mass, second.com, first.inertia + second.inertia)
    mass = first.mass + second.mass
    com = (first.mass * first.com + second.mass * second.com) / mass
    return _Part(mass, com, first.inertia + second.inertia)


def _move(part: _Part, T: Array) -> _Part:
    """Express a part in a frame at T in the present one. [D] (2.19), (2.20); exact for T = 1."""
    if np.array_equal(T, np.eye(4)):
        return part
    com = _points(part.com, T)
    R = T[:3, :3]
    about_com = R.T @ (part.inertia - _steiner(part.mass, part.com)) @ R
    return _Part(part.mass, com, about_com + _steiner(part.mass, com))


def _points(points: Interval, T: Array) -> Interval:
    """Coordinates (3,) in a frame at T of points given in the present frame."""
    back = invert(T)
    return (back[:3, :3] @ points[:, None])[:, 0] + back[:3, 3]


def _steiner(mass: Interval, com: Interval) -> Interval:
    """[m] S^T([c]) S([c]) with plain interval products, shape (3, 3)."""
    outer = com[:, None] * com[None, :]
    diagonal = Interval(np.diagonal(outer.inf), np.diagonal(outer.sup))
    rows = []
    for i in range(3):
        others = diagonal[(i + 1) % 3] + diagonal[(i + 2) % 3]
        rows.append(_stack([others if i == j else -outer[i, j] for j in range(3)]))
    return mass * _stack(rows)
