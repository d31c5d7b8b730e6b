"""The recursive Newton-Euler algorithm over many samples at once. [D] A.1; own code, because Pinocchio has no batch."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_inertia import LinearParameters, joined
from modrob_cli.dynamics.link_motion import JointPosition, Motion, base_motion, by_joint, joint_positions, link_motions
from modrob_cli.dynamics.vectors import apply, cross, zeros
from modrob_cli.model.robot import Robot


def rnea(robot: Robot, q: Array, dq: Array, ddq: Array) -> Array:
    r"""Joint torques of the nominal rigid bodies, M(q) ddq + C(q, dq) dq + g(q).

    Parameters
    ----------
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives

    Returns
    -------
    tau : shape (T, n), [N m] or [N]; friction and rotors excluded

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    """
    q, dq, ddq = by_joint(robot, q, dq, ddq)
    positions = joint_positions(robot, q)
    motions = link_motions(positions, dq, ddq, base_motion(robot, q.shape[1]))
    return np.ascontiguousarray(backward(positions, motions, nominal_links(robot)).T)


def nominal_links(robot: Robot) -> list[LinearParameters]:
    """Nominal parameters of links 1..n."""
    return [joined(robot.bodies_of(i + 1)) for i in range(robot.dof)]


def backward(positions: list[JointPosition], motions: list[Motion], links: list[LinearParameters]) -> Array:
    """Torques (n, T) of links with given linear parameters in given motion."""
    return sum_wrenches(positions, [link_wrench(*pair) for pair in zip(motions, links, strict=True)])


def sum_wrenches(positions: list[JointPosition], wrenches: list[tuple[Array, Array]]) -> Array:
    """Torques (n, T): each link's force and moment about its origin, (3, T), summed from the tip to the base."""
    count = wrenches[0][0].shape[1]
    force, moment = zeros(count), zeros(count)
    tau = np.empty((len(wrenches), count))
    for i in reversed(range(len(wrenches))):
        f, n = wrenches[i]
        force, moment = force + f, moment + n
        tau[i] = moment[2] if positions[i].is_revolute else force[2]
        if i:
            force, moment = positions[i].to_previous(force), positions[i].to_previous(moment)
            moment = moment + cross(positions[i].p, force)
    return tau


def link_wrench(motion: Motion, link: LinearParameters) -> tuple[Array, Array]:
    """Force and moment about the link's origin that its motion asks for, (3, T) each. [D] (2.15), (2.16)."""
    h = link.moment[:, None]
    spin = cross(motion.alpha, h) + cross(motion.omega, cross(motion.omega, h))
    momentum = apply(link.inertia, motion.omega)
    moment = apply(link.inertia, motion.alpha) + cross(motion.omega, momentum) + cross(h, motion.acc)
    return link.mass * motion.acc + spin, moment
