r"""Inverse-dynamics control, ``id``. [D] 2.5.1, (2.28)-(2.31).

.. math:: u = M(q)\,y + c(q, \dot q) + f(\dot q) + g(q), \qquad
          y = \ddot q_d + K_D \dot e + K_P e + K_I \int e \, dt

with K_P = w^2 and K_D = 2 z w for the natural frequency w and the damping ratio z. ([D] prints K_P = w.)
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

GAINS = ("frequency", "damping", "integral")


class InverseDynamics:
    """Gains: ``frequency`` [rad/s], ``damping`` [-], ``integral`` K_I [1/s^3]; [D] 2.6.4 has 35, 0.65 and none."""

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(GAINS)
        frequency, damping = task.gain("frequency", 35.0), task.gain("damping", 0.65)
        self._task = task
        self._kp, self._kd = frequency**2, 2.0 * damping * frequency
        self._ki = task.gain("integral", 0.0) * task.period
        self._sum = np.zeros(task.model.dof)

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e = desired.q - q
        self._sum += e
        y = desired.ddq + self._kd * (desired.dq - dq) + self._kp * e + self._ki * self._sum
        return self._task.model.inverse_dynamics(q, dq, y) + self._task.friction(dq, desired.dq)
