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


def pooled_errors(runs: Sequence[Run], predicted: Sequence[Array]) -> list[PooledError] | None:
    """Errors per joint against the torque as recorded; None if no sample is used.

    Parameters
    ----------
    predicted : for each run, shape (N, n), [N m] or [N]
    """
    kept = [(run, torque) for run, torque in zip(runs, predicted, strict=True) if run.used.any()]
    if not kept:
        return None
    recorded = np.concatenate([run.tau[run.used] for run, _ in kept])
    residual = np.concatenate([(run.tau - torque)[run.used] for run, torque in kept])
    low = np.concatenate([run.filtered(run.tau)[run.used] for run, _ in kept])
    low_residual = np.concatenate([run.filtered(run.tau - torque)[run.used] for run, torque in kept])
    times = np.concatenate([run.t[run.used] for run, _ in kept])
    names = np.concatenate([np.full(int(run.used.sum()), k) for k, (run, _) in enumerate(kept)])
    worst = np.argmax(np.abs(residual), axis=0)
    found = []
    for j in range(recorded.shape[1]):
        rmse, size, low_rmse, low_size = (
            float(np.sqrt(np.mean(x[:, j] ** 2))) for x in (residual, recorded, low_residual, low)
        )
        ratio = rmse / size if size > 0.0 else None
        low_ratio = low_rmse / low_size if low_size > 0.0 else None
        error = PredictionError(rmse, ratio, low_ratio, float(abs(residual[worst[j], j])), float(times[worst[j]]))
        found.append(PooledError(error, kept[int(names[worst[j]])][0].name, len(recorded)))
    return found
