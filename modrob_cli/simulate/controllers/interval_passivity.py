r"""Interval-arithmetic passivity-based control with guaranteed performance, ``ia-pb``. [D] 3.4.1, [R] (3)-(9).

.. math:: u = M_0\,\ddot q_a + C_0\,\dot q_a + f_0 + g_0 + \big(\kappa(t)\,\|\rho([\Phi])\| + \varphi(t)\big)\,r

with dq_a = dq_d + K_r e, r = dq_a - dq, and

.. math:: \kappa = \kappa_P + \kappa_I \int f\,dt, \quad \varphi = \varphi_P + \varphi_I \int f\,dt, \qquad
          f = \|e\| \text{ where it is at least } \epsilon, \text{ else } 0:

the gains grow until the error stays below epsilon. [D] 3.6.2 advises not to let them grow without need; see
:class:`IntervalPassivityBased`.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.integral import CommandLimits
from modrob_cli.simulate.controllers.interface import ControlTask, Desired, Perturbation
from modrob_cli.simulate.controllers.interval_bounds import PerturbationBounds, worst_norm
from modrob_cli.simulate.controllers.interval_inverse_dynamics import by_inertia

GAINS = ("error", "robustness", "robustness_growth", "damping", "damping_growth", "precision", "after_entry", "chatter")

_SLOW, _MEMORY = 0.01, 0.1
"""The fast part of the command is what changes within the first time [s]; its size is a mean over the second [s]."""


class IntervalPassivityBased:
    """Gains: ``error`` K_r, ``robustness`` kappa_P, ``damping`` phi_P, their ``*_growth``, ``precision`` epsilon.

    Left out, K_r is 30, kappa_P and kappa_I are 2 and epsilon is 0.01, as in [D] 3.5.3, but kappa is less for joints
    that feel less inertia than the others; phi_P and phi_I are 30 times the inertia that the joint feels ([D]: 100
    for its arm). The gains stop growing, after [D] 3.6.2,

    * before the error is below ``precision`` for the first time, if ``after_entry`` is 1 (so where left out; 0: as
      published), so that a wrong start does not wind them up;
    * while the fast part of the command of some joint is larger than ``chatter`` [N m] (0, where left out: never);
    * while a command is at a torque limit and more gain would push it further.

    Attributes
    ----------
    perturbation : [Phi] at the last command
    growth : the integral of f [rad s]
    """

    perturbation: Perturbation

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(GAINS)
        self._kr = task.gain("error", 30.0, "positive")
        share, inertia = by_inertia(task), task.joint_inertia()
        self._robustness = task.gain("robustness", 2.0 * share, "not negative")
        self._robustness_growth = task.gain("robustness_growth", 2.0 * share, "not negative")
        self._damping = task.gain("damping", 30.0 * inertia, "not negative")
        self._damping_growth = task.gain("damping_growth", 30.0 * inertia, "not negative")
        self._precision = float(task.gain("precision", 0.01, "positive").min())
        self._entered = not task.gain("after_entry", 1.0, "not negative").any()
        self._chatter = task.gain("chatter", 0.0, "not negative")
        if (self._robustness + self._damping <= 0.0).any():
            raise UsageError("controller: found robustness and damping of zero, expected one of them > 0")
        self._bounds, self._limits = PerturbationBounds(task), CommandLimits(task)
        self._task = task
        self.growth = 0.0
        self._slow: Array | None = None
        self._power = np.zeros(task.model.dof)

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        e = desired.q - q
        dq_a = desired.dq + self._kr * e
        ddq_a = desired.ddq + self._kr * (desired.dq - dq)
        r = dq_a - dq
        self.perturbation = self._bounds.at(q, dq, dq_a, ddq_a, self._task.friction(dq, desired.dq))
        robustness = self._robustness + self._robustness_growth * self.growth
        damping = self._damping + self._damping_growth * self.growth
        command = self.perturbation.nominal + (robustness * worst_norm(self.perturbation) + damping) * r
        self._grow(e, r, command)
        return np.asarray(command)

    def _grow(self, e: Array, r: Array, command: Array) -> None:
        """Go on by one period."""
        size = float(np.sqrt(e @ e))
        calm = self._is_calm(command)
        if size < self._precision:
            self._entered = True
        elif self._entered and calm and np.array_equal(self._limits.allowed(r, command), r):
            self.growth += self._task.period * size

    def _is_calm(self, command: Array) -> bool:
        """Whether the fast part of the command is small enough. [D] 3.6.2 proposes a Fourier transform for this."""
        if not self._chatter.any():
            return True
        period = self._task.period
        self._slow = command if self._slow is None else self._slow
        self._slow = self._slow + min(period / _SLOW, 1.0) * (command - self._slow)
        fast = (command - self._slow) ** 2
        self._power = self._power + min(period / _MEMORY, 1.0) * (fast - self._power)
        return not ((self._chatter > 0.0) & (self._power > self._chatter**2)).any()
