"""How far predicted torques are from recorded ones over a long log, piece by piece."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.prediction import PredictionError, error_of
from modrob_cli.identify.signals import Mask, filter_memory, low_pass


class LongErrors:
    """Sums of the errors of pieces that follow one another; what the low-pass needs of the next one is held back.

    The result is that of :func:`modrob_cli.identify.prediction.prediction_errors` over the whole log, up to rounding.

    Parameters
    ----------
    rate, cutoff : [Hz];  n : joints
    """

    def __init__(self, rate: float, cutoff: float, n: int) -> None:
        self.rate = rate
        self.cutoff = cutoff
        self.count = 0
        self._memory = filter_memory(rate, cutoff)
        self._squares = np.zeros((4, n))  # residual, recorded, both low-passed
        self._largest = np.full(n, -1.0)
        self._time = np.zeros(n)
        self._next = 0  # number of the sample behind the last piece
        self._held = np.empty((0, 2, n))
        self._held_used = np.empty(0, dtype=bool)
        self._done = 0  # of those held

    def add(self, first: int, t: Array, used: Mask, recorded: Array, predicted: Array) -> None:
        """Take a piece that begins with the sample ``first``; between it and the one before there may be a gap.

        Parameters
        ----------
        t, used : shape (N,);  recorded, predicted : shape (N, n)
        """
        if first != self._next:
            self._low_pass(last=True)
        self._next = first + len(t)
        residual = recorded - predicted
        self._add_plain(t[used], residual[used], recorded[used])
        self._held = np.concatenate([self._held, np.stack([residual, recorded], axis=1)])
        self._held_used = np.concatenate([self._held_used, used])
        self._low_pass(last=False)

    def _add_plain(self, t: Array, residual: Array, recorded: Array) -> None:
        if not len(t):
            return
        self.count += len(t)
        self._squares[:2] += [(residual**2).sum(axis=0), (recorded**2).sum(axis=0)]
        worst, joints = np.argmax(np.abs(residual), axis=0), np.arange(residual.shape[1])
        size = np.abs(residual[worst, joints])
        larger = size > self._largest
        self._largest, self._time = np.where(larger, [size, t[worst]], [self._largest, self._time])

    def _low_pass(self, last: bool) -> None:
        """Count the samples that no later one can reach through the filter, and keep what reaches the others."""
        end = len(self._held) - (0 if last else self._memory)
        if end > self._done:
            counted = self._held_used[self._done : end]
            low = low_pass(self._held, self.rate, self.cutoff)[self._done : end][counted]
            self._squares[2:] += (low**2).sum(axis=0)
            self._done = end
        begin = len(self._held) if last else max(self._done - self._memory, 0)
        self._held, self._held_used = self._held[begin:], self._held_used[begin:]
        self._done = max(self._done - begin, 0)

    def errors(self) -> list[PredictionError]:
        """Errors per joint; at least one sample has to count."""
        self._low_pass(last=True)
        rmse, size, low_rmse, low_size = np.sqrt(self._squares / self.count)
        return [
            error_of(rmse[j], size[j], low_rmse[j], low_size[j], self._largest[j], self._time[j])
            for j in range(len(rmse))
        ]
