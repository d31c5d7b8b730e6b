"""Single samples of position or velocity that cannot be true: lost bits, a message of zeros."""

from dataclasses import replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.log import JointLog

NOISE_FACTOR = 25.0
"""A sample is a glitch if it is off by this many robust standard deviations of such differences,"""

RANGE_SHARE = 0.01
"""and by this share of the channel's range."""

FEWEST = 5
"""Samples that it takes to compare one with its neighbours."""


def without_glitches(log: JointLog) -> tuple[JointLog, int]:
    """Replace single wild samples of positions and velocities; returns the log and how many there were.

    A sample is compared with the cubic through its two neighbours on either side. What does not stand alone (a jump,
    a dropout of several samples) stays. Efforts stay as they are: an unusual torque may be true.
    """
    q, places = repaired(log.q, glitch_limits(log.q))
    dq, more = (None, []) if log.dq is None else repaired(log.dq, glitch_limits(log.dq))
    count = len(places) + len(more)
    return (replace(log, q=q, dq=dq), count) if count else (log, 0)


def glitch_limits(x: Array) -> Array:
    """How far a sample of each channel may be off, shape (n,), from samples (N, n)."""
    if len(x) < FEWEST:
        return np.full(x.shape[1], np.inf)
    return limits_from(difference(x), x)


def limits_from(differences: Array, x: Array) -> Array:
    """The same from differences (M, n) and values (N, n), which may be a part of all."""
    spread = np.median(np.abs(differences), axis=0) / 0.6745
    # The range without the most extreme thousandth at either end, so that a glitch does not hide itself.
    low, high = np.quantile(x, [0.001, 0.999], axis=0)
    return np.asarray(np.maximum(NOISE_FACTOR * spread, RANGE_SHARE * (high - low)))


def repaired(x: Array, limits: Array) -> tuple[Array, list[int]]:
    """Samples (N, n) without glitches, and the places of those (one for each channel)."""
    if len(x) < FEWEST:
        return x, []
    sizes = np.abs(difference(x))
    wild = np.flatnonzero((sizes > limits).any(axis=0))
    if not len(wild):
        return x, []
    out, places = x.copy(), []
    for j in wild:
        column, limit = out[:, j], limits[j]
        for k in _suspects(sizes[:, j], limit):
            kept, column[k] = column[k], _expected(column[k - 2 : k + 3])[0]
            # An isolated glitch leaves nothing behind once it is replaced; anything else is not ours to mend.
            near = np.abs(difference(column[max(0, k - 4) : k + 5]))
            if np.any(near > limit):
                column[k] = kept
            else:
                places.append(k)
    return out, places


def _suspects(size: Array, limit: float) -> list[int]:
    """Samples whose difference is the largest within two samples on either side, and beyond the limit."""
    found = []
    for k in np.flatnonzero(size > limit):
        if size[k] >= np.max(size[max(0, k - 2) : k + 3]):
            found.append(int(k) + 2)
    return found


def difference(x: Array) -> Array:
    """Samples 2 to N - 3 minus what their neighbours let expect, along the first axis."""
    return np.asarray(x[2:-2] - _expected(x))


def _expected(x: Array) -> Array:
    """Cubic through two neighbours on either side, at samples 2 to N - 3."""
    return np.asarray((4.0 * (x[1:-3] + x[3:-1]) - (x[:-4] + x[4:])) / 6.0)
