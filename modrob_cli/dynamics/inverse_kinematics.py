r"""Joint motions that move a tool as planned: second-order closed-loop inverse kinematics. [D] 2.5.2, (2.40)-(2.42).

.. math:: \ddot q = J^\dagger(\nu - \dot J \dot q) - \kappa\,(1 - J^\dagger J)\,\dot q, \qquad
          \nu = \begin{pmatrix} \ddot p_r + K_v(\dot p_r - J_p \dot q) + K_p(p_r - p) \\
                \dot\omega_r + K_\omega(\omega_r - J_\omega \dot q) + K_o\,e_o \end{pmatrix}, \qquad
          e_o = \eta\,\epsilon_r - \eta_r\,\epsilon - \epsilon_r \times \epsilon.

([D] prints dJ/dt q in (2.40); it is dJ/dt dq.) Near singularities the pseudo-inverse is damped: singular values s below
``SINGULAR`` count as s / (s^2 + l^2), l^2 = L^2 (1 - (s / SINGULAR)^2), so that accelerations stay bounded and joints
that do not move the tool lose their speed through kappa.
"""

import math
from typing import NamedTuple

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.jacobian import ToolJacobian
from modrob_cli.errors import NumericalError
from modrob_cli.model.robot import Robot
from modrob_cli.model.task import ROWS, Task, quaternion

RATE = 1000.0
"""Steps per second."""
BANDWIDTH = 50.0
"""Deviations vanish as (1 + w t) exp(-w t), w in [1/s]."""
NULL_DAMPING = 20.0
"""kappa [1/s]."""
SETTLE = 0.5
"""Wait at the end, in which joints come to rest [s]."""
SINGULAR, DAMPING = 0.015, 0.03
"""Singular values of J [m and 1] from which on it is damped, and L."""
_FASTEST = 1e3


class JointMotion(NamedTuple):
    """Samples of a joint motion, and how well the tool follows.

    Attributes
    ----------
    t : shape (T,), [s];  q, dq, ddq : shape (T, n)
    position_error, orientation_error : shape (T,), [m] and [rad]; of ``position`` tasks the latter is 0
    least_singular : smallest singular value of the rows that count, shape (T,)
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    position_error: Array
    orientation_error: Array
    least_singular: Array


class _Solver:
    """Accelerations (2.40) for one task, and how far off the tool is."""

    def __init__(self, robot: Robot, task: Task, t: Array) -> None:
        self._jacobian, self._rows = ToolJacobian(robot), ROWS[task.rows]
        self._plan = task.tool_motion(self._jacobian(task.q0, np.zeros(robot.dof)).T, t)
        self._wanted = [quaternion(R) for R in self._plan.R]

    def __call__(self, k: int, q: Array, dq: Array) -> tuple[Array, tuple[float, float, float]]:
        """At sample k: ddq (n,), and position error [m], orientation error [rad], smallest singular value."""
        plan, rows = self._plan, self._rows
        T, J, dJ = self._jacobian(q, dq)
        speed = J @ dq
        off = orientation_error(self._wanted[k], quaternion(T[:3, :3]))
        linear = plan.ddp[k] + 2.0 * BANDWIDTH * (plan.dp[k] - speed[:3]) + BANDWIDTH**2 * (plan.p[k] - T[:3, 3])
        # e_o is half the angle that is missing, for small ones
        turning = plan.alpha[k] + 2.0 * BANDWIDTH * (plan.omega[k] - speed[3:]) + 2.0 * BANDWIDTH**2 * off
        nu = np.concatenate([linear, turning])[:rows] - (dJ @ dq)[:rows]
        inverse, least = damped_inverse(J[:rows])
        ddq = inverse @ nu - NULL_DAMPING * (dq - inverse @ speed[:rows])
        angle = 2.0 * math.asin(min(math.hypot(*off), 1.0)) if rows == ROWS["pose"] else 0.0
        return ddq, (math.dist(plan.p[k], T[:3, 3]), angle, least)


def joint_motion(robot: Robot, task: Task, rate: float = RATE) -> JointMotion:
    """Solve the inverse kinematics over time from ``task.q0`` on, where the arm is at rest.

    The tool waits for ``SETTLE`` seconds after the last move; what velocity is left then counts as none. Between
    samples accelerations are taken as straight lines, so that positions, velocities and accelerations fit together.

    Raises
    ------
    NumericalError
        If joints get absurdly fast.
    """
    steps = max(math.ceil((task.duration + SETTLE) * rate - 1e-6), 1)
    h = 1.0 / rate
    t: Array = np.asarray(np.arange(steps + 1) * h, dtype=float)
    solve = _Solver(robot, task, np.minimum(t, task.duration))
    out, errors = np.zeros((steps + 1, 3, robot.dof)), np.zeros((steps + 1, 3))
    q, dq = np.array(task.q0), np.zeros(robot.dof)
    ddq, errors[0] = solve(0, q, dq)
    for k in range(steps + 1):
        out[k] = q, dq, ddq
        if not (ddq @ ddq < (_FASTEST * rate) ** 2 and dq @ dq < _FASTEST**2):
            raise NumericalError(f"{task.name}: joints of {robot.name} get absurdly fast at t = {t[k]:.4g} s")
        if k < steps:
            ahead, errors[k + 1] = solve(k + 1, q + h * dq + 0.5 * h * h * ddq, dq + h * ddq)
            q = q + h * dq + h * h / 6.0 * (2.0 * ddq + ahead)
            dq, ddq = dq + 0.5 * h * (ddq + ahead), ahead
    out[-1, 1:] = 0.0
    return JointMotion(t, out[:, 0], out[:, 1], out[:, 2], errors[:, 0], errors[:, 1], errors[:, 2])


def orientation_error(wanted: Array, found: Array) -> Array:
    """e_o of two unit quaternions, shape (3,): sin of half the missing angle times its axis, the short way. (2.42)."""
    if wanted @ found < 0.0:
        found = -found
    n, a, b, c = found.tolist()
    m, x, y, z = wanted.tolist()
    return np.array([n * x - m * a - y * c + z * b, n * y - m * b - z * a + x * c, n * z - m * c - x * b + y * a])


def damped_inverse(J: Array) -> tuple[Array, float]:
    """Pseudo-inverse of J (m, n), damped near singularities, shape (n, m), and the smallest singular value."""
    U, s, V = np.linalg.svd(J, full_matrices=False)
    damping = np.where(s < SINGULAR, DAMPING**2 * (1.0 - (s / SINGULAR) ** 2), 0.0)
    least = float(s[-1]) if J.shape[0] <= J.shape[1] else 0.0
    return np.asarray(V.T * (s / (s * s + damping)) @ U.T), least
