r"""Inverse-dynamics control, ``id``. [D] 2.5.1, (2.28)-(2.31).

.. math:: u = M(q)\,y + c(q, \dot q) + f(\dot q) + g(q), \qquad
          y = \ddot q_d + K_D \dot e + K_P e + K_I \int e \, dt

with K_P = w^2 and K_D = 2 z w for the natural frequency w and the damping ratio z. ([D] prints K_P = w.) With the true
parameters each joint's error follows e'' + K_D e' + K_P e + K_I int e = 0, whatever the arm.
"""

from modrob_cli.arrays import Array
from modrob_cli.simulate.controllers.integral import Integral
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

GAINS = ("frequency", "damping", "integral")


class InverseDynamics:
    """Gains: ``frequency`` [rad/s], ``damping`` [-], ``integral`` K_I [1/s^3]; [D] 2.6.4 has 35, 0.65 and none."""

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(GAINS)
        frequency = task.gain("frequency", 35.0, "positive")
        self._kp = frequency**2
        self._kd = 2.0 * task.gain("damping", 0.65, "not negative") * frequency
        self._integral = Integral(task, task.gain("integral", 0.0, "not negative"))
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e = desired.q - q
        y = desired.ddq + self._kd * (desired.dq - dq) + self._kp * e + self._integral.value
        command = self._task.model.inverse_dynamics(q, dq, y) + self._task.friction(dq, desired.dq)
        self._integral.add(e, command)
        return command
