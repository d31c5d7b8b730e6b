"""Series that come in pieces, reduced to what a picture can show: smallest and largest of runs of samples."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array


@dataclass(frozen=True)
class Band:
    """Smallest and largest values of a series in each run, shape (runs, n)."""

    low: Array
    high: Array


class Envelope:
    """Smallest and largest values of runs of samples; the runs get longer as more samples come.

    At most ``2 most`` runs are kept; when they are full, neighbours are joined and the runs' length doubles. So no peak
    is lost, and memory does not grow with the motion.

    Parameters
    ----------
    series, joints : each piece has that many series of that many joints
    """

    def __init__(self, series: int, joints: int, most: int) -> None:
        self.size = 1
        self._most = most
        self._t = np.empty((0, 2))
        self._ends = np.empty((0, 2 * series, joints))  # -smallest and largest, so that both are maxima
        self._rest_t = np.empty(0)
        self._rest = np.empty((0, 2 * series, joints))

    def add(self, t: Array, values: Array) -> None:
        """Take the next samples: times (T,) and values (T, series, joints)."""
        t = np.concatenate([self._rest_t, t])
        ends = np.concatenate([self._rest, np.concatenate([-values, values], axis=1)])
        while len(t) >= self.size:
            runs = min(len(t) // self.size, 2 * self._most - len(self._t))
            taken = runs * self.size
            self._append(t[:taken].reshape(runs, -1), ends[:taken].reshape(runs, self.size, *ends.shape[1:]))
            t, ends = t[taken:], ends[taken:]
            if len(self._t) == 2 * self._most:
                self._join()
        self._rest_t, self._rest = t, ends

    def _append(self, t: Array, ends: Array) -> None:
        self._t = np.concatenate([self._t, t[:, [0, -1]]])
        self._ends = np.concatenate([self._ends, ends.max(axis=1)])

    def _join(self) -> None:
        self._t = np.stack([self._t[::2, 0], self._t[1::2, 1]], axis=1)
        self._ends = np.maximum(self._ends[::2], self._ends[1::2])
        self.size *= 2

    def bands(self) -> tuple[Array, list[Band]]:
        """Middle times of the runs (runs,), and the band of each series."""
        t, ends = self._t, self._ends
        if len(self._rest_t):
            t = np.concatenate([t, self._rest_t[None, [0, -1]]])
            ends = np.concatenate([ends, self._rest.max(axis=0)[None]])
        series = ends.shape[1] // 2
        return t.mean(axis=1), [Band(-ends[:, k], ends[:, series + k]) for k in range(series)]
