r"""How much a motion tells about the parameters of a robot, and how that changes with the motion.

The information matrix of the base parameters (friction included) is :math:`M = \frac1T \sum_t W_t' S^{-2} W_t`, with
S the expected size of each joint's torque, to which the residual is taken to be proportional. Two measures are offered:

* ``log-det``: :math:`-\ln\det M`, the D-optimality of J. Swevers et al., "Optimal robot excitation and identification",
  IEEE Trans. Robotics and Automation 13 (1997), section III: the volume of the confidence ellipsoid. It does not
  depend on the units of the parameters;
* ``condition``: :math:`\ln` of the condition number of S^-1 W with columns of equal length (M. Gautier, W. Khalil,
  "Exciting trajectories for the identification of base inertial parameters", IJRR 11 (1992)).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.base_columns import complete_regressor, nominal_values
from modrob_cli.identify.base_parameters import BaseModel
from modrob_cli.model.robot import Robot

Measure = Literal["log-det", "condition"]

STEP = 1e-5
"""Half-width of the central difference in q, [rad] or [m]: error about 1e-10 of the regressor's size."""
RATE_STEP = 1e-3
"""Half-width of the central difference in dq, [rad/s] or [m/s]."""

_SINGULAR = 1e-14
"""Eigenvalues and pivots of the normalised information matrix up to here are rounding."""

_AHEAD = 2.0
"""The unfavourable side of the friction begins this many soft widths before the reversal."""


