r"""Bounds of what imperfect knowledge of the model does to a closed loop. [D] (3.39), (3.40), [R] (12).

.. math:: w = M\,\ddot q_a + C\,\dot q_a + f + g - (M_0\,\ddot q_a + C_0\,\dot q_a + f_0 + g_0) + d \in [\Phi]

for all admissible parameters and disturbances d, at the measured state. With ``exact`` bounds [Phi] is the range of w
itself and C is Christoffel's; with ``ianea`` it is the published enclosure, and C that of NEA*.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_point import ExactPoint
from modrob_cli.dynamics.ianea_point import IaneaPoint
from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.interface import ControlTask, Perturbation


class PerturbationBounds:
    """[Phi] for one robot, one state after the other.

    Raises
    ------
    UsageError
        If the published bounds are asked for and the task has no parameters of links.
    """

    def __init__(self, task: ControlTask) -> None:
        robot = task.model.robot
        if task.control.bounds == "exact":
            self._point: ExactPoint | IaneaPoint = ExactPoint(robot)
        elif task.links is not None:
            self._point = IaneaPoint(robot, task.links)
        else:
            raise UsageError("controller: bounds: ianea needs interval parameters of the links, found none")

    def at(self, q: Array, dq: Array, dq_a: Array, ddq_a: Array, friction: Array) -> Perturbation:
        """Nominal torque with the compensated friction, and bounds of w, at one state, shape (n,) each."""
        rigid, lower, upper = self._point(q, dq, dq_a, ddq_a)
        nominal = rigid + friction
        return Perturbation(q, dq, dq_a, ddq_a, nominal, lower - nominal, upper - nominal)


def worst_norm(perturbation: Perturbation) -> float:
    """Norm of rho([Phi]), the largest absolute value of each component. [D] (3.7), (3.28)."""
    rho = np.maximum(np.abs(perturbation.lower), np.abs(perturbation.upper))
    return float(np.sqrt(rho @ rho))
