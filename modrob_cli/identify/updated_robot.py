"""A robot with the friction, rotor inertia and disturbance that a log has told."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction, Joint
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain


def with_friction(
    robot: Robot,
    friction: Sequence[Friction],
    rotor_inertia: Sequence[Uncertain] | None = None,
    disturbance: Interval | None = None,
) -> Robot:
    """The same arm with other drives; joints, bodies, limits, gear ratios and torque constants stay.

    Parameters
    ----------
    friction : one per joint, link side
    rotor_inertia : one per joint, **motor side** [kg m^2], as a robot keeps it (:func:`motor_side` converts what the
        joint feels); None keeps the robot's own
    disturbance : torque of unknown origin, shape (n,), [N m] or [N]; None keeps the robot's own

    Raises
    ------
    ShapeError
        If there are not as many entries as joints.
    """
    rotors = [joint.drive.rotor_inertia for joint in robot.joints] if rotor_inertia is None else rotor_inertia
    if not len(friction) == len(rotors) == robot.dof:
        raise ShapeError(f"{len(friction)} frictions and {len(rotors)} rotor inertias for {robot.dof} joints")
    joints = tuple(map(_with_drive, robot.joints, friction, rotors))
    return replace(robot, joints=joints, disturbance=robot.disturbance if disturbance is None else disturbance)


def motor_side(armature: Uncertain, drive: Drive) -> Uncertain:
    """Rotor inertia at the motor from the one that the joint feels: divided by the gear ratio squared.

    Parameters
    ----------
    armature : rotor inertia at the joint, shape (), [kg m^2] or [kg], >= 0

    Returns
    -------
    Uncertain
        Rounded outward, so that its product with the gear ratio squared holds the given interval; never below zero.

    Raises
    ------
    NumericalError
        If the gear ratio is zero, so that the joint feels no rotor.
    """
    if drive.gear_ratio == 0.0:
        raise NumericalError("a gear ratio of 0 gives no rotor inertia; correct gear_ratio in the robot file")
    ratio = Interval(drive.gear_ratio)
    found = armature.interval / (ratio * ratio)
    low, high = max(float(found.inf), 0.0), float(found.sup)
    nominal = np.clip(armature.nominal / drive.gear_ratio**2, low, high)
    return Uncertain(np.asarray(nominal), Interval(low, high))


def _with_drive(joint: Joint, friction: Friction, rotor_inertia: Uncertain) -> Joint:
    return replace(joint, friction=friction, drive=replace(joint.drive, rotor_inertia=rotor_inertia))
