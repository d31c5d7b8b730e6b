"""Planned motions of an arm as functions of time, with exact derivatives."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.model.motion import MotionPiece
from modrob_cli.model.trajectory_curves import MOST_DERIVED, Curve


@dataclass(frozen=True)
class Trajectory:
    """A motion over 0 .. duration, one curve for each joint.

    Attributes
    ----------
    curves : n curves of the same duration, base to tip
    """

    name: str
    curves: tuple[Curve, ...]

    def __post_init__(self) -> None:
        """Check that the curves fit together.

        Raises
        ------
        ShapeError
            If there are none, or their durations differ.
        """
        if len({float(curve.knots[-1]) for curve in self.curves}) != 1:
            raise ShapeError("expected one curve or more, all of the same duration")

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.curves)

    @property
    def duration(self) -> float:
        """Time of the end; the motion begins at 0, [s]."""
        return float(self.curves[0].knots[-1])

    def sample(self, t: ArrayLike, highest: int = MOST_DERIVED) -> Array:
        """Positions and their derivatives at times t.

        Where a derivative jumps (at points between polynomials) the value just after is taken, at the end the one just
        before.

        Parameters
        ----------
        t : times within 0 .. duration, any shape (...), [s]
        highest : order of the highest derivative, 0 to 4

        Returns
        -------
        values : shape (..., highest + 1, n); [..., k, j] is the k-th derivative of joint j, [rad/s^k] or [m/s^k]

        Raises
        ------
        NumericalError
            If a time is outside of 0 .. duration.
        """
        times = np.asarray(t, dtype=float)
        if not ((times >= 0.0) & (times <= self.duration)).all():
            raise NumericalError(f"a time is outside of the motion, expected 0 .. {self.duration:.9g} s")
        if not 0 <= highest <= MOST_DERIVED:
            raise ShapeError(f"derivatives are known up to order {MOST_DERIVED}, not {highest}")
        rows = [[curve.derivative(times, k) for curve in self.curves] for k in range(highest + 1)]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    def motion(self, t: Array) -> MotionPiece:
        """Samples of position, velocity and acceleration at increasing times t, shape (T,)."""
        values = self.sample(t, 2)
        return MotionPiece(t, values[:, 0], values[:, 1], values[:, 2])
