"""Parts of reports on collision thresholds, made from the results of one log or of many."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.report.document import Block, Table, Text, Tone, Verdict
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_result import METHODS, SCOPE

MOST_EVENTS = 200


def collision_verdict(results: Sequence[dict[str, Any]], skipped: int = 0) -> Verdict:
    """What was found, in a sentence; ``skipped`` logs have no result."""
    logs = [result for result in results if not result["planned"]]
    events = sum(len(result["events"]) for result in logs)
    left = f" {_count(skipped, 'log')} could not be judged." if skipped else ""
    if not logs:
        return Verdict("open", f"Thresholds of planned motions; nothing was measured.{left}", SCOPE)
    known = [contact for result in logs for contact in result["contacts"] or ()]
    tone: Tone = "bad" if events or skipped else "good"
    if not events and not known:
        return Verdict(tone, f"No collision: the measured torque never left its band.{left}", SCOPE)
    found = sum(contact["delays"]["bands"] is not None for contact in known)
    alarms = sum(result["methods"][0]["false_alarms"] or 0 for result in logs)
    text = f"{'Collision' if events else 'No collision'} found: {_count(events, 'event')} in {_count(len(logs), 'log')}"
    if events and len(logs) > 1:
        text += f", {sum(bool(result['events']) for result in logs)} of which have any"
    labelled = any(result["contacts"] is not None for result in logs)
    text += f". Of {len(known)} known contacts {found} were found; {alarms} false alarms." if labelled else "."
    return Verdict(tone, text + left, SCOPE)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def event_blocks(results: Sequence[dict[str, Any]]) -> list[Block]:
    """All events, up to a limit."""
    rows = [
        (result["log"], event["start"], event["end"], event["joint"], event["side"], event["peak"], event["unit"])
        for result in results
        for event in result["events"]
    ]
    if not rows:
        return [Text("None.")]
    header = ("log", "start [s]", "end [s]", "joint", "side", "peak beyond the band", "unit")
    left = f"{len(rows) - MOST_EVENTS} more are in the CSV file." if len(rows) > MOST_EVENTS else ""
    return [Table(header, tuple(rows[:MOST_EVENTS]), left)]


def method_blocks(results: Sequence[dict[str, Any]], head: dict[str, Any]) -> list[Block]:
    """What each method found in all logs together."""
    names = list(dict.fromkeys(method["method"] for result in results for method in result["methods"]))
    rows = []
    for name in names:
        found = [method for result in results for method in result["methods"] if method["method"] == name]
        known = [one for one in found if one["false_alarms"] is not None]
        delays = [
            contact["delays"][name]
            for result in results
            for contact in result["contacts"] or ()
            if contact["delays"][name] is not None
        ]
        alarms = sum(one["false_alarms"] for one in known) if known else None
        middle = float(np.median(delays)) if delays else None
        totals = [sum(one[key] for one in found) for key in ("events", "contacts", "detected", "missed")]
        rows.append((METHODS[name], totals[0], alarms, *totals[1:], middle))
    header = ("method", "events", "false alarms", "known contacts", "found", "missed", "median delay [s]")
    blocks: list[Block] = [
        Table(header, tuple(rows), "False alarms: in logs that tell about contacts (or their lack).")
    ]
    learned = head["learned"]
    if learned is None:
        return [*blocks, Text("Constant thresholds and the momentum observer need logs without contact (--train).")]
    text = f"Learned from {', '.join(learned['logs'])} with a margin of {learned['margin']:.0%}; "
    return [*blocks, Text(f"{text}gain of the observer {learned['observer']['gain']:g} 1/s.")]


def threshold_table(document: dict[str, Any]) -> Table:
    """Constant thresholds over all logs."""
    request = document["request"]
    rows = []
    for kind, names in (("torque", document["joints"]), ("force", ["Fx", "Fy", "Fz", "Mx", "My", "Mz"])):
        for j, name in enumerate(names):
            keys = (
                f"{end}_{kind}_thresholds_{phase}"
                for phase in ("acceleration", "nominal")
                for end in ("lower", "upper")
            )
            rows.append((name, *(request[key][j] for key in keys), document["units"][kind][j]))
    header = ("joint", "acceleration, lower", "upper", "constant velocity, lower", "upper", "unit")
    return Table(header, tuple(rows), document["description"])


def option_rows(options: CollisionOptions) -> list[tuple[str, str]]:
    """Label and value of each option."""
    return [(key.replace("_", " "), "-" if value in (None, []) else str(value)) for key, value in options.data.items()]
