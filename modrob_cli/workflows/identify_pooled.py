"""The logs that are fitted together: planned by what was found out about each alone, then made ready one by one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.batch.jobs import Failure, Listener, LogJob, Outcome
from modrob_cli.errors import Fault, InputFileError, ModrobError
from modrob_cli.identify.run import Run
from modrob_cli.identify.signal_cutoff import RATE_SHARE, RULE, CutoffChoice
from modrob_cli.io.log_sources import local_copy
from modrob_cli.io.outputs import sha256
from modrob_cli.model.log import JointLog, UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_runs import Parts, read_log, split_run
from modrob_cli.workflows.identify_summary import glitch_notes, part_facts
from modrob_cli.workflows.identify_task import look

Entry = dict[str, Any]
Stage = Callable[[str, float], None]
"""Told what is being done and which part of it is done."""

_RECORD_ONLY = ("robot", "signals", "fit", "options", "provenance")


@dataclass(frozen=True)
class PooledRun(Parts):
    """One of the logs that are fitted together.

    Attributes
    ----------
    found : the log, and what was found out about it alone
    entry : what it is, as plain data
    """

    found: Outcome
    entry: Entry

    @property
    def digest(self) -> str:
        """Hash of the log's content."""
        return str(self.found.done["provenance"]["log"])

    @property
    def used(self) -> UsedLog:
        """The stretch that was fitted."""
        held_out = bool(self.test.used.any())
        train = self.train
        last = float(train.t[train.used].max(initial=0.0) - train.t[0]) if held_out else None
        return UsedLog(self.found.job.file, self.digest.removeprefix("sha256:"), 0.0, last)


@dataclass(frozen=True)
class PooledRuns:
    """All of them.

    Attributes
    ----------
    runs : in the order in which they were given
    cutoff : the common one, and how it was chosen
    failed : logs that are left out here
    """

    runs: list[PooledRun]
    cutoff: CutoffChoice
    failed: list[Outcome]

    @property
    def train(self) -> list[Run]:
        """Parts to fit."""
        return [item.train for item in self.runs]

    @property
    def test(self) -> list[Run]:
        """Parts to judge."""
        return [item.test for item in self.runs]


def look_at_all(
    robot: Robot, jobs: Sequence[LogJob], options: IdentifyOptions, fail_fast: bool, listener: Listener | None
) -> tuple[list[Outcome], dict[str, JointLog]]:
    """What each log is, without a fit of its own, and the logs as read, by name."""
    outcomes, logs = [], {}
    for job in jobs:
        try:
            with local_copy(job.source) as path:
                logs[job.name], record = look(robot, job, path, options)
                record["provenance"] = {"log": _digest(path)}
            outcome = Outcome(job, record)
        except ModrobError as error:
            outcome = failed(job, error)
        outcomes.append(outcome)
        if listener is not None:
            listener(outcome)
        if outcome.failure is not None and fail_fast:
            break
    return outcomes, logs


def failed(job: LogJob, error: ModrobError) -> Outcome:
    """A log without a result."""
    return Outcome(job, None, Failure(str(error), error.exit_code))


def make_ready(
    robot: Robot,
    outcomes: Sequence[Outcome],
    logs: dict[str, JointLog],
    options: IdentifyOptions,
    fail_fast: bool,
    stage: Stage,
) -> PooledRuns:
    """Make all logs ready that have a record, with one cut-off; a log that fails here is left out.

    Parameters
    ----------
    logs : those that were read before; they are taken out, so that they do not stay in memory. The others are read
    """
    planned = [outcome for outcome in outcomes if outcome.record is not None]
    choice = common_cutoff([outcome.done for outcome in planned], options.cutoff)
    runs, lost = [], []
    for k, outcome in enumerate(planned):
        stage("reading", k / len(planned))
        try:
            job = outcome.job
            log = logs.pop(job.name) if job.name in logs else read_again(robot, outcome, options)
            runs.append(_pooled(robot, outcome, log, options, choice.cutoff))
        except ModrobError as error:
            lost.append(failed(outcome.job, error))
            if fail_fast:
                break
    return PooledRuns(runs, choice, lost)


def read_again(robot: Robot, outcome: Outcome, options: IdentifyOptions) -> JointLog:
    """A log that was read before.

    Raises
    ------
    InputFileError
        If it is not there any more, or not what it was.
    """
    job = outcome.job
    with local_copy(job.source) as path:
        if _digest(path) != outcome.done["provenance"]["log"]:
            raise InputFileError(Fault(job.label, "has changed while modrob was running; run it again with --resume"))
        return read_log(robot, path, options, job.name)


def _digest(path: Path) -> str:
    try:
        return f"sha256:{sha256(path)}"
    except OSError as error:
        raise InputFileError(Fault(str(path), f"cannot be read: {error.strerror or error}")) from error


def _pooled(robot: Robot, outcome: Outcome, log: JointLog, options: IdentifyOptions, cutoff: float) -> PooledRun:
    record = outcome.done
    parts = split_run(robot, log, options, cutoff)
    entry = {key: value for key, value in record.items() if key not in _RECORD_ONLY}
    notes = [*record["notes"], *(note for note in glitch_notes(parts.whole) if note not in record["notes"])]
    entry |= {**part_facts(parts), "cutoff": record["signals"]["cutoff"], "notes": notes}
    return PooledRun(parts.whole, parts.train, parts.test, outcome, entry)


def common_cutoff(records: Sequence[Mapping[str, Any]], given: float | None) -> CutoffChoice:
    """The given cut-off, or the median of those of the logs, the lowest quarter of a sampling rate at most."""
    signals = [record["signals"] for record in records]
    bandwidth = np.array([item["bandwidth"] for item in signals], dtype=float)
    middle = np.array([np.median(x[np.isfinite(x)]) if np.isfinite(x).any() else np.nan for x in bandwidth.T])
    if len(records) == 1:
        return CutoffChoice(signals[0]["cutoff"], middle, signals[0]["rule"])
    if given is not None:
        return CutoffChoice(given, middle, "given")
    lowest = min(RATE_SHARE * record["rate"] for record in records)
    cutoff = min(float(np.median([item["cutoff"] for item in signals])), lowest)
    return CutoffChoice(cutoff, middle, f"median over {len(records)} logs of: {RULE}")
