"""Friction, rotor inertia and offset from logs, with their uncertainty; written back into a robot file."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from modrob_cli.errors import NumericalError
from modrob_cli.identify.physical_fit import physical_robot
from modrob_cli.identify.prediction_pooled import pooled_errors
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.report.render import render
from modrob_cli.schema.from_model import robot_data
from modrob_cli.workflows.identify_base import base_csv, base_entry, base_report
from modrob_cli.workflows.identify_bounds import identify_bounds
from modrob_cli.workflows.identify_fit import Fitted, fit_all, gravity_text, predicted, scaled
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_pictures import draw_filter_of, draw_friction_of, draw_torques_of, worst_log
from modrob_cli.workflows.identify_report import identification_report
from modrob_cli.workflows.identify_robot import identified_robot
from modrob_cli.workflows.identify_runs import LoadedRuns, LogRun, Tracker, load_runs, used_logs
from modrob_cli.workflows.identify_summary import joint_entry, log_entry, parameters_csv
from modrob_cli.workflows.robots import LoadedRobot, load_robot


def identify(
    robot_path: Path,
    logs: Sequence[Path],
    options: IdentifyOptions,
    out: Path,
    overwrite: bool = False,
    track: Tracker = iter,
) -> dict[str, Any]:
    """Identify joint parameters from logs; a robot file, JSON, CSV and pictures.

    Parameters
    ----------
    track : wraps the list of logs, to show progress

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/identify.md``

    Raises
    ------
    InputFileError
        With the faults of all logs; nothing is written then.
    UsageError
        If options do not fit together, the robot or the logs.
    NumericalError
        If too few samples are left.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    options.check()
    robot = load_robot(robot_path)
    names = _names(robot, options)
    with OutputFolder(out, overwrite) as folder:
        folder.claim(list(names.values()))
        loaded = load_runs(robot.robot, logs, options, track)
        fitted = fit_all(robot.robot, loaded.runs, options.regression)
        alone = _alone(robot, loaded, options)
        result = _result(robot, loaded, fitted, alone, options)
        _write(folder, names, robot, loaded, fitted, alone, options)
        files = {kind: str(out / name) for kind, name in names.items()}
        if options.rigid_body:
            report = base_report(robot.robot, loaded.train)
            result["rigid_body"] = base_entry(report)
            folder.write(names["rigid_body"], base_csv(report))
            if report.physical is not None:
                arm = physical_robot(robot.robot, report.physical)
                physical = robot_data(arm, "modrob identify --rigid-body", used_logs(loaded.runs))
                folder.write(names["rigid_body_robot"], yaml_text(physical))
        if options.bounds is not None:
            inputs = [item.path for item in loaded.runs]
            used = used_logs(loaded.runs)
            result["bounds"] = identify_bounds(robot, loaded.train, options.bounds, folder, loaded.test, inputs, used)
            files |= {f"bounds_{kind}": path for kind, path in result["bounds"].pop("files").items()}
        result["provenance"] = provenance([*robot.files, *logs])
        folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
        folder.write(names["report"], render(identification_report(robot.robot, loaded, fitted, result, options)))
    return {**result, "files": files}


def _names(robot: LoadedRobot, options: IdentifyOptions) -> dict[str, str]:
    stem = robot.robot.name
    names = {"report": f"{stem}.identify.html", "robot": f"{stem}.identified.robot.yaml"}
    names |= {"json": f"{stem}.identify.json"}
    names |= {"parameters": f"{stem}.identify.csv", "friction": f"{stem}.identify.friction.png"}
    names |= {"torques": f"{stem}.identify.torques.png", "filter": f"{stem}.identify.filter.png"}
    if options.rigid_body:
        names["rigid_body"] = f"{stem}.identify.rigid-body.csv"
        names["rigid_body_robot"] = f"{stem}.rigid-body.robot.yaml"
    return names


