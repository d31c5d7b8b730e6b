"""Bounds of uncertain terms of the dynamics, estimated by sampling, for controllers that need such numbers. [D] 3.5."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.joint import Joint
from modrob_cli.model.scenario import Truth
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import ControlTask
from modrob_cli.simulate.truth import true_robot

_MEMBERS, _STATES = 48, 24
"""Robots drawn from the box, half of them from its vertices, and states for each of them."""
_TIMES = 200
_FASTER = 1.5
"""States are sampled up to this multiple of the largest planned velocity of each joint."""


def sampled_constants(task: ControlTask) -> dict[str, float]:
    """Estimates over random robots of the box at random states.

    States: positions within the joints' limits (where there are none a whole turn, or of prismatic joints the planned
    range), velocities up to 1.5 times the planned ones. Always the same samples. Estimates are too small by what the
    samples miss.

    Returns
    -------
    constants : largest norm of M^-1 (``inverse_inertia``), of 1 - M^-1 M_0 (``alpha``) and of n_0 - n (``eta``), the
        largest planned norm of ddq (``acceleration``), the least and the largest eigenvalue of M (``least_inertia``,
        ``most_inertia``), the largest norm of C(q, dq) / norm(dq) (``coriolis``), and that of gravity and friction that
        is not compensated (``gravity``)
    """
    rng = np.random.default_rng(0)
    model, motion = task.model, task.trajectory
    planned = motion.sample(np.linspace(0.0, motion.duration, _TIMES), 2)
    speeds = _FASTER * np.abs(planned[:, 1]).max(axis=0) + 1e-3
    low, high = np.array([_range(*pair) for pair in zip(model.robot.joints, planned[:, 0].T, strict=True)]).T
    found: dict[str, list[float]] = {}
    for k in range(_MEMBERS):
        draw = Truth(draw="vertices" if k % 2 else "uniform")
        truth = true_robot(model.robot, draw, rng)
        member = ControlModel(truth.robot)
        for _ in range(_STATES):
            q, dq = rng.uniform(low, high), rng.uniform(-speeds, speeds)
            for name, value in _at(task, member, truth.offset, q, dq).items():
                found.setdefault(name, []).append(value)
    largest = {name: max(values) for name, values in found.items() if name != "least_inertia"}
    acceleration = float(np.linalg.norm(planned[:, 2], axis=1).max())
    return {**largest, "least_inertia": min(found["least_inertia"]), "acceleration": acceleration}


def _range(joint: Joint, planned: Array) -> tuple[float, float]:
    """Positions that are sampled."""
    if joint.limits.position is not None:
        return joint.limits.position
    return (-np.pi, np.pi) if joint.type == "revolute" else (float(planned.min()), float(planned.max()))


def _at(task: ControlTask, member: ControlModel, offset: Array, q: Array, dq: Array) -> dict[str, float]:
    model, still = task.model, np.zeros(len(q))
    M, M_0 = member.inertia(q), model.inertia(q)
    sizes = np.linalg.eigvalsh(M)
    friction = member.viscous * dq + member.coulomb * np.sign(dq) + offset - task.friction(dq, dq)
    bias = member.inverse_dynamics(q, dq, still) - model.inverse_dynamics(q, dq, still) + friction
    gravity = member.inverse_dynamics(q, still, still) + friction
    return {
        "inverse_inertia": 1.0 / float(sizes[0]),
        "alpha": float(np.linalg.norm(np.eye(len(q)) - np.linalg.solve(M, M_0), 2)),
        "eta": float(np.linalg.norm(bias)),
        "least_inertia": float(sizes[0]),
        "most_inertia": float(sizes[-1]),
        "coriolis": float(np.linalg.norm(member.coriolis(q, dq), 2) / np.linalg.norm(dq)),
        "gravity": float(np.linalg.norm(gravity)),
    }
