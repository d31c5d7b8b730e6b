"""The assembled robot: a serial chain of joints and the bodies that they carry."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody
from modrob_cli.model.joint import Joint
from modrob_cli.spatial import rotation, translation

STANDARD_GRAVITY = (0.0, 0.0, -9.81)
"""Acceleration of free fall in the base frame [m/s^2] where a file says nothing."""


@dataclass(frozen=True)
class Robot:
    """A serial arm with n joints.

    Joint placements are kept as transforms; the D-H table is a view of them
    (:func:`modrob_cli.assembly.dh_synthesis.dh_table`), so that no computation suffers from the convention.

    Attributes
    ----------
    joints : n joints, base to tip
    bodies : rigid bodies fixed to links 0 (base) to n, each in its own frame with its own box
    tool_transform : end-effector frame in the frame of link n, shape (4, 4)
    gravity : acceleration of free fall in the base frame, shape (3,), [m/s^2]
    disturbance : torque of unknown origin at each joint, shape (n,), [N m] or [N]
    """

    name: str
    joints: tuple[Joint, ...]
    bodies: tuple[PlacedBody, ...]
    tool_transform: Array
    gravity: Array
    disturbance: Interval

    def __post_init__(self) -> None:
        """Freeze the arrays and check that shapes and link numbers fit."""
        object.__setattr__(self, "tool_transform", frozen(self.tool_transform, (4, 4)))
        object.__setattr__(self, "gravity", frozen(self.gravity, (3,)))
        if self.disturbance.shape != (self.dof,):
            raise ShapeError(f"disturbance of shape {self.disturbance.shape} for {self.dof} joints")
        if any(not 0 <= placed.link <= self.dof for placed in self.bodies):
            raise ShapeError(f"a body is fixed to a link outside 0..{self.dof}")

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, base to tip."""
        return tuple(joint.name for joint in self.joints)

    def bodies_of(self, link: int) -> tuple[PlacedBody, ...]:
        """Bodies fixed to one link, in the order of assembly."""
        return tuple(placed for placed in self.bodies if placed.link == link)

    def link_frames(self, q: Array) -> Array:
        """Frames of links 1..n and of the end effector in the base frame, shape (..., n + 1, 4, 4), at q (..., n).

        Raises
        ------
        ShapeError
            If the last axis of q is not n.
        """
        if q.shape[-1:] != (self.dof,):
            raise ShapeError(f"q of shape {q.shape} for {self.dof} joints")
        T = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
        frames = []
        for i, joint in enumerate(self.joints):
            motion = rotation("z", q[..., i]) if joint.type == "revolute" else translation("z", q[..., i])
            T = T @ joint.zero_placement @ motion
            frames.append(T)
        frames.append(T @ self.tool_transform)
        return np.stack(frames, axis=-3)
