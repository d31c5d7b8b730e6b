"""Tables of extended D-H parameters."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import ShapeError
from modrob_cli.model.joint import JointType
from modrob_cli.spatial import rotation, translation


@dataclass(frozen=True)
class DhTable:
    r"""Extended D-H parameters of n joints, standard (distal) convention. [D] (2.3)-(2.5).

    .. math:: A_i = R_z(\theta_i)\, T_z(d_i)\, T_x(a_i)\, R_x(\alpha_i)

    ``theta`` and ``d`` are the values at q = 0; ``gamma`` is theta at q = 0 of either joint type; ``p`` and ``n``
    place the joint connection points along the axes, d_i = n_{i-1} - p_i at q = 0 with n_0 = 0.

    Attributes
    ----------
    joint_types : n types
    a, d, p, n : shape (n,), [m];  alpha, gamma : shape (n,), [rad]
    base_transform : frame 0 in the base frame, shape (4, 4)
    tool_transform : end-effector frame in frame n, shape (4, 4)
    frames : D-H frame i in the frame of link i, shape (n, 4, 4) (link frames as in :class:`Robot`)
    """

    joint_types: tuple[JointType, ...]
    a: Array
    alpha: Array
    d: Array
    gamma: Array
    p: Array
    n: Array
    base_transform: Array
    tool_transform: Array
    frames: Array

    @property
    def theta(self) -> Array:
        """Joint angles of the convention at q = 0, equal to gamma."""
        return self.gamma

    def transforms(self, q: Array) -> Array:
        """Transforms A_1..A_n at joint positions q (..., n), shape (..., n, 4, 4). [D] (2.3).

        Raises
        ------
        ShapeError
            If the last axis of q is not n.
        """
        if q.shape[-1:] != self.a.shape:
            raise ShapeError(f"q of shape {q.shape} for {len(self.a)} joints")
        revolute = np.array([kind == "revolute" for kind in self.joint_types])
        theta = self.gamma + np.where(revolute, q, 0.0)
        d = self.d + np.where(revolute, 0.0, q)
        turn = rotation("z", theta) @ translation("z", d)
        return np.asarray(turn @ translation("x", self.a) @ rotation("x", self.alpha))

    def tool_pose(self, q: Array) -> Array:
        """End-effector frame in the base frame, shape (..., 4, 4), at q (..., n)."""
        T = self.base_transform
        for A in np.moveaxis(self.transforms(q), -3, 0):
            T = T @ A
        return np.asarray(T @ self.tool_transform)
