r"""Rotations and rigid transforms, batch first: (..., 3, 3) and (..., 4, 4).

Naming: ``T_ab`` maps coordinates in frame b to coordinates in frame a. Angles in rad, lengths in m.
Rounding: round-to-nearest; each entry of an elementary transform is off by at most a few units in the last place.
"""

import numpy as np
from numpy.typing import ArrayLike

from modrob_cli.arrays import Array

AXES = {"x": 0, "y": 1, "z": 2}


def rotation(axis: str, angle: ArrayLike) -> Array:
    """Transform of a rotation about a coordinate axis, shape (..., 4, 4), for angles of shape (...)."""
    angle = np.asarray(angle, dtype=float)
    c, s = np.cos(angle), np.sin(angle)
    i = AXES[axis]
    j, k = (i + 1) % 3, (i + 2) % 3
    T = np.zeros((*angle.shape, 4, 4))
    T[..., i, i] = T[..., 3, 3] = 1.0
    T[..., j, j] = T[..., k, k] = c
    T[..., k, j] = s
    T[..., j, k] = -s
    return T


def translation(axis: str, distance: ArrayLike) -> Array:
    """Transform of a translation along a coordinate axis, shape (..., 4, 4), for distances of shape (...)."""
    distance = np.asarray(distance, dtype=float)
    T = np.zeros((*distance.shape, 4, 4))
    T[..., range(4), range(4)] = 1.0
    T[..., AXES[axis], 3] = distance
    return T


def invert(T: Array) -> Array:
    """Inverse of rigid transforms, shape (..., 4, 4), by the transpose of the rotation."""
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.zeros_like(T)
    out[..., :3, :3] = R_t
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", R_t, T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def skew(v: Array) -> Array:
    """Matrix S(v) with S(v) w = v x w, shape (..., 3, 3), for v of shape (..., 3). [D] below (2.20)."""
    S = np.zeros((*v.shape, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return S


def parallel_axis(c: Array) -> Array:
    """Inertia of a unit point mass at c about the origin: (c'c) 1 - c c', shape (..., 3, 3)."""
    outer = c[..., :, None] * c[..., None, :]
    return np.asarray(np.trace(outer, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - outer)


def from_xyz_rpy(xyz: ArrayLike, rpy: ArrayLike) -> Array:
    """Transform from a position and roll, pitch, yaw (URDF: R = Rz(yaw) Ry(pitch) Rx(roll)).

    Parameters
    ----------
    xyz : array, shape (..., 3), [m]
    rpy : array, shape (..., 3), [rad]

    Returns
    -------
    T : array, shape (..., 4, 4)
    """
    rpy = np.asarray(rpy, dtype=float)
    T = rotation("z", rpy[..., 2]) @ rotation("y", rpy[..., 1]) @ rotation("x", rpy[..., 0])
    T[..., :3, 3] = xyz
    return T


def to_xyz_rpy(T: Array) -> tuple[Array, Array]:
    """Position and roll, pitch, yaw of rigid transforms of shape (..., 4, 4).

    Accurate at gimbal lock too: the roll is read after the yaw was taken out, so that errors of the two cancel.
    """
    R = T[..., :3, :3]
    yaw = np.arctan2(R[..., 1, 0], R[..., 0, 0])
    pitch = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 0, 0], R[..., 1, 0]))
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * R[..., 0, 2] - c * R[..., 1, 2], c * R[..., 1, 1] - s * R[..., 0, 1])
    return T[..., :3, 3].copy(), np.stack([roll, pitch, yaw], axis=-1)
