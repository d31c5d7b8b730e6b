"""A validation of many logs as one table, and as arrays per joint."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.io.table_writer import Column, DataTable, Kind
from modrob_cli.workflows.fleet_statistics import Flags, high_outliers, low_outliers

Result = dict[str, Any]

_JOINT: dict[str, Kind] = {
    "name": "text",
    "unit": "text",
    "passed": "flag",
    "nrmse": "number",
    "nrmse_low_passed": "number",
    "rmse": "number",
    "max_error": "number",
    "worst_time": "number",
    "inside": "number",
    "mean_width": "number",
}
_FIT: tuple[str, ...] = ("offset", "coulomb", "viscous", "reflected_inertia")
_LOG: dict[str, Kind] = {
    "duration": "number",
    "samples": "count",
    "samples_used": "count",
    "fitted_to_these_samples": "flag",
    "seconds_left_out": "number",
    "repeated_stamps": "count",
    "rate": "number",
    "resampled": "flag",
    "longest_gap": "number",
    "cutoff": "number",
    "velocity": "text",
    "effort": "text",
}


@dataclass(frozen=True)
class JointColumn:
    """One joint over all logs, N of them.

    Attributes
    ----------
    nrmse : nan where no torque was recorded;  inside : fraction inside the bounds
    high, low : logs that stand out by their NRMSE, and by what is inside
    """

    name: str
    unit: str
    nrmse: Array
    inside: Array
    high: Flags
    low: Flags


def validation_table(results: Sequence[Result]) -> DataTable:
    """A row for each joint of each log, in the order of the logs."""
    columns = [Column("log", "text"), Column("date", "date")]
    columns += [Column("joint" if key == "name" else key, kind) for key, kind in _JOINT.items()]
    columns += [Column(key, "number") for key in _FIT]
    columns += [Column(key, kind) for key, kind in _LOG.items()]
    columns.append(Column("notes", "text"))
    return DataTable(tuple(columns), tuple(_row(result, joint) for result in results for joint in result["joints"]))


def _row(result: Result, joint: Result) -> tuple[Any, ...]:
    fit = joint.get("fit") or {}
    return (
        result["log"],
        result.get("date"),
        *(joint[key] for key in _JOINT),
        *(fit.get(key) for key in _FIT),
        *(result[key] for key in _LOG),
        "; ".join([*result["notes"], *joint["notes"]]) or None,
    )


def joint_columns(results: Sequence[Result]) -> list[JointColumn]:
    """Errors of each joint over all logs, and which of them stand out."""
    out = []
    for j, joint in enumerate(results[0]["joints"]):
        entries = [result["joints"][j] for result in results]
        nrmse = np.array([np.nan if entry["nrmse"] is None else entry["nrmse"] for entry in entries], dtype=float)
        inside = np.array([entry["inside"] for entry in entries], dtype=float)
        column = (joint["name"], joint["unit"], nrmse, inside, high_outliers(nrmse), low_outliers(inside))
        out.append(JointColumn(*column))
    return out


def worst_first(results: Sequence[Result], columns: Sequence[JointColumn]) -> list[int]:
    """Places of the logs, by the NRMSE of the worst joint; first those with a joint that has none."""
    worst = np.stack([np.where(np.isfinite(column.nrmse), column.nrmse, np.inf) for column in columns]).max(axis=0)
    return sorted(range(len(results)), key=lambda k: (-worst[k], k))


def shown_name(result: Result) -> str:
    """Name of a log for tables: that of its files, or of itself."""
    return str(result.get("name") or PurePath(result["log"]).name)
