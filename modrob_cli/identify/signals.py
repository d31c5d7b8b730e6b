"""From a log to evenly sampled positions, velocities and accelerations without phase shift."""

from dataclasses import dataclass
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
    step = float(np.median(steps))
    cutoff = min(DEFAULT_CUTOFF, 0.25 / step) if cutoff is None else cutoff
    if not 0.0 < cutoff < 0.5 / step:
        limit = f"half the sampling rate of {log.name}, {0.5 / step:.5g} Hz"
        raise UsageError(f"--cutoff: found {cutoff:g} Hz, expected more than 0 and less than {limit}")
    resampled = bool(np.max(np.abs(steps - step)) > JITTER * step)
    t, q, dq, effort = _resample(log, step) if resampled else (log.t, log.q, log.dq, log.effort)
    used = _used(t, log.t, step, cutoff)
    if np.count_nonzero(used) < 50:
        raise NumericalError(
            f"{log.name} lasts {t[-1]:.3g} s with {len(log.t)} samples; without {MARGIN / cutoff:.2g} s at each end "
            "and around gaps fewer than 50 samples are left; use a longer log or a higher --cutoff"
        )
    q_low = low_pass(q, 1.0 / step, cutoff)
    if dq is None:
        spline = _spline(t, q_low)
        velocity, acceleration = spline.derivative(1)(t), spline.derivative(2)(t)
    else:
        velocity = low_pass(dq, 1.0 / step, cutoff)
        acceleration = _spline(t, velocity).derivative(1)(t)
    moving = _moving(q[used], q_low[used])
    band = VELOCITY_BAND * np.sqrt(np.mean(velocity[used] ** 2, axis=0))
    gap = float(np.max(steps))
    motion = (q_low, velocity, acceleration)
    return Signals(t, *motion, effort, used, moving, band, 1.0 / step, cutoff, resampled, gap)


def low_pass(x: Array, rate: float, cutoff: float) -> Array:
    """Zero-phase Butterworth filter along the first axis; the gain at the cut-off frequency is 1/2."""
    from scipy.signal import butter, sosfiltfilt

    sections = butter(ORDER, cutoff, fs=rate, output="sos")
    pad = min(len(x) - 1, int(np.ceil(rate / cutoff)))
    return np.asarray(sosfiltfilt(sections, x, axis=0, padlen=pad))


def _spline(t: Array, x: Array) -> Any:
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t, x, k=5)


def _resample(log: JointLog, step: float) -> tuple[Array, Array, Array | None, Array]:
    """Even times; positions and velocities by cubic splines, efforts (which may jump) along straight lines."""
    from scipy.interpolate import make_interp_spline

    t = np.arange(int(np.floor(log.t[-1] / step * (1.0 + 1e-12))) + 1, dtype=float) * step
    q = np.asarray(make_interp_spline(log.t, log.q, k=3)(t))
    dq = None if log.dq is None else np.asarray(make_interp_spline(log.t, log.dq, k=3)(t))
    effort = np.stack([np.interp(t, log.t, column) for column in log.effort.T], axis=1)
    return t, q, dq, effort


def _used(t: Array, recorded: Array, step: float, cutoff: float) -> Mask:
    """Mark the samples that no end of the recording and no gap in it can have reached through the filter."""
    margin = MARGIN / cutoff
    used = np.asarray((t >= t[0] + margin) & (t <= t[-1] - margin))
    gaps = np.flatnonzero(np.diff(recorded) > max(0.25 / cutoff, 1.5 * step))
    for start, end in zip(recorded[gaps], recorded[gaps + 1], strict=True):
        used &= (t <= start - margin) | (t >= end + margin)
    return used


def _moving(q: Array, q_low: Array) -> Mask:
    """Joints whose range exceeds 0.005 rad (or m) and ten times the noise that the filter took out."""
    noise = np.sqrt(np.mean((q - q_low) ** 2, axis=0))
    return np.asarray(np.ptp(q_low, axis=0) > np.maximum(5e-3, 10.0 * noise))
