"""Collision thresholds along logs and planned motions: bands, events, sensitivity, tables for controllers."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from modrob_cli.batch.jobs import BatchOptions, Listener, Outcome
from modrob_cli.batch.runner import BatchRun
from modrob_cli.batch.settle_all import settle_all
from modrob_cli.errors import UsageError
from modrob_cli.identify.effort import effort_factors
from modrob_cli.io.log_record import record_text
from modrob_cli.io.log_sources import job_names
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.table_writer import csv_table, parquet_table
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.robot import Robot
from modrob_cli.report.render import render
from modrob_cli.workflows.batch_result import all_files, input_hashes, jobs_of, overall_provenance, skipped_entries
from modrob_cli.workflows.collision_banding import learn
from modrob_cli.workflows.collision_fleet import collision_fleet_report, collision_table, nearness
from modrob_cli.workflows.collision_load import open_run
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_result import events_csv, threshold_document
from modrob_cli.workflows.collision_runs import PLANNED
from modrob_cli.workflows.collision_stream import RunStream
from modrob_cli.workflows.collision_task import CollisionTask, collision_head
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import load_trajectory

NO_BATCH = BatchOptions()


def collision(
    robot_path: Path,
    motions: Sequence[str | Path],
    options: CollisionOptions,
    out: Path,
    overwrite: bool = False,
    batch: BatchOptions = NO_BATCH,
    listener: Listener | None = None,
) -> dict[str, Any]:
    """Make thresholds along motions and look where measured torques leave them.

    Parameters
    ----------
    motions : paths or URLs of logs (MCAP, CSV) or planned motions (YAML, JSON)
    listener : called with the outcome of each motion as it comes

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/collision.md``

    Raises
    ------
    InputFileError
        If the robot, the planned motion or a training run cannot be used.
    UsageError
        If options, robot and motions do not fit together, or another run uses the folder.
    FailedLogsError
        If no motion has a result.
    OutputExistsError
        If there are results already that may not be replaced.
    StoppedError
        If a signal stops the run.
    """
    loaded = load_robot(robot_path)
    robot, several = loaded.robot, len(motions) > 1
    options.check(robot)
    logs = [motion for motion in motions if Path(str(motion)).suffix.lower() not in PLANNED]
    if options.train and not logs:
        raise UsageError("--train is for logs; there are only planned motions")
    if logs:
        effort_factors(robot, options.effort)
    if options.desired is not None:
        load_trajectory(options.desired, robot)
    learned = learn(_training(robot, options), options)
    jobs = jobs_of(motions, robot.name)
    common = _names(robot, several)
    inputs = input_hashes([*loaded.files, *options.train, *([options.desired] if options.desired else [])])
    task = CollisionTask(loaded, options, learned, inputs, None if several else common["report"])
    with BatchRun(task, out, batch, overwrite) as run:
        run.claim(jobs, list(common.values()))
        outcomes = settle_all(run, jobs, nearness, listener)
        result = _result(task, outcomes)
        with run.outputs() as folder:
            _write(folder, robot, result, options, common)
    return {**result, "files": all_files(common, outcomes, task.command, out)}


def _training(robot: Robot, options: CollisionOptions) -> Iterator[RunStream]:
    """Training runs, one at a time."""
    for path, name in zip(options.train, job_names([str(path) for path in options.train]), strict=True):
        with open_run(robot, path, name, options) as stream:
            yield stream


def _names(robot: Robot, several: bool) -> dict[str, str]:
    stem = f"{robot.name}.collision"
    names = {"report": f"{stem}.html", "events": f"{stem}.events.csv", "thresholds": f"{stem}.thresholds.yaml"}
    if several:
        names |= {"summary": f"{stem}.summary.json", "table": f"{stem}.logs.csv", "parquet": f"{stem}.logs.parquet"}
    return names


def _result(task: CollisionTask, outcomes: Sequence[Outcome]) -> dict[str, Any]:
    results = [outcome.done["logs"][0] for outcome in outcomes if outcome.record is not None]
    return {
        **collision_head(task, results),
        "skipped": skipped_entries(outcomes),
        "logs": results,
        "thresholds": threshold_document(task.loaded.robot, results, task.options),
        "provenance": overall_provenance(task.inputs, outcomes),
    }


def _write(
    folder: OutputFolder, robot: Robot, result: dict[str, Any], options: CollisionOptions, names: dict[str, str]
) -> None:
    """Results about all motions; the page of a single one is there already."""
    folder.write(names["thresholds"], yaml_text(result["thresholds"]))
    folder.write(names["events"], events_csv(result["logs"]))
    if "summary" not in names:
        return
    folder.write(names["summary"], record_text(result))
    table = collision_table(result["logs"])
    folder.write(names["table"], csv_table(table))
    folder.write(names["parquet"], parquet_table(table))
    folder.write(names["report"], render(collision_fleet_report(robot, result, options)))
