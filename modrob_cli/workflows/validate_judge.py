"""One log against the model: prediction, bounds, and which samples may judge it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import TorqueBounds, exact_bounds
from modrob_cli.errors import NumericalError
from modrob_cli.identify.prediction import PredictionError, prediction_errors
from modrob_cli.identify.regression import RegressionOptions
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.run import Run
from modrob_cli.identify.signals import MARGIN, Mask
from modrob_cli.io.outputs import sha256
from modrob_cli.model.joint import Joint
from modrob_cli.model.log import UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_fit import fit_all, predicted
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_robot import identified_robot
from modrob_cli.workflows.identify_runs import LogRun, read_run
from modrob_cli.workflows.robots import LoadedRobot
from modrob_cli.workflows.validate_options import FrictionFrom, ValidateOptions


@dataclass(frozen=True)
class JudgedLog:
    """One log and what the model says of it.

    Attributes
    ----------
    run : the log, made ready
    bounds : prediction and its bounds, shape (N, n)
    used : samples that count, shape (N,)
    fitted : True if friction was fitted to these very samples
    excluded : seconds of the log that were left out because the robot file was fitted to them
    estimates : friction that was fitted here, per joint; None if it comes from the file
    errors, inside : per joint, over the samples that count; the fraction inside the bounds
    """

    item: LogRun
    run: Run
    bounds: TorqueBounds
    used: Mask
    fitted: bool
    excluded: float
    estimates: list[JointEstimate] | None
    errors: list[PredictionError]
    inside: Array


def judge_log(loaded: LoadedRobot, path: Path, options: ValidateOptions) -> JudgedLog:
    """Read one log and compare it with the model.

    Raises
    ------
    InputFileError
        If the log cannot be used.
    UsageError
        If options, robot and log do not fit together.
    NumericalError
        If it is too short.
    """
    friction = friction_from(loaded.robot, options)
    holdout = options.holdout if friction == "held-out" else 0.0
    reading = IdentifyOptions(options.effort, options.reading, options.cutoff, holdout)
    item = read_run(loaded.robot, path, reading)
    return _by_file(loaded, item) if friction == "file" else _by_fit(loaded.robot, item, friction)


def friction_from(robot: Robot, options: ValidateOptions) -> FrictionFrom:
    """Where friction comes from: as asked for, else the robot file if it says anything of it."""
    return options.friction or ("file" if has_friction(robot) else "held-out")


def has_friction(robot: Robot) -> bool:
    """Whether the file says anything of friction."""
    parts = [part for joint in robot.joints for part in (joint.friction.viscous, joint.friction.coulomb)]
    return any(float(part.interval.sup) > 0.0 for part in parts)


def _by_file(loaded: LoadedRobot, item: LogRun) -> JudgedLog:
    """The robot as its file has it, on samples that the file was not fitted to."""
    run = item.whole
    digest = sha256(item.path) if loaded.identified_from else ""
    known = [used for used in loaded.identified_from if used.sha256 == digest]
    taken = taken_samples(run.t - run.t[0], run.signals.cutoff, known)
    used = run.used & ~taken
    fitted = bool(known) and not used.any()
    counted = run.used if fitted else used
    excluded = 0.0 if fitted else float(np.count_nonzero(taken)) / run.signals.rate
    return _judged(item, run, bounds_along(loaded.robot, run), counted, fitted, excluded, None)


def taken_samples(since: Array, cutoff: float, known: Sequence[UsedLog]) -> Mask:
    """Samples that were fitted, and those that the filter mixes with them; times (N,) since the first one, [s]."""
    smear = MARGIN / cutoff
    taken = np.zeros(len(since), dtype=bool)
    for used in known:
        end = np.inf if used.end is None else used.end + smear
        taken |= (since >= used.start - smear) & (since <= end)
    return taken


def _by_fit(robot: Robot, item: LogRun, friction: FrictionFrom) -> JudgedLog:
    """Friction fitted to the first part of the log; to all of it in-sample."""
    estimates = fit_all(robot, [item], RegressionOptions(), diagnose=False).estimates
    fitted_robot = identified_robot(robot, estimates, [item.train])
    run = item.train if friction == "in-sample" else item.test
    bounds = replace(bounds_along(fitted_robot, run), nominal=predicted(run, estimates))
    return _judged(item, run, bounds, run.used, friction == "in-sample", 0.0, estimates)


def bounds_along(robot: Robot, run: Run) -> TorqueBounds:
    """Bounds along the low-passed motion; where its velocity may be noise, so may be the direction of friction."""
    joints = tuple(_with_band(joint, float(band)) for joint, band in zip(robot.joints, run.standstill, strict=True))
    gravity = robot.gravity if run.gravity else np.zeros(3)
    return exact_bounds(replace(robot, joints=joints, gravity=gravity), run.q, run.dq, run.ddq)


def _with_band(joint: Joint, band: float) -> Joint:
    friction = replace(joint.friction, velocity_band=max(joint.friction.velocity_band, band))
    return replace(joint, friction=friction)


def _judged(
    item: LogRun,
    run: Run,
    bounds: TorqueBounds,
    used: Mask,
    fitted: bool,
    excluded: float,
    estimates: list[JointEstimate] | None,
) -> JudgedLog:
    if not used.any():
        raise NumericalError("no samples are left to judge the model by; use a longer log or another --holdout")
    errors = prediction_errors(replace(run.signals, used=used), run.tau, bounds.nominal)
    inside = ((bounds.lower <= run.tau) & (run.tau <= bounds.upper))[used].mean(axis=0)
    return JudgedLog(item, run, bounds, used, fitted, excluded, estimates, errors, inside)
