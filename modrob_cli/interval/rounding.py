r"""Directed rounding on top of round-to-nearest doubles.

Each function returns a pair (down, up) of doubles that enclose the exact real result for the given doubles.

Why this is sound: IEEE 754 round-to-nearest returns a double next to the exact value, so one step of
``nextafter`` outward always encloses it, in the subnormal range as well (the grid is uniform there). A step is
left out only where the result is known to be exact. An overflow to inf keeps the largest finite double as the
bound on the inner side.
"""

import numpy as np

from modrob_cli.arrays import Array


def _below(value: Array) -> Array:
    """Return the next double downward; NumPy warns of a step to infinity, which is meant here."""
    with np.errstate(over="ignore", under="ignore"):
        return np.asarray(np.nextafter(value, -np.inf))


def _above(value: Array) -> Array:
    """Return the next double upward, as above."""
    with np.errstate(over="ignore", under="ignore"):
        return np.asarray(np.nextafter(value, np.inf))


def _outward(value: Array, exact: Array) -> tuple[Array, Array]:
    """One step outward on both sides, except where the value is exact."""
    return np.where(exact, value, _below(value)), np.where(exact, value, _above(value))


def add(a: Array, b: Array) -> tuple[Array, Array]:
    """Enclose a + b; correctly rounded on each side (the error term of Knuth's TwoSum gives its sign)."""
    with np.errstate(over="ignore", invalid="ignore"):
        s = a + b
        t = s - a
        error = (a - (s - t)) + (b - t)
    known = np.isfinite(error) & np.isfinite(s)
    infinite_exact = np.isinf(a) | np.isinf(b)
    down = np.where((known & (error >= 0)) | infinite_exact, s, _below(s))
    up = np.where((known & (error <= 0)) | infinite_exact, s, _above(s))
    return down, up


def multiply(a: Array, b: Array) -> tuple[Array, Array]:
    """Enclose a b; exact for factors 0 and +-1. By convention 0 times an infinite end point is 0."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        p = a * b
    zero = (a == 0.0) | (b == 0.0)
    p = np.where(zero, 0.0, p)
    exact = zero | (np.abs(a) == 1.0) | (np.abs(b) == 1.0) | np.isinf(a) | np.isinf(b)
    return _outward(p, exact)


def divide(a: Array, b: Array) -> tuple[Array, Array]:
    """Enclose a / b for b != 0; exact for a = 0, |b| = 1, and infinite a or b."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        quotient = a / b
    quotient = np.where(np.isnan(quotient), 0.0, quotient)
    return _outward(quotient, (a == 0.0) | (np.abs(b) == 1.0) | np.isinf(a) | np.isinf(b))
