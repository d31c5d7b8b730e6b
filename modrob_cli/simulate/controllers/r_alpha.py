r"""The r-alpha tracker of Zenieh and Corless, ``r-alpha``. [D] 3.5.2.

.. math:: u = Q r + \frac{\rho\,r}{\|\rho\,r\| + \delta}\,\rho, \qquad
          \rho = \beta_1 \|\ddot q_a\| + \beta_2 \|\dot q_a\| \|\dot q\| + \beta_3,

with dq_a = dq_d + Lambda e, r = dq_a - dq. It follows within a bound r of the error, reached at the rate alpha, if
lambda_min(Lambda) >= alpha, lambda_min(Q) >= alpha beta_1 and delta <= (alpha r)^2 lambda_min(Q) beta_0 / beta_1. No
model is evaluated. ([D] prints the second term without its last factor rho; with it the term dominates every
perturbation up to rho, as the proof of such a controller needs.) Friction is compensated as by the other controllers.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.controllers.classical_robust import robust_constants
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

CONSTANTS = ("least_inertia", "most_inertia", "coriolis", "gravity")
GAINS = ("error", "damping", "rate", "precision", "smoothing", *CONSTANTS)


class RAlphaTracker:
    """Gains: ``error`` Lambda [1/s], ``damping`` Q [N m s/rad], ``rate`` alpha, ``precision`` r, ``smoothing`` delta.

    ``least_inertia`` .. ``gravity`` are beta_0 .. beta_3 of [D] 3.5.2; those left out are estimated by sampling.
    The others are alpha, 1.02 alpha beta_1, 1, 0.01 and 0.8 times the largest delta that is allowed.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(GAINS)
        rate = float(task.gain("rate", 1.0, "positive").min())
        precision = float(task.gain("precision", 0.01, "positive").min())
        self._error = task.gain("error", rate, "positive")
        given = task.gain("damping", 0.0, "not negative")
        least, self._most, self._coriolis, self._gravity = robust_constants(task, CONSTANTS)
        self._damping = given if "damping" in task.control.gains else np.full(task.model.dof, 1.02 * rate * self._most)
        largest = (rate * precision) ** 2 * float(self._damping.min()) * least / max(self._most, 1e-300)
        smoothing = task.gain("smoothing", 0.8 * largest, "not negative")
        self._smoothing = max(float(smoothing.min()), 1e-300)
        self._task = task

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        dq_a = desired.dq + self._error * (desired.q - q)
        ddq_a = desired.ddq + self._error * (desired.dq - dq)
        r = dq_a - dq
        speeds = float(np.sqrt((dq_a @ dq_a) * (dq @ dq)))
        rho = self._most * float(np.sqrt(ddq_a @ ddq_a)) + self._coriolis * speeds + self._gravity
        robust = rho**2 / (rho * float(np.sqrt(r @ r)) + self._smoothing)
        return np.asarray((self._damping + robust) * r + self._task.friction(dq, desired.dq))
