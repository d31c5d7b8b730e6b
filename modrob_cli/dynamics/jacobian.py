"""Geometric Jacobian of the tool and its derivative at one state. [D] A.3, Algorithm 5."""

import math
from typing import NamedTuple

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot


class ToolState(NamedTuple):
    """Tool at one state, in the base frame.

    Attributes
    ----------
    T : pose, shape (4, 4)
    J, J_rate : Jacobian and its derivative, shape (6, n): linear velocity above angular velocity
    """

    T: Array
    J: Array
    J_rate: Array


class ToolJacobian:
    """Pose, Jacobian and its derivative for one robot, state by state."""

    def __init__(self, robot: Robot) -> None:
        self._zero = [joint.zero_placement for joint in robot.joints]
        self._revolute = np.array([joint.type == "revolute" for joint in robot.joints])
        self._tool = robot.tool_transform

    def __call__(self, q: Array, dq: Array) -> ToolState:
        """At positions and velocities, shape (n,) each."""
        T, axes, origins = np.eye(4), np.empty((len(q), 3)), np.empty((len(q), 3))
        for i, (zero, angle, revolute) in enumerate(zip(self._zero, q.tolist(), self._revolute, strict=True)):
            T = T @ zero
            axes[i] = T[:3, 2]
            if revolute:
                c, s = math.cos(angle), math.sin(angle)
                x = T[:3, 0].copy()
                T[:3, 0], T[:3, 1] = c * x + s * T[:3, 1], c * T[:3, 1] - s * x
            else:
                T[:3, 3] += angle * axes[i]
            origins[i] = T[:3, 3]
        T = T @ self._tool
        turns = self._revolute[:, None] * axes
        lever = T[:3, 3] - origins
        J_p = np.where(self._revolute[:, None], _cross(axes, lever), axes)
        omega = np.cumsum(dq[:, None] * turns, axis=0)  # of the link behind each joint
        dp = _velocities(dq, axes, origins, self._revolute, omega)
        tool = (dq[:, None] * J_p).sum(axis=0)
        # a joint's axis moves with the link before it, which turns by less than its own motion about that axis
        d_axes = _cross(omega, axes)
        dJ_p = np.where(self._revolute[:, None], _cross(d_axes, lever) + _cross(axes, tool - dp), d_axes)
        dJ_w = np.where(self._revolute[:, None], d_axes, 0.0)
        return ToolState(T, np.vstack([J_p.T, turns.T]), np.vstack([dJ_p.T, dJ_w.T]))


def _velocities(dq: Array, axes: Array, origins: Array, revolute: Array, omega: Array) -> Array:
    """Velocities of the origins of links 1 .. n, shape (n, 3)."""
    before = np.vstack([np.zeros((1, 3)), omega[:-1]])
    ways = np.diff(origins, axis=0, prepend=np.zeros((1, 3)))
    steps = _cross(before, ways) + np.where(revolute[:, None], 0.0, dq[:, None] * axes)
    return np.cumsum(steps, axis=0)


def _cross(a: Array, b: Array) -> Array:
    """Cross products of rows; ``np.cross`` takes several times as long for so few."""
    x, y = a[:, [1, 2, 0]], a[:, [2, 0, 1]]
    return np.asarray(x * b[:, [2, 0, 1]] - y * b[:, [1, 2, 0]])
