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
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.collision.events import Band
from modrob_cli.collision.sensitivity import LinkPoint, point_jacobian
from modrob_cli.model.robot import Robot

STEADY = 0.05
"""Part of the largest acceleration of each joint up to which a motion counts as one of constant velocity."""
UPPER = 2.0


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


def steady_phase(ddq: Array) -> NDArray[np.bool_]:
    """Samples of constant velocity, shape (N,), for accelerations (N, n)."""
    most = np.abs(ddq).max(axis=0)
    return np.asarray((np.abs(ddq) <= STEADY * most).all(axis=1))


def threshold_table(robot: Robot, q: Array, ddq: Array, bands: Band, reach: int = 0) -> ThresholdTable:
    """Constant thresholds that no admissible parameter reaches along this motion.

    Parameters
    ----------
    q, ddq : shape (N, n);  bands : filtered, of the same samples
    reach : samples that the filter remembers; so much longer an acceleration counts as one
    """
    half = np.maximum(bands.upper - bands.middle, bands.middle - bands.lower)
    steady = steady_phase(ddq)
    if reach:
        recent = np.concatenate([[0], np.cumsum(~steady)])
        first = np.maximum(np.arange(len(steady)) - reach, 0)
        steady = steady & (recent[1:] - recent[first] == 0)
    phases = [_phase(robot, q[mask], half[mask]) if mask.any() else None for mask in (~steady, steady)]
    moving, constant = (phase or other for phase, other in zip(phases, phases[::-1], strict=True))
    if moving is None or constant is None:
        raise ValueError("a motion without samples")
    return ThresholdTable(moving, constant)


def _phase(robot: Robot, q: Array, half: Array) -> PhaseTable:
    tool = LinkPoint("tool", robot.dof + 1, np.zeros(3))
    step = max(1, len(q) // 2000)
    J = np.zeros((len(q[::step]), 6, robot.dof))
    J[:, :3] = point_jacobian(robot, q[::step], tool)
    frames = robot.link_frames(q[::step])
    for i, joint in enumerate(robot.joints):
        if joint.type == "revolute":
            J[:, 3:, i] = frames[:, i, :3, 2]
    inverse = np.abs(np.linalg.pinv(J.transpose(0, 2, 1)))
    force = np.einsum("tkj,tj->tk", inverse, half[::step]).max(axis=0)
    return PhaseTable(len(q), half.max(axis=0), force)
