"""What is in logs, for people and scripts."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.joint_batch import QUANTITIES
from modrob_cli.io.joint_summary import (
    JointTopicSummary,
    Range,
    TimeSummary,
    summarize_mcap,
    summarize_times,
)
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.log_sources import local_copy
from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.model.log import Recording

Tracker = Callable[[Sequence[str]], Iterable[str]]


def log_info(logs: Sequence[str | Path], options: LogOptions, track: Tracker = iter) -> dict[str, Any]:
    """Describe logs.

    Parameters
    ----------
    logs : paths or URLs
    track : wraps the list of logs, to show progress

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/logs.md``; "skipped" has files of which nothing can be read,
        and damaged ones if ``options.strict``

    Raises
    ------
    InputFileError
        If all are, with the faults of all.
    """
    results: list[dict[str, Any]] = []
    skipped: list[dict[str, Any]] = []
    faults: list[Fault] = []
    for source in track([str(log) for log in logs]):
        try:
            with local_copy(source) as path:
                found = _csv_info(path, options) if path.suffix.lower() == ".csv" else _mcap_info(path, options)
            results.append({**found, "log": source})
        except InputFileError as error:
            faults.extend(error.faults)
            skipped.append({"log": source, "reason": str(error), "code": error.exit_code})
    if faults and not results:
        raise InputFileError(faults)
    return {"logs": results, "skipped": skipped}


def _mcap_info(path: Path, options: LogOptions) -> dict[str, Any]:
    summary = summarize_mcap(path)
    if options.strict and summary.damage[0]:
        raise InputFileError(
            Fault(str(path), f"--strict refuses a file that is damaged: {'; '.join(summary.damage[0])}")
        )
    if summary.damage[0] and not any(count for *_, count in summary.topics):
        raise InputFileError(Fault(str(path), f"no message can be read: {'; '.join(summary.damage[0])}"))
    candidates = summary.candidates()
    wanted = options.topic or (candidates[0] if len(candidates) == 1 else None)
    read, problem = None, None
    try:
        recording = read_recording(path, None, options)
        read = _reading(recording)
    except (InputFileError, UsageError) as error:
        problem = error.faults[0].message if isinstance(error, InputFileError) else str(error)
    return {
        "log": str(path),
        "kind": "mcap",
        "topics": [
            {"topic": topic, "type": kind, "encoding": encoding, "messages": count}
            for topic, kind, encoding, count in summary.topics
        ],
        "joint_topics": [_joint_topic(topic, one, wanted) for topic, one in sorted(summary.joints.items())],
        "read": read,
        "problem": problem,
        "damage": {
            **summary.damage[1],
            "words": summary.damage[0],
            "unknown_messages": summary.unknown,
            "unchecked_messages": summary.unchecked,
        },
    }


def _joint_topic(topic: str, summary: JointTopicSummary, wanted: str | None) -> dict[str, Any]:
    header, log = summary.times()
    return {
        "topic": topic,
        "type": summary.kind,
        "used": topic == wanted,
        "messages": sum(summary.sources.values()),
        "undecoded": summary.undecoded,
        "problem": summary.problem or None,
        "publishers": [
            {
                "number": number,
                "messages": count,
                "channel": source.channel,
                "frame": source.frame,
                "quantities": list(source.recorded),
                "joints": list(source.names),
            }
            for number, (source, count) in enumerate(summary.publishers()[:50], start=1)
        ],
        "publisher_count": len(summary.sources),
        "joints": [
            {"name": name, **{key: _range(one) for key, one in zip(QUANTITIES, ranges, strict=True)}}
            for name, ranges in summary.ranges.items()
        ],
        "header_time": _times(header),
        "log_time": _times(log),
    }


def _range(one: Range) -> dict[str, float | int | None]:
    known = one.least <= one.most
    return {"min": one.least if known else None, "max": one.most if known else None, "missing": one.missing}


def _times(times: TimeSummary) -> dict[str, Any]:
    known = times.start is not None and times.end is not None
    duration = times.end - times.start if times.start is not None and times.end is not None and known else None
    return {
        **asdict(times),
        "gaps": [list(gap) for gap in times.gaps],
        "duration": duration,
        "rate": None if times.step is None else 1.0 / times.step,
    }


def _reading(recording: Recording) -> dict[str, Any]:
    """What a command that reads the log gets."""
    steps = np.diff(recording.stamps)
    return {
        "topic": recording.topic or None,
        "time": recording.time,
        "samples": len(recording.stamps),
        "joints": list(recording.joint_names),
        "duration": int(recording.stamps[-1] - recording.stamps[0]) / 1e9,
        "rate": 1e9 / float(np.median(steps)),
        "longest_gap": int(steps.max()) / 1e9,
        "velocity": recording.dq is not None,
        "effort": recording.effort is not None,
        "repeated": recording.repeated,
        "notes": list(recording.notes),
    }


def _csv_info(path: Path, options: LogOptions) -> dict[str, Any]:
    recording = read_recording(path, None, options)
    tables = zip(QUANTITIES, (recording.q, recording.dq, recording.effort), strict=True)
    joints: list[dict[str, Any]] = [{"name": name} for name in recording.joint_names]
    for key, table in tables:
        for j, joint in enumerate(joints):
            one = Range(missing=len(recording.stamps) if table is None else 0)
            if table is not None:
                one.add(table[:, j])
            joint[key] = _range(one)
    return {
        "log": str(path),
        "kind": "csv",
        "topics": [],
        "joint_topics": [],
        "read": _reading(recording),
        "problem": None,
        "joints": joints,
        "time": _times(summarize_times(recording.stamps)),
        "damage": None,
    }
