"""Friction, rotor inertia and offset from logs, with their uncertainty; written back into a robot file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from modrob_cli.batch.jobs import BatchOptions, Listener, LogJob, Outcome
from modrob_cli.batch.runner import BatchRun
from modrob_cli.batch.settle_all import failures_as_error
from modrob_cli.identify.effort import effort_factors
from modrob_cli.identify.physical_fit import physical_robot
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.schema.from_model import robot_data
from modrob_cli.workflows.batch_result import input_hashes, jobs_of, log_files, overall_provenance
from modrob_cli.workflows.identify_base import base_csv, base_entry, base_report
from modrob_cli.workflows.identify_bounds import bounded_names, identify_bounds
from modrob_cli.workflows.identify_fit import fit_all
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_pooled import PooledRuns, Stage, look_at_all, make_ready
from modrob_cli.workflows.identify_result import identification_result
from modrob_cli.workflows.identify_task import IdentifyTask
from modrob_cli.workflows.identify_write import Written, write_identification
from modrob_cli.workflows.robots import LoadedRobot, load_robot

NO_BATCH = BatchOptions()


def silent(what: str, fraction: float) -> None:
    """Nobody wants to know how far the fit is."""


def identify(
    robot_path: Path,
    logs: Sequence[str | Path],
    options: IdentifyOptions,
    out: Path,
    overwrite: bool = False,
    batch: BatchOptions = NO_BATCH,
    listener: Listener | None = None,
    stage: Stage = silent,
) -> dict[str, Any]:
    """Identify joint parameters from logs; a robot file, JSON, CSV and pictures.

    Several logs are first fitted each alone, which many processes share and an interrupted run can go on with, then
    all together. A log that fails at either is left out, and listed.

    Parameters
    ----------
    logs : paths or URLs
    listener : called with the outcome of each log as it comes
    stage : told how far the fit of all together is

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/identify.md``

    Raises
    ------
    UsageError
        If options and robot do not fit together, or another run uses the folder.
    FailedLogsError
        If no log can be used, with the reasons of all.
    NumericalError
        If too few samples are left.
    OutputExistsError
        If there are results already that may not be replaced.
    StoppedError
        If a signal stops the run.
    """
    from threadpoolctl import threadpool_limits

    options.check()
    robot = load_robot(robot_path)
    effort_factors(robot.robot, options.recorded)
    jobs = jobs_of(logs, robot.robot.name)
    alone = len(jobs) > 1 and options.fit_per_log
    inputs = input_hashes(robot.files)
    task = IdentifyTask(robot, options, inputs)
    names = _names(robot.robot, options, alone)
    # One thread for linear algebra, as in the fits of single logs, so that sums come out the same everywhere.
    with BatchRun(task, out, batch, overwrite) as run, threadpool_limits(limits=1):
        run.claim(jobs if alone else [], [*names.values(), *(bounded_names(robot.robot) if options.bounds else [])])
        outcomes, read = _looked_at(run, jobs, task, alone, listener)
        pooled = _made_ready(robot.robot, outcomes, read, options, batch.fail_fast, stage)
        fitted = fit_all(robot.robot, pooled.runs, options.regression, stage=stage)
        lost = [*outcomes, *pooled.failed]
        result = identification_result(robot.robot, pooled, fitted, lost, options, alone)
        result["provenance"] = overall_provenance(inputs, [item.found for item in pooled.runs])
        stage("writing", 1.0)
        with run.outputs() as folder:
            bounds = _more(folder, names, robot, pooled, result, options)
            written = Written(folder, names, robot, result)
            names = write_identification(written, pooled, fitted, options)
    files = {kind: str(out / name) for kind, name in names.items()} | bounds
    return {**result, "files": files | (log_files(outcomes, task.command, out) if alone else {})}


def _looked_at(
    run: BatchRun, jobs: Sequence[LogJob], task: IdentifyTask, alone: bool, listener: Listener | None
) -> tuple[list[Outcome], dict[str, JointLog]]:
    """What became of each log alone, and those that are in memory."""
    if alone:
        return run.settle(jobs, False, listener), {}
    return look_at_all(task.loaded.robot, jobs, task.options, run.options.fail_fast, listener)


def _made_ready(
    robot: Robot,
    outcomes: Sequence[Outcome],
    read: dict[str, JointLog],
    options: IdentifyOptions,
    fail_fast: bool,
    stage: Stage,
) -> PooledRuns:
    """The logs that are fitted together.

    Raises
    ------
    FailedLogsError
        If there are none, or, with ``fail_fast``, if one is missing.
    """
    bad = [outcome for outcome in outcomes if outcome.failure is not None]
    if bad and (fail_fast or len(bad) == len(outcomes)):
        raise failures_as_error(bad)
    pooled = make_ready(robot, outcomes, read, options, fail_fast, stage)
    if pooled.failed and (fail_fast or not pooled.runs):
        raise failures_as_error([*bad, *pooled.failed])
    return pooled


def _more(
    folder: OutputFolder,
    names: dict[str, str],
    robot: LoadedRobot,
    pooled: PooledRuns,
    result: dict[str, Any],
    options: IdentifyOptions,
) -> dict[str, str]:
    """Rigid bodies and bounds, where they are asked for, into ``result``; paths of the bounds' files."""
    used = [item.used for item in pooled.runs]
    if options.rigid_body:
        report = base_report(robot.robot, pooled.train)
        result["rigid_body"] = base_entry(report)
        folder.write(names["rigid_body"], base_csv(report))
        if report.physical is not None:
            arm = physical_robot(robot.robot, report.physical)
            physical = robot_data(arm, "modrob identify --rigid-body", used)
            folder.write(names["rigid_body_robot"], yaml_text(physical))
    if options.bounds is None:
        return {}
    made_from = result["provenance"]
    found = identify_bounds(robot, pooled.train, options.bounds, folder, pooled.test, made_from, used)
    result["bounds"] = {key: value for key, value in found.items() if key != "files"}
    return {f"bounds_{kind}": path for kind, path in found["files"].items()}


def _names(robot: Robot, options: IdentifyOptions, alone: bool) -> dict[str, str]:
    stem = robot.name
    names = {"report": f"{stem}.identify.html", "robot": f"{stem}.identified.robot.yaml"}
    names |= {"json": f"{stem}.identify.json"}
    names |= {"parameters": f"{stem}.identify.csv", "friction": f"{stem}.identify.friction.png"}
    names |= {"torques": f"{stem}.identify.torques.png", "filter": f"{stem}.identify.filter.png"}
    if alone:
        names |= {"table": f"{stem}.identify.logs.csv", "parquet": f"{stem}.identify.logs.parquet"}
    if options.rigid_body:
        names["rigid_body"] = f"{stem}.identify.rigid-body.csv"
        names["rigid_body_robot"] = f"{stem}.rigid-body.robot.yaml"
    return names
