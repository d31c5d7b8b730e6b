"""Robots whose rigid bodies' boxes have grown about their nominal values."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

_FREE = -np.inf
_DIAGONAL_LEAST = np.array([0.0, _FREE, _FREE, 0.0, _FREE, 0.0])


def labelled(robot: Robot) -> Iterator[tuple[str, PlacedBody]]:
    """Every body with a name of its own: where several share one, with its number in the list of bodies."""
    count = Counter(placed.body.name for placed in robot.bodies)
    for k, placed in enumerate(robot.bodies, start=1):
        name = placed.body.name
        yield (name if count[name] == 1 else f"{name} (body {k})"), placed


def is_point(placed: PlacedBody) -> bool:
    """True if no parameter of the body has any width."""
    body = placed.body
    return body.mass.is_exact and body.com.is_exact and body.inertia.is_exact


def with_grown_masses(robot: Robot, bodies: Sequence[PlacedBody], share: float) -> Robot:
    """The robot with the bounds of these bodies' masses moved outward by a share of the nominal mass."""
    chosen = {id(placed) for placed in bodies}

    def grown(placed: PlacedBody) -> PlacedBody:
        mass = placed.body.mass
        wider = mass.interval.widen(share * np.abs(mass.nominal))
        body = replace(placed.body, mass=_not_below(mass.nominal, wider, 0.0))
        return replace(placed, body=body) if id(placed) in chosen else placed

    return replace(robot, bodies=tuple(grown(placed) for placed in robot.bodies))


def with_grown_boxes(robot: Robot, factor: float) -> Robot:
    """The robot with every box of its bodies grown by a factor about the nominal value; masses stay >= 0."""

    def grown(body: RigidBody) -> RigidBody:
        return replace(
            body,
            mass=_grown(body.mass, factor, 0.0),
            com=_grown(body.com, factor, _FREE),
            inertia=_grown(body.inertia, factor, _DIAGONAL_LEAST),
        )

    return replace(robot, bodies=tuple(replace(placed, body=grown(placed.body)) for placed in robot.bodies))


def _grown(value: Uncertain, factor: float, least: Array | float) -> Uncertain:
    offset = (value.interval - value.nominal) * factor + value.nominal
    return _not_below(value.nominal, offset.hull(value.interval), least)


def _not_below(nominal: Array, wider: Interval, least: Array | float) -> Uncertain:
    return Uncertain(nominal, Interval(np.maximum(wider.inf, least), wider.sup))
