r"""Torque of friction, rotor and disturbance, as exact ranges. [S] (21), [D] 2.4.

.. math:: \tau = F_v\,\dot q + F_c\,\mathrm{sgn}(\dot q + [-w, w]) + [-b, b] + \sigma^2 I_m\,\ddot q + [d]

Near standstill, |dq| <= w, the sign is the interval [-1, 1]; at dq = 0 with w = 0 it is [-1, 1] too, because a joint
at rest may be held by any friction up to the Coulomb torque. All terms are independent, so the sum of their ranges is
the range.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class DriveBox:
    """Parameters of one joint's drive as plain numbers: viscous, Coulomb and armature as (lower, upper).

    ``armature`` is the reflected rotor inertia, rounded outward; ``rest`` the friction band plus the disturbance.
    """

    viscous: tuple[float, float]
    coulomb: tuple[float, float]
    armature: tuple[float, float]
    rest: tuple[float, float]
    velocity_band: float

    @classmethod
    def of(cls, joint: Joint, disturbance: Interval) -> "DriveBox":
        """Prepare one joint; ``disturbance`` of shape ()."""
        friction, gear = joint.friction, Interval(joint.drive.gear_ratio)
        band = Interval(-friction.coulomb_band, friction.coulomb_band)
        parts = (friction.viscous.interval, friction.coulomb.interval)
        more = ((gear * gear) * joint.drive.rotor_inertia.interval, band + disturbance)
        ends = [(float(part.inf), float(part.sup)) for part in (*parts, *more)]
        return cls(ends[0], ends[1], ends[2], ends[3], friction.velocity_band)

    def torque_range(self, dq: Array, ddq: Array) -> tuple[Array, Array]:
        """Smallest and largest torque (T,) at velocities and accelerations (T,); rounded to nearest."""
        moving_up, moving_down = dq > self.velocity_band, dq < -self.velocity_band
        low = np.where(moving_up, self.coulomb[0], -self.coulomb[1]) + self.rest[0]
        high = np.where(moving_down, -self.coulomb[0], self.coulomb[1]) + self.rest[1]
        for ends, rate in ((self.viscous, dq), (self.armature, ddq)):
            if ends[1] > 0.0:
                first, second = ends[0] * rate, ends[1] * rate
                low += np.minimum(first, second)
                high += np.maximum(first, second)
        return low, high

    def magnitude(self, dq: Array, ddq: Array) -> Array:
        """Bound (T,) of the sum of absolute values of the terms, for the rounding margin."""
        fixed = self.coulomb[1] + max(abs(self.rest[0]), abs(self.rest[1]))
        return fixed + self.viscous[1] * np.abs(dq) + self.armature[1] * np.abs(ddq)


def drive_boxes(robot: Robot) -> list[DriveBox]:
    """Drives of all joints, prepared."""
    return [DriveBox.of(joint, robot.disturbance[i]) for i, joint in enumerate(robot.joints)]


def drive_nominal(joint: Joint, dq: Array, ddq: Array, disturbance: Interval | None = None) -> Array:
    """Nominal friction, rotor and disturbance torque of one joint, shape (T,).

    Within the velocity band the sign rises along a straight line through zero; a disturbance (shape ()) counts with its
    member nearest to zero. So the nominal torque lies between the bounds.
    """
    friction, drive = joint.friction, joint.drive
    band = friction.velocity_band
    sign = np.clip(dq / band, -1.0, 1.0) if band > 0.0 else np.sign(dq)
    armature = drive.gear_ratio**2 * drive.rotor_inertia.nominal
    constant = 0.0 if disturbance is None else float(np.clip(0.0, disturbance.inf, disturbance.sup))
    return np.asarray(friction.viscous.nominal * dq + friction.coulomb.nominal * sign + armature * ddq + constant)


def torque_limits(robot: Robot) -> tuple[Array, Array]:
    """Lower and upper limit of the motor torque at each joint, from torque and current limits; infinite if unknown."""
    ranges = []
    for joint in robot.joints:
        low, high = joint.limits.torque or (-np.inf, np.inf)
        constant, current = joint.drive.torque_constant, joint.limits.current
        if current is not None and constant is not None:
            ends = sorted(float(constant * joint.drive.gear_ratio * end) for end in current)
            low, high = max(low, ends[0]), min(high, ends[1])
        ranges.append((low, high))
    ends_of = np.array(ranges)
    return ends_of[:, 0], ends_of[:, 1]
