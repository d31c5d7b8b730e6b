"""Evenly picked samples of signals of any length in bounded memory."""

import numpy as np

from modrob_cli.arrays import Array


class Thinned:
    """Keeps all samples, or every second, fourth, eighth and so on once there are more than ``most``.

    What is kept depends on the samples alone, not on the pieces they come in.
    """

    def __init__(self, most: int) -> None:
        self.count = 0
        self._most = most
        self._step = 1
        self._parts: list[Array] = []
        self._kept = 0

    def add(self, rows: Array) -> None:
        """Take the next samples, shape (N, ...)."""
        picked = rows[-self.count % self._step :: self._step]
        self.count += len(rows)
        # A copy, or a view would hold all the samples.
        self._parts.append(picked.copy())
        self._kept += len(picked)
        while self._kept > self._most:
            self._parts = [np.concatenate(self._parts)[::2].copy()]
            self._kept = len(self._parts[0])
            self._step *= 2

    @property
    def rows(self) -> Array:
        """Samples that were kept; there has to be at least one."""
        return np.concatenate(self._parts)
