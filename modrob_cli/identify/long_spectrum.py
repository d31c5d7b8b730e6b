"""The spectrum of a long signal: Welch's method, piece by piece."""

import numpy as np

from modrob_cli.arrays import Array

SEGMENT = 2**17
"""Samples of a segment at most; a longer log has more segments than eight, not longer ones."""


class LongSpectrum:
    """Averages the spectra of half-overlapping segments of a signal that comes in pieces.

    The result is that of :func:`modrob_cli.identify.signal_cutoff.welch_spectrum`, in a third of its time: a straight
    line is taken out of each segment in closed form.

    Parameters
    ----------
    rate : [Hz];  length : samples of a segment;  n : channels
    """

    def __init__(self, rate: float, length: int, n: int) -> None:
        from scipy.signal import get_window

        self.rate = rate
        self.length = length
        self._step = length - length // 2
        self._window = get_window("hann", length)
        self._ramp = np.arange(length) - 0.5 * (length - 1)
        self._held: Array = np.empty((0, n))
        self._sum = np.zeros((n, length // 2 + 1))
        self._segments = 0

    def add(self, x: Array) -> None:
        """Take the next samples (N, n)."""
        held = np.concatenate([self._held, x])
        first = 0
        while first + self.length <= len(held):
            self._add_segment(np.ascontiguousarray(held[first : first + self.length].T))
            first += self._step
        self._held = held[first:].copy()

    def _add_segment(self, x: Array) -> None:
        """Take a segment (n, length)."""
        from scipy.fft import rfft

        x -= x.mean(axis=1, keepdims=True)
        x -= (x @ self._ramp / max(float(self._ramp @ self._ramp), 1.0))[:, None] * self._ramp
        self._sum += np.abs(rfft(x * self._window, axis=1)) ** 2
        self._segments += 1

    def density(self) -> tuple[Array, Array]:
        """Frequencies (F,) and densities (F, n), as those of :func:`modrob_cli.identify.signal_cutoff.spectrum`."""
        frequency = np.fft.rfftfreq(self.length, 1.0 / self.rate)
        sides = np.full(len(frequency), 2.0)
        sides[0] = 1.0
        if self.length % 2 == 0:
            sides[-1] = 1.0
        scale = sides / (self.rate * float(self._window @ self._window) * max(self._segments, 1))
        return np.asarray(frequency), np.asarray(self._sum * scale).T
