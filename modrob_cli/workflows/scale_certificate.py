"""Certificates: what was proven about a scaled motion, and checking it again."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli import __version__
from modrob_cli.arrays import Array
from modrob_cli.io.certificate import KIND
from modrob_cli.io.outputs import provenance
from modrob_cli.model.trajectory_extremes import QUANTITIES
from modrob_cli.scaling.certify import Proof
from modrob_cli.scaling.sampled import SampledFactors
from modrob_cli.workflows.scale_problem import ScaleProblem

STATEMENT = (
    "For every time t from 0 to duration / c, every admissible value of every uncertain parameter of the robot, and "
    "every factor c in 'proven', the motion q(c t) keeps the limits below: the motor torque of each joint, and its "
    "velocity, acceleration and jerk. 'cells' bounds the torques over intervals of the unscaled time at 'factor'."
)


def certificate_data(
    problem: ScaleProblem, paths: tuple[Path, Path], topic: str | None, sampled: SampledFactors, proof: Proof, out: Path
) -> dict[str, Any]:
    """Everything that is needed to check the proof again; paths are relative to the certificate's folder."""
    robot, trajectory = (os.path.relpath(path, out) for path in paths)
    edges = np.append(proof.cells.start, proof.cells.end[-1])
    critical = sampled.critical
    return {
        "modrob": KIND,
        "tool": f"modrob {__version__}",
        "statement": STATEMENT,
        "robot": Path(robot).as_posix(),
        "trajectory": Path(trajectory).as_posix(),
        "topic": topic,
        "inputs": provenance(problem.files)["inputs"],
        "options": problem.options.data,
        "joints": list(problem.robot.joint_names),
        "duration": problem.trajectory.duration,
        "limits": limit_data(problem),
        "sampled_factor": sampled.factor,
        "critical": None
        if critical is None
        else {"joint": critical.joint, "quantity": critical.quantity, "side": critical.side, "time": critical.time},
        "factor": proof.factor,
        "proven": [list(part) for part in proof.free],
        "speed": {"lower": proof.speed[0].tolist(), "upper": proof.speed[1].tolist()},
        "cells": {"edges": edges.tolist(), "lower": proof.lower.T.tolist(), "upper": proof.upper.T.tolist()},
    }


def limit_data(problem: ScaleProblem) -> dict[str, Any]:
    """Limits that count; None where there is none."""
    data: dict[str, Any] = {"torque_lower": _finite(problem.low), "torque_upper": _finite(problem.high)}
    for quantity in QUANTITIES[1:]:
        ranges = [getattr(joint.limits, quantity) for joint in problem.robot.joints]
        data[quantity] = [None if item is None else list(item) for item in ranges]
    return data


def _finite(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
