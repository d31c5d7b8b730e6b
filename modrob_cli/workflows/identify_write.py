"""The files of an identification."""

from dataclasses import dataclass
from typing import Any

from modrob_cli.errors import InputFileError
from modrob_cli.io.log_record import record_text
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.table_writer import csv_table, parquet_table
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.log import JointLog
from modrob_cli.report.render import render
from modrob_cli.schema.from_model import robot_data
from modrob_cli.workflows.identify_fit import Fitted, scaled
from modrob_cli.workflows.identify_fleet import identify_table
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_pictures import draw_filter_of, draw_friction_of, draw_torques_of, friction_panels
from modrob_cli.workflows.identify_pooled import PooledRun, PooledRuns, read_again
from modrob_cli.workflows.identify_report import identification_report
from modrob_cli.workflows.identify_robot import identified_robot
from modrob_cli.workflows.identify_summary import fit_entry, parameters_csv
from modrob_cli.workflows.robots import LoadedRobot


@dataclass(frozen=True)
class Written:
    """Where to and what.

    Attributes
    ----------
    names : of the files by kind
    result : plain data as documented in ``docs/identify.md``
    """

    folder: OutputFolder
    names: dict[str, str]
    robot: LoadedRobot
    result: dict[str, Any]


def write_identification(to: Written, pooled: PooledRuns, fitted: Fitted, options: IdentifyOptions) -> dict[str, str]:
    """Robot file, tables, pictures, report and JSON; returns the names of the files that there are."""
    arm, folder, names = to.robot.robot, to.folder, to.names
    confidence = options.regression.confidence
    train = scaled(pooled.train, fitted.estimates)
    source = f"modrob identify from {to.robot.files[0].name} and {len(pooled.runs)} logs; {confidence:.0%} intervals"
    updated = identified_robot(arm, fitted.estimates, train)
    folder.write(names["robot"], yaml_text(robot_data(updated, source, [item.used for item in pooled.runs])))
    logs = to.result["logs"]
    tables = [(run.whole.name, log["fit"]) for run, log in zip(pooled.runs, logs, strict=True) if log.get("fit")]
    folder.write(names["parameters"], parameters_csv(arm, [("pooled", fit_entry(arm, fitted)), *tables]))
    panels = friction_panels(arm, pooled, fitted, confidence)
    item = worst_log(pooled, fitted)
    draw_friction_of(arm, pooled, panels, folder.stage(names["friction"]))
    draw_torques_of(arm, item, fitted, folder.stage(names["torques"]))
    raw = _as_recorded(to.robot, item, options)
    if raw is None:
        names = {kind: name for kind, name in names.items() if kind != "filter"}
    else:
        draw_filter_of(arm, item, raw, pooled.cutoff.reason, folder.stage(names["filter"]))
    if "table" in names:
        table = identify_table(logs)
        folder.write(names["table"], csv_table(table))
        folder.write(names["parquet"], parquet_table(table))
    folder.write(names["report"], render(identification_report(arm, item, panels, fitted, to.result, options)))
    folder.write(names["json"], record_text(to.result))
    return names


def worst_log(pooled: PooledRuns, fitted: Fitted) -> PooledRun:
    """The log that is predicted worst by the sum over joints of squared errors relative to the recorded torque."""
    sizes = []
    for errors in fitted.logs:
        ratios = [found.error.nrmse or 0.0 for found in errors or []]
        sizes.append(sum(ratio**2 for ratio in ratios) if errors else -1.0)
    return pooled.runs[max(range(len(sizes)), key=sizes.__getitem__)]


def _as_recorded(robot: LoadedRobot, item: PooledRun, options: IdentifyOptions) -> JointLog | None:
    """The log before the low-pass, which nothing holds in memory; None if it is gone by now."""
    try:
        return read_again(robot.robot, item.found, options)
    except InputFileError:
        return None
