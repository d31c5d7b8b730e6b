r"""Passivity-based control, ``pb``, and with adaptive friction compensation, ``pb-afc``. [D] 2.5.1, (2.32)-(2.39).

.. math:: u = M(q)\,\ddot q_a + C(q, \dot q)\,\dot q_a + f(\dot q) + g(q) + \Lambda r + K_I \int r\,dt

with dq_a = dq_d + K_r e and r = dq_a - dq. The adaptive form replaces f by the estimate
beta_v dq + beta_c sgn(dq), whose parameters follow

.. math:: \dot{\hat\beta} = K_\beta^{-1}\, Y(\dot q)^T r .

([D] (2.39) prints neither the term Lambda r nor the minus of its right-hand side; the law itself is right.)
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

GAINS = ("error", "damping", "integral")
ADAPTIVE_GAINS = (*GAINS, "adaptation", "viscous_guess", "coulomb_guess")


class PassivityBased:
    """Gains: ``error`` K_r [1/s], ``damping`` Lambda [N m s/rad] ([D] 2.6.4: 42 each), ``integral`` K_I [N m/rad]."""

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(self.gains())
        self._task = task
        self._kr, self._damping = task.gain("error", 42.0), task.gain("damping", 42.0)
        self._ki = task.gain("integral", 0.0) * task.period
        self._sum = np.zeros(task.model.dof)

    @staticmethod
    def gains() -> tuple[str, ...]:
        """Names of the gains."""
        return GAINS

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        dq_a = desired.dq + self._kr * (desired.q - q)
        ddq_a = desired.ddq + self._kr * (desired.dq - dq)
        r = dq_a - dq
        self._sum += r
        rigid = self._task.model.passivity_dynamics(q, dq, dq_a, ddq_a)
        return rigid + self._friction(dq, desired.dq, r) + self._damping * r + self._ki * self._sum

    def _friction(self, dq: Array, desired_dq: Array, r: Array) -> Array:
        return self._task.friction(dq, desired_dq)


class AdaptivePassivityBased(PassivityBased):
    """The same with friction parameters that are learned while moving.

    Further gains: ``adaptation`` K_beta ([D] 2.6.4: 1; smaller learns faster), ``viscous_guess`` and ``coulomb_guess``,
    where learning starts (the nominal friction). Friction is that at the measured velocity.
    """

    def __init__(self, task: ControlTask) -> None:
        super().__init__(task)
        model = task.model
        self._step = task.period / task.gain("adaptation", 1.0)
        self.viscous = task.gain("viscous_guess", tuple(model.viscous.tolist()))
        self.coulomb = task.gain("coulomb_guess", tuple(model.coulomb.tolist()))

    @staticmethod
    def gains() -> tuple[str, ...]:
        """Names of the gains."""
        return ADAPTIVE_GAINS

    def _friction(self, dq: Array, desired_dq: Array, r: Array) -> Array:
        sign = self._task.sign(dq)
        self.viscous = self.viscous + self._step * dq * r
        self.coulomb = self.coulomb + self._step * sign * r
        return np.asarray(self.viscous * dq + self.coulomb * sign)
