"""Factors that limits of velocity, acceleration and jerk allow.

At a factor c the k-th derivative of the position is c^k times as large, so a limit L and the extreme x of the planned
motion (from :mod:`modrob_cli.model.trajectory_extremes`) ask for c <= (L / x)^(1/k).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_extremes import QUANTITIES, extremes

Side = Literal["lower", "upper"]
_DOWN = 1.0 - 2.0**-48
"""The power and the quotient may be rounded upward."""


@dataclass(frozen=True)
class SpeedLimit:
    """One side of a joint's range of velocity, acceleration or jerk.

    Attributes
    ----------
    joint : number from 0;  quantity : velocity, acceleration or jerk;  side : of the range
    limit, value : of the quantity, and its extreme at c = 1, [rad/s^k] or [m/s^k];  time : where, [s]
    factor : the largest that the limit allows; infinite where the joint does not move to that side
    """

    joint: int
    quantity: str
    side: Side
    limit: float
    value: float
    time: float
    factor: float


def allowed(limit: float, value: float, order: int) -> float:
    """Largest factor for an extreme on the limit's side; rounded down."""
    if value * np.sign(limit) <= 0.0:
        return float("inf")
    return float((limit / value) ** (1.0 / order)) * _DOWN


def speed_limits(trajectory: Trajectory, robot: Robot) -> list[SpeedLimit]:
    """Every limit of velocity, acceleration and jerk that the robot has, both sides, base to tip."""
    out = []
    for j, (joint, curve) in enumerate(zip(robot.joints, trajectory.curves, strict=True)):
        for order, quantity in enumerate(QUANTITIES):
            limits = getattr(joint.limits, quantity)
            if order == 0 or limits is None:
                continue
            found = extremes(curve, order)
            ends: tuple[tuple[Side, float, float, float], ...] = (
                ("lower", limits[0], found.low, found.low_time),
                ("upper", limits[1], found.high, found.high_time),
            )
            for side, limit, value, time in ends:
                out.append(SpeedLimit(j, quantity, side, limit, value, time, allowed(limit, value, order)))
    return out


def enclosed_factor(robot: Robot, lower: Array, upper: Array) -> tuple[float, Array]:
    """Largest factor that all these limits allow for enclosed motions, and the one of each cell.

    Parameters
    ----------
    lower, upper : of velocity, acceleration and jerk over K cells, shape (3, n, K)

    Returns
    -------
    factor : infinite without limits
    by_cell : shape (K,)
    """
    by_cell = np.full(lower.shape[2], np.inf)
    for j, joint in enumerate(robot.joints):
        for order, quantity in enumerate(QUANTITIES[1:], start=1):
            limits = getattr(joint.limits, quantity)
            for limit, ends, sign in () if limits is None else zip(limits, (lower, upper), (-1.0, 1.0), strict=True):
                reach = np.maximum(sign * ends[order - 1, j], np.finfo(float).tiny)
                with np.errstate(over="ignore"):  # a motion that hardly moves may be run at any speed
                    by_cell = np.minimum(by_cell, (abs(limit) / reach) ** (1.0 / order) * _DOWN)
    return float(by_cell.min()), by_cell
