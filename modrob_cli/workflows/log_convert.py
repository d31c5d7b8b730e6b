"""Logs from one format to another."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.log_csv import write_log_csv
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.model.log import Recording

TOPIC = "/joint_states"
_LAST = 2**31 * 10**9
"""Stamps of ROS 2 messages are below this, [ns]."""


def log_convert(
    source: Path,
    target: Path,
    options: LogOptions,
    joints: Sequence[str] | None = None,
    from_zero: bool = False,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Read a log (MCAP or CSV) and write its joint states as MCAP or CSV, by the ending of ``target``.

    Parameters
    ----------
    joints : joints to write, in this order; None: all
    from_zero : count times from the first sample

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/logs.md``

    Raises
    ------
    InputFileError
        If the log cannot be read, or its times do not fit into messages.
    UsageError
        If ``target`` ends neither with .mcap nor with .csv, or cannot be written.
    OutputExistsError
        If it is there already and ``overwrite`` is false.
    """
    kind = target.suffix.lower()
    if kind not in (".csv", ".mcap"):
        raise UsageError(f"{target}: found the ending {target.suffix or 'none'!r}, expected .csv or .mcap")
    with OutputFolder(target.parent, overwrite) as folder:
        folder.claim([target.name])
        recording = read_recording(source, joints, options)
        if from_zero:
            recording = replace(recording, stamps=recording.stamps - recording.stamps[0])
        origin = provenance([source])
        staged = folder.stage(target.name)
        if kind == ".csv":
            write_log_csv(staged, recording)
        else:
            _check_stamps(source, recording)
            write_mcap(staged, [_series(recording)], {"modrob": _texts(origin)})
    return {
        "log": str(source),
        "samples": len(recording.stamps),
        "joints": list(recording.joint_names),
        "quantities": [key for key in ("q", "dq", "effort") if getattr(recording, key) is not None],
        "topic": recording.topic or None,
        "time": recording.time,
        "start": int(recording.stamps[0]) / 1e9,
        "duration": int(recording.stamps[-1] - recording.stamps[0]) / 1e9,
        "repeated": recording.repeated,
        "notes": list(recording.notes),
        "files": {target.name: str(target)},
        "provenance": origin,
    }


def _check_stamps(source: Path, recording: Recording) -> None:
    first, last = int(recording.stamps[0]), int(recording.stamps[-1])
    if first < 0 or last >= _LAST:
        found = f"found times from {first / 1e9:.9g} s to {last / 1e9:.9g} s"
        message = f"{found}, a ROS 2 message holds 0 to {_LAST / 1e9:.10g} s; count from the first sample: --from-zero"
        raise InputFileError(Fault(str(source), message))


def _series(recording: Recording) -> Series:
    """``sensor_msgs/msg/JointState`` messages."""
    has = {"velocity": recording.dq is not None, "effort": recording.effort is not None}
    tables = [table for table in (recording.q, recording.dq, recording.effort) if table is not None]
    layout = joint_state(recording.joint_names, **has)
    return Series(TOPIC, layout, recording.stamps, np.concatenate(tables, axis=1))


def _texts(origin: dict[str, object]) -> dict[str, str]:
    """Provenance as texts."""
    inputs = origin["inputs"]
    hashes = inputs if isinstance(inputs, dict) else {}
    return {"version": str(origin["modrob"]), **{str(name): str(digest) for name, digest in hashes.items()}}
