r"""Control joint by joint: ``pid``, and with the whole model as feed-forward, ``feedforward-pd``. [D] 2.6.4.

.. math:: u = J\,(\ddot q_d + K_D \dot e + K_P e + K_I \int e\,dt) + f(\dot q_d)
          \qquad\text{and}\qquad
          u = M(q_d)\,\ddot q_d + c(q_d, \dot q_d) + g(q_d) + f + J\,(K_D \dot e + K_P e)

with one inertia J for each joint, K_P = w^2 and K_D = 2 z w: every axis is treated as a second-order system of its own,
couplings and gravity are left to be rejected.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

PID_GAINS = ("frequency", "damping", "integral", "inertia", "kp", "kd", "ki")
FEEDFORWARD_GAINS = ("frequency", "damping", "inertia", "kp", "kd")

_STATES = 50
"""States along the motion over which the feed-forward controller takes the mean inertia of each joint."""


class Pid:
    """Gains: ``frequency`` [rad/s], ``damping`` [-], ``integral`` [1/s^3], ``inertia`` J [kg m^2]; or kp, kd, ki, u.

    Left out, the inertia is that of the rotor alone ("the actuator dynamics only"), the integral a tenth of what makes
    the axis unstable, w^3 2 z / 10. ``kp``, ``kd``, ``ki`` [N m/rad ...] replace the products with J.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(PID_GAINS)
        frequency, damping = task.gain("frequency", 50.0), task.gain("damping", 0.65)
        integral = task.gain("integral", tuple((0.2 * damping * frequency**3).tolist()))
        self._inertia = _axis_inertia(task, task.model.armature)
        self._kp, self._kd = _proportional_derivative(task, self._inertia, frequency, damping)
        self._ki = task.gain("ki", tuple((self._inertia * integral).tolist())) * task.period
        self._task = task
        self._sum = np.zeros(task.model.dof)

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e = desired.q - q
        self._sum += e
        feedback = self._kd * (desired.dq - dq) + self._kp * e + self._ki * self._sum
        return self._inertia * desired.ddq + feedback + self._task.friction(desired.dq, desired.dq)


class FeedforwardPd:
    """Gains: ``frequency`` [rad/s], ``damping`` [-], ``inertia`` J [kg m^2]; or ``kp``, ``kd`` instead.

    Left out, the inertia of a joint is the mean of its M_ii along the motion.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(FEEDFORWARD_GAINS)
        frequency, damping = task.gain("frequency", 35.0), task.gain("damping", 0.65)
        times = np.linspace(0.0, task.trajectory.duration, _STATES)
        along = [np.diag(task.model.inertia(q)) for q in task.trajectory.sample(times, 0)[:, 0]]
        inertia = _axis_inertia(task, np.mean(along, axis=0))
        self._kp, self._kd = _proportional_derivative(task, inertia, frequency, damping)
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        planned = self._task.model.inverse_dynamics(*desired) + self._task.friction(dq, desired.dq)
        return planned + self._kd * (desired.dq - dq) + self._kp * (desired.q - q)


def _axis_inertia(task: ControlTask, default: Array) -> Array:
    """Inertia of each axis [kg m^2].

    Raises
    ------
    UsageError
        If neither it nor kp is given and the robot knows no rotor inertia.
    """
    inertia = task.gain("inertia", tuple(default.tolist()))
    gains = task.control.gains
    if not (inertia > 0.0).all() and not ("kp" in gains and "kd" in gains):
        names = [joint.name for joint, value in zip(task.model.robot.joints, inertia, strict=True) if not value > 0.0]
        without = f"{', '.join(names)} have no rotor_inertia"
        raise UsageError(f"controller: the gain inertia is missing: {without}; give inertia, or kp and kd")
    return inertia


def _proportional_derivative(
    task: ControlTask, inertia: Array, frequency: Array, damping: Array
) -> tuple[Array, Array]:
    kp = task.gain("kp", tuple((inertia * frequency**2).tolist()))
    kd = task.gain("kd", tuple((2.0 * inertia * damping * frequency).tolist()))
    return kp, kd
