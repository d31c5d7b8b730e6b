"""What bounded-error identification is asked for, joint by joint."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.identify.bounded_error import JointRequest, Spread
from modrob_cli.identify.bounded_ranges import MotionNoise
from modrob_cli.identify.bounded_samples import JointSamples
from modrob_cli.identify.bounded_velocity import narrowest_velocity_band
from modrob_cli.identify.run import Run
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.bounds_method import per_joint


@dataclass(frozen=True)
class BoundedOptions:
    """How intervals are found.

    Attributes
    ----------
    effort_noise : the recorded torque is known to +- this, [N m] or [N]; like the following, one number for all joints
        or one each, and None for none
    velocity_band : speed up to which the sign of the friction is unknown; None for the robot's own, or else 3 % of the
        RMS velocity; "auto" for the one that makes the bounds narrowest
    q_noise, dq_noise, ddq_noise : the motion is known to +- this
    outliers : at most so many samples (a whole number), or this fraction of them (below 1), may be left out per joint
    spread : see :mod:`modrob_cli.identify.bounded_error`; None: ``consistent`` with a stated noise, else ``least``
    torque : the torque as recorded, or low-passed like the motion
    growth : also find how much the rigid bodies' boxes would have to grow
    """

    effort_noise: list[float] | None = None
    velocity_band: list[float] | Literal["auto"] | None = None
    q_noise: list[float] | None = None
    dq_noise: list[float] | None = None
    ddq_noise: list[float] | None = None
    outliers: float = 0.0
    spread: Spread | None = None
    torque: Literal["recorded", "filtered"] = "recorded"
    growth: bool = True

    def motion_noise(self, dof: int) -> MotionNoise:
        """Half-widths of the motion.

        Raises
        ------
        UsageError
            If there are neither one nor as many numbers as joints, or one is negative.
        """
        return MotionNoise(
            per_joint(self.q_noise, dof, "--q-noise"),
            per_joint(self.dq_noise, dof, "--dq-noise"),
            per_joint(self.ddq_noise, dof, "--ddq-tolerance"),
        )

    def torque_noise(self, dof: int) -> Array:
        """Half-widths of the recorded torque, shape (n,); raises as :meth:`motion_noise`."""
        return per_joint(self.effort_noise, dof, "--effort-noise")


def requests(arm: Robot, runs: Sequence[Run], options: BoundedOptions, samples: int) -> list[JointRequest]:
    """One request per joint, for so many samples.

    Raises
    ------
    UsageError
        If an option does not fit.
    """
    noise = options.torque_noise(arm.dof)
    spread = options.spread or ("consistent" if noise.any() else "least")
    if spread == "consistent" and not noise.all():
        raise UsageError("the intervals of all consistent parameters need --effort-noise > 0 for every joint")
    moving = np.any([run.signals.moving for run in runs], axis=0)
    outliers = most_outliers(options.outliers, samples)
    found = []
    for j, joint in enumerate(arm.joints):
        parts = (joint.friction.viscous, joint.friction.coulomb, joint.drive.rotor_inertia)
        own = np.array([[float(part.interval.inf), float(part.interval.sup)] for part in parts])
        own[2] *= joint.drive.gear_ratio**2
        found.append(JointRequest(spread, float(noise[j]), outliers, own, joint.drive.gear_ratio, bool(moving[j])))
    return found


def most_outliers(wanted: float, samples: int) -> int:
    """Number of samples that may be left out, from a whole number or a fraction below 1.

    Raises
    ------
    UsageError
        If it is neither, or more than half of the samples.
    """
    whole = wanted >= 1.0 and wanted == np.floor(wanted) and np.isfinite(wanted)
    if not (0.0 <= wanted < 1.0 or whole):
        raise UsageError(f"--outliers: found {wanted:g}, expected a whole number of samples or a fraction below 1")
    most = int(wanted) if whole else int(wanted * samples)
    if most > samples // 2:
        raise UsageError(f"--outliers: found {most} of {samples} samples; more than half of them are no outliers")
    return most


def with_velocity_bands(
    arm: Robot,
    runs: Sequence[Run],
    options: BoundedOptions,
    samples: Sequence[JointSamples],
    asked: Sequence[JointRequest],
) -> list[JointSamples]:
    """The samples of each joint with the band in which the sign of the friction is unknown.

    Raises
    ------
    UsageError
        If the numbers do not fit.
    NumericalError
        If the solver fails.
    """
    if options.velocity_band == "auto":
        bands = np.array([narrowest_velocity_band(part, request) for part, request in zip(samples, asked, strict=True)])
    elif options.velocity_band is not None:
        bands = per_joint(options.velocity_band, arm.dof, "--velocity-band")
    else:
        own = np.array([joint.friction.velocity_band for joint in arm.joints])
        usual = np.max([run.signals.band for run in runs], axis=0)
        bands = np.where(own > 0.0, own, [float(f"{band:.3g}") for band in usual])
    return [replace(part, velocity_band=float(band)) for part, band in zip(samples, bands, strict=True)]
