"""Limits that an exciting motion keeps: from the robot or from options, with a margin; and how much of them it uses."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.identify.excitation_limits import MotionLimits, nominal_torque
from modrob_cli.identify.excitation_series import FourierMotion
from modrob_cli.model.joint import Limits
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory_extremes import extremes

Ranges = Sequence[tuple[float, float]]
"""(lower, upper) for each joint, or one for all."""

QUANTITIES = tuple(item.name for item in fields(MotionLimits))


def motion_limits(
    robot: Robot, overrides: Mapping[str, Ranges], margin: float, moving: Sequence[int]
) -> tuple[MotionLimits, MotionLimits]:
    """Limits as given and with the margin: the position range about its middle, all others about zero.

    Parameters
    ----------
    overrides : ranges by quantity that replace those of the robot
    margin : part of the limits that may be used
    moving : joints (from 0) that need limits

    Raises
    ------
    UsageError
        If a limit is missing or a range makes no sense, with the names of the joints.
    """
    given = {quantity: _ranges(robot, quantity, overrides.get(quantity)) for quantity in QUANTITIES}
    _complain(robot, given, moving)
    reduced = {quantity: margin * ranges for quantity, ranges in given.items()}
    middle = np.where(np.isfinite(given["position"]), given["position"], 0.0).mean(axis=1, keepdims=True)
    reduced["position"] = middle + margin * (given["position"] - middle)
    return MotionLimits(**given), MotionLimits(**reduced)


def _ranges(robot: Robot, quantity: str, override: Ranges | None) -> Array:
    if override is None:
        own = [getattr(joint.limits, quantity) or (-np.inf, np.inf) for joint in robot.joints]
        return np.array(own, dtype=float)
    if len(override) not in (1, robot.dof):
        found = f"found {len(override)} ranges, expected {robot.dof}, one for each joint, or one for all"
        raise UsageError(f"--{quantity}-limits: {found}: {', '.join(robot.joint_names)}")
    out = np.array(list(override) * (robot.dof if len(override) == 1 else 1), dtype=float)
    for low, high in out.tolist():
        if low < high and (quantity == "position" or low < 0.0 < high):
            continue
        about = "lower < upper" if quantity == "position" else "lower < 0 < upper"
        raise UsageError(f"--{quantity}-limits: found {low:g}:{high:g}, expected {about}, or one number > 0")
    return out


def _complain(robot: Robot, given: dict[str, Array], moving: Sequence[int]) -> None:
    """Name what is missing, all at once."""
    known = {quantity: [bool(np.isfinite(row).all()) for row in ranges] for quantity, ranges in given.items()}
    known["acceleration"] = [a or b for a, b in zip(known["acceleration"], known["torque"], strict=True)]
    names = robot.joint_names
    parts = []
    for quantity in ("position", "velocity", "acceleration"):
        missing = [names[j] for j in moving if not known[quantity][j]]
        if missing:
            instead = " (or torque)" if quantity == "acceleration" else ""
            parts.append(f"{quantity}{instead} for {', '.join(missing)}")
    if parts:
        options = "--position-limits, --velocity-limits, --acceleration-limits or --torque-limits"
        raise UsageError(
            f"{robot.name} lacks limits that an exciting motion must keep: {'; '.join(parts)}; give them in the file "
            f"or with {options}"
        )
    for quantity in ("velocity", "acceleration", "jerk", "torque", "position"):
        low, high = given[quantity][:, 0], given[quantity][:, 1]
        stuck = [
            names[j] for j in moving if not low[j] < high[j] or (quantity != "position" and not low[j] < 0.0 < high[j])
        ]
        if stuck:
            raise UsageError(f"the {quantity} limits of {robot.name} leave no room for a motion of {', '.join(stuck)}")


def limited_robot(robot: Robot, limits: MotionLimits) -> Robot:
    """The robot with these limits in place of its own."""
    joints = []
    for j, joint in enumerate(robot.joints):
        values = {}
        for quantity in QUANTITIES:
            low, high = (float(end) for end in getattr(limits, quantity)[j])
            values[quantity] = (low, high) if np.isfinite([low, high]).all() else None
        joints.append(replace(joint, limits=Limits(**values)))
    return replace(robot, joints=tuple(joints))


def used_limits(robot: Robot, motion: FourierMotion, given: MotionLimits, j: int) -> dict[str, float | None]:
    """Part of each limit (without margin) that joint j uses; None where there is no limit."""
    curve = motion.trajectory("motion").curves[j]
    tau = nominal_torque(robot, motion)[:, j]
    found = [(item.low, item.high) for item in (extremes(curve, order) for order in range(4))]
    found.append((float(tau.min()), float(tau.max())))
    out: dict[str, float | None] = {}
    for quantity, (low, high) in zip(QUANTITIES, found, strict=True):
        lower, upper = getattr(given, quantity)[j]
        middle = 0.5 * (lower + upper) if quantity == "position" else 0.0
        if not np.isfinite([lower, upper]).all():
            out[quantity] = None
        else:
            out[quantity] = float(max((middle - low) / (middle - lower), (high - middle) / (upper - middle)))
    return out
