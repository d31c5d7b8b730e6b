"""The HTML report of a validation of many logs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.plot.fleet import SpreadPanel, spread_figure
from modrob_cli.report.document import Block, Cell, Picture, Report, Section, Table, Text, Verdict
from modrob_cli.workflows.fleet_hashes import hash_rows
from modrob_cli.workflows.fleet_parameters import parameter_measures
from modrob_cli.workflows.fleet_statistics import FEWEST, MAD_TO_SIGMA, OUTLYING, spread
from modrob_cli.workflows.fleet_time import FleetTime, fleet_time
from modrob_cli.workflows.fleet_trends import Measure, Series, trend_sections
from modrob_cli.workflows.identify_summary import UNITS
from modrob_cli.workflows.validate_fleet_logs import (
    all_logs_blocks,
    note_blocks,
    page_link,
    skipped_blocks,
    worst_blocks,
)
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_report import provenance_rows, verdict
from modrob_cli.workflows.validate_table import JointColumn, Result, joint_columns, worst_first

RULE = (
    f"An outlier has an NRMSE above median + {OUTLYING:g} x {MAD_TO_SIGMA} MAD of its logarithm, or a fraction inside "
    f"below median - {OUTLYING:g} x {MAD_TO_SIGMA} MAD, joint by joint (MAD: median absolute deviation; at least 2 % "
    f"of NRMSE, half a percent of the samples). Of fewer than {FEWEST} logs none is called one."
)


def validation_fleet_report(robot_name: str, result: Result, options: ValidateOptions) -> Report:
    """Verdict first, then what could not be judged, joints, worst logs, drift, parameters, all logs.

    Parameters
    ----------
    result : as ``modrob validate --json`` gives it
    """
    logs, skipped = result["logs"], result["skipped"]
    sections = [Section("Logs that could not be judged", tuple(skipped_blocks(skipped)))] if skipped else []
    if logs:
        sections += _sections(logs, options)
    left = f", {len(skipped)} more could not be judged" if skipped else ""
    return Report(
        f"Validation of {robot_name}",
        f"{_count(len(logs))}{left}; effort is {options.effort}; friction: {result['friction']}",
        _verdict(result, options),
        tuple(sections),
        (*provenance_rows({}, options), *hash_rows(result["provenance"]["inputs"])),
        signature=True,
    )


def _count(number: int) -> str:
    return "1 log" if number == 1 else f"{number} logs"


def _sections(logs: Sequence[Result], options: ValidateOptions) -> list[Section]:
    columns = joint_columns(logs)
    order = worst_first(logs, columns)
    when = fleet_time([result.get("date") for result in logs])
    sections = [
        Section("Joints over all logs", tuple(_joints(logs, columns, options))),
        Section("The worst logs and the outliers", (*worst_blocks(logs, columns, order), Text(RULE))),
    ]
    if len(logs) > 1:
        sections += trend_sections("Drift of the errors", when, _errors(columns, options), "drift")
        sections += _parameters(logs, when)
    sections.append(
        Section(f"All logs ({len(logs)})", tuple(all_logs_blocks(logs, columns, order)), folded=True, on_paper=False)
    )
    notes = note_blocks(logs)
    return [*sections, Section("Notes", tuple(notes), folded=True)] if notes else sections


def _verdict(result: Result, options: ValidateOptions) -> Verdict:
    """That of all logs, and how many of them it was not kept by."""
    said = verdict(result, options)
    failed = [log for log in result["logs"] if any(joint["passed"] is False for joint in log["joints"])]
    counts = f"{len(failed)} of {_count(len(result['logs']))} did not pass. " if failed else ""
    if result["skipped"]:
        counts += f"{_count(len(result['skipped']))} could not be judged. "
    return Verdict(said.tone, said.headline, counts + said.scope)


def _joints(logs: Sequence[Result], columns: Sequence[JointColumn], options: ValidateOptions) -> list[Block]:
    rows: list[tuple[Cell, ...]] = []
    for j, column in enumerate(columns):
        entries = [result["joints"][j] for result in logs]
        ratio, inside = spread(column.nrmse), spread(column.inside)
        worst = int(np.nanargmax(column.nrmse)) if ratio is not None else None
        figures = (None,) * 4 if ratio is None else (ratio.lower, ratio.median, ratio.upper, ratio.largest)
        row = (column.name, *figures, None if worst is None else page_link(logs[worst]), int(column.high.sum()))
        largest = max(entry["max_error"] for entry in entries)
        part = (max(entry["rmse"] for entry in entries), largest, column.unit)
        held = (None, None) if inside is None else (inside.median, inside.least)
        rows.append((*row, *part, *held, int(column.low.sum())))
    quartiles = ("NRMSE: lower quartile", "median", "upper quartile", "worst", "in", "NRMSE outliers")
    others = ("RMSE, worst", "largest error", "unit", "inside: median", "least", "inside outliers")
    header = ("joint", *quartiles, *others)
    caption = (
        "NRMSE: RMS error / RMS of the recorded torque. Inside: fraction of samples inside the bounds of the model."
    )
    return [Table(header, tuple(rows), caption), _distribution(columns, options)]


def _distribution(columns: Sequence[JointColumn], options: ValidateOptions) -> Picture:
    ratios = SpreadPanel(
        "NRMSE",
        tuple(column.nrmse for column in columns),
        tuple(column.high for column in columns),
        logarithmic=True,
        limit=options.max_nrmse,
    )
    inside = SpreadPanel(
        "fraction of samples inside the bounds",
        tuple(column.inside for column in columns),
        tuple(column.low for column in columns),
        limit=options.min_inside,
    )
    words = "NRMSE and fraction of samples inside the bounds of each log, joint by joint"
    limits = " Dashed: what passes." if options.wants_verdict else ""
    caption = f"{words}. Frame: quartiles; thick line: median; red: outliers.{limits}"
    return Picture(spread_figure([column.name for column in columns], [ratios, inside], "spread"), caption, words)


def _errors(columns: Sequence[JointColumn], options: ValidateOptions) -> list[Measure]:
    ratios = tuple(Series(column.name, "", column.nrmse, column.high) for column in columns)
    inside = tuple(Series(column.name, "", column.inside, column.low) for column in columns)
    return [Measure("NRMSE", ratios, options.max_nrmse), Measure("fraction inside", inside, options.min_inside)]


def _parameters(logs: Sequence[Result], when: FleetTime) -> list[Section]:
    """Friction that was fitted to each log, if any was."""
    if not any("fit" in joint for result in logs for joint in result["joints"]):
        return []
    fits: list[list[dict[str, Any]] | None] = [
        [{"name": joint["name"], **joint.get("fit", {})} for joint in result["joints"]] for result in logs
    ]
    joints = logs[0]["joints"]
    measures = parameter_measures(fits, lambda j, key: UNITS[key][0 if joints[j]["unit"] == "N m" else 1])
    title = "Friction fitted to each log, link side (modrob identify tells its intervals)"
    return trend_sections(title, when, measures, "fit")
