r"""Classical robust control by Lyapunov's second method, ``cr``. [D] 3.5.1, (3.45).

.. math:: u = M_0\,(\ddot q_d + K_D \dot e + K_P e + \nu) + n_0, \qquad
          \nu = \rho\,z / \max(\|z\|, \delta), \quad z = B^T P\,\xi,

.. math:: \rho = \frac{\alpha\,Q_M + \alpha\,\|(K_P, K_D)\|\,\|\xi\| + B_M\,\eta}{1 - \alpha}.

Unlike the interval controllers it needs numbers that bound the perturbation everywhere; the disturbance's bound is part
of eta here, times B_M ([D] adds beta_d alone, which has another unit).
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.interface import ControlTask, Desired
from modrob_cli.simulate.controllers.interval_inverse_dynamics import lyapunov_rows, second_order
from modrob_cli.simulate.controllers.sampled_constants import sampled_constants

CONSTANTS = ("inverse_inertia", "alpha", "eta", "acceleration")
GAINS = ("frequency", "damping", "weight", "smoothing", *CONSTANTS)


class ClassicalRobust:
    """Gains: ``frequency``, ``damping``, ``weight`` q, ``smoothing`` delta, and the bounds of [D] 3.5.1.

    ``inverse_inertia`` B_M, ``alpha``, ``eta`` [N m], ``acceleration`` Q_M; those that are left out are estimated by
    sampling (:func:`sampled_constants`). The others are 40, 0.9, 1 and 0.04 where left out.

    Raises
    ------
    UsageError
        If alpha is not below 1: then no such control exists.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(GAINS)
        self._kp, self._kd = second_order(task, 40.0, 0.9)
        self._rows = lyapunov_rows(self._kp, self._kd, task.gain("weight", 1.0, "positive"))
        self._smoothing = float(task.gain("smoothing", 0.04, "positive").min())
        B, alpha, eta, Q = robust_constants(task, CONSTANTS)
        if alpha >= 1.0:
            found = f"alpha, the largest norm of 1 - M^-1 M_0, is {alpha:.3g}"
            raise UsageError(f"controller: {found}; cr needs it below 1: expected a nominal robot nearer to the others")
        size = float(np.sqrt(self._kp**2 + self._kd**2).max())
        self._constant, self._slope = (alpha * Q + B * eta) / (1.0 - alpha), alpha * size / (1.0 - alpha)
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e, de = desired.q - q, desired.dq - dq
        z = self._rows[0] * e + self._rows[1] * de
        rho = self._constant + self._slope * float(np.sqrt(e @ e + de @ de))
        nu = rho / max(float(np.sqrt(z @ z)), self._smoothing) * z
        y = desired.ddq + self._kd * de + self._kp * e + nu
        return self._task.model.inverse_dynamics(q, dq, y) + self._task.friction(dq, desired.dq)


def robust_constants(task: ControlTask, names: tuple[str, ...]) -> list[float]:
    """Bounds of uncertain terms by name, from the gains or by sampling; of several values the largest counts."""
    found = {} if all(name in task.control.gains for name in names) else sampled_constants(task)
    return [float(task.gain(name, found.get(name), "not negative").max()) for name in names]
