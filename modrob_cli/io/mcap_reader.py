"""Logs in: positions, velocities and efforts of a robot's joints from an MCAP or a CSV file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from modrob_cli.io.joint_reader import JointReader
from modrob_cli.io.log_completeness import Completeness
from modrob_cli.io.log_csv import read_log_csv
from modrob_cli.io.log_options import LogOptions
from modrob_cli.model.log import JointLog, Recording


def read_joint_log(
    path: Path,
    joint_names: Sequence[str] | None = None,
    topic: str | None = None,
    options: LogOptions | None = None,
) -> JointLog:
    """Read positions, velocities and efforts of a robot's joints.

    Samples that lack a position or an effort are left out. Velocities that are missing anywhere count as not recorded.

    Parameters
    ----------
    path : MCAP file; or CSV file with the columns that ``docs/logs.md`` describes
    joint_names : joints that are wanted, in this order; others are ignored. None: all, in the order of the log
    topic : shorthand for ``options.topic``

    Raises
    ------
    InputFileError
        If the file cannot be read; nothing in it can be used; it has no such topic or several; it lacks joints,
        positions or efforts; several publishers contradict one another; its times go back.
    """
    options = options or LogOptions()
    recording = read_recording(path, joint_names, replace(options, topic=topic or options.topic))
    return complete_log(path, recording)


def read_recording(
    path: Path, joint_names: Sequence[str] | None = None, options: LogOptions | None = None
) -> Recording:
    """Read what a file says about joints; parameters and errors as in :func:`read_joint_log`.

    Values may be missing (NaN, None).
    """
    options = options or LogOptions()
    if path.suffix.lower() == ".csv":
        return read_log_csv(path, joint_names, options.joint_map, options.strict)
    return JointReader(path, joint_names, options).read()


def complete_log(path: Path, recording: Recording) -> JointLog:
    """Leave out samples without position or effort, and velocities if some are missing.

    Raises
    ------
    InputFileError
        If too little is left.
    """
    found = Completeness(len(recording.joint_names))
    good = found.add(recording.q, recording.dq, recording.effort)
    notes = (*recording.notes, *found.notes(path, recording.joint_names))
    kept = slice(None) if good.all() else np.flatnonzero(good)  # a slice does not copy
    dq = recording.dq[kept] if recording.dq is not None and found.has_velocity else None
    effort = np.asarray(recording.effort)[kept]  # there are efforts: without any, there is an error by now
    stamps = recording.stamps[kept]
    t = (stamps - stamps[0]) / 1e9
    arrays = (recording.q[kept], dq, effort)
    return JointLog(recording.name, recording.joint_names, t, *arrays, recording.repeated, notes, int(stamps[0]))
