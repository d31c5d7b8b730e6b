"""One log to identify from: read, low-passed, split into a part to fit and a part to judge."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.identify.signal_cutoff import CutoffChoice, choose_cutoff
from modrob_cli.identify.signals import MARGIN
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_options import IdentifyOptions

ABSURD = 1e12
"""Largest position, velocity or effort that is believed, in any unit."""


@dataclass(frozen=True)
class Parts:
    """A log made ready.

    Attributes
    ----------
    whole : all that counts;  train, test : what the fit sees of it, and what it is judged by
    """

    whole: Run
    train: Run
    test: Run


@dataclass(frozen=True)
class LogRun(Parts):
    """A log made ready, with what was read.

    Attributes
    ----------
    path : of the file;  log : as read
    """

    path: Path
    log: JointLog


def read_log(robot: Robot, path: Path, options: IdentifyOptions, name: str | None = None) -> JointLog:
    """Read one log.

    Parameters
    ----------
    name : for reports; None for that of the file

    Raises
    ------
    InputFileError
        If it cannot be used.
    """
    log = read_joint_log(path, robot.joint_names, options=options.reading)
    largest = [0.0 if values is None else float(np.max(np.abs(values))) for values in (log.q, log.dq, log.effort)]
    refuse_absurd(path, largest)
    return replace(log, name=name or path.stem)


def refuse_absurd(path: Path, largest: Sequence[float]) -> None:
    """Refuse positions, velocities or efforts (largest absolute values) that no arm has; their squares would overflow.

    Raises
    ------
    InputFileError
        Saying which.
    """
    found = zip(("positions", "velocities", "efforts"), largest, strict=True)
    faults = [
        Fault(str(path), f"found {what} up to {value:.3g}; check the units, or what was recorded")
        for what, value in found
        if value > ABSURD
    ]
    if faults:
        raise InputFileError(faults)


def read_run(robot: Robot, path: Path, options: IdentifyOptions, name: str | None = None) -> LogRun:
    """Read one log and make it ready with a cut-off of its own; errors as for its two steps."""
    log = read_log(robot, path, options, name)
    parts = split_run(robot, log, options, own_cutoff(log, options).cutoff)
    return LogRun(parts.whole, parts.train, parts.test, path, log)


def own_cutoff(log: JointLog, options: IdentifyOptions) -> CutoffChoice:
    """The given cut-off, or the one that suits this log."""
    choice = choose_cutoff(log)
    return choice if options.cutoff is None else CutoffChoice(options.cutoff, choice.bandwidth, "given")


def split_run(robot: Robot, log: JointLog, options: IdentifyOptions, cutoff: float) -> Parts:
    """Low-pass one log and hold out its end.

    Raises
    ------
    UsageError
        If the robot lacks constants that the effort needs, or the cut-off does not fit.
    NumericalError
        If the log is too short.
    """
    whole = prepare_run(robot, log, options.recorded, cutoff)
    if options.holdout == 0.0:
        return Parts(whole, whole, whole.between(0.0, 0.0))
    split = (1.0 - options.holdout) * whole.duration
    # What the filter smears across the split must not tell the fit about the held-out part.
    train = whole.between(0.0, split - MARGIN / cutoff)
    return Parts(whole, train, whole.between(split, np.inf))
