"""From a log to evenly sampled positions, velocities and accelerations without phase shift."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, UsageError
from modrob_cli.model.log import JointLog

Mask = NDArray[np.bool_]

DEFAULT_CUTOFF = 10.0
"""Default cut-off frequency [Hz]: several times the band of an arm's motion (most below 4 Hz), below its gear noise."""

ORDER = 4
"""Order of the Butterworth filter; run forward and backward it falls off as one of twice the order."""

MARGIN = 2.0
"""Periods of the cut-off frequency after which an end of the recording matters by less than 0.5 % (accelerations)."""

JITTER = 0.01
"""Steps that differ from the median step by more than this share make resampling necessary."""

VELOCITY_BAND = 0.03
"""Half-width of the band around standstill, as a share of the RMS velocity of the joint."""

FEWEST_USED = 50
"""Samples that a log has to have beyond its ends and gaps."""

ALL = slice(None)


@dataclass(frozen=True)
class Signals:
    """Evenly sampled motion and effort; N samples, n joints.

    Attributes
    ----------
    t : times, shape (N,), [s]
    q, dq, ddq : low-passed positions and their derivatives, shape (N, n), [rad] or [m]
    effort : as recorded (interpolated where resampled), not filtered, shape (N, n)
    used : False within two periods of the cut-off frequency from either end and from gaps, shape (N,)
    moving : joints whose motion stands out from the noise, shape (n,)
    band : half-width of the band around standstill in which the sign of dq is uncertain, shape (n,), [rad/s] or [m/s]
    rate, cutoff : sampling and cut-off frequency, [Hz]
    resampled : True if the times were not even
    gap : longest time between two samples of the log, [s]
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    effort: Array
    used: Mask
    moving: Mask
    band: Array
    rate: float
    cutoff: float
    resampled: bool
    gap: float


def prepare(log: JointLog, cutoff: float | None = None) -> Signals:
    """Resample if needed, low-pass without phase shift, differentiate.

    A Butterworth filter of order 4 runs forward and backward over q (and dq, if it was recorded). Velocities come
    from the recorded ones, or else from a quintic spline through the positions; accelerations from such a spline
    through either. [D] 2.6.2.

    Parameters
    ----------
    cutoff : [Hz]; None for 10 Hz, or a quarter of the sampling rate where that is lower

    Raises
    ------
    UsageError
        If the cut-off is not between 0 and half the sampling rate.
    NumericalError
        If the log is too short.
    """
    steps = np.diff(log.t)
    step, gap = float(np.median(steps)), float(np.max(steps))
    cutoff = checked_cutoff(log.name, cutoff, step)
    resampled = uneven(float(np.min(steps)), gap, step)
    t, q, dq, effort = (log.t, log.q, log.dq, log.effort)
    if resampled:
        t = np.arange(grid_size(log.t[-1], step), dtype=float) * step
        q, dq, effort = resample(log, t)
    used = used_samples(t, (t[0], t[-1]), log.t, step, cutoff)
    check_used(log.name, float(t[-1]), len(log.t), int(np.count_nonzero(used)), cutoff)
    q_low, velocity, acceleration = filtered_motion(t, q, dq, 1.0 / step, cutoff)
    moving = in_motion(np.mean((q[used] - q_low[used]) ** 2, axis=0), np.ptp(q_low[used], axis=0))
    band = VELOCITY_BAND * np.sqrt(np.mean(velocity[used] ** 2, axis=0))
    motion = (q_low, velocity, acceleration)
    return Signals(t, *motion, effort, used, moving, band, 1.0 / step, cutoff, resampled, gap)


def checked_cutoff(name: str, cutoff: float | None, step: float) -> float:
    """The cut-off frequency [Hz], or a default; errors as those of :func:`prepare`."""
    cutoff = min(DEFAULT_CUTOFF, 0.25 / step) if cutoff is None else cutoff
    if not 0.0 < cutoff < 0.5 / step:
        limit = f"half the sampling rate of {name}, {0.5 / step:.5g} Hz"
        raise UsageError(f"--cutoff: found {cutoff:g} Hz, expected more than 0 and less than {limit}")
    return cutoff


def uneven(shortest: float, longest: float, step: float) -> bool:
    """Whether steps [s] between these differ too much from the median one."""
    return max(longest - step, step - shortest) > JITTER * step


def grid_size(end: float, step: float) -> int:
    """Number of even times from 0 to ``end`` [s]."""
    return int(np.floor(end / step * (1.0 + 1e-12))) + 1


def check_used(name: str, duration: float, samples: int, used: int, cutoff: float) -> None:
    """Refuse a log that is too short; errors as those of :func:`prepare`."""
    if used < FEWEST_USED:
        raise NumericalError(
            f"{name} lasts {duration:.3g} s with {samples} samples; without {MARGIN / cutoff:.2g} s at each end "
            f"and around gaps fewer than {FEWEST_USED} samples are left; use a longer log or a higher --cutoff"
        )


def filtered_motion(
    t: Array, q: Array, dq: Array | None, rate: float, cutoff: float, core: slice = ALL
) -> tuple[Array, Array, Array]:
    """Low-passed positions, velocities, accelerations at the samples ``core``, from samples (N, n) at all times."""
    q_low = low_pass(q, rate, cutoff)
    if dq is None:
        spline = _spline(t, q_low)
        return q_low[core], spline.derivative(1)(t[core]), spline.derivative(2)(t[core])
    velocity = low_pass(dq, rate, cutoff)
    return q_low[core], velocity[core], _spline(t, velocity).derivative(1)(t[core])


def filter_memory(rate: float, cutoff: float) -> int:
    """Samples after which less than 1e-15 is left of what the low-pass saw, by the slowest of its poles."""
    from scipy.signal import butter

    _, poles, _ = butter(ORDER, cutoff, fs=rate, output="zpk")
    return int(np.ceil(np.log(1e-15) / np.log(np.max(np.abs(poles)))))


def low_pass(x: Array, rate: float, cutoff: float) -> Array:
    """Zero-phase Butterworth filter along the first axis; the gain at the cut-off frequency is 1/2."""
    from scipy.signal import sosfilt

    sections, start = _design(rate, cutoff)
    pad = min(len(x) - 1, int(np.ceil(rate / cutoff)))
    # As scipy.signal.sosfiltfilt, which would find the steady state of the sections anew each time, and that takes
    # longer than filtering: each end is continued by its reflection in the last point.
    y = np.concatenate([2.0 * x[0] - x[pad:0:-1], x, 2.0 * x[-1] - x[-2 : -pad - 2 : -1]]) if pad else x
    start = start.reshape(start.shape + (1,) * (x.ndim - 1))
    for _ in range(2):
        y, _ = sosfilt(sections, y, axis=0, zi=start * y[0])
        y = y[::-1]
    return np.array(y[pad : len(y) - pad])


@lru_cache(maxsize=1024)
def _design(rate: float, cutoff: float) -> tuple[Array, Array]:
    """Second-order sections (S, 6) of the filter, and the state (S, 2) in which they answer 1 with 1."""
    from scipy.signal import butter, sosfilt_zi

    sections = butter(ORDER, cutoff, fs=rate, output="sos")
    return np.asarray(sections), np.asarray(sosfilt_zi(sections))


def _spline(t: Array, x: Array) -> Any:
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t, x, k=5)


def resample(log: JointLog, t: Array) -> tuple[Array, Array | None, Array]:
    """Positions and velocities at times t by cubic splines, efforts (which may jump) along straight lines."""
    from scipy.interpolate import make_interp_spline

    q = np.asarray(make_interp_spline(log.t, log.q, k=3)(t))
    dq = None if log.dq is None else np.asarray(make_interp_spline(log.t, log.dq, k=3)(t))
    effort = np.stack([np.interp(t, log.t, column) for column in log.effort.T], axis=1)
    return q, dq, effort


def used_samples(t: Array, ends: tuple[float, float], recorded: Array, step: float, cutoff: float) -> Mask:
    """Mark the samples that no end of the recording and no gap in it can have reached through the filter.

    Parameters
    ----------
    t : increasing times, shape (N,), [s]
    ends : first and last time of the recording, [s]
    recorded : times as recorded, those of the gaps among them, shape (M,), [s]
    """
    margin = MARGIN / cutoff
    used = np.asarray((t >= ends[0] + margin) & (t <= ends[1] - margin))
    gaps = np.flatnonzero(np.diff(recorded) > max(0.25 / cutoff, 1.5 * step))
    first = np.searchsorted(t, recorded[gaps] - margin, "right")
    last = np.searchsorted(t, recorded[gaps + 1] + margin, "left")
    for start, end in zip(first, last, strict=True):
        used[start:end] = False
    return used


def in_motion(noise: Array, extent: Array) -> Mask:
    """Joints whose range exceeds 0.005 rad (or m) and ten times the noise that the filter took out.

    Parameters
    ----------
    noise : mean square of what the filter took out, shape (n,);  extent : range of the positions, shape (n,)
    """
    return np.asarray(extent > np.maximum(5e-3, 10.0 * np.sqrt(noise)))
