r"""Causal low-pass filters for a measured torque, and what they do to bounds of it. [S] III.B, with a correction.

[S] low-passes the measured current and applies the same filter to both bounds. With an impulse response h that is
negative anywhere, as that of every Butterworth filter of order 2 or more, the filtered torque can leave the filtered
bounds: a torque that jumps from the lower to the upper bound overshoots. What always holds: for lower <= x <= upper
with middle m and half-width r,

.. math:: (h * m)_k - (|h| * r)_k \le (h * x)_k \le (h * m)_k + (|h| * r)_k,

and both ends are attained, by x = m +- sgn(h) r. It is the same as splitting h = h+ - h- (upper = h+ * upper - h- *
lower). Where h >= 0 it is the filter of both bounds.

A filter runs as a controller would run it: once per sample, causal. Before the first sample the signal is taken to have
had its first value for ever, which lies in the first bounds, so inclusion holds from the first sample on.

abs(h) is cut off after N samples where the sum of the rest is below ``REST``; the rest times the largest half-width is
added. The sum is bounded by the poles: h is a sum of c p^k, so the rest is at most the sum of abs(c) abs(p)^N / (1 -
abs(p)). Rounding of the recursions is covered by ``ROUNDING`` times the largest value; that is an allowance (a thousand
times what was measured), not a proof.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError

Kind = Literal["none", "first-order", "butterworth"]

MOST_ORDER = 8
REST = 1e-12
"""Sum of abs(h) that is cut off, relative to 1, the gain at rest."""
ROUNDING = 1e-9
_LONGEST = 10_000_000


@dataclass(frozen=True)
class SignalFilter:
    """A low-pass with gain 1 at rest.

    Attributes
    ----------
    kind : none; first-order: y += a (x - y) with a = 1 - exp(-2 pi cutoff / rate), ``order`` times one after the other;
        butterworth: of that order, by the bilinear transform
    cutoff : [Hz]; 0 for none
    """

    kind: Kind = "none"
    order: int = 1
    cutoff: float = 0.0

    def __str__(self) -> str:
        """As on the command line."""
        if self.kind == "none":
            return "none"
        if self.kind == "butterworth":
            return f"butterworth{self.order}:{self.cutoff:g}"
        return f"first-order:{self.cutoff:g}" + (f"x{self.order}" if self.order > 1 else "")

    def at(self, rate: float) -> "RunningFilter":
        """The filter at a sampling rate [Hz].

        Raises
        ------
        NumericalError
            If the cut-off frequency is not below half the rate, or so low that the filter forgets nothing.
        """
        if self.kind == "none":
            return RunningFilter(np.empty((0, 6)), np.ones(1), 0.0)
        if not 0.0 < self.cutoff < 0.5 * rate:
            message = f"expected a cut-off between 0 and half the sampling rate, {0.5 * rate:.5g} Hz"
            raise NumericalError(f"the filter {self} does not fit: {message}")
        from scipy.signal import butter, zpk2sos

        if self.kind == "butterworth":
            zeros, poles, gain = butter(self.order, self.cutoff, fs=rate, output="zpk")
        else:
            pole = float(np.exp(-2.0 * np.pi * self.cutoff / rate))
            zeros, poles, gain = np.zeros(self.order), np.full(self.order, pole), (1.0 - pole) ** self.order
        sections = np.asarray(zpk2sos(zeros, poles, gain))
        response, rest = _response(sections, np.asarray(poles), self.kind == "first-order")
        return RunningFilter(sections, response, rest)


@dataclass(frozen=True)
class RunningFilter:
    """A filter at one sampling rate.

    Attributes
    ----------
    sections : second-order sections, shape (S, 6); none for the signal itself
    response : impulse response h, shape (N,)
    rest : bound of the sum of abs(h) from N on
    """

    sections: Array
    response: Array
    rest: float

    @property
    def gain(self) -> float:
        """Sum of abs(h): how much wider a constant band gets; 1 for filters that do not overshoot."""
        return float(np.abs(self.response).sum()) + self.rest

    def apply(self, x: Array) -> Array:
        """Filter signals along the first axis, shape (T, ...)."""
        return FilterRun(self).apply(x)

    def bounds(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Bounds (T, n) of every filtered signal that lies between lower and upper (T, n).

        Raises
        ------
        ShapeError
            If the shapes differ.
        """
        return BoundsRun(self).bounds(lower, upper)


