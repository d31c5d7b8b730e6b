"""Vectors of samples, component first: arrays (3, T), so that each component is contiguous over the samples.

Rounding: round-to-nearest; see :mod:`modrob_cli.dynamics.margin` for what that costs a torque.
"""

import numpy as np

from modrob_cli.arrays import Array

NEGLIGIBLE = 2.0**-53
"""Entries of constant rotations up to this size are taken as zero (the 6e-17 in the cosine of pi / 2); the change is
one of the errors that the rounding margin covers."""


def zeros(count: int) -> Array:
    """Zero vectors, shape (3, count)."""
    return np.zeros((3, count))


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (3, T); either may be one vector (3, 1)."""
    out = np.empty((3, max(a.shape[1], b.shape[1])))
    part = np.empty(out.shape[1])
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=out[i])
        np.multiply(a[k], b[j], out=part)
        out[i] -= part
    return out


def dot(a: Array, b: Array) -> Array:
    """Scalar products of vectors (3, T), shape (T,)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def norm(a: Array) -> Array:
    """Lengths of vectors (3, T), shape (T,)."""
    return np.sqrt(dot(a, a))


def apply(M: Array, x: Array) -> Array:
    """A constant matrix (3, 3) times vectors (3, T); zero entries cost nothing."""
    out = np.zeros_like(x)
    for i in range(3):
        for j in range(3):
            if abs(M[i, j]) > NEGLIGIBLE:
                out[i] += x[j] if M[i, j] == 1.0 else M[i, j] * x[j]
    return out


def turn_back(cos: Array, sin: Array, x: Array) -> Array:
    """Coordinates in a frame that was turned about z: Rz' x."""
    out = np.empty_like(x)
    np.multiply(cos, x[0], out=out[0])
    out[0] += sin * x[1]
    np.multiply(cos, x[1], out=out[1])
    out[1] -= sin * x[0]
    out[2] = x[2]
    return out


def turn(cos: Array, sin: Array, x: Array) -> Array:
    """Coordinates in the frame before a turn about z: Rz x."""
    return turn_back(cos, -sin, x)
