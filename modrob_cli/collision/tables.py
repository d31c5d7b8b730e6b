r"""Constant thresholds from bands, for controllers that know nothing else, in the terms of franka_msgs.

Such a controller compares the residual r = measured - nominal torque with numbers. Let b be the largest distance of
the band from the nominal torque over a phase of the motion. Without contact abs(r) <= b for every admissible
parameter. Hence

* ``lower`` = b: above it there is a contact for certain;
* ``upper`` = 2 b: above it the torque of the contact itself is above b for certain; and a contact torque of 2 b is
  certain to pass ``lower``.

For the wrench at the end effector, estimated as pinv(J') r, the bound without contact is sum_j abs(pinv(J'))_kj b_j,
with b of each instant. Near singular positions it grows without bound, as the estimate itself does.

Phases: constant velocity, where no acceleration exceeds a small part of the largest of its joint, and the rest.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.events import Band
from modrob_cli.collision.sensitivity import LinkPoint, point_jacobian
from modrob_cli.collision.thinned import Thinned
from modrob_cli.model.robot import Robot

STEADY = 0.05
"""Part of the largest acceleration of each joint up to which a motion counts as one of constant velocity."""
UPPER = 2.0
MOST_POSES = 4000
"""Of a longer phase, evenly picked poses tell about the wrench: every second, fourth, eighth and so on."""


@dataclass(frozen=True)
class PhaseTable:
    """Thresholds of one phase.

    Attributes
    ----------
    samples : of the phase
    torque : b of each joint, shape (n,), [N m] or [N]
    force : of Fx, Fy, Fz [N], Mx, My, Mz [N m] at the end effector in the base frame, shape (6,)
    """

    samples: int
    torque: Array
    force: Array


@dataclass(frozen=True)
class ThresholdTable:
    """Thresholds of both phases; a phase that the motion does not have takes those of the other."""

    acceleration: PhaseTable
    nominal: PhaseTable


class TableRun:
    """Finds the thresholds of one motion, which comes piece by piece.

    Parameters
    ----------
    most : largest acceleration of each joint along the motion, shape (n,)
    reach : samples that the filter remembers; so much longer an acceleration counts as one
    """

    def __init__(self, robot: Robot, most: Array, reach: int = 0) -> None:
        self._robot, self._limit, self._reach = robot, STEADY * most, reach
        self._phases = {name: _PhaseRun() for name in ("moving", "constant")}
        self._since = reach + 1  # samples since the last acceleration

    def add(self, q: Array, ddq: Array, bands: Band) -> None:
        """Take the next samples: q, ddq of shape (N, n), and their filtered bands."""
        half = np.maximum(bands.upper - bands.middle, bands.middle - bands.lower)
        steady = np.asarray((np.abs(ddq) <= self._limit).all(axis=1))
        k = np.arange(len(steady))
        last = np.maximum.accumulate(np.where(steady, -self._since, k))
        still = k - last > self._reach if self._reach else steady
        self._since = min(int(k[-1] - last[-1]), self._reach) + 1
        self._phases["moving"].add(q[~still], half[~still])
        self._phases["constant"].add(q[still], half[still])

    def table(self) -> ThresholdTable:
        """The thresholds by all samples up to now."""
        phases = [phase.table(self._robot) if phase.samples else None for phase in self._phases.values()]
        moving, constant = (phase or other for phase, other in zip(phases, phases[::-1], strict=True))
        if moving is None or constant is None:
            raise ValueError("a motion without samples")
        return ThresholdTable(moving, constant)


def threshold_table(robot: Robot, q: Array, ddq: Array, bands: Band, reach: int = 0) -> ThresholdTable:
    """Constant thresholds that no admissible parameter reaches along a whole motion; see :class:`TableRun`."""
    run = TableRun(robot, np.abs(ddq).max(axis=0), reach)
    run.add(q, ddq, bands)
    return run.table()


class _PhaseRun:
    """One phase: its largest half-widths, and positions and half-widths at some samples for the wrench."""

    def __init__(self) -> None:
        self._picked = Thinned(MOST_POSES)
        self._most = np.zeros(1)

    @property
    def samples(self) -> int:
        return self._picked.count

    def add(self, q: Array, half: Array) -> None:
        if len(q):
            self._most = np.maximum(self._most, half.max(axis=0))
            self._picked.add(np.stack([q, half], axis=1))

    def table(self, robot: Robot) -> PhaseTable:
        q, half = self._picked.rows.transpose(1, 0, 2)
        tool = LinkPoint("tool", robot.dof + 1, np.zeros(3))
        J = np.zeros((len(q), 6, robot.dof))
        J[:, :3] = point_jacobian(robot, q, tool)
        frames = robot.link_frames(q)
        for i, joint in enumerate(robot.joints):
            if joint.type == "revolute":
                J[:, 3:, i] = frames[:, i, :3, 2]
        inverse = np.abs(np.linalg.pinv(J.transpose(0, 2, 1)))
        force = np.einsum("tkj,tj->tk", inverse, half).max(axis=0)
        return PhaseTable(self.samples, self._most, force)
