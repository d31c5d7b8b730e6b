"""Fourier motions that rest at both ends, as linear functions of free numbers."""

import math
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import ShapeError
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import SineCurve


@dataclass(frozen=True)
class FourierMotion:
    """Joint j follows offset_j + sum_k sin_jk sin(k w t) + cos_jk cos(k w t), w = 2 pi / period, k = 1..K.

    Attributes
    ----------
    period : [s];  offset : shape (n,), [rad] or [m];  sin, cos : shape (n, K)
    """

    period: float
    offset: Array
    sin: Array
    cos: Array

    @property
    def base_frequency(self) -> float:
        """Angular frequency w, [rad/s]."""
        return 2.0 * math.pi / self.period

    def trajectory(self, name: str, periods: int = 1) -> Trajectory:
        """The motion over a number of periods."""
        harmonics = np.arange(1, self.sin.shape[1] + 1)
        frequency = np.concatenate([harmonics, harmonics]) * self.base_frequency
        phase = np.repeat([0.0, 0.5 * math.pi], len(harmonics))
        amplitude = np.concatenate([self.sin, self.cos], axis=1)
        duration = periods * self.period
        rows = zip(self.offset, amplitude, strict=True)
        return Trajectory(name, tuple(SineCurve(duration, float(q0), row, frequency, phase) for q0, row in rows))


@dataclass(frozen=True)
class RestingSeries:
    """Series of K harmonics whose velocity and acceleration vanish at both ends of the period.

    At t = 0 the velocity is sum k w sin_k and the acceleration -sum (k w)^2 cos_k: two linear conditions, which leave
    K - 1 free numbers each. With the offset, a joint has m = 2 K - 1 free numbers x.

    Attributes
    ----------
    period : [s];  harmonics : K >= 2
    """

    period: float
    harmonics: int

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises
        ------
        ShapeError
            If they leave no motion.
        """
        if self.harmonics < 2 or not self.period > 0.0:
            raise ShapeError(f"a motion at rest at its ends needs 2 harmonics or more, got {self.harmonics}")

    @property
    def size(self) -> int:
        """Free numbers m of one joint."""
        return 2 * self.harmonics - 1

    def spread(self) -> Array:
        """Matrix from free numbers to (offset, sin, cos), shape (2 K + 1, m)."""
        k = np.arange(1, self.harmonics + 1, dtype=float)
        out = np.zeros((2 * self.harmonics + 1, self.size))
        out[0, 0] = 1.0
        out[1 : self.harmonics + 1, 1 : self.harmonics] = _orthogonal_to(k)
        out[self.harmonics + 1 :, self.harmonics :] = _orthogonal_to(k**2)
        return out

    def matrices(self, count: int, highest: int = 2) -> tuple[Array, ...]:
        """Position, velocity, ... up to the derivative ``highest`` at ``count`` even times of the period.

        Each of shape (count, m), times x.
        """
        k = np.arange(1, self.harmonics + 1)
        w = 2.0 * math.pi / self.period * k
        angle = 2.0 * math.pi / count * np.outer(np.arange(count), k)
        s, c, constant = np.sin(angle), np.cos(angle), np.ones((count, 1))
        out = []
        for _ in range(highest + 1):
            out.append(np.hstack([constant, s, c]) @ self.spread())
            s, c, constant = c * w, -s * w, np.zeros((count, 1))
        return tuple(out)

    def motion(self, x: Array) -> FourierMotion:
        """Motion of the free numbers x, shape (n, m)."""
        values = x @ self.spread().T
        return FourierMotion(
            self.period, values[:, 0], values[:, 1 : self.harmonics + 1], values[:, self.harmonics + 1 :]
        )


def _orthogonal_to(v: Array) -> Array:
    """Orthonormal basis of the vectors orthogonal to v, shape (K, K - 1); the same on every machine up to rounding."""
    Q, _ = np.linalg.qr(np.column_stack([v, np.eye(len(v))[:, 1:]]))
    return np.asarray(Q[:, 1:])
