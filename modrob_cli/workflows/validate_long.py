"""A log that is too long for memory against the model, stretch by stretch."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.identify.long_errors import LongErrors
from modrob_cli.identify.long_run import LongRun, prepare_long_run
from modrob_cli.identify.long_signals import Sizes
from modrob_cli.identify.prediction import rms
from modrob_cli.identify.regression import RegressionOptions
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.run import LEAST_FAST, Run
from modrob_cli.identify.signals import MARGIN, Mask
from modrob_cli.io.long_log import WINDOW, open_long_log
from modrob_cli.io.outputs import OutputFolder, sha256
from modrob_cli.model.log import UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_fit import fit_all, predicted
from modrob_cli.workflows.identify_robot import identified_robot
from modrob_cli.workflows.identify_runs import Parts, refuse_absurd
from modrob_cli.workflows.robots import LoadedRobot
from modrob_cli.workflows.validate_judge import bounds_along, friction_from, taken_samples
from modrob_cli.workflows.validate_long_files import LongPage, ThinnedCsv, WorstStretch, write_details
from modrob_cli.workflows.validate_long_result import LongJudged, Stretch, long_result
from modrob_cli.workflows.validate_options import ValidateOptions

FIT_SAMPLES = 200_000
"""Samples of a long log that friction is fitted to at most: the first ones."""


@dataclass(frozen=True)
class LongSizes:
    """How much is done at once, and how much of a log is used or written; smaller for tests.

    Attributes
    ----------
    fit : as :data:`FIT_SAMPLES`
    rows : lines of the CSV file, about
    window : messages that are put in order at once
    """

    motion: Sizes = Sizes()
    fit: int = FIT_SAMPLES
    rows: int = 200_000
    window: int = WINDOW


DEFAULT_SIZES = LongSizes()


@dataclass(frozen=True)
class Judge:
    """What a long log is judged by.

    Attributes
    ----------
    robot : with the friction that counts
    since : samples before do not count, [s]
    known : stretches that the robot file was fitted to, which do not count either
    fitted, excluded, estimates : as for :class:`modrob_cli.workflows.validate_judge.JudgedLog`
    notes : what to know about it
    """

    robot: Robot
    since: float
    known: tuple[UsedLog, ...]
    fitted: bool
    excluded: float
    estimates: list[JointEstimate] | None
    notes: tuple[str, ...] = ()

    def used(self, run: Run) -> Mask:
        """Samples of a piece that count."""
        used = run.used & (run.t >= self.since)
        return used & ~taken_samples(run.t, run.signals.cutoff, self.known) if self.known else used

    def bounds(self, run: Run) -> TorqueBounds:
        """Prediction and bounds along a piece."""
        bounds = bounds_along(self.robot, run)
        return bounds if self.estimates is None else replace(bounds, nominal=predicted(run, self.estimates))


def judge_long(
    loaded: LoadedRobot,
    name: str,
    source: str,
    path: Path,
    options: ValidateOptions,
    folder: OutputFolder,
    page: LongPage | None,
    sizes: LongSizes = DEFAULT_SIZES,
) -> dict[str, Any]:
    """Judge one log; files NAME.validate.csv, and NAME.validate.png and a page if there shall be one.

    Parameters
    ----------
    name, source : of the log, for files and reports
    page : the page; its inputs without the log

    Returns
    -------
    result : what :func:`modrob_cli.workflows.validate_result.log_result` gives, and the key ``stretches``

    Raises
    ------
    InputFileError
        If the log cannot be used.
    UsageError
        If options, robot and log do not fit together.
    NumericalError
        If nothing of it can be judged.
    """
    robot, friction = loaded.robot, friction_from(loaded.robot, options)
    with open_long_log(path, robot.joint_names, options.reading, sizes.window) as log:
        refuse_absurd(path, log.largest.tolist())
        run = prepare_long_run(robot, log, options.effort, options.cutoff, sizes.motion, fit=friction != "file")
        judge = _by_file(loaded, path, run) if friction == "file" else _by_fit(robot, run, options, friction, sizes)
        errors = LongErrors(run.known.rate, run.motion.cutoff, robot.dof)
        worst, stretches = WorstStretch(), []
        with ThinnedCsv(robot, folder.stage(f"{name}.validate.csv"), run.known.count, sizes.rows) as table:
            for first, piece, bounds, used in _judged_pieces(robot, run, judge):
                errors.add(first, piece.t, used, piece.tau, bounds.nominal)
                table.write(first, piece, bounds, used)
                if used.any():
                    stretches.append(_stretch(piece, bounds, used))
                    worst.offer(stretches[-1], piece, bounds, used)
        drawn = worst.judged(path, log.piece(0, 2))
        notes = (*log.notes, *judge.notes, *table.notes)
        judged = LongJudged(log, run, errors.errors(), stretches, judge.fitted, judge.excluded, judge.estimates, notes)
        result = long_result(robot, source, judged, options)
        if page is not None:
            made_from = {**page.inputs, Path(source).name: f"sha256:{sha256(path)}"}
            write_details(robot, name, result, drawn, options, LongPage(page.name, made_from), folder)
    return result


def _judged_pieces(robot: Robot, run: LongRun, judge: Judge) -> Iterator[tuple[int, Run, TorqueBounds, Mask]]:
    """Number of the first sample, run, prediction and samples that count of each piece."""
    for piece in run.pieces():
        part = run.run(robot, piece, rigid=judge.estimates is not None)
        yield piece.first, part, judge.bounds(part), judge.used(part)


def _by_file(loaded: LoadedRobot, path: Path, run: LongRun) -> Judge:
    """The robot as its file has it, on samples that the file was not fitted to."""
    digest = sha256(path) if loaded.identified_from else ""
    known = tuple(used for used in loaded.identified_from if used.sha256 == digest)
    if not known:
        return Judge(loaded.robot, 0.0, (), False, 0.0, None)
    taken = left = 0
    for t, used in run.motion.times():
        mask = taken_samples(t, run.motion.cutoff, known)
        taken += int(np.count_nonzero(mask))
        left += int(np.count_nonzero(used & ~mask))
    if not left:
        return Judge(loaded.robot, 0.0, (), True, 0.0, None)
    return Judge(loaded.robot, 0.0, known, False, taken / run.known.rate, None)


def _by_fit(robot: Robot, run: LongRun, options: ValidateOptions, friction: str, sizes: LongSizes) -> Judge:
    """Friction fitted to the beginning of the first part of the log; of the whole log in-sample."""
    held_out = friction == "held-out"
    split = (1.0 - options.holdout) * run.duration if held_out else 0.0
    # What the filter smears across the split must not tell the fit about the held-out part.
    end = split - MARGIN / run.motion.cutoff if held_out else np.inf
    train, notes = _training_part(robot, run, end, sizes.fit)
    estimates = fit_all(robot, [Parts(train, train, train.between(0.0, 0.0))], RegressionOptions(), False).estimates
    fitted_robot = identified_robot(robot, estimates, [train])
    return Judge(fitted_robot, split, (), not held_out, 0.0, estimates, notes)


def _training_part(robot: Robot, run: LongRun, end: float, most: int) -> tuple[Run, tuple[str, ...]]:
    """The samples before ``end`` [s], the first ``most`` of them; with what the filter needs behind them; and notes."""
    count = run.known.count
    last = min(run.motion.number(end), count)
    fit = min(last, most)
    # Confidence intervals depend on where the record ends; where it can be held whole, they are those of a short log.
    held = count if fit == last and count <= 2 * most else min(fit + run.motion.overlap, count)
    train = run.run(robot, run.motion.piece(0, held), rigid=True)
    train = replace(train, used=train.used & (np.arange(len(train.t)) < fit))
    if fit == last:
        return train, ()
    # A joint that moves later only tells nothing here.
    fast = _share_fast(train) > LEAST_FAST
    signals = replace(train.signals, moving=train.signals.moving & fast)
    note = f"friction was fitted to the first {fit} of the {last} samples that a fit may see"
    return replace(train, signals=signals), (note,)


def _share_fast(run: Run) -> Array:
    return np.asarray((np.abs(run.dq[run.used]) > run.standstill).sum(axis=0) / max(np.count_nonzero(run.used), 1))


def _stretch(run: Run, bounds: TorqueBounds, used: Mask) -> Stretch:
    tau = run.tau[used]
    inside = ((bounds.lower[used] <= tau) & (tau <= bounds.upper[used])).sum(axis=0)
    width = (bounds.upper[used] - bounds.lower[used]).sum(axis=0)
    times, error = run.t[used], rms(tau - bounds.nominal[used])
    return Stretch(float(times[0]), float(times[-1]), len(tau), error, rms(tau), inside, width)
