"""Compare the torques that a model predicts with recorded ones."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from modrob_cli.batch.jobs import BatchOptions, Listener, Outcome
from modrob_cli.batch.runner import BatchRun
from modrob_cli.batch.settle_all import settle_all
from modrob_cli.io.log_record import record_text
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.table_writer import csv_table, parquet_table
from modrob_cli.model.robot import Robot
from modrob_cli.report.render import render
from modrob_cli.workflows.batch_result import (
    all_files,
    input_hashes,
    jobs_of,
    overall_provenance,
    skipped_entries,
)
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.validate_fleet import validation_fleet_report
from modrob_cli.workflows.validate_judge import friction_from
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_result import SCOPES, junit, passed
from modrob_cli.workflows.validate_table import validation_table
from modrob_cli.workflows.validate_task import ValidateTask

NO_BATCH = BatchOptions()


def validate(
    robot_path: Path,
    logs: Sequence[str | Path],
    options: ValidateOptions,
    out: Path,
    overwrite: bool = False,
    batch: BatchOptions = NO_BATCH,
    listener: Listener | None = None,
) -> dict[str, Any]:
    """Compare predicted with recorded torque: JSON and CSV for each log, a report over all logs.

    Parameters
    ----------
    logs : paths or URLs
    listener : called with the outcome of each log as it comes

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/validate.md``

    Raises
    ------
    UsageError
        If options and robot do not fit together, or another run uses the folder.
    FailedLogsError
        If no log can be judged.
    OutputExistsError
        If there are results already that may not be replaced.
    StoppedError
        If a signal stops the run.
    """
    options.check()
    loaded = load_robot(robot_path)
    robot, jobs, several = loaded.robot, jobs_of(logs, loaded.robot.name), len(logs) > 1
    common = _names(robot, several)
    inputs = input_hashes(loaded.files)
    task = ValidateTask(loaded, options, inputs, None if several else common["report"])
    with BatchRun(task, out, batch, overwrite) as run:
        run.claim(jobs, list(common.values()))
        outcomes = settle_all(run, jobs, worst_nrmse, listener)
        result = _result(robot, outcomes, inputs, options)
        with run.outputs() as folder:
            _write(folder, robot, result, options, common)
    return {**result, "files": all_files(common, outcomes, task.command, out)}


def worst_nrmse(record: dict[str, Any]) -> float:
    """NRMSE of the worst joint of a log; infinite where no torque was recorded."""
    (log,) = record["logs"]
    return max(float("inf") if joint["nrmse"] is None else float(joint["nrmse"]) for joint in log["joints"])


def _names(robot: Robot, several: bool) -> dict[str, str]:
    stem = f"{robot.name}.validate"
    names = {"report": f"{stem}.html", "junit": f"{stem}.junit.xml"}
    if several:
        names |= {"summary": f"{stem}.summary.json", "table": f"{stem}.logs.csv", "parquet": f"{stem}.logs.parquet"}
    return names


def _result(
    robot: Robot, outcomes: Sequence[Outcome], inputs: dict[str, str], options: ValidateOptions
) -> dict[str, Any]:
    results = [outcome.done["logs"][0] for outcome in outcomes if outcome.record is not None]
    skipped = skipped_entries(outcomes)
    friction = friction_from(robot, options)
    return {
        "passed": passed(results, skipped),
        "friction": friction,
        "scope": SCOPES[friction],
        "skipped": skipped,
        "options": options.data,
        "logs": results,
        "provenance": overall_provenance(inputs, outcomes),
    }


def _write(
    folder: OutputFolder, robot: Robot, result: dict[str, Any], options: ValidateOptions, names: dict[str, str]
) -> None:
    """Results about all logs; the page of a single log is there already."""
    folder.write(names["junit"], junit(robot, result["logs"], result["skipped"], options))
    if "summary" not in names:
        return
    folder.write(names["summary"], record_text(result))
    table = validation_table(result["logs"])
    folder.write(names["table"], csv_table(table))
    folder.write(names["parquet"], parquet_table(table))
    folder.write(names["report"], render(validation_fleet_report(robot.name, result, options)))
