"""The robot with what the logs told: estimates as nominal values, confidence intervals as bounds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from modrob_cli.identify.regression_result import Estimate, JointEstimate
from modrob_cli.identify.run import Run
from modrob_cli.identify.updated_robot import motor_side, with_friction
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction, Joint
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

Ends = tuple[float, float]


def identified_robot(robot: Robot, estimates: Sequence[JointEstimate], runs: Sequence[Run]) -> Robot:
    """Write estimates into a robot; what the motion did not tell stays as it was.

    ``robot/1`` knows viscous and Coulomb friction, a rotor and a disturbance. Refinements widen the interval that
    they refine over what occurred in the runs: asymmetric friction that of the viscous one, Stribeck and load that of
    the Coulomb one. The offset becomes the disturbance, on top of one that the robot had. Twice the width of the
    transition becomes the velocity band.
    """
    frictions, rotors, ends = [], [], []
    for j, (joint, estimate) in enumerate(zip(robot.joints, estimates, strict=True)):
        values = estimate.model(physical=True)
        frictions.append(_friction(joint, estimate, values, _largest_load(runs, j)))
        rotors.append(_rotor(joint, estimate, values))
        offset = estimate.estimates.get("offset")
        own = robot.disturbance[j]
        ends.append(own + Interval(*offset.interval) if offset and offset.interval else own)
    disturbance = Interval(np.array([float(x.inf) for x in ends]), np.array([float(x.sup) for x in ends]))
    updated = with_friction(robot, frictions, rotors, disturbance)
    joints = tuple(map(_with_gain, updated.joints, estimates))
    return replace(updated, joints=joints)


def _friction(joint: Joint, estimate: JointEstimate, values: dict[str, float], load: float) -> Friction:
    viscous = _uncertain(estimate.estimates.get("viscous"), values.get("viscous"), joint.friction.viscous)
    coulomb = _uncertain(estimate.estimates.get("coulomb"), values.get("coulomb"), joint.friction.coulomb)
    lean = abs(values.get("asymmetric", 0.0))
    viscous = _widened(viscous, (-lean, lean))
    peak = values.get("stribeck", 0.0)
    coulomb = _widened(coulomb, (min(peak, 0.0), max(peak, 0.0)))
    coulomb = _widened(coulomb, (0.0, max(values.get("load", 0.0) * load, 0.0)))
    band = 2.0 * estimate.width if values.get("coulomb") is not None else joint.friction.velocity_band
    return replace(joint.friction, viscous=viscous, coulomb=coulomb, velocity_band=band)


def _rotor(joint: Joint, estimate: JointEstimate, values: dict[str, float]) -> Uncertain:
    found = estimate.estimates.get("reflected_inertia")
    own = joint.drive.rotor_inertia
    if found is None or found.value is None or joint.drive.gear_ratio == 0.0:
        return own
    return motor_side(_uncertain(found, values.get("reflected_inertia"), own), joint.drive)


def _uncertain(estimate: Estimate | None, value: float | None, own: Uncertain) -> Uncertain:
    """Estimate and interval, cut off at zero; the robot's own where there is no estimate."""
    if estimate is None or estimate.value is None or estimate.interval is None or value is None:
        return own
    nominal = max(value, 0.0)
    low, high = max(min(estimate.interval[0], nominal), 0.0), max(estimate.interval[1], nominal)
    return Uncertain(np.asarray(nominal), Interval(low, high))


def _widened(quantity: Uncertain, by: Ends) -> Uncertain:
    """Ends moved by as much, the lower one not below zero."""
    if by == (0.0, 0.0):
        return quantity
    moved = quantity.interval + Interval(*by)
    low = min(max(float(moved.inf), 0.0), float(quantity.nominal))
    return Uncertain(quantity.nominal, Interval(low, float(moved.sup)))


def _largest_load(runs: Sequence[Run], j: int) -> float:
    return max(float(np.max(np.abs(run.tau_rigid[run.used, j]), initial=0.0)) for run in runs)


def _with_gain(joint: Joint, estimate: JointEstimate) -> Joint:
    """A fitted drive gain as torque constant, which is per turn of the motor."""
    gain = estimate.value("drive_gain")
    constant = gain / joint.drive.gear_ratio if gain is not None and joint.drive.gear_ratio != 0.0 else 0.0
    if not constant > 0.0:
        return joint
    drive: Drive = replace(joint.drive, torque_constant=constant)
    return replace(joint, drive=drive)
