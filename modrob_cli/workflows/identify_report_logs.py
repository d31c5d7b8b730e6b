"""What the report of an identification says of the logs: the worst, all of them, those left out, notes."""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

from modrob_cli.report.document import Block, Cell, Link, Notes, Section, Table
from modrob_cli.workflows.identify_result import badness, worst_first

Entry = dict[str, Any]

FEW = 12
"""Up to so many logs are shown in one table; of more, so many of the worst, and all in a folded one."""
MOST_ROWS = 5000
MOST_SKIPPED = 50
MOST_NOTES = 40
MOST_HASHES = 40
MOST_JOINTS = 8
"""Joints that have a column each."""


def log_sections(result: Entry) -> list[Section]:
    """How each log was read and is predicted by the fit of all together."""
    logs, signals = result["logs"], result["signals"]
    notes = [f"low-pass at {signals['cutoff']:.4g} Hz: {signals['rule']}", *_notes(logs)]
    if len(logs) <= FEW:
        return [Section("Logs and signals", (_signals(logs), *_predictions(logs), Notes(tuple(notes))))]
    ordered = worst_first(logs)
    return [
        Section("Logs and signals", (*_predictions(ordered[:FEW]), Notes(tuple(notes)))),
        Section(f"All logs ({len(logs)})", (*_predictions(ordered), _signals(ordered)), folded=True, on_paper=False),
    ]


def skipped_section(skipped: Sequence[Entry]) -> list[Section]:
    """Logs that were left out, with the reasons; nothing without any."""
    if not skipped:
        return []
    rows = tuple((entry["log"], entry["reason"], entry["code"]) for entry in skipped[:MOST_SKIPPED])
    left = len(skipped) - len(rows)
    more = f" {left} more are in the JSON file." if left else ""
    caption = f"Exit codes: 1 a bug of this tool, 2 the options, 3 the file, 5 too little in it.{more}"
    return [Section("Logs that are left out", (Table(("log", "why", "exit code"), rows, caption),))]


def _predictions(logs: Sequence[Entry]) -> list[Block]:
    """NRMSE of the pooled fit, log by log; nothing for a single one, of which the joints' errors tell it."""
    if len(logs) < 2:
        return []
    names = next(([joint["name"] for joint in log["prediction"]] for log in logs if log["prediction"]), [])
    shown = names if len(names) <= MOST_JOINTS else []
    rows: list[tuple[Cell, ...]] = []
    for log in logs[:MOST_ROWS]:
        ratios = [joint["nrmse"] for joint in log["prediction"] or []] or [None] * len(names)
        worst = badness(log)
        cells = ratios if shown else [worst if worst >= 0.0 else None]
        rows.append((_link(log), _date(log), log["duration"], *cells))
    header = ("log", "date (UTC)", "duration [s]", *([f"NRMSE {name}" for name in shown] or ["NRMSE, worst joint"]))
    caption = "NRMSE of the fit of all logs together, by the part that is held out, if there is one."
    return [Table(header, tuple(rows), caption)]


def _signals(logs: Sequence[Entry]) -> Table:
    keys = ("samples", "samples_fitted", "samples_held_out", "rate", "velocity")
    rows = tuple((log["log"], *(log[key] for key in keys)) for log in logs[:MOST_ROWS])
    return Table(("log", "samples", "fitted", "held out", "rate [Hz]", "velocity"), rows)


def _link(log: Entry) -> Cell:
    """The log, leading to the record of its own fit if there is one."""
    return Link(log["log"], f"{log['name']}.identify.json") if "fit" in log else log["log"]


def _date(log: Entry) -> str | None:
    return log["date"][:16].replace("T", " ") if log["date"] else None


def _notes(logs: Sequence[Entry]) -> list[str]:
    """What was noticed, each note once with the logs that have it."""
    found: dict[str, list[str]] = {}
    for log in logs:
        for note in dict.fromkeys(log["notes"]):
            found.setdefault(note, []).append(log["log"])
    ordered = sorted(found.items(), key=lambda item: -len(item[1]))
    items = [f"{_several(names)}: {note}" for note, names in ordered[:MOST_NOTES]]
    left = len(ordered) - len(items)
    return [*items, f"{left} more notes are in the JSON file"] if left else items


def _several(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{len(names)} logs ({', '.join(names[:3])}{', ...' * (len(names) > 3)})"


def input_rows(inputs: Mapping[str, str]) -> list[tuple[str, str]]:
    """Hashes one by one, or of many files one over all of their names and hashes."""
    if len(inputs) <= MOST_HASHES:
        return list(inputs.items())
    lines = "".join(f"{name} {digest}\n" for name, digest in inputs.items())
    whole = hashlib.sha256(lines.encode(errors="surrogateescape")).hexdigest()
    return [(f"{len(inputs)} inputs", f"sha256:{whole} over the lines 'NAME HASH' of the inputs in the JSON file")]
