r"""Torque bounds for accelerations that are known to +-tolerance, [ddq] = ddq +- delta. [R] Alg. 1 with [ddq].

For fixed parameters the torque is linear in ddq, so its extremes over the box are at corners: taking the exact range
at each of the 2^n corners is exact. The cheap form adds to the exact range at the midpoint, for each joint k, the
largest |M_jk| over all admissible parameters times delta_k; it is slightly wide, because different parameters may be
the worst.
"""

from itertools import product
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import CHUNK, Prepared, TorqueBounds, exact_bounds, rigid_ranges
from modrob_cli.dynamics.link_motion import by_joint, joint_positions, link_motions, weightless
from modrob_cli.dynamics.margin import rounding_margin, torque_magnitude
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.model.robot import Robot

Method = Literal["corners", "cheap"]


def ddq_bounds(
    robot: Robot, q: Array, dq: Array, ddq: Array, tolerance: Array, method: Method = "corners"
) -> TorqueBounds:
    """Range over all admissible parameters and all accelerations within the tolerance, at each sample.

    Parameters
    ----------
    q, dq, ddq : shape (T, n)
    tolerance : half-widths of ddq, shape (n,), >= 0

    Returns
    -------
    TorqueBounds
        Outward. "corners" is exact and costs up to 2^n exact ranges; "cheap" encloses it and costs about n.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If a tolerance is negative or not finite, or a result is not finite.
    """
    tolerance = np.asarray(tolerance, dtype=float)
    if tolerance.shape != (robot.dof,):
        raise ShapeError(f"tolerance of shape {tolerance.shape} for {robot.dof} joints")
    if not np.all(np.isfinite(tolerance) & (tolerance >= 0.0)):
        raise NumericalError("an acceleration tolerance is negative or not finite")
    return _corners(robot, q, dq, ddq, tolerance) if method == "corners" else _cheap(robot, q, dq, ddq, tolerance)


def _corners(robot: Robot, q: Array, dq: Array, ddq: Array, tolerance: Array) -> TorqueBounds:
    middle = exact_bounds(robot, q, dq, ddq)
    lower, upper = middle.lower, middle.upper
    signs = [(-1.0, 1.0) if width > 0.0 else (0.0,) for width in tolerance]
    for corner in product(*signs):
        bounds = exact_bounds(robot, q, dq, ddq + np.asarray(corner) * tolerance)
        lower = np.minimum(lower, bounds.lower)
        upper = np.maximum(upper, bounds.upper)
    return TorqueBounds(middle.nominal, lower, upper)


def _cheap(robot: Robot, q: Array, dq: Array, ddq: Array, tolerance: Array) -> TorqueBounds:
    middle = exact_bounds(robot, q, dq, ddq)
    prepared = Prepared.of(robot)
    reach = [np.empty((0, robot.dof))]
    for start in range(0, len(q), CHUNK):
        (piece,) = by_joint(robot, q[start : start + CHUNK])
        reach.append(_reach(prepared, piece, tolerance).T)
    more = np.concatenate(reach)
    # One more rounding each, of numbers no larger than the results: a unit in the last place outward.
    return TorqueBounds(
        middle.nominal,
        np.nextafter(middle.lower - more, -np.inf),
        np.nextafter(middle.upper + more, np.inf),
    )


def _reach(prepared: Prepared, q: Array, tolerance: Array) -> Array:
    """Sum over k of max |M_jk| delta_k over all admissible parameters, rounded upward, shape (n, T) for q (n, T)."""
    robot, still = prepared.robot, np.zeros_like(q)
    positions = joint_positions(robot, q)
    total = np.zeros_like(q)
    for k in np.flatnonzero(tolerance):
        unit = still.copy()
        unit[k] = tolerance[k]
        motions = link_motions(positions, still, unit, weightless(q.shape[1]))
        _, low, high = rigid_ranges(prepared, positions, [(1.0, motions)])
        high, low = high.copy(), low.copy()
        armature = prepared.drives[k].armature[1] * tolerance[k]
        high[k] += armature
        magnitude = torque_magnitude(robot, q, still, unit)
        magnitude[k] += armature
        total += np.maximum(np.abs(low), np.abs(high)) + rounding_margin(robot.dof, magnitude)
    return total * (1.0 + 1e-14)
