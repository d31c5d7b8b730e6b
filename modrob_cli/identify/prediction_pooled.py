"""How far predicted torques are from recorded ones over several runs together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.prediction import PredictionError
from modrob_cli.identify.run import Run


@dataclass(frozen=True)
class PooledError:
    """Error of one joint over the used samples of several runs.

    Attributes
    ----------
    error : over all of them; its worst time counts within ``worst_log``
    worst_log : where the largest error occurs
    samples : how many count
    """

    error: PredictionError
    worst_log: str
    samples: int


@dataclass(frozen=True)
class ErrorSums:
    """Squares and largest error over the used samples of one run, from which errors over several runs follow.

    Attributes
    ----------
    log : name of the run;  samples : how many count
    squares : sums for error, recorded torque, and both low-passed, shape (4, n)
    largest, time : largest error of each joint and when it occurs, shape (n,)
    """

    log: str
    samples: int
    squares: Array
    largest: Array
    time: Array


def error_sums(parts: Sequence[Run], predicted: Array) -> list[ErrorSums]:
    """Sums of each part of one log.

    Parameters
    ----------
    parts : the same run, with other samples used
    predicted : torque, shape (N, n), [N m] or [N]
    """
    run = parts[0]
    residual = run.tau - predicted
    signals = (residual, run.tau, run.filtered(residual), run.filtered(run.tau))
    found = []
    for part in parts:
        picked = [x[part.used] for x in signals]
        squares = np.array([np.sum(x**2, axis=0) for x in picked])
        size, joints = np.abs(picked[0]), np.arange(run.tau.shape[1])
        largest = time = np.zeros(len(joints))
        if len(size):
            worst = np.argmax(size, axis=0)
            largest, time = size[worst, joints], run.t[part.used][worst]
        found.append(ErrorSums(run.name, len(size), squares, largest, time))
    return found


def errors_of(sums: Sequence[ErrorSums]) -> list[PooledError] | None:
    """Errors per joint over all that was summed; None if no sample is used."""
    kept = [part for part in sums if part.samples]
    if not kept:
        return None
    samples = sum(part.samples for part in kept)
    rmse, size, low_rmse, low_size = np.sqrt(np.sum([part.squares for part in kept], axis=0) / samples).tolist()
    worst = np.argmax([part.largest for part in kept], axis=0)
    found = []
    for j, k in enumerate(worst.tolist()):
        ratio = rmse[j] / size[j] if size[j] > 0.0 else None
        low_ratio = low_rmse[j] / low_size[j] if low_size[j] > 0.0 else None
        error = PredictionError(rmse[j], ratio, low_ratio, float(kept[k].largest[j]), float(kept[k].time[j]))
        found.append(PooledError(error, kept[k].log, samples))
    return found
