"""A robot with the intervals that bounded-error identification found."""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.bounded_error import JointBounds
from modrob_cli.identify.bounded_rounding import nearest
from modrob_cli.identify.bounded_samples import COULOMB, DISTURBANCE, PARAMETERS, VISCOUS
from modrob_cli.identify.updated_robot import with_friction
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Friction, Joint
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain


def bounded_robot(robot: Robot, found: Sequence[JointBounds], velocity_bands: Array) -> Robot:
    """The robot with these intervals; parameters that the samples do not tell stay as they are.

    Unknown torque goes into the disturbance, so the friction's own band is zero.
    """
    friction, rotors = [], []
    for joint, bounds, band in zip(robot.joints, found, velocity_bands, strict=True):
        own = joint.friction
        parts = [
            value if PARAMETERS[k] in bounds.kept else _uncertain(float(bounds.nominal[k]), bounds.ends[k])
            for k, value in ((VISCOUS, own.viscous), (COULOMB, own.coulomb))
        ]
        friction.append(Friction(parts[0], parts[1], coulomb_band=0.0, velocity_band=float(band)))
        rotors.append(rotor_inertia(joint, bounds))
    ends = np.array([bounds.ends[DISTURBANCE] for bounds in found])
    return with_friction(robot, friction, rotors, Interval(ends[:, 0], ends[:, 1]))


def rotor_inertia(joint: Joint, bounds: JointBounds) -> Uncertain:
    """Rotor inertia at the motor, [kg m^2]: as found, or the robot's own."""
    if "armature" in bounds.kept:
        return joint.drive.rotor_inertia
    return _uncertain(nearest(float(bounds.nominal[2]) / joint.drive.gear_ratio**2), bounds.rotor)


def _uncertain(nominal: float, ends: Array) -> Uncertain:
    return Uncertain(np.asarray(float(np.clip(nominal, ends[0], ends[1]))), Interval(ends[0], ends[1]))
