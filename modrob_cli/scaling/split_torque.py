r"""The published split of the torque, [S] (10)-(12): c^2 [tau_a] + c [tau_b] + [tau_p], each part an interval.

Interval ranges of the two parts of the rigid bodies by IANEA*. They share parameters (a payload's mass is in both), so
their sum is wider than the range of the torque. The same form as ``ScaledTorques``, with an R that is linear in c^2.
"""

from dataclasses import replace

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.dynamics.exact_bounds import Prepared
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.dynamics.link_motion import by_joint
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot
from modrob_cli.scaling.scaled_torque import drive_polynomial


class SplitTorques:
    """Published ranges of the torque at T samples of a motion, for any factor.

    Parameters
    ----------
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives at c = 1
    links : interval parameters of the links

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    """

    def __init__(self, robot: Robot, q: Array, dq: Array, ddq: Array, links: LinkBoxes) -> None:
        still = np.zeros_like(q)
        bare = _bodies_alone(robot)
        static = ianea(bare, q, still, still, links)
        dynamic = ianea(replace(bare, gravity=np.zeros(3)), q, dq, ddq, links)
        self._static, self._dynamic = (np.stack([part.upper.T, -part.lower.T]) for part in (static, dynamic))
        speed, push = by_joint(robot, dq, ddq)
        # The ends of IANEA* hold its own rounding; what a sum of them adds is a few u of their size.
        sizes = [np.abs(part).max(axis=0) for part in (self._static, self._dynamic)]
        self.polynomial = drive_polynomial(Prepared.of(robot), speed, push, *sizes)
        self.samples = len(q)

    def rigid(self, u: float, which: Indices | None = None) -> Array:
        """As ``ScaledTorques.rigid``."""
        picked = slice(None) if which is None else which
        return np.asarray(self._static[..., picked] + u * self._dynamic[..., picked])


def _bodies_alone(robot: Robot) -> Robot:
    joints = tuple(replace(joint, friction=Friction(), drive=Drive()) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))


def published_factor(torques: SplitTorques, low: Array, high: Array) -> float | None:
    """Factor of the published rule, [S] (16), (18), (19), which is not safe; infinite if no limit counts.

    It drops the lower limit where inf tau_a >= 0, and the upper one where sup tau_a <= 0. There the torque may still
    go beyond the limit between the two roots of A c^2 + B c + E, when viscous friction helps to slow a joint down.
    It takes the larger root, and asks that the path is feasible at c = 0: None where it is not.

    Parameters
    ----------
    low, high : limits, shape (n,), infinite where there is none
    """
    p = torques.polynomial
    A = torques.rigid(1.0) - torques.rigid(0.0) + p.alpha
    E = torques.rigid(0.0) + p.gamma_moving - np.stack([high, -low])[..., None]
    if (E > 0.0).any():
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        roots = (-p.beta + np.sqrt(p.beta**2 - 4.0 * A * E)) / (2.0 * A)
    counted = (A > 0.0) & np.isfinite(roots)
    return float(roots[counted].min(initial=np.inf))
