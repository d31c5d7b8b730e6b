"""How much of its limit a motion uses at each instant, for many factors: what pictures show."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_extremes import QUANTITIES
from modrob_cli.scaling.scaled_torque import TorqueRanges, bounds_at


def limit_use(torques: TorqueRanges, limits: tuple[Array, Array], c: Array) -> tuple[Array, Array]:
    """Largest part of a torque limit that some admissible parameters use, and which joint it is, shape (C, T) each.

    Parameters
    ----------
    limits : lower and upper, shape (n,) each;  c : factors, shape (C,)
    """
    ends = np.maximum(np.stack([limits[1], -limits[0]]), np.finfo(float).tiny)[..., None]
    use, joint = [], []
    for factor in c:
        with np.errstate(over="ignore"):  # a limit of zero that is broken
            parts = (bounds_at(torques, float(factor)) / ends).max(axis=0)
        use.append(parts.max(axis=0))
        joint.append(parts.argmax(axis=0))
    return np.stack(use), np.stack(joint)


def speed_use(robot: Robot, trajectory: Trajectory, t: Array, c: Array) -> tuple[Array, Array]:
    """The same for limits of velocity, acceleration and jerk."""
    x = trajectory.sample(t, 3)
    use = np.zeros((len(c), len(t)))
    which = np.zeros((len(c), len(t)), dtype=int)
    for j, joint in enumerate(robot.joints):
        for order, quantity in enumerate(QUANTITIES[1:], start=1):
            limits = getattr(joint.limits, quantity)
            if limits is None:
                continue
            low, high = min(limits[0], -np.finfo(float).tiny), max(limits[1], np.finfo(float).tiny)
            own = np.maximum(x[:, order, j] / high, x[:, order, j] / low)
            part = c[:, None] ** order * own
            which = np.where(part > use, j, which)
            use = np.maximum(use, part)
    return use, which
