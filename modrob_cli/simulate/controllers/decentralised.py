r"""Control joint by joint: ``pid``, and with the whole model as feed-forward, ``feedforward-pd``. [D] 2.6.4.

.. math:: u = J\,\ddot q_d + f(\dot q_d) + K_D \dot e + K_P e + K_I \int e\,dt
          \qquad\text{and}\qquad
          u = M(q_d)\,\ddot q_d + c(q_d, \dot q_d) + g(q_d) + f + K_D \dot e + K_P e

with one inertia J for each joint. ``pid`` takes each axis for its actuator alone, J and the viscous friction b. Gains

.. math:: K_D = 2 z w J, \qquad K_P = w^2 J + 2 z w b, \qquad K_I = w^2 b

make its error follow (J s + b)(s^2 + 2 z w s + w^2) = 0: the integral part cancels the pole of the motor, and a
second-order system of the chosen frequency w and damping ratio z is left (the position and velocity feedback of
Siciliano and others, Robotics, 8.3.1, to which [D] refers). Couplings, gravity and the inertia of the links are left
to be rejected.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.integral import Integral
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

PID_GAINS = ("frequency", "damping", "integral", "inertia", "kp", "kd", "ki")
FEEDFORWARD_GAINS = ("frequency", "damping", "inertia", "kp", "kd")


class Pid:
    """Gains: ``frequency`` w [rad/s], ``damping`` z [-], ``integral`` K_I/J [1/s^3], ``inertia`` J [kg m^2].

    Left out, the inertia is that of the rotor alone ("the actuator dynamics only"), for joints without one that of
    :meth:`ControlTask.joint_inertia`; the integral is w^2 b / J. ``kp`` [N m/rad], ``kd`` [N m s/rad] and ``ki``
    [N m/(rad s)] replace the formulas.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(PID_GAINS)
        rotors, viscous = task.model.armature, task.model.viscous
        default = rotors if (rotors > 0.0).all() else np.where(rotors > 0.0, rotors, task.joint_inertia())
        self._inertia = _axis_inertia(task, default)
        frequency, damping = _frequency_and_damping(task, 50.0)
        motor = viscous * (2.0 * damping * frequency)
        self._kp = task.gain("kp", self._inertia * frequency**2 + motor, "not negative")
        self._kd = task.gain("kd", 2.0 * self._inertia * damping * frequency, "not negative")
        asked = "integral" in task.control.gains
        integral = self._inertia * task.gain("integral", 0.0, "not negative") if asked else viscous * frequency**2
        self._integral = Integral(task, task.gain("ki", integral, "not negative"))
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e = desired.q - q
        feedback = self._kd * (desired.dq - dq) + self._kp * e + self._integral.value
        command = self._inertia * desired.ddq + feedback + self._task.friction(desired.dq, desired.dq)
        self._integral.add(e, command)
        return np.asarray(command)


class FeedforwardPd:
    """Gains: ``frequency`` [rad/s], ``damping`` [-], ``inertia`` J [kg m^2]; or ``kp``, ``kd`` instead.

    K_P = w^2 J and K_D = 2 z w J. Left out, the inertia is that of :meth:`ControlTask.joint_inertia`.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(FEEDFORWARD_GAINS)
        inertia = _axis_inertia(task, task.joint_inertia())
        frequency, damping = _frequency_and_damping(task, 35.0)
        self._kp = task.gain("kp", inertia * frequency**2, "not negative")
        self._kd = task.gain("kd", 2.0 * inertia * damping * frequency, "not negative")
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        planned = self._task.model.inverse_dynamics(*desired) + self._task.friction(dq, desired.dq)
        return np.asarray(planned + self._kd * (desired.dq - dq) + self._kp * (desired.q - q))


def _frequency_and_damping(task: ControlTask, default: float) -> tuple[Array, Array]:
    return task.gain("frequency", default, "positive"), task.gain("damping", 0.65, "not negative")


def _axis_inertia(task: ControlTask, default: Array) -> Array:
    """Inertia of each axis [kg m^2].

    Raises
    ------
    UsageError
        If it is neither given nor known, and kp and kd are not both given.
    """
    inertia = task.gain("inertia", default, "not negative")
    gains = task.control.gains
    if not (inertia > 0.0).all() and not ("kp" in gains and "kd" in gains):
        names = [joint.name for joint, value in zip(task.model.robot.joints, inertia, strict=True) if not value > 0.0]
        without = f"{', '.join(names)} move without any inertia"
        raise UsageError(f"controller: the gain inertia is missing: {without}; give inertia > 0, or kp and kd")
    return inertia
