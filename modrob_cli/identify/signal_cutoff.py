"""The cut-off frequency of the low-pass, chosen from the spectrum of the recorded motion."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.log import JointLog

BANDWIDTH_SHARE = 0.999
"""Share of the power of the velocity below the bandwidth of the motion."""

NOISE_FACTOR = 10.0
"""Only frequencies at which the spectrum is this many times the noise floor count as motion."""

MULTIPLE = 5.0
"""Cut-off over bandwidth: the low-pass then takes less than 1e-5 of the motion's own amplitude."""

LOWEST, HIGHEST = 5.0, 40.0
"""Limits of the choice, [Hz]: below, reversals of the friction blur over much of a motion; above, gears vibrate."""

RATE_SHARE = 0.25
"""The cut-off is at most this share of the sampling rate."""


@dataclass(frozen=True)
class CutoffChoice:
    """A cut-off frequency and what it was chosen from.

    Attributes
    ----------
    cutoff : [Hz]
    bandwidth : of each joint's motion, shape (n,), [Hz]
    reason : the rule and its figures in words
    """

    cutoff: float
    bandwidth: Array
    reason: str


RULE = (
    f"{MULTIPLE:g} x the median bandwidth of the joints ({BANDWIDTH_SHARE:.1%} of the velocity's power), within "
    f"{LOWEST:g} to {HIGHEST:g} Hz and a quarter of the sampling rate"
)
"""How the cut-off is chosen, in words."""


def choose_cutoff(log: JointLog) -> CutoffChoice:
    """Five times the bandwidth of the motion, within 5 to 40 Hz and a quarter of the sampling rate.

    The bandwidth of a joint is the frequency below which 99.9 % of the power of its velocity lies, counting only
    frequencies at which the spectrum stands ten times above the noise floor (the median over the upper half of the
    band). Of several joints the median is taken, so that one noisy encoder does not decide. "Five times the bandwidth
    of the dynamics" is the usual rule for the filter of inverse-dynamics identification (M. Gautier, A. Janot,
    P.-O. Vandanjon, IEEE Trans. Control Syst. Technol. 21 (2013)); the limits are ours.
    """
    rate = 1.0 / float(np.median(np.diff(log.t)))
    frequency, density = spectrum(log.q if log.dq is None else log.dq, rate)
    return cutoff_from(frequency, density, rate, np.ptp(log.q, axis=0), derived=log.dq is None)


def cutoff_from(frequency: Array, density: Array, rate: float, extent: Array, derived: bool) -> CutoffChoice:
    """The choice from the spectrum of the velocities, or of the positions if ``derived``.

    Parameters
    ----------
    frequency, density : shapes (F,) and (F, n), as those of :func:`spectrum`
    extent : range of the positions, shape (n,), [rad] or [m]
    """
    power = velocity_power(frequency, density, derived)
    floor = noise_floor(frequency, density, rate)
    counted = np.where(density > NOISE_FACTOR * floor, power, 0.0)
    total = np.cumsum(counted, axis=0)
    reached = total >= BANDWIDTH_SHARE * np.maximum(total[-1], np.finfo(float).tiny)
    bandwidth = np.where(total[-1] > 0.0, frequency[np.argmax(reached, axis=0)], np.nan)
    known = bandwidth[np.isfinite(bandwidth) & (extent > 5e-3)]
    middle = float(np.median(known)) if len(known) else 0.0
    top = RATE_SHARE * rate
    cutoff = min(float(np.clip(MULTIPLE * middle, LOWEST, HIGHEST)), top)
    reason = f"{RULE}; the bandwidth is {middle:.3g} Hz, the rate {rate:.5g} Hz"
    return CutoffChoice(cutoff, bandwidth, reason)


def spectrum(x: Array, rate: float) -> tuple[Array, Array]:
    """Power spectral density by Welch's method, eight half-overlapping segments, Hann window.

    Parameters
    ----------
    x : shape (N, ...), evenly sampled; a slightly uneven one is taken as even
    rate : [Hz]

    Returns
    -------
    frequency : shape (F,), [Hz]
    density : shape (F, ...), in the square of the unit of x per Hz
    """
    return welch_spectrum(x, rate, segment_length(len(x)))


def segment_length(samples: int) -> int:
    """Samples of a segment, so that there are eight."""
    return min(samples, max(64, int(samples / 4.5)))


def welch_spectrum(x: Array, rate: float, length: int) -> tuple[Array, Array]:
    """As :func:`spectrum`, by segments of this length."""
    from scipy.signal import welch

    frequency, density = welch(x, fs=rate, window="hann", nperseg=length, detrend="linear", axis=0)
    return np.asarray(frequency), np.asarray(density)


def velocity_power(frequency: Array, density: Array, derived: bool) -> Array:
    """Spectrum of the velocity; from that of the position if ``derived``."""
    return density * (2.0 * np.pi * frequency[:, None]) ** 2 if derived else density


def noise_floor(frequency: Array, density: Array, rate: float) -> Array:
    """Median density over the upper half of the band, shape (n,), close to the Nyquist frequency left out; or 0."""
    upper = (frequency > 0.25 * rate) & (frequency < 0.45 * rate)
    if not upper.any():
        return np.zeros(density.shape[1:])
    return np.asarray(np.median(density[upper], axis=0))


def motion_noise(log: JointLog, cutoff: float) -> tuple[Array, Array]:
    """Noise that the low-pass leaves in velocity and acceleration, RMS, each of shape (n,).

    From the noise floor of what was recorded, taken as flat; noise that grows toward low frequencies is
    underestimated. The filter is that of :mod:`modrob_cli.identify.signals`, gain 1 / (1 + (f / cutoff)^8).
    """
    rate = 1.0 / float(np.median(np.diff(log.t)))
    frequency, density = spectrum(log.q if log.dq is None else log.dq, rate)
    return noise_from(noise_floor(frequency, density, rate), rate, cutoff, derived=log.dq is None)


def noise_from(floor: Array, rate: float, cutoff: float, derived: bool) -> tuple[Array, Array]:
    """The same from the noise floor of the velocities, or of the positions if ``derived``, shape (n,)."""
    order = 1 if derived else 0
    fine = np.linspace(0.0, 0.5 * rate, 2000)
    passed = 1.0 / (1.0 + (fine / cutoff) ** 8) ** 2
    angular = 2.0 * np.pi * fine
    power = [float(np.trapezoid(angular ** (2 * k) * passed, fine)) for k in (order, order + 1)]
    return np.sqrt(floor * power[0]), np.sqrt(floor * power[1])
