"""A trajectory: sampled, drawn, compared with the limits of a robot."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import NumericalError, UsageError
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.io.yaml_loader import is_same_file
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory_extremes import QUANTITIES, Violation, extremes, violations
from modrob_cli.plot.trajectory import TrajectoryLabels, draw_trajectory
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_mcap import check_fits, write_motion_mcap
from modrob_cli.workflows.trajectory_motion import DEFAULT_RATE, LoadedTrajectory, TrajectoryMotion, load_trajectory

_PER_TIME = ("", "/s", "/s^2", "/s^3")


FORMATS = ("csv", "mcap")


def trajectory(
    path: Path,
    robot_path: Path | None,
    out: Path,
    rate: float = DEFAULT_RATE,
    overwrite: bool = False,
    topic: str | None = None,
    formats: Sequence[str] = FORMATS,
) -> dict[str, Any]:
    """Sample and draw a trajectory; with a robot, look for limits that it exceeds.

    Parameters
    ----------
    rate : samples per second
    topic : where the motion is in an MCAP file
    formats : of the samples, some of FORMATS

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/trajectories.md``

    Raises
    ------
    InputFileError
        If a file cannot be used, or its joints are not those of the robot; nothing is written then.
    UsageError
        If the rate, the topic or a format makes no sense, or an output would replace the trajectory itself.
    NumericalError
        If a value is not finite.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise UsageError(f"--format: found {', '.join(map(ascii, unknown))}, expected some of {','.join(FORMATS)}")
    robot = load_robot(robot_path) if robot_path is not None else None
    arm = robot.robot if robot is not None else None
    loaded = load_trajectory(path, arm, topic)
    motion = TrajectoryMotion(loaded.trajectory, rate)
    if "mcap" in formats:
        check_fits(motion)
    names = _file_names(loaded, out, formats)
    sources = provenance([loaded.path, *(robot.files if robot is not None else [])])
    with OutputFolder(out, overwrite) as folder:
        folder.claim(list(names.values()))
        warnings = list(loaded.warnings)
        if "samples" in names:
            with NumberCsv(folder.stage(names["samples"]), _header(loaded.trajectory.dof)) as table:
                for piece in motion:
                    table.write(np.column_stack([piece.t, piece.q, piece.dq, piece.ddq]))
        if "mcap" in names:
            joint_names = arm.joint_names if arm is not None else loaded.joint_names
            warnings += write_motion_mcap(folder.stage(names["mcap"]), motion, joint_names, sources)
        found = violations(loaded.trajectory, arm) if arm is not None else []
        result = {**_result(loaded, arm, motion, found), "warnings": warnings, "provenance": sources}
        folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
        draw_trajectory(loaded.trajectory, _labels(loaded, arm), found, folder.stage(names["picture"]))
    return {**result, "files": {kind: str(out / file) for kind, file in names.items()}}


def _file_names(loaded: LoadedTrajectory, out: Path, formats: Sequence[str]) -> dict[str, str]:
    """Names of the files to write."""
    name = loaded.name
    samples = {"samples": f"{name}.csv"} if "csv" in formats else {}
    mcap = {"mcap": f"{name}.mcap"} if "mcap" in formats else {}
    names = {**samples, **mcap, "picture": f"{name}.png", "json": f"{name}.trajectory.json"}
    if any(is_same_file(loaded.path, out / file) for file in names.values()):
        raise UsageError(f"{loaded.path}: an output would replace it; choose another folder with -o")
    return names


def _header(dof: int) -> list[str]:
    return ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, dof + 1))]


def _result(
    loaded: LoadedTrajectory, arm: Robot | None, motion: TrajectoryMotion, found: list[Violation]
) -> dict[str, Any]:
    checked = _limits_known(arm)
    return {
        "trajectory": loaded.name,
        "kind": loaded.kind,
        "detail": loaded.detail,
        "robot": arm.name if arm is not None else None,
        "dof": loaded.trajectory.dof,
        "duration": loaded.trajectory.duration,
        "rate": motion.rate,
        "samples": motion.samples,
        "joints": _joints(loaded, arm),
        "limits_checked": checked,
        "within_limits": not found if checked else None,
        "violations": [_violation(violation, arm, loaded) for violation in found],
    }


def _limits_known(robot: Robot | None) -> int:
    joints = robot.joints if robot is not None else ()
    return sum(getattr(joint.limits, quantity) is not None for joint in joints for quantity in QUANTITIES)


def _unit(robot: Robot | None, j: int) -> str | None:
    """Return rad or m, None where no robot tells it."""
    if robot is None:
        return None
    return "rad" if robot.joints[j].type == "revolute" else "m"


def _joints(loaded: LoadedTrajectory, robot: Robot | None) -> list[dict[str, Any]]:
    out = []
    for j, curve in enumerate(loaded.trajectory.curves):
        joint: dict[str, Any] = {"name": _name(loaded, robot, j), "unit": _unit(robot, j)}
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


def _name(loaded: LoadedTrajectory, robot: Robot | None, j: int) -> str:
    names = robot.joint_names if robot is not None else loaded.joint_names
    return names[j] if names is not None else f"joint {j + 1}"


def _violation(violation: Violation, robot: Robot | None, loaded: LoadedTrajectory) -> dict[str, Any]:
    """A violation as plain data, with a sentence for people."""
    name = _name(loaded, robot, violation.joint)
    unit = f"{_unit(robot, violation.joint)}{_PER_TIME[QUANTITIES.index(violation.quantity)]}"
    low, high = violation.limit
    reached = f"{name}: {violation.quantity} {violation.value:.6g} {unit} at t = {violation.time:.6g} s"
    message = f"{reached}, {violation.excess:.3g} outside of {low:.6g} .. {high:.6g}"
    data = {**asdict(violation), "joint": name, "limit": [low, high], "unit": unit, "excess": violation.excess}
    return {**data, "message": message}


def _labels(loaded: LoadedTrajectory, robot: Robot | None) -> TrajectoryLabels:
    motion = loaded.trajectory
    kind = f"{loaded.kind}, {loaded.detail}" if loaded.detail else loaded.kind
    subtitle = f"{kind}; {motion.dof} joints, {motion.duration:.6g} s"
    return TrajectoryLabels(
        loaded.name if robot is None else f"{loaded.name} on {robot.name}",
        subtitle,
        tuple(_name(loaded, robot, j) for j in range(motion.dof)),
        tuple(_unit(robot, j) or "rad" for j in range(motion.dof)),
        tuple(tuple(getattr(joint.limits, key) for key in QUANTITIES[:3]) for joint in robot.joints) if robot else (),
    )
