r"""Motion of the links over many samples: the forward recursion of the Newton-Euler algorithms. [D] A.1, A.2.

All quantities are given in the frame of the moving link, at its origin.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.vectors import apply, cross, turn, turn_back, zeros
from modrob_cli.errors import ShapeError
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class Motion:
    """Velocity and acceleration of a frame in its own coordinates, each of shape (3, T).

    Attributes
    ----------
    omega : angular velocity;  alpha : angular acceleration
    acc : acceleration of the origin minus that of free fall
    """

    omega: Array
    alpha: Array
    acc: Array

    def at(self, t: Array) -> Array:
        """Acceleration (3, T) of the point that is fixed to the frame at t (3, T) or (3, 1)."""
        return self.acc + cross(self.alpha, t) + cross(self.omega, cross(self.omega, t))

    def seen_from(self, R: Array, t: Array) -> "Motion":
        """The motion of another frame of the same body, at constant rotation R (3, 3) and translation t (3,)."""
        back = R.T
        moved = self.at(t[:, None]) if np.any(t != 0.0) else self.acc
        return Motion(apply(back, self.omega), apply(back, self.alpha), apply(back, moved))


@dataclass(frozen=True)
class JointPosition:
    """Where the link of one joint is in the frame of the link before it.

    Attributes
    ----------
    R : constant rotation of the placement, shape (3, 3);  cos, sin : of the turn about z, shape (T,)
    p : origin of the link in the previous link's frame, shape (3, T) or (3, 1)
    """

    R: Array
    cos: Array
    sin: Array
    p: Array
    is_revolute: bool

    def to_link(self, x: Array) -> Array:
        """Vectors (3, T) from the previous link's coordinates into the link's."""
        return turn_back(self.cos, self.sin, apply(self.R.T, x))

    def to_previous(self, x: Array) -> Array:
        """Vectors (3, T) from the link's coordinates into the previous link's."""
        return apply(self.R, turn(self.cos, self.sin, x))


def joint_position(joint: Joint, q: Array) -> JointPosition:
    """Relative position of a joint's link at positions q, shape (T,)."""
    # The offset is part of the constant rotation: added to q it would be rounded away for large angles.
    R, p = joint.zero_placement[:3, :3], joint.placement[:3, 3][:, None]
    if joint.type == "revolute":
        return JointPosition(R, np.cos(q), np.sin(q), p, True)
    return JointPosition(R, np.ones_like(q), np.zeros_like(q), p + R[:, 2:] * q, False)


def base_motion(robot: Robot, count: int) -> Motion:
    """Motion of the base: at rest, which feels like an acceleration against gravity."""
    return Motion(zeros(count), zeros(count), np.repeat(-robot.gravity[:, None], count, axis=1))


def weightless(count: int) -> Motion:
    """Motion of a base at rest where there is no gravity."""
    return Motion(zeros(count), zeros(count), zeros(count))


def next_motion(before: Motion, position: JointPosition, dq: Array, ddq: Array) -> Motion:
    """Motion of the link behind a joint from that of the link before it; dq, ddq of shape (T,). [D] Alg. 2."""
    omega, alpha = position.to_link(before.omega), position.to_link(before.alpha)
    acc = position.to_link(before.at(position.p))
    if position.is_revolute:
        alpha[0] += omega[1] * dq
        alpha[1] -= omega[0] * dq
        alpha[2] += ddq
        omega[2] += dq
    else:
        acc[0] += 2.0 * omega[1] * dq
        acc[1] -= 2.0 * omega[0] * dq
        acc[2] += ddq
    return Motion(omega, alpha, acc)


def joint_positions(robot: Robot, q: Array) -> list[JointPosition]:
    """Relative positions of all links at q, shape (n, T)."""
    return [joint_position(joint, q[i]) for i, joint in enumerate(robot.joints)]


def link_motions(positions: list[JointPosition], dq: Array, ddq: Array, base: Motion) -> list[Motion]:
    """Motions of links 1..n at joint velocities and accelerations of shape (n, T), for a given motion of the base."""
    motion = base
    motions = []
    for i, position in enumerate(positions):
        motion = next_motion(motion, position, dq[i], ddq[i])
        motions.append(motion)
    return motions


def by_joint(robot: Robot, *states: Array) -> list[Array]:
    """States of shape (T, n) as contiguous arrays (n, T).

    Raises
    ------
    ShapeError
        If the last axis is not n, or the shapes differ.
    """
    for state in states:
        if state.ndim != 2 or state.shape != (states[0].shape[0], robot.dof):
            raise ShapeError(f"states of shapes {[s.shape for s in states]}, expected (samples, {robot.dof}) for all")
    return [np.ascontiguousarray(state.T) for state in states]
