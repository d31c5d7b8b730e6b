"""Compare the torques that a model predicts with recorded ones."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.model.robot import Robot
from modrob_cli.plot.validation import TorquePicture, draw_torques
from modrob_cli.report.render import render
from modrob_cli.workflows.identify_runs import Tracker, unique_stems
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.validate_judge import Judged, JudgedLog, judge
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_report import validation_report
from modrob_cli.workflows.validate_result import SCOPES, junit, log_result, passed

_PER_LOG = ("json", "png", "csv")


def validate(
    robot_path: Path,
    logs: Sequence[Path],
    options: ValidateOptions,
    out: Path,
    overwrite: bool = False,
    track: Tracker = iter,
) -> dict[str, Any]:
    """Compare predicted with recorded torque: a report over all logs; JSON, picture and CSV for each.

    Parameters
    ----------
    track : wraps the list of logs, to show progress

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/validate.md``

    Raises
    ------
    InputFileError
        With the faults of all logs; nothing is written then.
    UsageError
        If options, robot and logs do not fit together.
    NumericalError
        If all logs are too short.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    options.check()
    loaded = load_robot(robot_path)
    robot = loaded.robot
    common = {"report": f"{robot.name}.validate.html", "junit": f"{robot.name}.validate.junit.xml"}
    with OutputFolder(out, overwrite) as folder:
        folder.claim([f"{stem}.validate.{kind}" for stem in unique_stems(logs) for kind in _PER_LOG])
        folder.claim(list(common.values()))
        judged = judge(loaded, logs, options, track)
        results = [log_result(robot, log, options) for log in judged.logs]
        head = _head(judged, results, options)
        made_from = provenance([*loaded.files, *logs])
        for log, result in zip(judged.logs, results, strict=True):
            stem = f"{log.item.log.name}.validate"
            text = json.dumps({**head, "logs": [result], "provenance": made_from}, indent=2, allow_nan=False)
            folder.write(f"{stem}.json", text + "\n")
            _draw(robot, log, judged, folder.stage(f"{stem}.png"))
            _write_series(robot, log, folder.stage(f"{stem}.csv"))
        page = render(validation_report(robot, judged, results, head, options, made_from))
        folder.write(common["report"], page)
        folder.write(common["junit"], junit(robot, results, judged, options))
    names = [f"{log.item.log.name}.validate.{kind}" for log in judged.logs for kind in _PER_LOG]
    files = {kind: str(out / name) for kind, name in common.items()} | {name: str(out / name) for name in names}
    return {**head, "logs": results, "provenance": made_from, "files": files}


def _head(judged: Judged, results: list[dict[str, Any]], options: ValidateOptions) -> dict[str, Any]:
    return {
        "passed": passed(judged, results, options),
        "friction": judged.friction,
        "scope": SCOPES[judged.friction],
        "skipped": [{"log": str(path), "reason": reason} for path, reason in judged.skipped],
        "options": options.data,
    }


def _write_series(robot: Robot, log: JudgedLog, path: Path) -> None:
    """Recorded and predicted torque with its bounds at each sample, and whether it counts."""
    kinds = ("recorded", "predicted", "lower", "upper")
    header = ["t", "used", *(f"{name}.{kind}" for name in robot.joint_names for kind in kinds)]
    parts = (log.run.tau, log.bounds.nominal, log.bounds.lower, log.bounds.upper)
    series = np.stack(parts, axis=-1).reshape(len(log.run.t), -1)
    with NumberCsv(path, header) as table:
        table.write(np.column_stack([log.run.t, log.used, series]))


def _draw(robot: Robot, log: JudgedLog, judged: Judged, path: Path) -> None:
    units = tuple("N m" if joint.type == "revolute" else "N" for joint in robot.joints)
    captions = tuple(
        f"RMSE {error.rmse:.3g} {unit}"
        + (f", NRMSE {error.nrmse:.3f}" if error.nrmse is not None else ", no torque recorded")
        for error, unit in zip(log.errors, units, strict=True)
    )
    subtitle = f"friction: {judged.friction}; low-pass {log.run.signals.cutoff:.3g} Hz; grey: not counted"
    series = (log.run.t, log.run.tau, log.bounds.nominal, log.used)
    title = f"{robot.name}: {log.item.log.name}"
    draw_torques(TorquePicture(title, subtitle, *series, robot.joint_names, units, captions), path)
