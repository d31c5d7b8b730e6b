"""Single samples of position or velocity that cannot be true: lost bits, a message of zeros."""

from dataclasses import replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.log import JointLog

NOISE_FACTOR = 25.0
"""A sample is a glitch if it is off by this many robust standard deviations of such differences,"""

RANGE_SHARE = 0.01
"""and by this share of the channel's range."""


def without_glitches(log: JointLog) -> tuple[JointLog, int]:
    """Replace single wild samples of positions and velocities; returns the log and how many there were.

    A sample is compared with the cubic through its two neighbours on either side. What does not stand alone (a jump,
    a dropout of several samples) stays. Efforts stay as they are: an unusual torque may be true.
    """
    q, count = _repaired(log.q)
    dq, more = (None, 0) if log.dq is None else _repaired(log.dq)
    return (replace(log, q=q, dq=dq), count + more) if count + more else (log, 0)


def _repaired(x: Array) -> tuple[Array, int]:
    if len(x) < 5:
        return x, 0
    out, count = x.copy(), 0
    for j in range(x.shape[1]):
        column = out[:, j]
        limit = _limit(column)
        for k in _suspects(column, limit):
            kept, column[k] = column[k], _expected(column)[k - 2]
            # An isolated glitch leaves nothing behind once it is replaced; anything else is not ours to mend.
            near = np.abs(_difference(column)[max(0, k - 4) : k + 1])
            if np.any(near > limit):
                column[k] = kept
            else:
                count += 1
    return out, count


def _suspects(column: Array, limit: float) -> list[int]:
    """Samples whose difference is the largest within two samples on either side, and beyond the limit."""
    size = np.abs(_difference(column))
    found = []
    for k in np.flatnonzero(size > limit):
        if size[k] >= np.max(size[max(0, k - 2) : k + 3]):
            found.append(int(k) + 2)
    return found


def _limit(column: Array) -> float:
    difference = np.abs(_difference(column))
    return max(NOISE_FACTOR * float(np.median(difference)) / 0.6745, RANGE_SHARE * _range(column))


def _range(column: Array) -> float:
    """Range without the most extreme thousandth at either end, so that a glitch does not hide itself."""
    low, high = np.quantile(column, [0.001, 0.999])
    return float(high - low)


def _difference(column: Array) -> Array:
    """Samples 2 to N - 3 minus what their neighbours let expect."""
    return column[2:-2] - _expected(column)


def _expected(column: Array) -> Array:
    """Cubic through two neighbours on either side, at samples 2 to N - 3."""
    return (4.0 * (column[1:-3] + column[3:-1]) - (column[:-4] + column[4:])) / 6.0
