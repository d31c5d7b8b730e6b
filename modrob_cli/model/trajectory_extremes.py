"""Extremes of planned motions, and where they leave the limits of a robot."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import ShapeError
from modrob_cli.model.motion import ALLOWED_EXCESS
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve

QUANTITIES = ("position", "velocity", "acceleration", "jerk")
"""What robots have limits for; the k-th derivative of the position."""

_BLOCK = 2**15
_HALVINGS = 30


@dataclass(frozen=True)
class Extremes:
    """Smallest and largest value of a quantity over a motion, and the times where they are taken first."""

    low: float
    low_time: float
    high: float
    high_time: float


@dataclass(frozen=True)
class Violation:
    """A joint that leaves the range of one quantity on one side.

    Attributes
    ----------
    joint : number from 0;  quantity : one of QUANTITIES
    limit : (lower, upper);  value : the farthest from it;  time : where it is taken first, [s]
    """

    joint: int
    quantity: str
    limit: tuple[float, float]
    value: float
    time: float

    @property
    def excess(self) -> float:
        """How far the value is outside, > 0."""
        return max(self.limit[0] - self.value, self.value - self.limit[1])


def extremes(curve: Curve, order: int) -> Extremes:
    """Extremes of a derivative of the given order, 0 to 3, over the whole curve.

    The time between two knots is divided into parts. Ends of parts are looked at (knots from both sides), and where the
    next derivative changes its sign within a part, its zero is found by halving and a last straight line, to the last
    digit. What is approximate: two turns within one part are not seen. There are 32 parts in a piece of polynomial and
    in a period of the fastest sine, so that two turns in one part are close to each other in value too; of a curve of
    thousands of pieces each has fewer, as :attr:`PiecewiseCurve.divisions` says.
    """
    low, low_time, high, high_time = np.inf, 0.0, -np.inf, 0.0
    for t, values in _candidates(curve, order):
        below, above = int(values.argmin()), int(values.argmax())
        if values[below] < low:
            low, low_time = float(values[below]), float(t[below])
        if values[above] > high:
            high, high_time = float(values[above]), float(t[above])
    return Extremes(low, low_time, high, high_time)


def _candidates(curve: Curve, order: int) -> Iterator[tuple[Array, Array]]:
    """Times and values among which the extremes are, shapes (C,), block by block."""
    knots, parts = curve.knots, curve.divisions
    total = (len(knots) - 1) * parts
    for first in range(0, total, _BLOCK):
        piece, part = np.divmod(np.arange(first, min(first + _BLOCK, total)), parts)
        left, length = knots[piece], np.diff(knots)[piece]
        start = left + length * (part / parts)
        end = np.where(part == parts - 1, knots[piece + 1], left + length * ((part + 1) / parts))
        turn = _turns(curve, order, start, end)
        t = np.concatenate([start, end, turn])
        values = [curve.derivative(start, order), curve.derivative(end, order, before=True)]
        ordered = np.argsort(t, kind="stable")
        yield t[ordered], np.concatenate([*values, curve.derivative(turn, order)])[ordered]


def _turns(curve: Curve, order: int, start: Array, end: Array) -> Array:
    """Zeros of the next derivative in those parts in which its sign changes."""
    first = curve.derivative(start, order + 1)
    last = curve.derivative(end, order + 1, before=True)
    changes = np.where(first > 0.0, last < 0.0, last > 0.0)
    low, high, first, last = start[changes], end[changes], first[changes], last[changes]
    rising = first > 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        value = curve.derivative(middle, order + 1)
        before = (value > 0.0) == rising
        low, first = np.where(before, middle, low), np.where(before, value, first)
        high, last = np.where(before, high, middle), np.where(before, last, value)
    # In a part of 1e-9 of what it was the curve is straight to the last digit. Of opposite signs: no division by zero,
    # but for a zero that was met exactly.
    share = np.divide(first, first - last, out=np.full_like(first, 0.5), where=first != last)
    return np.asarray(low + np.clip(share, 0.0, 1.0) * (high - low))


def violations(trajectory: Trajectory, robot: Robot) -> list[Violation]:
    """Limits of position, velocity, acceleration and jerk that a motion exceeds, base to tip.

    A joint that leaves a range on both sides is listed twice. Touching a limit up to rounding is allowed.

    Raises
    ------
    ShapeError
        If the motion has another number of joints than the robot.
    """
    if trajectory.dof != robot.dof:
        raise ShapeError(f"a motion of {trajectory.dof} joints for a robot of {robot.dof}")
    out = []
    for j, (joint, curve) in enumerate(zip(robot.joints, trajectory.curves, strict=True)):
        for order, quantity in enumerate(QUANTITIES):
            limit = getattr(joint.limits, quantity)
            if limit is None:
                continue
            found = extremes(curve, order)
            allowed = ALLOWED_EXCESS * (1.0 + max(abs(limit[0]), abs(limit[1])))
            if found.low < limit[0] - allowed:
                out.append(Violation(j, quantity, limit, found.low, found.low_time))
            if found.high > limit[1] + allowed:
                out.append(Violation(j, quantity, limit, found.high, found.high_time))
    return out
