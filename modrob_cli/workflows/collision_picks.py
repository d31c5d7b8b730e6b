"""What is kept of the stretches of a run for the end: picked samples, widths, and how near the torque came."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.collision.events import Band
from modrob_cli.collision.thinned import Thinned

MOST_WIDTHS = 65_536
"""Of more samples, medians of widths are those of every second, fourth, eighth and so on."""
MOST_SHARE = 1e9
"""Larger shares of a band are given as this: it has no width."""

Mask = NDArray[np.bool_]


class Picks:
    """Keeps so many evenly spaced samples of a run of known length."""

    def __init__(self, samples: int, most: int) -> None:
        self._wanted = np.unique(np.linspace(0, samples - 1, most).astype(int))
        self._count = 0
        self._kept: list[tuple[NDArray[Any], ...]] = []

    def add(self, *parts: NDArray[Any]) -> None:
        """Take the next samples: arrays of shape (N, ...), the same kinds every time."""
        size = len(parts[0])
        ends = np.searchsorted(self._wanted, (self._count, self._count + size))
        picked = self._wanted[ends[0] : ends[1]] - self._count
        self._kept.append(tuple(part[picked] for part in parts))
        self._count += size

    def arrays(self) -> tuple[NDArray[Any], ...]:
        """The picked samples, put together."""
        return tuple(np.concatenate(parts) for parts in zip(*self._kept, strict=True))


@dataclass(frozen=True)
class Widths:
    """Of the filtered band over the samples that count, shape (n,) each.

    ``other_ratio``: median of the other band's width over this one's; None without one.
    """

    least: Array
    median: Array
    most: Array
    other_ratio: Array | None


class WidthsRun:
    """Finds the widths of one run."""

    def __init__(self) -> None:
        self._least, self._most = np.full(1, np.inf), np.zeros(1)
        self._widths, self._ratios = Thinned(MOST_WIDTHS), Thinned(MOST_WIDTHS)

    def add(self, width: Array, other: Array | None, counts: Mask) -> None:
        """Take the next samples: widths of both bands, shape (N, n), and which samples count."""
        counted = width[counts]
        if len(counted):
            self._least = np.minimum(self._least, counted.min(axis=0))
            self._most = np.maximum(self._most, counted.max(axis=0))
            self._widths.add(counted)
        if other is not None:
            self._ratios.add(other / np.maximum(width, 1e-300))

    def result(self) -> Widths:
        """Widths over all samples up to now."""
        ratio = np.median(self._ratios.rows, axis=0) if self._ratios.count else None
        return Widths(self._least, np.median(self._widths.rows, axis=0), self._most, ratio)


@dataclass(frozen=True)
class Closest:
    """How near the measurement came to an end of its band, shape (n,) each.

    Attributes
    ----------
    share : of the half-width, measured from the middle of the band: 1 at its end, more outside
    time : where, [s]
    """

    share: Array
    time: Array


class ClosestRun:
    """Finds how near the measurement of one run came."""

    def __init__(self, dof: int) -> None:
        self.result = Closest(np.zeros(dof), np.zeros(dof))

    def add(self, band: Band, used: Mask) -> None:
        """Take the next samples."""
        if not used.any():
            return
        half = 0.5 * (band.upper - band.lower)[used]
        away = np.abs(band.measured - 0.5 * (band.lower + band.upper))[used]
        share = np.where(away > MOST_SHARE * half, MOST_SHARE, away / np.where(half > 0.0, half, 1.0))
        at = share.argmax(axis=0)
        most, time = share[at, np.arange(len(at))], band.t[used][at]
        nearer = most > self.result.share
        self.result = Closest(np.where(nearer, most, self.result.share), np.where(nearer, time, self.result.time))
