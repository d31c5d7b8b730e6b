"""A trajectory: sampled, drawn, compared with the limits of a robot."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import NumericalError
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_extremes import QUANTITIES, Violation, extremes, violations
from modrob_cli.plot.trajectory import TrajectoryLabels, draw_trajectory
from modrob_cli.workflows.robots import LoadedRobot, load_robot
from modrob_cli.workflows.trajectory_motion import DEFAULT_RATE, LoadedTrajectory, TrajectoryMotion, load_trajectory

_PER_TIME = ("", "/s", "/s^2", "/s^3")


def trajectory(
    path: Path, robot_path: Path | None, out: Path, rate: float = DEFAULT_RATE, overwrite: bool = False
) -> dict[str, Any]:
    """Sample and draw a trajectory; with a robot, look for limits that it exceeds.

    Parameters
    ----------
    rate : samples per second

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/trajectories.md``

    Raises
    ------
    InputFileError
        If a file cannot be used, or the robot has another number of joints; nothing is written then.
    UsageError
        If the rate makes no sense.
    NumericalError
        If a value is not finite.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    loaded = load_trajectory(path)
    robot = load_robot(robot_path) if robot_path is not None else None
    if robot is not None:
        loaded.check_joints(robot.robot)
    motion = TrajectoryMotion(loaded.trajectory, rate)
    name = loaded.document.name
    names = {"samples": f"{name}.csv", "picture": f"{name}.png", "json": f"{name}.trajectory.json"}
    with OutputFolder(out, overwrite) as folder:
        folder.claim(list(names.values()))
        with NumberCsv(folder.stage(names["samples"]), _header(loaded.trajectory.dof)) as table:
            for piece in motion:
                table.write(np.column_stack([piece.t, piece.q, piece.dq, piece.ddq]))
        found = violations(loaded.trajectory, robot.robot) if robot is not None else []
        result = _result(loaded, robot, motion, found)
        folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
        labels = _labels(loaded, robot.robot if robot is not None else None)
        draw_trajectory(loaded.trajectory, labels, found, folder.stage(names["picture"]))
    return {**result, "files": {kind: str(out / file) for kind, file in names.items()}}


def _header(dof: int) -> list[str]:
    return ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, dof + 1))]


def _result(
    loaded: LoadedTrajectory, robot: LoadedRobot | None, motion: TrajectoryMotion, found: list[Violation]
) -> dict[str, Any]:
    arm = robot.robot if robot is not None else None
    checked = _limits_known(arm)
    return {
        "trajectory": loaded.document.name,
        "kind": loaded.document.kind,
        "robot": arm.name if arm is not None else None,
        "dof": loaded.trajectory.dof,
        "duration": loaded.trajectory.duration,
        "rate": motion.rate,
        "samples": motion.samples,
        "joints": _joints(loaded.trajectory, arm),
        "limits_checked": checked,
        "within_limits": not found if checked else None,
        "violations": [_violation(violation, arm) for violation in found],
        "provenance": provenance([loaded.path, *(robot.files if robot is not None else [])]),
    }


def _limits_known(robot: Robot | None) -> int:
    joints = robot.joints if robot is not None else ()
    return sum(getattr(joint.limits, quantity) is not None for joint in joints for quantity in QUANTITIES)


def _unit(robot: Robot | None, j: int) -> str | None:
    """Return rad or m, None where no robot tells it."""
    if robot is None:
        return None
    return "rad" if robot.joints[j].type == "revolute" else "m"


def _joints(motion: Trajectory, robot: Robot | None) -> list[dict[str, Any]]:
    out = []
    for j, curve in enumerate(motion.curves):
        joint: dict[str, Any] = {"name": _name(robot, j), "unit": _unit(robot, j)}
        for order, quantity in enumerate(QUANTITIES):
            with np.errstate(all="ignore"):
                found = extremes(curve, order)
            if not np.isfinite([found.low, found.high]).all():
                raise NumericalError(f"the {quantity} of joint {j + 1} has values beyond the range of numbers")
            joint[quantity] = {
                "min": found.low, "min_time": found.low_time, "max": found.high, "max_time": found.high_time
            }  # fmt: skip
        out.append(joint)
    return out


def _name(robot: Robot | None, j: int) -> str:
    return robot.joints[j].name if robot is not None else f"joint {j + 1}"


def _violation(violation: Violation, robot: Robot | None) -> dict[str, Any]:
    """A violation as plain data, with a sentence for people."""
    name = _name(robot, violation.joint)
    unit = f"{_unit(robot, violation.joint)}{_PER_TIME[QUANTITIES.index(violation.quantity)]}"
    low, high = violation.limit
    reached = f"{name}: {violation.quantity} {violation.value:.6g} {unit} at t = {violation.time:.6g} s"
    message = f"{reached}, {violation.excess:.3g} outside of {low:.6g} .. {high:.6g}"
    data = {**asdict(violation), "joint": name, "limit": [low, high], "unit": unit, "excess": violation.excess}
    return {**data, "message": message}


def _labels(loaded: LoadedTrajectory, robot: Robot | None) -> TrajectoryLabels:
    motion, document = loaded.trajectory, loaded.document
    kind = f"{document.kind}, order {document.order}" if document.order else document.kind
    subtitle = f"{kind}; {motion.dof} joints, {motion.duration:.6g} s"
    return TrajectoryLabels(
        document.name if robot is None else f"{document.name} on {robot.name}",
        subtitle,
        tuple(_name(robot, j) for j in range(motion.dof)),
        tuple(_unit(robot, j) or "rad" for j in range(motion.dof)),
        tuple(tuple(getattr(joint.limits, key) for key in QUANTITIES[:3]) for joint in robot.joints) if robot else (),
    )
