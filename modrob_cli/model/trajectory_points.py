"""Motions that are given by points or samples: the curves through them, and what an arm would not like about them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices, frozen
from modrob_cli.errors import ShapeError
from modrob_cli.model.trajectory_curves import PiecewiseCurve
from modrob_cli.model.trajectory_pieces import cubic_hermite, quintic_spline, spline_velocities

JUMP = 0.01
"""An acceleration that jumps by more than this part of its largest size is worth a warning: samples of a smooth motion
with their velocities jump by less."""
STILL = 1e-6
"""A velocity of less than this part of the largest one is rest."""

END_POINTS, END_EXCESS = 3, 3.0
"""Positions alone, of which this many first or last ones see accelerations so many times those elsewhere, are samples
of a motion that does not begin or end at rest."""


@dataclass(frozen=True)
class MotionPoints:
    """Points that a motion goes through.

    Attributes
    ----------
    t : times that increase from 0, shape (N,), N >= 2, [s]
    q : positions, shape (N, n), [rad] or [m]
    dq, ddq : derivatives, shape (N, n), or None where not given; ddq only together with dq
    joint_names : n names, or None where the points name no joints: they are in the order of the robot then
    """

    t: Array
    q: Array
    dq: Array | None = None
    ddq: Array | None = None
    joint_names: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit together.

        Raises
        ------
        ShapeError
            If they do not.
        """
        object.__setattr__(self, "t", frozen(self.t, (-1,)))
        if len(self.t) < 2 or (self.ddq is not None and self.dq is None):
            raise ShapeError("expected two points or more, and accelerations only together with velocities")
        for key in ("q", "dq", "ddq"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, frozen(value, (len(self.t), self.q.shape[1])))

    def picked(self, joints: Indices, names: tuple[str, ...]) -> "MotionPoints":
        """Points of these joints, by number, with their names."""
        dq, ddq = (None if value is None else value[:, joints] for value in (self.dq, self.ddq))
        return MotionPoints(self.t, self.q[:, joints], dq, ddq, names)

    @property
    def interpolation(self) -> str:
        """How the curve between points is found: ``quintic``, ``cubic`` or ``cubic-spline``."""
        if self.ddq is not None:
            return "quintic"
        return "cubic" if self.dq is not None else "cubic-spline"

    def curves(self) -> tuple[PiecewiseCurve, ...]:
        """Curves through the points, one for each joint.

        With accelerations polynomials of order 5, whose acceleration is continuous; with velocities polynomials of
        order 3, whose acceleration may jump; with positions only the clamped cubic spline, at rest at both ends, whose
        acceleration is continuous.
        """
        dq = self.dq if self.dq is not None else spline_velocities(self.t, self.q)
        joints = range(self.q.shape[1])
        if self.ddq is not None:
            return tuple(quintic_spline(self.t, self.q[:, j], dq[:, j], self.ddq[:, j]) for j in joints)
        return tuple(cubic_hermite(self.t, self.q[:, j], dq[:, j]) for j in joints)

    def names(self) -> list[str]:
        """Names for people."""
        return list(self.joint_names or (f"joint {j + 1}" for j in range(self.q.shape[1])))

    def warnings(self, curves: tuple[PiecewiseCurve, ...]) -> Iterator[str]:
        """What an arm cannot follow exactly: jumps of acceleration, and motion at the beginning or the end."""
        if self.interpolation == "cubic":
            yield from self._jump_warning(curves)
        if self.interpolation == "cubic-spline" and len(self.t) > 4 * END_POINTS:
            yield from self._rest_warning(curves)
        if self.dq is not None:
            size = float(np.abs(self.dq).max())
            for k, words in ((0, "begins"), (-1, "ends")):
                j = int(np.abs(self.dq[k]).argmax())
                if abs(self.dq[k, j]) > STILL * size:
                    speed = f"{self.names()[j]} at {self.dq[k, j]:.4g} /s"
                    yield f"the motion {words} while joints move ({speed}): an arm at rest cannot follow it there"

    def _rest_warning(self, curves: tuple[PiecewiseCurve, ...]) -> Iterator[str]:
        """Samples that begin or end in motion: the spline stops there at once, with accelerations of its own making."""
        size = np.abs([curve.derivative(self.t, 2) for curve in curves])
        ends = np.concatenate([size[:, :END_POINTS], size[:, -END_POINTS:]], axis=1).max(axis=1)
        inner = size[:, END_POINTS:-END_POINTS].max(axis=1)
        moving = [name for name, high, low in zip(self.names(), ends, inner, strict=True) if high > END_EXCESS * low]
        if moving:
            yield (
                f"positions alone are taken to begin and end at rest, and the acceleration of {', '.join(moving)} is "
                f"more than {END_EXCESS:g} times as large there as elsewhere: give velocities too if the motion "
                "begins or ends while joints move"
            )

    def _jump_warning(self, curves: tuple[PiecewiseCurve, ...]) -> Iterator[str]:
        inner = self.t[1:-1]
        pairs = [(curve.derivative(inner, 2, before=True), curve.derivative(inner, 2)) for curve in curves]
        before, after = (np.stack(side, axis=1) for side in zip(*pairs, strict=True))
        if not before.size:
            return
        jumps = np.abs(after - before)
        size = np.maximum(np.abs(before), np.abs(after)).max(axis=0)
        wrong = jumps > JUMP * size
        if wrong.any():
            k, j = np.unravel_index(int(np.where(wrong, jumps, 0.0).argmax()), jumps.shape)
            count = int(wrong.any(axis=1).sum())
            where = f"the largest by {jumps[k, j]:.4g} /s^2 of {self.names()[int(j)]} at t = {inner[k]:.6g} s"
            yield (
                f"the acceleration jumps at {count} of {len(inner)} inner points, {where}: the file gives velocities "
                "without accelerations, give both (or positions only) for a smooth motion"
            )
