"""The usual step between the samples of a long log: its exact median, in memory that does not grow with the log."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.identify.long_source import SampleTimes

PIECE = 2**18
"""Times that are read at once."""

MOST_BINS = 2**19
"""Different steps that are told apart in the first pass; of more, neighbours are put together."""

Counts = NDArray[np.int64]


@dataclass(frozen=True)
class Steps:
    """Steps between samples, [s]: median, shortest and longest."""

    median: float
    shortest: float
    longest: float


class Tally:
    """How often each value came; values in increasing order.

    Attributes
    ----------
    values, counts : shape (K,)
    """

    def __init__(self) -> None:
        self.values: Array = np.empty(0)
        self.counts: Counts = np.empty(0, dtype=np.int64)

    def add(self, values: Array) -> None:
        """Count values (N,)."""
        found, counts = np.unique(values, return_counts=True)
        merged, place = np.unique(np.concatenate([self.values, found]), return_inverse=True)
        total = np.zeros(len(merged), dtype=np.int64)
        np.add.at(total, place, np.concatenate([self.counts, counts]))
        self.values, self.counts = merged, total

    def at(self, rank: int) -> float:
        """The value that is so many places behind the smallest one."""
        return float(self.values[np.searchsorted(np.cumsum(self.counts), rank, "right")])


def step_statistics(source: SampleTimes, piece: int = PIECE, most_bins: int = MOST_BINS) -> Steps:
    """Median as ``numpy.median`` of all steps gives it, shortest and longest step.

    A first pass counts steps in bins of a nanosecond, or of more if there are too many different ones; a second one
    counts those in the bins of the two steps in the middle.

    Parameters
    ----------
    piece : times that are read at once
    """
    tally, width = Tally(), 1e-9
    shortest, longest = np.inf, 0.0
    for steps in _steps(source, piece):
        shortest, longest = min(shortest, float(steps.min())), max(longest, float(steps.max()))
        tally.add(np.rint(steps / width))
        while len(tally.values) > most_bins:
            width *= 2.0
            tally = _coarser(tally)
    total = source.count - 1
    ranks = ((total - 1) // 2, total // 2)
    # One bin more on either side: rounding may put a step beside its bin.
    low, high = (tally.at(ranks[0]) - 1.5) * width, (tally.at(ranks[1]) + 1.5) * width
    below, inside = 0, Tally()
    for steps in _steps(source, piece):
        below += int(np.count_nonzero(steps < low))
        inside.add(steps[(steps >= low) & (steps <= high)])
    middle = [inside.at(rank - below) for rank in ranks]
    return Steps(float(np.mean(middle)), shortest, longest)


def _steps(source: SampleTimes, piece: int) -> Iterator[Array]:
    for first in range(0, source.count - 1, piece):
        yield np.diff(source.times(first, first + piece + 1))


def _coarser(tally: Tally) -> Tally:
    """Bins of twice the width."""
    out = Tally()
    out.values, place = np.unique(np.floor(tally.values / 2.0), return_inverse=True)
    out.counts = np.zeros(len(out.values), dtype=np.int64)
    np.add.at(out.counts, place, tally.counts)
    return out
