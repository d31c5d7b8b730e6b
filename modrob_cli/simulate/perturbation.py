"""The true perturbation of a run, beside the bounds that the controller had of it."""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler_star import rnea_star
from modrob_cli.model.scenario import BoundsMethod
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import Perturbation
from modrob_cli.simulate.truth import TrueRobot


def perturbation_columns(
    truth: TrueRobot, bounds: BoundsMethod, perturbations: Sequence[Perturbation]
) -> dict[str, Array]:
    """What a controller did not know of the model, shape (K, n) each, [N m] or [N]. [D] (3.6), (3.26).

    ``perturbation`` is the torque of the true robot at the state, auxiliary velocity and acceleration of the command,
    with its friction at the measured velocity and its constant disturbance, minus the nominal torque; contacts and
    random disturbances are no part of it. ``phi_lower`` and ``phi_upper`` are the controller's bounds. Nothing
    where the controller has none.

    Parameters
    ----------
    bounds : decides the factorisation of C, as in the controller
    """
    if not perturbations:
        return {}
    q, dq, dq_a, ddq_a, nominal, lower, upper = (np.array(part) for part in zip(*perturbations, strict=True))
    model = ControlModel(truth.robot)
    if bounds == "ianea":
        torque = rnea_star(truth.robot, q, dq, dq_a, ddq_a) + model.armature * ddq_a
    else:
        states = zip(q, dq, dq_a, ddq_a, strict=True)
        torque = np.array([model.passivity_dynamics(*state) for state in states])
    torque = torque + model.viscous * dq + model.coulomb * np.sign(dq) + truth.offset
    return {"perturbation": torque - nominal, "phi_lower": lower, "phi_upper": upper}


def violations(perturbation: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """For each joint the number of samples outside the bounds, and how far outside at most [N m] or [N], shape (n,)."""
    beyond = np.maximum(np.maximum(lower - perturbation, perturbation - upper), 0.0)
    return np.count_nonzero(beyond > 0.0, axis=0), beyond.max(axis=0, initial=0.0)