def _alone(robot: LoadedRobot, loaded: LoadedRuns, options: IdentifyOptions) -> list[Fitted | str | None]:
    """The fit of each log alone, or why there is none; None where there is but one log or it was not asked for."""
    found: list[Fitted | str | None] = []
    for item in loaded.runs:
        if len(loaded.runs) == 1 or not options.fit_per_log:
            found.append(None)
            continue
        try:
            found.append(fit_all(robot.robot, [item], options.regression, diagnose=False))
        except NumericalError as error:
            found.append(str(error))
    return found


def _result(
    robot: LoadedRobot,
    loaded: LoadedRuns,
    fitted: Fitted,
    alone: Sequence[Fitted | str | None],
    options: IdentifyOptions,
) -> dict[str, Any]:
    arm = robot.robot
    joints = [joint_entry(arm, j, fitted, loaded.train) for j in range(arm.dof)]
    entries = []
    for item, own in zip(loaded.runs, alone, strict=True):
        entries.append(log_entry(arm, item, _log_errors(item, fitted), own))
    gravity = gravity_text(fitted, all(run.gravity for run in loaded.train))
    share = fitted.gravity
    return {
        "robot": arm.name,
        **_verdict(joints, gravity, fitted, options),
        "joints": joints,
        "condition": max(joint["condition"] for joint in joints),
        "samples": sum(int(run.used.sum()) for run in loaded.train),
        "samples_held_out": sum(int(run.used.sum()) for run in loaded.test),
        "gravity": None if share is None else {"share": share.value, "interval": list(share.interval)},
        "signals": {
            "cutoff": loaded.cutoff.cutoff,
            "rule": loaded.cutoff.reason,
            "bandwidth": [float(x) if x == x else None for x in loaded.cutoff.bandwidth],
        },
        "logs": entries,
        "skipped": [{"log": str(path), "reason": reason} for path, reason in loaded.skipped],
        "options": options.data,
    }


def _log_errors(item: LogRun, fitted: Fitted) -> Any:
    """Errors of the pooled fit on one log, on its held-out part if it has one."""
    part = item.test if item.test.used.any() else item.train
    run = scaled([part], fitted.estimates)[0]
    return pooled_errors([run], [predicted(run, fitted.estimates)])


def _verdict(
    joints: Sequence[dict[str, Any]], gravity: str | None, fitted: Fitted, options: IdentifyOptions
) -> dict[str, Any]:
    """Whether the fit explains the record, on what evidence, and whether it passes ``--max-nrmse``."""
    reasons = [f"{joint['name']}: {reason}" for joint in joints for reason in joint["reasons"]]
    if gravity is not None:
        reasons.insert(0, gravity)
    passed = None
    if options.max_nrmse is not None:
        ratios = [found.error.nrmse for found in fitted.judged]
        passed = all(ratio is not None and ratio <= options.max_nrmse for ratio in ratios)
    held = f"the last {options.holdout:.0%} of each log, which the fit did not see"
    seen = "the samples that were fitted, so the errors say nothing about another log"
    return {
        "passed": passed,
        "explained": not reasons,
        "reasons": reasons,
        "scope": f"Judged on {held if fitted.test else seen}.",
    }


def _write(
    folder: OutputFolder,
    names: dict[str, str],
    robot: LoadedRobot,
    loaded: LoadedRuns,
    fitted: Fitted,
    alone: Sequence[Fitted | str | None],
    options: IdentifyOptions,
) -> None:
    arm = robot.robot
    train = scaled(loaded.train, fitted.estimates)
    confidence = options.regression.confidence
    source = f"modrob identify from {robot.files[0].name} and {len(loaded.runs)} logs; {confidence:.0%} intervals"
    updated = identified_robot(arm, fitted.estimates, train)
    folder.write(names["robot"], yaml_text(robot_data(updated, source, used_logs(loaded.runs))))
    tables = [(item.train.name, own) for item, own in zip(loaded.runs, alone, strict=True) if isinstance(own, Fitted)]
    folder.write(names["parameters"], parameters_csv(arm, fitted, tables))
    item = worst_log(loaded, fitted)
    draw_friction_of(arm, loaded, fitted, confidence, folder.stage(names["friction"]))
    draw_torques_of(arm, item, fitted, folder.stage(names["torques"]))
    draw_filter_of(arm, item, loaded.cutoff.reason, folder.stage(names["filter"]))
