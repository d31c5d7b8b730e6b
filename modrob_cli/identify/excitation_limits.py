"""Limits of exciting motions, and steps that keep them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import drive_nominal
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.errors import NumericalError
from modrob_cli.identify.excitation_series import FourierMotion, RestingSeries
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory_extremes import extremes

GRID_PER_HARMONIC = 24
"""Times at which limits are kept, per harmonic; between them a motion goes beyond by less than 1 % of its range."""

TORQUES_PER_HARMONIC = 200
"""Times per harmonic at which torques are compared with their limits."""


@dataclass(frozen=True)
class MotionLimits:
    """Ranges (lower, upper) of each joint, shape (n, 2); infinite where there is none.

    Joints that move need finite ranges of position and velocity.
    """

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    torque: Array

    @property
    def motion(self) -> tuple[Array, ...]:
        """Ranges of position and its derivatives, by order."""
        return self.position, self.velocity, self.acceleration, self.jerk


class LimitedJoint:
    """The free numbers x of one joint that keep its limits at even times: a polytope."""

    def __init__(self, series: RestingSeries, limits: MotionLimits, joint: int) -> None:
        matrices = series.matrices(GRID_PER_HARMONIC * series.harmonics, 3)
        ranges = [quantity[joint] for quantity in limits.motion]
        rows, bounds = [], []
        for A, (low, high) in zip(matrices, ranges, strict=True):
            if np.isfinite(high):
                rows.append(A)
                bounds.append(np.full(len(A), high))
            if np.isfinite(low):
                rows.append(-A)
                bounds.append(np.full(len(A), -low))
        self.A, self.b = np.vstack(rows), np.concatenate(bounds)

    def inside(self, shape: Array, fraction: float, place: float) -> Array:
        """A motion of the given shape (its first number, the offset, is ignored), as large as a fraction of the limits.

        Parameters
        ----------
        fraction : 0 .. 1, of the largest possible
        place : 0 .. 1, where the offset is between the lowest and highest possible
        """
        offset, sway = self.A[:, 0], self.A[:, 1:] @ shape[1:]
        up, down = offset > 0.5, offset < -0.5  # rows of the upper and lower position limits
        still = ~(up | down)
        room = (self.b[up].min() + self.b[down].min()) / (sway[up].max() + sway[down].max())
        with np.errstate(divide="ignore", invalid="ignore"):
            rates = np.where(sway > 0.0, self.b / sway, np.inf)[still]
        size = fraction * min(room, float(rates.min(initial=np.inf)))
        low, high = -(self.b[down].min() - size * sway[down].max()), self.b[up].min() - size * sway[up].max()
        return np.concatenate([[low + place * (high - low)], size * shape[1:]])

    def best_step(self, x: Array, slope: Array, trust: Array) -> Array:
        """The step d with least slope . d that keeps A (x + d) <= b and |d| <= trust; zero if none is found."""
        from scipy.optimize import linprog

        slack = np.maximum(self.b - self.A @ x, 0.0)
        near = slack < np.abs(self.A) @ trust  # the others cannot be reached
        norm = float(np.abs(slope).max())
        if norm == 0.0:
            return np.zeros_like(x)
        bounds = np.column_stack([-trust, trust])
        found = linprog(slope / norm, self.A[near], slack[near], bounds=bounds, method="highs")
        return np.asarray(found.x) if found.status == 0 else np.zeros_like(x)


def nominal_torque(robot: Robot, motion: FourierMotion) -> Array:
    """Torque of the nominal robot, friction and rotors included, at even times of the period, shape (T, n)."""
    count = TORQUES_PER_HARMONIC * motion.sin.shape[1]
    t = np.arange(count) * (motion.period / count)
    piece = motion.trajectory("motion").motion(t)
    tau = rnea(robot, piece.q, piece.dq, piece.ddq)
    for j, joint in enumerate(robot.joints):
        tau[:, j] += drive_nominal(joint, piece.dq[:, j], piece.ddq[:, j])
    return tau


def within_limits(
    robot: Robot, limits: MotionLimits, motion: FourierMotion, moving: Sequence[int]
) -> tuple[FourierMotion, Array]:
    """Make a motion smaller about its offsets, as little as its exact extremes and the nominal torques ask for.

    Returns
    -------
    motion : within the limits of position, velocity and acceleration; torques at 200 times per harmonic
    factors : on the amplitudes, shape (n,)

    Raises
    ------
    NumericalError
        If the torque limits do not even allow the arm to rest at the offsets.
    """
    factors = np.ones(robot.dof)
    curves = motion.trajectory("motion").curves
    for j in moving:
        for order, ranges in enumerate(limits.motion):
            found, middle = extremes(curves[j], order), motion.offset[j] if order == 0 else 0.0
            for value, limit in (
                (middle - found.low, middle - ranges[j, 0]),
                (found.high - middle, ranges[j, 1] - middle),
            ):
                if value > limit:
                    factors[j] = min(factors[j], max(limit, 0.0) / value)
    if not _torques_beyond(robot, limits, _smaller(motion, factors)).any():
        return _smaller(motion, factors), factors
    heavy = _torques_beyond(robot, limits, _smaller(motion, 0.0 * factors))
    if heavy.any():
        names = ", ".join(joint.name for joint, beyond in zip(robot.joints, heavy, strict=True) if beyond)
        raise NumericalError(
            f"where the motion would be, the arm at rest needs more than the torque limits of {names}; give position "
            "limits where it can be held, or other torque limits"
        )
    low, high = 0.0, 1.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        fits = not _torques_beyond(robot, limits, _smaller(motion, middle * factors)).any()
        low, high = (middle, high) if fits else (low, middle)
    return _smaller(motion, low * factors), low * factors


def _smaller(motion: FourierMotion, factors: Array) -> FourierMotion:
    return replace(motion, sin=motion.sin * factors[:, None], cos=motion.cos * factors[:, None])


def _torques_beyond(robot: Robot, limits: MotionLimits, motion: FourierMotion) -> NDArray[np.bool_]:
    """Which joints' nominal torques leave their range, shape (n,)."""
    tau = nominal_torque(robot, motion)
    return np.asarray(((tau < limits.torque[:, 0]) | (tau > limits.torque[:, 1])).any(axis=0))
