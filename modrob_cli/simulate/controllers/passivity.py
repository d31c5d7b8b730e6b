r"""Passivity-based control, ``pb``, and with adaptive friction compensation, ``pb-afc``. [D] 2.5.1, (2.32)-(2.39).

.. math:: u = M(q)\,\ddot q_a + C(q, \dot q)\,\dot q_a + f(\dot q) + g(q) + \Lambda r + K_I \int r\,dt

with dq_a = dq_d + K_r e, r = dq_a - dq and Christoffel's C. With the true parameters M r' + C r + Lambda r = 0 ([D]
(2.33)). The adaptive form replaces f by the estimate beta_v dq + beta_c sgn(dq), whose parameters follow

.. math:: \dot{\hat\beta} = K_\beta^{-1}\, Y(\dot q)^T r .

Then V = r'M r / 2 + (beta_hat - beta)' K_beta (beta_hat - beta) / 2 falls: dV/dt = -r' Lambda r. ([D] (2.39) lacks the
minus before Y(dq) (beta_hat - beta); the printed law is the right one for it.)
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.integral import CommandLimits, Integral
from modrob_cli.simulate.controllers.interface import ControlTask, Desired

GAINS = ("error", "damping", "integral")
ADAPTIVE_GAINS = (*GAINS, "adaptation", "viscous_guess", "coulomb_guess")

_RATE = 42.0
"""K_r of [D] 2.6.4, and Lambda over inertia where no gain is given [1/s]."""


class PassivityBased:
    """Gains: ``error`` K_r [1/s], ``damping`` Lambda [N m s/rad], ``integral`` K_I [N m/rad].

    Left out, K_r is 42 and Lambda is 42/s times :meth:`ControlTask.joint_inertia`, so that a joint alone has both its
    poles at -42/s whatever the arm; there is no integral.
    """

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(self.gains())
        self._task = task
        self._kr = task.gain("error", _RATE, "positive")
        self._damping = task.gain("damping", _RATE * task.joint_inertia(), "positive")
        self._integral = Integral(task, task.gain("integral", 0.0, "not negative"))

    @staticmethod
    def gains() -> tuple[str, ...]:
        """Names of the gains."""
        return GAINS

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`."""
        dq_a = desired.dq + self._kr * (desired.q - q)
        ddq_a = desired.ddq + self._kr * (desired.dq - dq)
        r = dq_a - dq
        rigid = self._task.model.passivity_dynamics(q, dq, dq_a, ddq_a)
        command = rigid + self._friction(dq, desired.dq) + self._damping * r + self._integral.value
        self._integral.add(r, command)
        self._learn(dq, desired.dq, r, command)
        return command

    def _friction(self, dq: Array, desired_dq: Array) -> Array:
        """Friction that is compensated, shape (n,)."""
        return self._task.friction(dq, desired_dq)

    def _learn(self, dq: Array, desired_dq: Array, r: Array, command: Array) -> None:
        """Change what is known of friction: here not at all."""


class AdaptivePassivityBased(PassivityBased):
    """The same with friction parameters that are learned while moving.

    Further gains: ``adaptation`` K_beta [s^2/(N m) ...] ([D] 2.6.4: 1; smaller learns faster), ``viscous_guess`` and
    ``coulomb_guess``, where learning starts (the nominal friction). Estimates never get negative, and rest while the
    command is beyond a torque limit and they would push it further.

    Attributes
    ----------
    viscous, coulomb : estimates, shape (n,), [N m s/rad] and [N m]
    """

    def __init__(self, task: ControlTask) -> None:
        super().__init__(task)
        if task.control.friction == "none":
            raise UsageError("controller: pb-afc compensates friction; found friction: none, expected measured")
        self._limits = CommandLimits(task)
        self._step = task.period / task.gain("adaptation", 1.0, "positive")
        self.viscous = task.gain("viscous_guess", task.model.viscous, "not negative")
        self.coulomb = task.gain("coulomb_guess", task.model.coulomb, "not negative")

    @staticmethod
    def gains() -> tuple[str, ...]:
        """Names of the gains."""
        return ADAPTIVE_GAINS

    def _friction(self, dq: Array, desired_dq: Array) -> Array:
        velocity = self._task.friction_velocity(dq, desired_dq)
        return np.asarray(self.viscous * velocity + self.coulomb * self._task.sign(velocity))

    def _learn(self, dq: Array, desired_dq: Array, r: Array, command: Array) -> None:
        velocity = self._task.friction_velocity(dq, desired_dq)
        way = self._step * self._limits.allowed(r, command)
        self.viscous = np.maximum(self.viscous + velocity * way, 0.0)
        self.coulomb = np.maximum(self.coulomb + self._task.sign(velocity) * way, 0.0)
