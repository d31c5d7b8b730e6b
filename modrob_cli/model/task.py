"""Planned motions of a tool: poses over time with velocities and accelerations."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modrob_cli.arrays import Array, frozen

ROWS = {"pose": 6, "position": 3}


class ToolMotion(NamedTuple):
    """Motion of the tool at T times, in the base frame.

    Attributes
    ----------
    p, dp, ddp : position and derivatives, shape (T, 3), [m]
    R : orientation, shape (T, 3, 3);  omega, alpha : angular velocity and acceleration, shape (T, 3)
    """

    p: Array
    dp: Array
    ddp: Array
    R: Array
    omega: Array
    alpha: Array


@dataclass(frozen=True)
class Move:
    """From pose to pose, at rest at both ends.

    Attributes
    ----------
    duration : [s]
    xyz : end position, shape (3,), [m]; None: where it was
    R : orientation at the end, shape (3, 3); None: as it was. It turns about one axis that stays.
    centre, axis, angle : in place of a straight line an arc about the axis through the centre, shape (3,) each; [rad]
    """

    duration: float
    xyz: Array | None = None
    R: Array | None = None
    centre: Array | None = None
    axis: Array | None = None
    angle: float = 0.0

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for key, shape in (("xyz", (3,)), ("R", (3, 3)), ("centre", (3,)), ("axis", (3,))):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, frozen(value, shape))


@dataclass(frozen=True)
class Task:
    """Moves of the tool one after the other.

    Attributes
    ----------
    q0 : joint positions at the start, shape (n,): they say where the first move begins
    rows : ``pose``, or ``position`` where the orientation does not matter
    relative : poses are given in the frame of the tool at the start, not in the base frame
    """

    name: str
    q0: Array
    moves: tuple[Move, ...]
    rows: str = "pose"
    relative: bool = False

    def __post_init__(self) -> None:
        """Freeze the array."""
        object.__setattr__(self, "q0", frozen(self.q0, (-1,)))

    @property
    def duration(self) -> float:
        """Of all moves together, [s]."""
        return float(sum(move.duration for move in self.moves))

    def tool_motion(self, start: Array, t: Array) -> ToolMotion:
        """Where the tool is to be at increasing times t, shape (T,), within 0 .. duration.

        Parameters
        ----------
        start : pose of the tool at the start in the base frame, shape (4, 4)
        """
        base = start if self.relative else np.eye(4)
        parts: list[ToolMotion] = []
        pose, begin = start, 0.0
        for k, move in enumerate(self.moves):
            end = begin + move.duration
            last = k == len(self.moves) - 1
            now = t[(t >= begin) & ((t < end) | last)]
            found, pose = _moved(move, pose, base, (now - begin) / move.duration)
            parts.append(found)
            begin = end
        return ToolMotion(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _moved(move: Move, pose: Array, base: Array, share: Array) -> tuple[ToolMotion, Array]:
    """Motion at these shares of the duration, shape (T,), and the pose at the end."""
    x = np.clip(share, 0.0, 1.0)
    s = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    ds = 30.0 * x**2 * (1.0 - x) ** 2 / move.duration
    dds = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / move.duration**2
    s, ds, dds = s[:, None], ds[:, None], dds[:, None]
    end = pose.copy()
    if move.centre is not None and move.axis is not None:
        centre = base[:3, :3] @ move.centre + base[:3, 3]
        axis = base[:3, :3] @ (move.axis / np.linalg.norm(move.axis))
        arm = turned(axis, move.angle * s[:, 0]) @ (pose[:3, 3] - centre)
        p = centre + arm
        w, dw = move.angle * ds * axis, move.angle * dds * axis
        dp = np.cross(w, arm)
        ddp = np.cross(dw, arm) + np.cross(w, dp)
        end[:3, 3] = centre + turned(axis, np.array([move.angle]))[0] @ (pose[:3, 3] - centre)
    else:
        if move.xyz is not None:
            end[:3, 3] = base[:3, :3] @ move.xyz + base[:3, 3]
        way = end[:3, 3] - pose[:3, 3]
        p, dp, ddp = pose[:3, 3] + s * way, ds * way, dds * way
    if move.R is not None:
        end[:3, :3] = base[:3, :3] @ move.R
    axis, angle = axis_angle(end[:3, :3] @ pose[:3, :3].T)
    R = turned(axis, angle * s[:, 0]) @ pose[:3, :3]
    return ToolMotion(p, dp, ddp, R, angle * ds * axis, angle * dds * axis), end


def turned(axis: Array, angle: Array) -> Array:
    """Rotations about a unit vector (3,) by angles (T,), shape (T, 3, 3)."""
    S = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * S + (1.0 - c) * (S @ S))


def axis_angle(R: Array) -> tuple[Array, float]:
    """Axis (3,) and angle 0 .. pi of a rotation (3, 3)."""
    Q = quaternion(R)
    size = float(np.linalg.norm(Q[1:]))
    if size < 1e-12:
        return np.array([0.0, 0.0, 1.0]), 0.0
    return Q[1:] / size, 2.0 * float(np.arctan2(size, Q[0]))


def quaternion(R: Array) -> Array:
    """Unit quaternion (eta, eps_x, eps_y, eps_z) with eta >= 0 of a rotation (3, 3)."""
    d = np.array([np.trace(R), R[0, 0], R[1, 1], R[2, 2]])
    k = int(np.argmax(d))  # the largest component is found first: the others are divided by it
    if k == 0:
        Q = np.array([1.0 + d[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        i, j, m = k - 1, k % 3, (k + 1) % 3
        Q = np.empty(4)
        Q[0] = R[m, j] - R[j, m]
        Q[1 + i] = 1.0 + R[i, i] - R[j, j] - R[m, m]
        Q[1 + j], Q[1 + m] = R[j, i] + R[i, j], R[m, i] + R[i, m]
    Q = Q / np.linalg.norm(Q)
    return np.asarray(Q if Q[0] >= 0.0 else -Q)
