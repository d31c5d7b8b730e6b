"""Tables of logs in the report of many: the worst and the outlying ones, all of them, those that failed."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.report.document import Block, Cell, Link, Notes, Table, Text, Tone
from modrob_cli.workflows.validate_table import JointColumn, Result, shown_name

WORST = 10
"""Logs that are listed at any rate; outliers come on top of them."""
MOST_LISTED = 40
MOST_ROWS = 5000
MOST_JOINTS = 8
"""Joints that have a column each in the table of all logs."""
MOST_SKIPPED = 50
MOST_NOTES = 40


def page_link(result: Result) -> Cell:
    """Name of a log that leads to its page, or else to its data."""
    name = shown_name(result)
    return Link(name, result["page"]) if result.get("page") else _data(result, name)


def _data(result: Result, text: str) -> Cell:
    return Link(text, f"{result['name']}.validate.json") if result.get("name") else text


def shown_date(result: Result) -> str | None:
    """Date and time to the minute."""
    return result["date"][:16].replace("T", " ") if result.get("date") else None


def skipped_blocks(skipped: Sequence[dict[str, Any]]) -> list[Block]:
    """Logs without a result, with their errors."""
    rows = tuple(
        (entry["log"], entry["reason"].removeprefix(f"{entry['log']}: "), entry["code"])
        for entry in skipped[:MOST_SKIPPED]
    )
    left = len(skipped) - len(rows)
    more = f" {left} more are in the summary JSON." if left else ""
    caption = f"Exit codes: 1 a bug of this tool, 3 the file, 5 too little in it to judge by.{more}"
    return [Table(("log", "why", "exit code"), rows, caption)]


def worst_blocks(results: Sequence[Result], columns: Sequence[JointColumn], order: Sequence[int]) -> list[Block]:
    """The worst logs and all outliers, worst first."""
    standing_out = np.any([column.high | column.low for column in columns], axis=0)
    listed = [k for place, k in enumerate(order) if place < WORST or standing_out[k]]
    rows: list[tuple[Cell, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    medians = [_median(column.nrmse) for column in columns]
    for k in listed[:MOST_LISTED]:
        j = _worst_joint(columns, k)
        value, middle = columns[j].nrmse[k], medians[j]
        worst = float(value) if np.isfinite(value) else None
        times = round(worst / middle, 1) if worst is not None and middle else None
        least = min(range(len(columns)), key=lambda i: columns[i].inside[k])
        inside = f"{columns[least].inside[k]:.1%} ({columns[least].name})"
        failed = _failed(results[k])
        if failed:
            tones[len(rows), 3] = "bad"
        why = _why(columns, k)
        if why:
            tones[len(rows), 6] = "open"
        links = (
            Link("picture", results[k]["picture"]) if results[k].get("picture") else None,
            _data(results[k], "data"),
        )
        row = (
            page_link(results[k]),
            shown_date(results[k]),
            columns[j].name,
            worst,
            times,
            inside,
            why or None,
            *links,
        )
        rows.append(row)
    left = len(listed) - len(rows)
    caption = f"{left} more outliers are in the table of all logs." if left else ""
    header = (
        "log",
        "date (UTC)",
        "worst joint",
        "NRMSE",
        "times median",
        "inside, least",
        "outlier by",
        "picture",
        "data",
    )
    return [Table(header, tuple(rows), caption, tones)]


def _median(values: Any) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


def _worst_joint(columns: Sequence[JointColumn], k: int) -> int:
    """The joint of the largest NRMSE; one without comes first."""
    values = [column.nrmse[k] if np.isfinite(column.nrmse[k]) else np.inf for column in columns]
    return int(np.argmax(values))


def _why(columns: Sequence[JointColumn], k: int) -> str:
    high = [column.name for column in columns if column.high[k]]
    low = [column.name for column in columns if column.low[k]]
    parts = [f"NRMSE of {_few(high)}"] if high else []
    return "; ".join([*parts, f"inside of {_few(low)}"] if low else parts)


def _few(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{len(names)} joints"


def _failed(result: Result) -> bool:
    return any(joint["passed"] is False for joint in result["joints"])


def all_logs_blocks(results: Sequence[Result], columns: Sequence[JointColumn], order: Sequence[int]) -> list[Block]:
    """One row for each log, worst first: NRMSE of each joint, least fraction inside."""
    shown = columns if len(columns) <= MOST_JOINTS else []
    dated = any(result.get("date") for result in results)
    wanted = any(joint["passed"] is not None for result in results for joint in result["joints"])
    rows: list[tuple[Cell, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for k in order[:MOST_ROWS]:
        result = results[k]
        row: list[Cell] = [page_link(result)]
        row += [shown_date(result)] if dated else []
        row += [_verdict(result)] if wanted else []
        j = _worst_joint(columns, k)
        row += [columns[j].name] if not shown else []
        for column in shown or [columns[j]]:
            place = columns.index(column)
            if result["joints"][place]["passed"] is False:
                tones[len(rows), len(row)] = "bad"
            elif column.high[k]:
                tones[len(rows), len(row)] = "open"
            row.append(float(column.nrmse[k]) if np.isfinite(column.nrmse[k]) else None)
        row += [min(float(column.inside[k]) for column in columns), result["duration"], result["samples_used"]]
        rows.append(tuple(row))
    head = ["log", *(["date (UTC)"] if dated else []), *(["verdict"] if wanted else [])]
    head += [f"NRMSE {column.name}" for column in shown] or ["worst joint", "NRMSE"]
    head += ["inside, least", "duration [s]", "samples counted"]
    left = len(results) - len(rows)
    caption = f"The {len(rows)} worst; {left} more are in the CSV and Parquet files." if left else "Worst first."
    return [Table(tuple(head), tuple(rows), f"{caption} Red: not passed; amber: outlier.", tones)]


def _verdict(result: Result) -> str:
    verdicts = [joint["passed"] for joint in result["joints"]]
    return "failed" if False in verdicts else "passed" if True in verdicts else "none"


def note_blocks(results: Sequence[Result]) -> list[Block]:
    """What was noticed, each note once with the logs that have it."""
    found: dict[str, list[str]] = {}
    for result in results:
        name = shown_name(result)
        notes = [
            *result["notes"],
            *(f"{joint['name']}: {note}" for joint in result["joints"] for note in joint["notes"]),
        ]
        if result["seconds_left_out"]:
            notes.append(f"{result['seconds_left_out']:.4g} s were left out: the robot file was fitted to them")
        if result["fitted_to_these_samples"]:
            notes.append("friction was fitted to these very samples")
        for note in dict.fromkeys(notes):
            found.setdefault(note, []).append(name)
    if not found:
        return []
    ordered = sorted(found.items(), key=lambda item: -len(item[1]))
    items = [f"{names[0] if len(names) == 1 else _several(names)}: {note}" for note, names in ordered[:MOST_NOTES]]
    blocks: list[Block] = [Notes(tuple(items))]
    left = len(ordered) - len(items)
    return [*blocks, Text(f"{left} more notes are in the CSV and Parquet files.")] if left else blocks


def _several(names: Sequence[str]) -> str:
    return f"{len(names)} logs ({', '.join(names[:3])}{', ...' if len(names) > 3 else ''})"
