"""Logs in: positions, velocities and efforts of a robot's joints from an MCAP or a CSV file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.joint_reader import JointReader
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
    return _complete(path, recording)


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


def _complete(path: Path, recording: Recording) -> JointLog:
    """Leave out samples without position or effort, and velocities if some are missing."""
    notes = list(recording.notes)
    if recording.effort is None:
        raise _fault(path, f"found no effort of {', '.join(recording.joint_names)}; a log needs effort")
    for what, values in (("position", recording.q), ("effort", recording.effort)):
        empty = np.asarray(~np.isfinite(values).any(axis=0))
        if empty.any():
            names = ", ".join(name for name, bad in zip(recording.joint_names, empty, strict=True) if bad)
            raise _fault(path, f"found no {what} of {names}; a log needs positions and efforts of all joints")
    good = np.asarray(np.isfinite(recording.q).all(axis=1) & np.isfinite(recording.effort).all(axis=1))
    if not good.all():
        notes.append(f"{np.count_nonzero(~good)} of {len(good)} samples lack a position or an effort and were left out")
    if np.count_nonzero(good) < 2:
        raise _fault(path, f"found {np.count_nonzero(good)} samples with all positions and efforts, expected 2 or more")
    kept = slice(None) if good.all() else np.flatnonzero(good)  # a slice does not copy
    dq = recording.dq[kept] if recording.dq is not None else None
    if dq is not None and not np.isfinite(dq).all():
        bad = np.count_nonzero(~np.isfinite(dq).all(axis=1))
        notes.append(f"velocities are missing in {bad} of {len(dq)} samples and count as not recorded")
        dq = None
    stamps = recording.stamps[kept]
    t = (stamps - stamps[0]) / 1e9
    arrays: tuple[Array, Array | None, Array] = (recording.q[kept], dq, recording.effort[kept])
    return JointLog(recording.name, recording.joint_names, t, *arrays, recording.repeated, tuple(notes))


def _fault(path: Path, message: str) -> InputFileError:
    return InputFileError(Fault(str(path), message))
