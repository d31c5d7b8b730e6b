"""The HTML report over many logs and planned motions, and their table."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.io.table_writer import Column, DataTable
from modrob_cli.model.robot import Robot
from modrob_cli.plot.fleet import SpreadPanel, spread_figure
from modrob_cli.report.document import Block, Link, Notes, Picture, Report, Section, Table, Tone
from modrob_cli.workflows.collision_blocks import (
    collision_verdict,
    event_blocks,
    method_blocks,
    option_rows,
    threshold_table,
)
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.fleet_hashes import hash_rows
from modrob_cli.workflows.fleet_statistics import FEWEST, MAD_TO_SIGMA, OUTLYING, high_outliers
from modrob_cli.workflows.fleet_time import fleet_time
from modrob_cli.workflows.fleet_trends import Measure, Series, trend_sections
from modrob_cli.workflows.validate_fleet_logs import shown_date, skipped_blocks

MOST_SHOWN = 30
"""Logs in the table that is open; the others are in one that opens on request."""
MOST_ROWS, MOST_NOTES = 5000, 40
RULE = (
    f"An outlier uses more than median + {OUTLYING:g} x {MAD_TO_SIGMA} MAD of the logarithm, joint by joint (MAD: "
    f"median absolute deviation). Of fewer than {FEWEST} logs none is called one."
)
_BAD = 1.0
"""Share of the band that a measurement uses at its end."""


def nearness(record: dict[str, Any]) -> float:
    """How bad a log is: the largest share of its band that was used, those with events before all others."""
    (result,) = record["logs"]
    return share_of(result) + (1e12 if result["events"] else 0.0)


def share_of(result: dict[str, Any]) -> float:
    """Largest share of the band that any joint used; -1 for a planned motion."""
    return max((joint["share"] for joint in result["closest"] or ()), default=-1.0)


def collision_fleet_report(robot: Robot, result: dict[str, Any], options: CollisionOptions) -> Report:
    """Verdict, logs worst first, how near they came to their bands, methods, sensitivity, thresholds.

    Parameters
    ----------
    result : plain data about all logs, see ``docs/collision.md``
    """
    results = result["logs"]
    order = sorted(results, key=lambda one: -nearness({"logs": [one]}))
    skipped = result["skipped"]
    sections = [Section("Logs that could not be judged", tuple(skipped_blocks(skipped)))] if skipped else []
    sections.append(Section("Logs, the worst first", (_log_table(order[:MOST_SHOWN]),)))
    measured = [one for one in results if one["closest"]]
    if measured:
        sections += _nearness(robot, measured)
    sections.append(Section("Events", tuple(event_blocks(order)), folded=True))
    if any(one["methods"] for one in results):
        sections.append(Section("Methods side by side", tuple(method_blocks(results, result))))
    sections.append(Section("What is certain to be found", tuple(_sensitivity(robot, results))))
    sections.append(Section("Constant thresholds for controllers", (threshold_table(result["thresholds"]),)))
    if len(order) > MOST_SHOWN:
        rest = (_log_table(order[:MOST_ROWS]),)
        sections.append(Section(f"All logs ({len(order)})", rest, folded=True, on_paper=False))
    sections += _notes(order)
    made_from = result["provenance"]
    rows = [("modrob", str(made_from["modrob"])), *option_rows(options), *hash_rows(made_from["inputs"])]
    return Report(
        f"Collision thresholds of {robot.name}",
        f"{len(results)} motions; filter {options.filter}; {options.method} bands",
        collision_verdict(results, len(result["skipped"])),
        tuple(sections),
        tuple(rows),
        signature=True,
    )


def _log_table(results: Sequence[dict[str, Any]]) -> Table:
    rows: list[tuple[Any, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for result in results:
        worst = max(result["closest"] or [{"share": None, "joint": None, "time": None}], key=lambda one: one["share"])
        count = None if result["planned"] else len(result["events"])
        if count:
            tones[len(rows), 2] = "bad"
        alarms = result["methods"][0]["false_alarms"] if result["methods"] else None
        place = (worst["share"], worst["joint"], worst["time"])
        rows.append(
            (log_link(result), shown_date(result), count, alarms, *place, result["duration"], result["samples"])
        )
    header = ("log", "date", "events", "false alarms", "share of the band used", "joint", "at [s]", "duration [s]")
    caption = "Share used: distance from the middle of the band over its half-width; beyond 1 is outside."
    return Table((*header, "samples"), tuple(rows), caption, tones)


def _nearness(robot: Robot, results: Sequence[dict[str, Any]]) -> list[Section]:
    """Which share of its band each log used, joint by joint, and whether that drifts."""
    shares = np.array([[joint["share"] for joint in result["closest"]] for result in results])
    marked = tuple(high_outliers(column) for column in shares.T)
    rows = []
    for j, name in enumerate(robot.joint_names):
        quartiles = np.quantile(shares[:, j], [0.25, 0.5, 0.75, 1.0]).tolist()
        worst = results[int(shares[:, j].argmax())]
        beyond = int(np.count_nonzero(shares[:, j] > _BAD))
        rows.append((name, *quartiles, log_link(worst), beyond, int(np.count_nonzero(marked[j]))))
    header = ("joint", "lower quartile", "median", "upper quartile", "largest", "in", "logs beyond 1", "outliers")
    panel = SpreadPanel("largest share of the band used", tuple(shares.T), marked, limit=_BAD)
    words = "Largest share of its band that the measurement of each joint used, log by log"
    caption = f"{words}. Frame: quartiles; thick line: median; dashed: the end of the band; red: outliers."
    drawn = Picture(spread_figure(robot.joint_names, [panel], "shares"), caption, words)
    blocks = (Table(header, tuple(rows), RULE), drawn)
    sections = [Section("How near the measured torque came to its band", blocks)]
    if len(results) > 1:
        when = fleet_time([result["date"] for result in results])
        names = robot.joint_names
        series = tuple(Series(name, "", shares[:, j], marked[j]) for j, name in enumerate(names))
        sections += trend_sections("Drift of the share used", when, [Measure("share used", series, _BAD)], "drift")
    return sections


def log_link(result: dict[str, Any]) -> Link:
    """Name of a log that leads to its page, or else to its data."""
    return Link(result["log"], result["page"] or f"{result['log']}.collision.json")


def _notes(results: Sequence[dict[str, Any]]) -> list[Section]:
    """What was noticed, each note once with the logs that have it."""
    found: dict[str, list[str]] = {}
    for result in results:
        for note in result["notes"]:
            found.setdefault(note, []).append(result["log"])
    if not found:
        return []
    ordered = sorted(found.items(), key=lambda item: -len(item[1]))
    items = [f"{_several(names)}: {note}" for note, names in ordered[:MOST_NOTES]]
    left = len(ordered) - len(items)
    items += [f"{left} more notes are in the summary JSON"] if left else []
    return [Section("Notes", (Notes(tuple(items)),), folded=True)]


def _several(names: Sequence[str]) -> str:
    listed = ", ".join(names[:3])
    return listed if len(names) == 1 else f"{len(names)} logs ({listed}{', ...' if len(names) > 3 else ''})"


def _sensitivity(robot: Robot, results: Sequence[dict[str, Any]]) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    for j, name in enumerate(robot.joint_names):
        found = [result["sensitivity"][j] for result in results]
        ratios = [one["other_band_ratio"] for one in found if one["other_band_ratio"] is not None]
        least, worst = min(one["least"] for one in found), max(one["min_detectable"] for one in found)
        middle = float(np.median([one["median"] for one in found]))
        rows.append((name, least, middle, worst, float(np.median(ratios)) if ratios else None, found[0]["unit"]))
    header = ("joint", "least", "median", "worst", "other band is wider by", "unit")
    caption = "External joint torque that is certain to be found (width of the filtered band), over all logs."
    blocks: list[Block] = [Table(header, tuple(rows), caption + " Median: of the medians of the logs.")]
    rows = []
    for k, point in enumerate(results[0]["contact_forces"]):
        for key in [key for key in point if key != "point"]:
            figures = [result["contact_forces"][k][key] for result in results]
            rows.append(
                (point["point"], key.replace("_", " "), *(_over(figures, part) for part in ("median", "worst")))
            )
    caption = "Smallest contact force that is certain to be found, base frame; –: in some log no joint feels it."
    return [*blocks, Table(("point", "direction", "median [N]", "worst [N]"), tuple(rows), caption)]


def _over(figures: Sequence[dict[str, Any]], key: str) -> float | None:
    """Median of medians, or the worst of all; None where some log has none."""
    values = [figure[key] for figure in figures]
    if any(value is None for value in values):
        return None
    return float(np.median(values) if key == "median" else np.max(values))


def collision_table(results: Sequence[dict[str, Any]]) -> DataTable:
    """One row for each log and joint."""
    columns = (
        Column("log", "text"), Column("date", "date"), Column("joint", "text"), Column("unit", "text"),
        Column("planned", "flag"), Column("events", "count"),
        *(Column(name, "number") for name in ("share", "share_time", "least", "median", "min_detectable")),
        Column("samples", "count"), Column("duration", "number"), Column("source", "text"),
    )  # fmt: skip
    rows = []
    for result in results:
        for j, joint in enumerate(result["sensitivity"]):
            events = sum(event["joint"] == joint["joint"] for event in result["events"])
            near = result["closest"][j] if result["closest"] else {"share": None, "time": None}
            head = (result["log"], result["date"], joint["joint"], joint["unit"], result["planned"])
            figures = (near["share"], near["time"], joint["least"], joint["median"], joint["min_detectable"])
            tail = (result["samples"], result["duration"], result["source"])
            rows.append((*head, None if result["planned"] else events, *figures, *tail))
    return DataTable(columns, tuple(rows))
