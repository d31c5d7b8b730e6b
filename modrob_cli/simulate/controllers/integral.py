"""Integrals over time that do not wind up where a motor is at its limit."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.simulate.controllers.interface import ControlTask


class CommandLimits:
    """The torque and current limits of the robot's file, as a controller knows them."""

    def __init__(self, task: ControlTask) -> None:
        self._low, self._high = torque_limits(task.model.robot)

    def allowed(self, rate: Array, command: Array) -> Array:
        """``rate``, but 0 for the joints whose command is at a limit and that it would push further, shape (n,)."""
        pushes = ((command >= self._high) & (rate > 0.0)) | ((command <= self._low) & (rate < 0.0))
        return np.where(pushes, 0.0, rate)


class Integral:
    """The integral of an error, joint by joint, by conditional integration: it stands still at a torque limit.

    Attributes
    ----------
    value : gain times the sum of all errors before now, times the period, shape (n,)
    """

    def __init__(self, task: ControlTask, gain: Array) -> None:
        self._limits = CommandLimits(task)
        self._step = gain * task.period
        self._used = bool(gain.any())
        self.value = np.zeros(task.model.dof)

    def add(self, error: Array, command: Array) -> None:
        """Go on by one period with this error; ``command`` is the whole torque that was asked for, shape (n,)."""
        if self._used:
            self.value = self.value + self._step * self._limits.allowed(error, command)