class FilterRun:
    """A filter at work on one signal, which comes piece by piece."""

    def __init__(self, running: RunningFilter) -> None:
        self._running = running
        self._state: Array | None = None

    def apply(self, x: Array) -> Array:
        """Filter the next samples along the first axis, shape (T, ...)."""
        sections = self._running.sections
        if not len(sections) or not len(x):
            return x
        from scipy.signal import sosfilt, sosfilt_zi

        if self._state is None:
            self._state = sosfilt_zi(sections).reshape(len(sections), 2, *[1] * (x.ndim - 1)) * x[0]
        filtered, self._state = sosfilt(sections, x, axis=0, zi=self._state)
        return np.asarray(filtered)


class BoundsRun:
    """A filter at work on bounds that come piece by piece."""

    def __init__(self, running: RunningFilter) -> None:
        self._running = running
        self._middle = FilterRun(running)
        self._held: Array | None = None  # half-widths that the filter still remembers
        self._most = self._widest = np.zeros(1)

    def bounds(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Bounds of the next samples, as :meth:`RunningFilter.bounds`."""
        if lower.shape != upper.shape or lower.ndim != 2:
            raise ShapeError(f"bounds of shapes {lower.shape} and {upper.shape}, expected (T, n) for both")
        if not len(self._running.sections) or not len(lower):
            return lower, upper
        middle, radius = 0.5 * (lower + upper), 0.5 * (upper - lower)
        most = np.maximum(np.maximum.accumulate(np.maximum(np.abs(lower), np.abs(upper)), axis=0), self._most)
        widest = np.maximum(np.maximum.accumulate(radius, axis=0), self._widest)
        self._most, self._widest = most[-1], widest[-1]
        half = self._widened(radius) + self._running.rest * widest + ROUNDING * most
        centre = self._middle.apply(middle)
        return centre - half, centre + half

    def _widened(self, radius: Array) -> Array:
        """Convolution of abs(h) with the half-widths, the first of which held for ever."""
        from scipy.signal import oaconvolve

        size = np.abs(self._running.response)
        before = len(size) - 1
        past = np.broadcast_to(radius[0], (before, radius.shape[1])) if self._held is None else self._held
        held = np.concatenate([past, radius])
        self._held = held[len(held) - before :].copy()
        return np.asarray(oaconvolve(held, size[:, None], mode="valid", axes=0))


def _response(sections: Array, poles: Array, repeated: bool) -> tuple[Array, float]:
    """Impulse response up to where the rest is below ``REST``, and a bound of the sum of the rest's absolute values."""
    from scipy.signal import sosfilt

    slowest = float(np.abs(poles).max())
    order = len(poles)
    # Repeated poles decay as k^(order - 1) p^k: some more time constants each; the bound below then says whether
    # enough.
    length = int(np.ceil((np.log(1.0 / REST) + 12.0 * order) / -np.log(slowest))) + 2 * order if slowest > 0.0 else 64
    if not length < _LONGEST:
        raise NumericalError("the cut-off frequency is too low for this sampling rate; expected a higher one")
    impulse = np.zeros(length)
    impulse[0] = 1.0
    h = np.asarray(sosfilt(sections, impulse))
    if repeated:
        # h >= 0 and its sum is the gain at rest, 1.
        return np.maximum(h, 0.0), max(1.0 - float(h.sum()), 0.0) + length * 1e-16
    spread = np.abs(poles[:, None] - poles[None, :]) + np.eye(order)
    numerator = np.abs(_polynomial(sections, poles)) / spread.prod(axis=1)
    decay = np.abs(poles)
    rest = 4.0 * float(np.sum(numerator * decay ** (length - order) / (1.0 - decay)))
    return h, rest + length * 1e-16


def _polynomial(sections: Array, z: Array) -> Array:
    """Numerator of the transfer function at z, in powers of z."""
    value = np.ones(len(z), dtype=complex)
    for section in sections:
        value = value * (section[0] * z * z + section[1] * z + section[2])
    return np.asarray(value)
