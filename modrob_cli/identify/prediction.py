"""How far predicted torques are from recorded ones."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.signals import Signals, low_pass


@dataclass(frozen=True)
class PredictionError:
    """Error of one joint over the used samples of one log.

    Attributes
    ----------
    rmse : root of the mean square error against the torque as recorded, [N m] or [N]
    nrmse : rmse divided by the RMS of the recorded torque; None if that is zero
    nrmse_low_passed : the same with both low-passed like the motion: without noise that no model can predict
    max_error : largest error, [N m] or [N], and the time it occurs, [s]
    """

    rmse: float
    nrmse: float | None
    nrmse_low_passed: float | None
    max_error: float
    worst_time: float


def prediction_errors(signals: Signals, recorded: Array, predicted: Array) -> list[PredictionError]:
    """Errors per joint; all used samples count, those near standstill included.

    Parameters
    ----------
    recorded, predicted : joint torques, shape (N, n), [N m] or [N]
    """
    used = signals.used
    residual = (recorded - predicted)[used]
    low_passed = [low_pass(x, signals.rate, signals.cutoff)[used] for x in (recorded, recorded - predicted)]
    rmse, size, low_size, low_rmse = (rms(x) for x in (residual, recorded[used], *low_passed))
    worst = np.argmax(np.abs(residual), axis=0)
    largest, times = np.abs(residual[worst, np.arange(residual.shape[1])]), signals.t[used][worst]
    return [
        error_of(rmse[j], size[j], low_rmse[j], low_size[j], largest[j], times[j]) for j in range(recorded.shape[1])
    ]


def error_of(
    rmse: float, size: float, low_rmse: float, low_size: float, max_error: float, worst_time: float
) -> PredictionError:
    """Error of one joint from RMS error and recorded torque, both low-passed, and the largest error."""
    ratios = _ratio(rmse, size), _ratio(low_rmse, low_size)
    return PredictionError(float(rmse), *ratios, float(max_error), float(worst_time))


def rms(x: Array) -> Array:
    """Root of the mean square along the first axis."""
    return np.asarray(np.sqrt(np.mean(x**2, axis=0)))


def _ratio(part: float, whole: float) -> float | None:
    return float(part / whole) if whole > 0.0 else None
