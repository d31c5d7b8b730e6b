r"""Interval-arithmetic inverse-dynamics control, ``ia-id``. [D] 3.4.1, (3.3), (3.17).

.. math:: u = M_0\,y + n_0 - \nu, \qquad y = \ddot q_d + K_D \dot e + K_P e, \qquad
          \nu = -\kappa_P\,\|\rho([\Phi])\|^2\,B^T P\,\xi, \qquad \xi = (e, \dot e),

with K_P = w^2, K_D = 2 z w, and A'P + PA = -Q for Q = q 1. The error ends in a ball whose radius shrinks as 1 / sqrt(
kappa_P) (3.21); the law is continuous.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.controllers.interface import ControlTask, Desired, Perturbation
from modrob_cli.simulate.controllers.interval_bounds import PerturbationBounds, worst_norm

GAINS = ("frequency", "damping", "robustness", "weight")


class IntervalInverseDynamics:
    """Gains: ``frequency`` w [rad/s], ``damping`` z [-], ``robustness`` kappa_P, ``weight`` q.

    Left out they are 40, 0.9, 3.5 and 1, those of [D] 3.5.3; ``robustness`` is less for joints that feel less inertia
    than the others (:func:`by_inertia`).

    Attributes
    ----------
    perturbation : [Phi] at the last command
    """

    perturbation: Perturbation

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(GAINS)
        self._kp, self._kd = second_order(task, 40.0, 0.9)
        self._rows = lyapunov_rows(self._kp, self._kd, task.gain("weight", 1.0, "positive"))
        self._robustness = task.gain("robustness", 3.5 * by_inertia(task), "not negative")
        self._bounds = PerturbationBounds(task)
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e, de = desired.q - q, desired.dq - dq
        y = desired.ddq + self._kd * de + self._kp * e
        self.perturbation = self._bounds.at(q, dq, dq, y, self._task.friction(dq, desired.dq))
        z = self._rows[0] * e + self._rows[1] * de
        return np.asarray(self.perturbation.nominal + self._robustness * worst_norm(self.perturbation) ** 2 * z)


def by_inertia(task: ControlTask) -> Array:
    """Inertia that each joint feels over the largest of them, shape (n,): how gains on torques may differ.

    With one gain for all joints, a light wrist would be unstable at rates at which the shoulder needs that gain.
    """
    inertia = task.joint_inertia()
    largest = float(inertia.max())
    return np.asarray(inertia / largest) if largest > 0.0 else np.ones_like(inertia)


def second_order(task: ControlTask, frequency: float, damping: float) -> tuple[Array, Array]:
    """K_P = w^2 and K_D = 2 z w from the gains ``frequency`` and ``damping``, shape (n,) each."""
    w = task.gain("frequency", frequency, "positive")
    return w**2, 2.0 * task.gain("damping", damping, "positive") * w


def lyapunov_rows(kp: Array, kd: Array, weight: Array) -> tuple[Array, Array]:
    """B'P xi = first e + second de, joint by joint, for A'P + PA = -weight 1. [D] (3.12), (3.13)."""
    first = 0.5 * weight / kp
    return first, (0.5 * weight + first) / kd
