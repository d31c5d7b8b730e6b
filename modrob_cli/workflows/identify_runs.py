"""Logs to identify from: read, one cut-off for all, split into a part to fit and a part to judge."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.errors import Fault, InputFileError, NumericalError
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.identify.signal_cutoff import RATE_SHARE, RULE, CutoffChoice, choose_cutoff
from modrob_cli.identify.signals import MARGIN
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.io.outputs import sha256
from modrob_cli.model.log import JointLog, UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_options import IdentifyOptions

ABSURD = 1e12
"""Largest position, velocity or effort that is believed, in any unit."""

Tracker = Callable[[Sequence[Path]], Iterable[Path]]


@dataclass(frozen=True)
class LogRun:
    """One log and what became of it.

    Attributes
    ----------
    path : of the file;  log : as read
    whole : all that counts;  train, test : parts of it
    gravity : torque that carries the arm at rest, shape (N, n)
    """

    path: Path
    log: JointLog
    whole: Run
    train: Run
    test: Run
    gravity: Array


@dataclass(frozen=True)
class LoadedRuns:
    """All logs.

    Attributes
    ----------
    runs : usable ones
    skipped : path and reason of those that are too short
    cutoff : how the cut-off was chosen
    """

    runs: list[LogRun]
    skipped: list[tuple[Path, str]]
    cutoff: CutoffChoice

    @property
    def train(self) -> list[Run]:
        """Parts to fit."""
        return [item.train for item in self.runs]

    @property
    def test(self) -> list[Run]:
        """Parts to judge."""
        return [item.test for item in self.runs]


def load_runs(robot: Robot, logs: Sequence[Path], options: IdentifyOptions, track: Tracker = iter) -> LoadedRuns:
    """Read and prepare all logs.

    Raises
    ------
    InputFileError
        With the faults of all logs.
    UsageError
        If the robot lacks constants that the effort needs, or the cut-off does not fit.
    NumericalError
        If all logs are too short.
    """
    found: list[tuple[Path, JointLog]] = []
    faults: list[Fault] = []
    names = iter(unique_stems(logs))
    for path in track(logs):
        name = next(names)
        try:
            log = read_joint_log(path, robot.joint_names, options=options.reading)
            faults += _absurd(path, log)
            found.append((path, replace(log, name=name)))
        except InputFileError as error:
            faults.extend(error.faults)
    if faults:
        raise InputFileError(faults)
    choice = _common_cutoff([log for _, log in found], options.cutoff)
    runs, skipped = [], []
    for path, log in found:
        try:
            runs.append(_log_run(robot, path, log, options, choice.cutoff))
        except NumericalError as error:
            skipped.append((path, str(error)))
    if not runs:
        raise NumericalError("\n".join(reason for _, reason in skipped))
    return LoadedRuns(runs, skipped, choice)


def _absurd(path: Path, log: JointLog) -> list[Fault]:
    """Values that no arm has; their squares would overflow."""
    found = []
    for what, values in (("positions", log.q), ("velocities", log.dq), ("efforts", log.effort)):
        largest = 0.0 if values is None else float(np.max(np.abs(values)))
        if largest > ABSURD:
            found.append(Fault(str(path), f"found {what} up to {largest:.3g}; check the units, or what was recorded"))
    return found


def _common_cutoff(logs: Sequence[JointLog], given: float | None) -> CutoffChoice:
    """The given cut-off, or the median of those of the logs, the lowest quarter of a sampling rate at most."""
    choices = [choose_cutoff(log) for log in logs]
    bandwidth = np.array([choice.bandwidth for choice in choices])
    middle = np.array([np.median(x[np.isfinite(x)]) if np.isfinite(x).any() else np.nan for x in bandwidth.T])
    if given is not None:
        return CutoffChoice(given, middle, "given")
    lowest = min(RATE_SHARE / float(np.median(np.diff(log.t))) for log in logs)
    cutoff = min(float(np.median([choice.cutoff for choice in choices])), lowest)
    if len(logs) == 1:
        return CutoffChoice(cutoff, middle, choices[0].reason)
    return CutoffChoice(cutoff, middle, f"median over {len(logs)} logs of: {RULE}")


def _log_run(robot: Robot, path: Path, log: JointLog, options: IdentifyOptions, cutoff: float) -> LogRun:
    # An unknown drive gain is fitted in units of what was recorded, as if that were torque.
    effort = "torque" if options.regression.drive_gain else options.effort
    whole = prepare_run(robot, log, effort, cutoff)
    still = np.zeros_like(whole.q)
    gravity = rnea(robot, whole.q, still, still)
    if options.holdout == 0.0:
        return LogRun(path, log, whole, whole, whole.between(0.0, 0.0), gravity)
    split = (1.0 - options.holdout) * whole.duration
    # What the filter smears across the split must not tell the fit about the held-out part.
    train = whole.between(0.0, split - MARGIN / cutoff)
    return LogRun(path, log, whole, train, whole.between(split, np.inf), gravity)


def used_logs(runs: Sequence[LogRun]) -> list[UsedLog]:
    """Stretches of the logs that were fitted, for the robot file."""
    out = []
    for item in runs:
        held_out = bool(item.test.used.any())
        last = float(item.train.t[item.train.used].max(initial=0.0) - item.train.t[0]) if held_out else None
        out.append(UsedLog(item.path.name, sha256(item.path), 0.0, last))
    return out


def unique_stems(logs: Sequence[Path]) -> list[str]:
    """Names of logs for people and outputs; those of one name in different folders get -2, -3, ..."""
    stems: list[str] = []
    for path in logs:
        stem, count = path.stem, 1
        while stem in stems:
            count += 1
            stem = f"{path.stem}-{count}"
        stems.append(stem)
    return stems
