"""From models back to document data: plain mappings and lists, ready to be written as YAML."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.interval import Interval
from modrob_cli.model.body import INERTIA_ENTRIES, PlacedBody, RigidBody
from modrob_cli.model.joint import Joint
from modrob_cli.model.log import UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import to_xyz_rpy

_NAMED_ANGLES = {sign * math.pi / k: f"{'-' if sign < 0 else ''}pi{f'/{k}' if k > 1 else ''}" for sign in (1, -1) for k in (1, 2, 3, 4, 6)}  # fmt: skip  # noqa: E501

Data = dict[str, Any]


def robot_data(robot: Robot, source: str = "", identified_from: Sequence[UsedLog] = ()) -> Data:
    """A robot as ``robot/1`` data with placements; every body keeps its own frame and box.

    Reading it back gives the same robot, to the rounding of roll, pitch and yaw (a few units in the last place).

    Parameters
    ----------
    identified_from : logs that values were fitted to
    """
    data: Data = {"modrob": "robot/1", "name": robot.name}
    if source:
        data["source"] = source
    data["gravity"] = robot.gravity.tolist()
    data["joints"] = [_joint_data(joint) for joint in robot.joints]
    data["bodies"] = [_placed_data(placed) for placed in robot.bodies]
    data["tool_transform"] = pose_data(robot.tool_transform)
    if np.any(robot.disturbance.mag > 0.0):
        ends = zip(robot.disturbance.inf, robot.disturbance.sup, strict=True)
        data["disturbance"] = [[float(low), float(high)] for low, high in ends]
    return data | identified_from_data(identified_from)


def identified_from_data(used: Sequence[UsedLog]) -> Data:
    """The logs that values were fitted to, under their key; nothing if there are none."""
    entries = [{key: value for key, value in asdict(log).items() if value is not None} for log in used]
    return {"identified_from": entries} if entries else {}


def angle_data(angle: float) -> float | str:
    """An angle as a number, or as text where it is exactly the double of a simple fraction of pi."""
    return _NAMED_ANGLES.get(float(angle), float(angle))


def pose_data(T: Array) -> Data:
    """A transform as xyz and rpy."""
    xyz, rpy = to_xyz_rpy(T)
    return {"xyz": xyz.tolist(), "rpy": [angle_data(angle) for angle in rpy]}


def scalar_data(nominal: float, interval: Interval) -> float | Data:
    """An uncertain number; a plain one where it is exact."""
    low, high = float(interval.inf), float(interval.sup)
    return float(nominal) if low == high else {"nominal": float(nominal), "min": low, "max": high}


def _uncertain(value: Uncertain) -> Any:
    if value.nominal.ndim == 0:
        return scalar_data(float(value.nominal), value.interval)
    return [scalar_data(float(value.nominal[k]), value.interval[k]) for k in range(len(value.nominal))]


def body_data(body: RigidBody) -> Data:
    """Mass, centre of mass and tensor of a body."""
    return {
        "mass": _uncertain(body.mass),
        "com": _uncertain(body.com),
        "inertia": dict(zip(INERTIA_ENTRIES, _uncertain(body.inertia), strict=True)),
        "inertia_about": body.inertia_about,
    }


def _placed_data(placed: PlacedBody) -> Data:
    return {"name": placed.body.name, "link": placed.link, "pose": pose_data(placed.pose), **body_data(placed.body)}


def _joint_data(joint: Joint) -> Data:
    friction, drive = joint.friction, joint.drive
    data: Data = {"name": joint.name, "type": joint.type, "placement": pose_data(joint.placement)}
    if joint.offset != 0.0:
        data["offset"] = angle_data(joint.offset)
    data["friction"] = {
        "viscous": _uncertain(friction.viscous),
        "coulomb": _uncertain(friction.coulomb),
        "coulomb_band": friction.coulomb_band,
        "velocity_band": friction.velocity_band,
    }
    data["rotor_inertia"] = _uncertain(drive.rotor_inertia)
    data["gear_ratio"] = drive.gear_ratio
    for key in ("torque_constant", "stiffness"):
        if getattr(drive, key) is not None:
            data[key] = getattr(drive, key)
    limits = {key: list(value) for key, value in vars(joint.limits).items() if value is not None}
    if limits:
        data["limits"] = limits
    return data
