r"""Interval vectors of samples, component first, as midpoints and half-widths.

A number times an interval, and sums, need no case distinction in this form: midpoints go through the plain formula,
half-widths through the formula with absolute values and sums in place of differences. Both give exactly the interval
operations of [R] section II. The product of two intervals is taken from its end points; one factor is always a
parameter, whose sign is known beforehand, so that two products per end suffice.

Rounding: to nearest; half-widths are sums of products of non-negative numbers, so their relative error is that of the
number of operations. See :mod:`modrob_cli.dynamics.ianea` for what the ends need.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_motion import JointPosition
from modrob_cli.dynamics.vectors import apply, cross

Range = tuple[float, float]


@dataclass(frozen=True)
class Box:
    """Midpoints and half-widths of interval vectors, shape (3, T) or (3, 1) each; ``rad`` None for no width."""

    mid: Array
    rad: Array | None = None

    def __add__(self, other: "Box") -> "Box":
        """Sum."""
        if self.rad is None or other.rad is None:
            return Box(self.mid + other.mid, other.rad if self.rad is None else self.rad)
        return Box(self.mid + other.mid, self.rad + other.rad)

    def turned(self, R: Array) -> "Box":
        """A constant matrix (3, 3) times the box."""
        return Box(apply(R, self.mid), None if self.rad is None else apply(np.abs(R), self.rad))

    def to_previous(self, position: JointPosition) -> "Box":
        """From a link's coordinates into the previous link's."""
        mid = position.to_previous(self.mid)
        return Box(mid, None if self.rad is None else apply(np.abs(position.R), turn_width(position, self.rad)))


def turn_width(position: JointPosition, rad: Array) -> Array:
    """Half-widths (3, T) after a turn by the joint, the same forward and back."""
    cos, sin = np.abs(position.cos), np.abs(position.sin)
    return np.stack([cos * rad[0] + sin * rad[1], sin * rad[0] + cos * rad[1], rad[2]])


def cross_width(a: Array, rad: Array) -> Array:
    """Half-widths of a x [b] for numbers with absolute values a and a box of half-widths rad."""
    return np.stack([a[1] * rad[2] + a[2] * rad[1], a[2] * rad[0] + a[0] * rad[2], a[0] * rad[1] + a[1] * rad[0]])


def cross_number(a: Array, box: Box) -> Box:
    """Numbers (3, T) or (3, 1) cross a box. [R] Definition 6 with a degenerate factor."""
    return Box(cross(a, box.mid), None if box.rad is None else cross_width(np.abs(a), box.rad))


def times(factor: Range, mid: Array, rad: Array | None) -> tuple[Array, Array | None]:
    """An interval parameter times intervals of shape (T,); midpoints and half-widths of the hull."""
    low, high = factor
    if low == high:
        return low * mid, None if rad is None else abs(low) * rad
    if rad is None:
        return 0.5 * (low + high) * mid, 0.5 * (high - low) * np.abs(mid)
    y_low, y_high = mid - rad, mid + rad
    if low >= 0.0:
        inf, sup = np.minimum(low * y_low, high * y_low), np.maximum(low * y_high, high * y_high)
    elif high <= 0.0:
        inf, sup = np.minimum(low * y_high, high * y_high), np.maximum(low * y_low, high * y_low)
    else:
        inf, sup = np.minimum(low * y_high, high * y_low), np.maximum(low * y_low, high * y_high)
    return 0.5 * (inf + sup), 0.5 * (sup - inf)


def scaled(factor: Range, box: Box) -> Box:
    """An interval parameter times a box."""
    if factor[0] == factor[1] or box.rad is None:
        mid, rad = times(factor, box.mid, box.rad)
        return Box(mid, rad)
    return _stack([times(factor, box.mid[k], box.rad[k]) for k in range(3)])


def cross_parameter(ends: list[Range], box: Box) -> Box:
    """A vector of three interval parameters cross a box. [R] Definition 6."""
    if all(low == high for low, high in ends):
        return cross_number(np.array([[low] for low, _ in ends]), box)
    parts = []
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        plus = _component(ends[i], box, j)
        minus = _component(ends[j], box, i)
        parts.append((plus[0] - minus[0], _sum(plus[1], minus[1])))
    return _stack(parts)


def matrix_parameter(ends: list[Range], box: Box) -> Box:
    """A symmetric matrix of interval parameters, entries xx, xy, xz, yy, yz, zz, times a box. [R] Definition 5."""
    rows = ((0, 1, 2), (1, 3, 4), (2, 4, 5))
    parts = []
    for row in rows:
        mid: Array = np.zeros(box.mid.shape[1])
        rad: Array | None = None
        for k, entry in enumerate(row):
            if ends[entry] != (0.0, 0.0):
                product = _component(ends[entry], box, k)
                mid, rad = mid + product[0], _sum(rad, product[1])
        parts.append((mid, rad))
    return _stack(parts)


def _component(factor: Range, box: Box, k: int) -> tuple[Array, Array | None]:
    return times(factor, box.mid[k], None if box.rad is None else box.rad[k])


def _sum(a: Array | None, b: Array | None) -> Array | None:
    if a is None or b is None:
        return b if a is None else a
    return a + b


def _stack(parts: list[tuple[Array, Array | None]]) -> Box:
    mid = np.stack([part[0] for part in parts])
    if all(part[1] is None for part in parts):
        return Box(mid)
    return Box(mid, np.stack([np.zeros(mid.shape[1]) if part[1] is None else part[1] for part in parts]))
