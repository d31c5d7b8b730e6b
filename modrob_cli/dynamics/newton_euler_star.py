r"""The modified Newton-Euler algorithm NEA* over many samples at once. [R] Alg. 1, [D] A.2 and Algorithm 3.

Two joint velocities, dq and the auxiliary dq_a, keep the Coriolis terms apart:

.. math:: \tau = M(q)\,\ddot q + C(q, \dot q)\,\dot q_a + g(q), \qquad x'(\dot M - 2 C)\,x = 0.

Per link, with the velocities of its centre of mass :math:`v = J_v \dot q` in axes at rest and its angular velocity
:math:`\omega = J_\omega \dot q` in its own axes, where its tensor I is constant,

.. math:: \tau = J_v'\, m\,(J_v \ddot q + \dot J_v \dot q_a)
                 + J_\omega' \big(I (J_\omega \ddot q + \dot J_\omega \dot q_a) + \omega_a \times I \omega\big),
          \qquad \omega_a = J_\omega \dot q_a.

The last term vanishes in x'C x (there omega_a = J_omega x), and what is left of 2 x'C x is x'(dM/dt) x: the property
holds for revolute and prismatic joints, since the recursion computes both derivatives exactly.

This C is not the symmetric one of the Christoffel symbols, which has a moment of
:math:`\tfrac12 \mathrm{tr}(I)\,\omega_a \times \omega` less per link. It therefore depends on which bodies are
taken together (here, as published, all that a joint moves as one link); for dq_a = dq all agree.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_inertia import LinearParameters
from modrob_cli.dynamics.link_motion import JointPosition, base_motion, by_joint, joint_positions
from modrob_cli.dynamics.newton_euler import nominal_links, sum_wrenches
from modrob_cli.dynamics.vectors import apply, cross
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class StarMotion:
    """Motion of a frame with an auxiliary angular velocity, in its own coordinates, each of shape (3, T).

    Attributes
    ----------
    omega, omega_a : angular velocity from dq and from dq_a
    alpha : angular acceleration J ddq + dJ/dt dq_a, with J in the frame's own axes
    acc : the same of the origin, with J in axes at rest; minus free fall
    """

    omega: Array
    omega_a: Array
    alpha: Array
    acc: Array

    def at(self, t: Array) -> Array:
        """As ``acc``, of the point that is fixed to the frame at t (3, T) or (3, 1). [D] Alg. 4, line 15."""
        return self.acc + cross(self.alpha, t) + cross(self.omega, cross(self.omega_a, t))

    def seen_from(self, R: Array, t: Array) -> "StarMotion":
        """The motion of another frame of the same body, at constant rotation R (3, 3) and translation t (3,)."""
        moved = self.at(t[:, None]) if np.any(t != 0.0) else self.acc
        return StarMotion(*(apply(R.T, x) for x in (self.omega, self.omega_a, self.alpha, moved)))


def star_motions(robot: Robot, positions: list[JointPosition], dq: Array, dq_a: Array, ddq: Array) -> list[StarMotion]:
    """Motions of links 1..n at joint rates of shape (n, T). [D] Alg. 4, lines 10-21."""
    rest = base_motion(robot, dq.shape[1])
    motion = StarMotion(rest.omega, rest.omega, rest.alpha, rest.acc)
    motions = []
    for i, position in enumerate(positions):
        motion = _next(motion, position, dq[i], dq_a[i], ddq[i])
        motions.append(motion)
    return motions


def _next(before: StarMotion, position: JointPosition, dq: Array, dq_a: Array, ddq: Array) -> StarMotion:
    omega, omega_a = position.to_link(before.omega), position.to_link(before.omega_a)
    alpha, acc = position.to_link(before.alpha), position.to_link(before.at(position.p))
    if position.is_revolute:
        alpha[0] += omega_a[1] * dq
        alpha[1] -= omega_a[0] * dq
        alpha[2] += ddq
        omega[2] += dq
        omega_a[2] += dq_a
    else:
        acc[0] += omega_a[1] * dq + omega[1] * dq_a
        acc[1] -= omega_a[0] * dq + omega[0] * dq_a
        acc[2] += ddq
    return StarMotion(omega, omega_a, alpha, acc)


def rnea_star(robot: Robot, q: Array, dq: Array, dq_a: Array, ddq: Array) -> Array:
    r"""Joint torques M(q) ddq + C(q, dq) dq_a + g(q) of the nominal rigid bodies, with dM/dt - 2 C skew-symmetric.

    Parameters
    ----------
    q, dq, dq_a, ddq : shape (T, n), [rad] or [m] and derivatives; dq_a is an auxiliary velocity, dq the real one

    Returns
    -------
    tau : shape (T, n), [N m] or [N]; friction and rotors excluded

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    """
    q, dq, dq_a, ddq = by_joint(robot, q, dq, dq_a, ddq)
    positions = joint_positions(robot, q)
    motions = star_motions(robot, positions, dq, dq_a, ddq)
    return np.ascontiguousarray(star_backward(positions, motions, nominal_links(robot)).T)


def star_backward(positions: list[JointPosition], motions: list[StarMotion], links: list[LinearParameters]) -> Array:
    """Torques (n, T) of links with given linear parameters. [D] Alg. 4, lines 25-34."""
    return sum_wrenches(positions, [_wrench(*pair) for pair in zip(motions, links, strict=True)])


def _wrench(motion: StarMotion, link: LinearParameters) -> tuple[Array, Array]:
    """Force and moment about the link's origin, (3, T) each.

    The published moment c x F + I alpha + omega_a x (I omega), with I about the centre of mass, written in the
    parameters about the origin, which need no division where nothing has a mass.
    """
    h = link.moment[:, None]
    force = link.mass * motion.acc + cross(motion.alpha, h) + cross(motion.omega, cross(motion.omega_a, h))
    moment = apply(link.inertia, motion.alpha) + cross(motion.omega_a, apply(link.inertia, motion.omega))
    if link.mass > 0.0:
        moment -= float(link.moment @ link.moment) / link.mass * cross(motion.omega_a, motion.omega)
    return force, moment + cross(h, motion.acc)