@dataclass(frozen=True)
class Information:
    """The measure as a function of states of all joints.

    Attributes
    ----------
    model : base parameters that the motion is to tell
    scale : expected size of each joint's torque, shape (n,), [N m] or [N]
    soft : velocity over which the sign of the friction changes, shape (n,); a step would have no derivative
    torque_limits : shape (n, 2); infinite where none;  strength : of the penalty for going beyond
    """

    robot: Robot
    model: BaseModel
    measure: Measure
    scale: Array
    soft: Array
    torque_limits: Array
    strength: float = 1e4

    def columns(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Complete regressor with a soft sign, shape (T, n, C)."""
        W = complete_regressor(self.robot, q, dq, ddq)
        n = self.robot.dof
        W[:, range(n), range(11 * n, 12 * n)] = np.tanh(dq / self.soft)
        return W

    def matrix(self, W: Array) -> Array:
        """Information matrix (p, p) of a complete regressor."""
        rows = (self.model.regressor(W) / self.scale[:, None]).reshape(-1, self.model.count)
        return np.asarray(rows.T @ rows / len(W))

    def value(self, q: Array, dq: Array, ddq: Array) -> float:
        """Measure plus penalty of torque limits; smaller is better; infinite without full rank."""
        W = self.columns(q, dq, ddq)
        return measure_of(self.matrix(W), self.measure)[0] + self._penalty(W, dq)[0]

    def penalty(self, q: Array, dq: Array, ddq: Array) -> float:
        """Penalty of torque limits alone; 0 if they are kept."""
        return self._penalty(self.columns(q, dq, ddq), dq)[0]

    def gradient(self, q: Array, dq: Array, ddq: Array) -> tuple[float, tuple[Array, Array, Array]]:
        """Value, and its derivatives with respect to q, dq and ddq, each of shape (T, n).

        The regressor is linear in ddq and quadratic in dq, so that differences are exact there, the sign aside.
        """
        W = self.columns(q, dq, ddq)
        value, slope = measure_of(self.matrix(W), self.measure)
        penalty, torque_slope, friction_slope = self._penalty(W, dq)
        G = torque_slope[:, :, None] * nominal_values(self.robot)
        rows = self.model.regressor(W) / self.scale[:, None] ** 2
        G[:, :, self.model.grouping.independent] += 2.0 / len(W) * rows @ slope
        by_q, by_dq, by_ddq = self._states_slope(G, W, (q, dq, ddq))
        return value + penalty, (by_q, by_dq + friction_slope, by_ddq)

    def _states_slope(self, G: Array, W: Array, states: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        """Derivatives of sum(G W) with respect to the states, from regressors at shifted states in one batch."""
        count, n = states[0].shape
        shifts = [(0, STEP), (0, -STEP), (1, RATE_STEP), (1, -RATE_STEP), (2, 1.0)]
        stacked = [np.tile(x, (len(shifts) * n, 1)).reshape(len(shifts), n, count, n) for x in states]
        for s, (which, size) in enumerate(shifts):
            stacked[which][s, range(n), :, range(n)] += size
        moved = self.columns(*(x.reshape(-1, n) for x in stacked)).reshape(len(shifts), n, *W.shape)
        sums = np.einsum("sjtic,tic->stj", moved, G, optimize=True)
        here = np.einsum("tic,tic->t", W, G)[:, None]
        return (sums[0] - sums[1]) / (2.0 * STEP), (sums[2] - sums[3]) / (2.0 * RATE_STEP), sums[4] - here

    def _penalty(self, W: Array, dq: Array) -> tuple[float, Array, Array]:
        """Penalty of torques of the nominal robot beyond their limits, its derivatives by torque and by dq (T, n).

        Around a reversal the Coulomb friction is taken on its unfavourable side, because the true sign is no soft one.
        """
        joints = self.robot.joints
        coulomb = np.array([float(joint.friction.coulomb.nominal) for joint in joints])
        tau = W @ nominal_values(self.robot) - coulomb * np.tanh(dq / self.soft)
        ahead, behind = np.tanh(dq / self.soft + _AHEAD), np.tanh(dq / self.soft - _AHEAD)
        low, high = self.torque_limits[:, 0], self.torque_limits[:, 1]
        size = np.where(np.isfinite(high - low), 0.5 * (high - low), 1.0)
        above = np.maximum(tau + coulomb * ahead - high, 0.0) / size
        below = np.maximum(low - tau - coulomb * behind, 0.0) / size
        strength = self.strength / len(W)
        slope = 2.0 * strength * (above - below) / size
        true = 1.0 - np.tanh(dq / self.soft) ** 2
        bend = above * (1.0 - ahead**2 - true) - below * (1.0 - behind**2 - true)
        by_dq = 2.0 * strength / size * coulomb / self.soft * bend
        return float(strength * (above**2 + below**2).sum()), slope, by_dq


def measure_of(M: Array, measure: Measure) -> tuple[float, Array]:
    """Measure of an information matrix (p, p) and its derivative (p, p)."""
    d = np.sqrt(np.diag(M))
    if not (d > 0.0).all():
        return np.inf, np.zeros_like(M)
    normal = M / np.outer(d, d)
    if measure == "log-det":
        try:
            root = np.linalg.cholesky(normal)
        except np.linalg.LinAlgError:
            return np.inf, np.zeros_like(M)
        if not np.diag(root).min() ** 2 > _SINGULAR:
            return np.inf, np.zeros_like(M)
        inverse = np.linalg.inv(root)
        value = -2.0 * float(np.log(np.diag(root)).sum() + np.log(d).sum())
        return value, -(inverse.T @ inverse) / np.outer(d, d)
    values, vectors = np.linalg.eigh(normal)
    if not values[0] > _SINGULAR:
        return np.inf, np.zeros_like(M)
    first, last = vectors[:, -1], vectors[:, 0]
    H = 0.5 * (np.outer(first, first) / values[-1] - np.outer(last, last) / values[0])
    slope = H / np.outer(d, d) - np.diag((H * normal).sum(axis=1) / d**2)
    return float(0.5 * np.log(values[-1] / values[0])), slope


def condition(M: Array) -> float:
    """Condition number of the regressor with columns of equal length, from its information matrix."""
    return float(np.exp(measure_of(M, "condition")[0]))
