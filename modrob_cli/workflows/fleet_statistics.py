"""Figures of many logs: how they spread, which stand out, whether they drift."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array

Flags = NDArray[np.bool_]

FEWEST = 10
"""Of fewer logs none is called an outlier, and no drift is looked for: the normal approximations do not hold."""
OUTLYING = 3.0
"""Robust standard deviations beyond the median from which a log is an outlier."""
MAD_TO_SIGMA = 1.4826
"""Median absolute deviation of a normal distribution, inverse."""
LEAST_LOG_SIGMA = 0.02
LEAST_SIGMA = 0.005
"""Logs that differ by less are alike, however small the deviation of the rest: 2 % of NRMSE, 0.5 % of the samples."""
LEVEL = 0.05
"""Chance of finding any drift among all trends of a table where there is none."""
MOST_PAIRS = 1_000_000
_SEED = 1
_Z = 1.959963984540054


@dataclass(frozen=True)
class Spread:
    """Quartiles and extremes of the values that are there."""

    count: int
    least: float
    lower: float
    median: float
    upper: float
    largest: float


@dataclass(frozen=True)
class Trend:
    """How a value changes over time.

    Attributes
    ----------
    slope, lower, upper : Theil-Sen slope per unit of time and its 95 % interval
    time, value : medians, through which the line goes
    p : of Kendall's test if each log were independent of the one before
    p_alike : the same if neighbouring logs are as alike as they look, apart from the trend
    p_likeness : of logs in a row being as alike as that by chance
    count : logs
    """

    slope: float
    lower: float
    upper: float
    time: float
    value: float
    p: float
    p_alike: float
    p_likeness: float
    count: int


def spread(values: Array) -> Spread | None:
    """Quartiles of the finite values; None if there are none."""
    found = values[np.isfinite(values)]
    if not len(found):
        return None
    return Spread(len(found), *(float(x) for x in np.quantile(found, [0.0, 0.25, 0.5, 0.75, 1.0])))


def high_outliers(values: Array) -> Flags:
    """Values above median + 3 x 1.4826 MAD of their logarithms, for ratios such as NRMSE; what is not finite never is.

    Parameters
    ----------
    values : at least 0
    """
    logarithms = np.log(np.maximum(values, np.finfo(float).tiny))
    return _above(np.where(np.isfinite(values), logarithms, np.nan), LEAST_LOG_SIGMA)


def low_outliers(values: Array) -> Flags:
    """Values below median - 3 x 1.4826 MAD, for fractions such as those inside the bounds."""
    return _above(-values, LEAST_SIGMA)


def _above(values: Array, least: float) -> Flags:
    found = values[np.isfinite(values)]
    if len(found) < FEWEST:
        return np.zeros(len(values), dtype=bool)
    middle = np.median(found)
    sigma = max(MAD_TO_SIGMA * float(np.median(np.abs(found - middle))), least)
    return values > middle + OUTLYING * sigma  # comparisons with nan are false


def trend(time: Array, values: Array) -> Trend | None:
    """Theil-Sen slope with its interval, and Kendall's test of it.

    The slope is the median over all pairs of logs with different times, the interval that of Sen, "Estimates of the
    regression coefficient based on Kendall's tau" (1968), the variance of Kendall's sum with ties that of Kendall,
    "Rank correlation methods" (1970). Logs in a row that are alike tell less than as many independent ones: if the
    ranks of what the line leaves over are correlated from one log to the next, the variance grows by
    (1 + r) / (1 - r), that of a first-order process (Matalas and Sankarasubramanian 2003, large sample).

    From about 1400 logs on, the slopes are those of about a million pairs: logs so many places apart, for distances
    that are picked at random, always the same ones.

    Parameters
    ----------
    time, values : shape (N,); what is not finite is left out

    Returns
    -------
    trend : None if fewer than 10 logs are there, or all of one time
    """
    there = np.isfinite(time) & np.isfinite(values)
    order = np.argsort(time[there], kind="stable")
    t, y = time[there][order], values[there][order]
    if len(t) < FEWEST or t[0] == t[-1]:
        return None
    slopes = _slopes(t, y)
    slope = float(np.median(slopes))
    total, variance = _kendall(t, y)
    likeness = _likeness(_ranks(y - slope * (t - t[0])))
    factor = (1.0 + likeness) / (1.0 - likeness) if likeness >= _Z / np.sqrt(len(t)) else 1.0
    half = _Z * np.sqrt(variance * factor) / _pairs(t)
    lower, upper = np.quantile(slopes, np.clip([0.5 - half / 2.0, 0.5 + half / 2.0], 0.0, 1.0))
    score = max(abs(total) - 1.0, 0.0) / np.sqrt(variance) if variance > 0.0 else 0.0
    p, p_alike = (math.erfc(z / math.sqrt(2.0)) for z in (score, score / math.sqrt(factor)))
    p_likeness = math.erfc(likeness * math.sqrt(len(t) / 2.0)) / 2.0
    return Trend(
        slope, float(lower), float(upper), float(np.median(t)), float(np.median(y)), p, p_alike, p_likeness, len(t)
    )


def _slopes(t: Array, y: Array) -> Array:
    """Slopes of pairs of logs with different times; times ascend."""
    n = len(t)
    distances = np.arange(1, n)
    if n * (n - 1) // 2 > MOST_PAIRS:
        # One distance of each of so many stretches, so that near and far pairs keep their shares.
        edges = np.linspace(1, n, 2 * MOST_PAIRS // n + 1)
        rng = np.random.default_rng(_SEED)
        distances = np.unique((edges[:-1] + rng.random(len(edges) - 1) * np.diff(edges)).astype(int))
    steps = np.concatenate([t[d:] - t[:-d] for d in distances])
    rises = np.concatenate([y[d:] - y[:-d] for d in distances])
    use = steps > 0.0
    slopes: Array = rises[use] / steps[use]
    return slopes


def _pairs(t: Array) -> float:
    """Number of pairs of different times."""
    return len(t) * (len(t) - 1) / 2.0 - float(sum(size * (size - 1) / 2.0 for size in _ties(t)))


def _ties(values: Array) -> list[int]:
    return [int(size) for size in np.unique(values, return_counts=True)[1] if size > 1]


def _kendall(t: Array, y: Array) -> tuple[float, float]:
    """Concordant less discordant pairs, and the variance of that without trend, with ties in both; times ascend."""
    total = 0.0
    for value, first in zip(y, np.searchsorted(t, t), strict=True):
        earlier = y[:first]
        total += int(np.count_nonzero(earlier < value)) - int(np.count_nonzero(earlier > value))
    n, groups_t, groups_y = len(t), _ties(t), _ties(y)

    def three(sizes: Sequence[int]) -> float:
        return float(sum(size * (size - 1) * (2 * size + 5) for size in sizes))

    def two(sizes: Sequence[int], last: int) -> float:
        return float(sum(size * (size - 1) * (size - 2 if last else 1) for size in sizes))

    variance = (three([n]) - three(groups_t) - three(groups_y)) / 18.0
    variance += two(groups_t, 0) * two(groups_y, 0) / (2.0 * n * (n - 1))
    variance += two(groups_t, 1) * two(groups_y, 1) / (9.0 * n * (n - 1) * (n - 2))
    return total, max(variance, 0.0)


def _ranks(values: Array) -> Array:
    """Ranks from 1; equal values share the mean of theirs."""
    _, place, sizes = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(sizes)
    ranks: Array = (ends - (sizes - 1) / 2.0)[place]
    return ranks


def _likeness(ranks: Array) -> float:
    """Correlation of ranks from one log to the next; 0 if all are equal."""
    centred = ranks - ranks.mean()
    power = float(centred @ centred)
    likeness = float(centred[1:] @ centred[:-1]) / power if power > 0.0 else 0.0
    return min(likeness, 1.0 - 2.0 / len(ranks))


def significant(p_values: Sequence[float], level: float = LEVEL) -> list[bool]:
    """Which of several tests speak, so that the chance of any false one is the level (Holm 1979)."""
    out = [False] * len(p_values)
    for rank, k in enumerate(sorted(range(len(p_values)), key=lambda k: p_values[k])):
        if p_values[k] > level / (len(p_values) - rank):
            break
        out[k] = True
    return out
