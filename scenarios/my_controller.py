"""A controller of your own: gravity compensation and PD.

    modrob simulate ROBOT TRAJECTORY --controller scenarios/my_controller.py -o run.mcap

modrob runs this file, calls make_controller once for each run and torque for each command. The import of modrob below
is for editors and can be left out. docs/scenarios.md says what a task and its model offer.
"""

import numpy as np

from modrob_cli.simulate.controllers.interface import ControlTask, Desired


class GravityPd:
    """Torque g(q) + kp e + kd de/dt with the gains kp [N m/rad] and kd [N m s/rad]."""

    def __init__(self, task: ControlTask) -> None:
        task.check_gains(["kp", "kd"])  # others are mistakes
        self.model = task.model
        self.kp = task.gain("kp", 3000.0)  # one value for each joint, from the scenario
        self.kd = task.gain("kd", 150.0)

    def torque(self, t: float, q: np.ndarray, dq: np.ndarray, desired: Desired) -> np.ndarray:
        """Motor torque at the joints, shape (n,), from time, measured and desired state (desired.q, .dq, .ddq)."""
        still = np.zeros(self.model.dof)
        gravity = self.model.inverse_dynamics(q, still, still)
        return gravity + self.kp * (desired.q - q) + self.kd * (desired.dq - dq)


def make_controller(task: ControlTask) -> GravityPd:
    """What modrob calls."""
    return GravityPd(task)
