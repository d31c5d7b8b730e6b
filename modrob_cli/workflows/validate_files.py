"""Files about one validated log: its samples as CSV, its picture."""

from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.identify.run import Run
from modrob_cli.identify.signals import Mask
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.model.robot import Robot
from modrob_cli.plot.validation import TorquePicture, draw_torques
from modrob_cli.workflows.validate_judge import JudgedLog


def write_series(robot: Robot, log: JudgedLog, path: Path) -> None:
    """Recorded and predicted torque with its bounds at each sample, and whether it counts."""
    with NumberCsv(path, series_header(robot)) as table:
        table.write(series_rows(log.run, log.bounds, log.used))


def series_header(robot: Robot) -> list[str]:
    """Columns of that table."""
    kinds = ("recorded", "predicted", "lower", "upper")
    return ["t", "used", *(f"{name}.{kind}" for name in robot.joint_names for kind in kinds)]


def series_rows(run: Run, bounds: TorqueBounds, used: Mask) -> Array:
    """Rows of that table, shape (N, 2 + 4 n)."""
    series = np.stack((run.tau, bounds.nominal, bounds.lower, bounds.upper), axis=-1).reshape(len(run.t), -1)
    return np.column_stack([run.t, used, series])


def draw_log(robot: Robot, name: str, log: JudgedLog, friction: str, path: Path, part: str = "") -> None:
    """Picture of recorded and predicted torque; ``part`` says which part of the log, if not all, is shown."""
    units = tuple("N m" if joint.type == "revolute" else "N" for joint in robot.joints)
    captions = tuple(
        f"RMSE {error.rmse:.3g} {unit}"
        + (f", NRMSE {error.nrmse:.3f}" if error.nrmse is not None else ", no torque recorded")
        for error, unit in zip(log.errors, units, strict=True)
    )
    subtitle = f"{part}friction: {friction}; low-pass {log.run.signals.cutoff:.3g} Hz; grey: not counted"
    series = (log.run.t, log.run.tau, log.bounds.nominal, log.used)
    draw_torques(TorquePicture(f"{robot.name}: {name}", subtitle, *series, robot.joint_names, units, captions), path)
