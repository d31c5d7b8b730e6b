r"""Midpoint-radius arithmetic: arrays of balls {x : |x - c| <= r}, many samples at once.

Why the results enclose the exact reals, with u = 2^-53:

1. A product is c1 c2 with radius |c1| r2 + r1 (|c2| + r2), a sum c1 + c2 with radius r1 + r2: exact set arithmetic.
2. Centres are computed in round-to-nearest. Each operation here adds at most nine products, so its centre is off by at
   most 10 u times the sum of the absolute values, and ``EPS`` = 32 u times that sum goes into the radius. Constant
   rotations may be off by 4 u per entry, or have entries up to u left out: the same term covers it.
3. Radii are computed in round-to-nearest by additions and multiplications of non-negative numbers, so a radius that k
   roundings lead to has at least (1 - u)^k of its exact value. A torque's gradient is a polynomial of degree below 8 in
   quantities with fewer than 100 roundings per joint: k < 800 n. :meth:`Ball.reach` divides this out, once at the end:
   it multiplies by 1 + 2^-36, enough for k < 2^17, that is for 160 joints.
4. Underflow loses at most 2^-1075 per operation: ``TINY`` in ``reach``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from modrob_cli.arrays import Array
from modrob_cli.dynamics import vectors

EPS = 2.0**-48
GROW = 1.0 + 2.0**-36
TINY = 1e-290


@dataclass(frozen=True)
class Ball:
    """Centres and radii >= 0, of one shape (or broadcastable). Vectors have their components on the first axis."""

    c: Array
    r: Array

    @classmethod
    def exact(cls, value: ArrayLike) -> "Ball":
        """Balls of radius zero."""
        c = np.asarray(value, dtype=float)
        return cls(c, np.zeros_like(c))

    @classmethod
    def between(cls, lower: Array, upper: Array) -> "Ball":
        """Balls around given intervals."""
        c = 0.5 * lower + 0.5 * upper
        return cls(c, np.maximum(upper - c, c - lower))

    @property
    def reach(self) -> Array:
        """The radius with all roundings accounted for."""
        return self.r * GROW + TINY

    @property
    def mag(self) -> Array:
        """Largest absolute value of a member, rounded up."""
        return (np.abs(self.c) + self.r) * GROW + TINY

    @property
    def sign(self) -> Array:
        """1 or -1 where all members are positive or negative, else 0."""
        return np.where(np.abs(self.c) > self.reach, np.sign(self.c), 0.0)

    def __getitem__(self, key: Any) -> "Ball":
        """Index or slice as an array."""
        return Ball(self.c[key], self.r[key])

    def __neg__(self) -> "Ball":
        """Exact negation."""
        return Ball(-self.c, self.r)

    def __add__(self, other: "Ball") -> "Ball":
        """Sum."""
        c = self.c + other.c
        return Ball(c, self.r + other.r + EPS * np.abs(c))

    def __sub__(self, other: "Ball") -> "Ball":
        """Difference of independent members."""
        return self + (-other)

    def __mul__(self, other: "Ball") -> "Ball":
        """Product of independent members, element by element."""
        c = self.c * other.c
        size = np.abs(other.c) + other.r
        return Ball(c, np.abs(self.c) * other.r + self.r * size + EPS * np.abs(c))

    def both(self, other: "Ball") -> "Ball":
        """Ball around what two enclosures of the same members have in common."""
        lower = np.maximum(self.c - self.reach, other.c - other.reach)
        upper = np.minimum(self.c + self.reach, other.c + other.reach)
        size = EPS * (np.abs(lower) + np.abs(upper))
        return Ball.between(lower - size, upper + size)

    def twice(self) -> "Ball":
        """Exact double."""
        return Ball(2.0 * self.c, 2.0 * self.r)


def stack(parts: Sequence[Ball], axis: int = 0) -> Ball:
    """Join balls along a new axis."""
    shape = np.broadcast_shapes(*(ball.c.shape for ball in parts))
    centres, radii = ([np.broadcast_to(getattr(ball, name), shape) for ball in parts] for name in ("c", "r"))
    return Ball(np.stack(centres, axis), np.stack(radii, axis))


def concatenate(parts: Sequence[Ball], axis: int) -> Ball:
    """Join balls along an existing axis."""
    return Ball(np.concatenate([b.c for b in parts], axis), np.concatenate([b.r for b in parts], axis))


def lead(x: Ball, ndim: int) -> Ball:
    """Vectors (3, ..., T) with axes of length one put in after the first, up to ``ndim`` axes."""
    missing = ndim - x.c.ndim
    if missing <= 0:
        return x
    shape = (x.c.shape[0],) + (1,) * missing + x.c.shape[1:]
    return Ball(x.c.reshape(shape), x.r.reshape(shape))


def cross(a: Ball, b: Ball) -> Ball:
    """Cross products of vectors (3, ..., T); axes that one lacks are put in after the first."""
    a, b = lead(a, b.c.ndim), lead(b, a.c.ndim)
    a_c, a_r, b_c = np.abs(a.c), a.r, np.abs(b.c)
    b_r = b.r + EPS * b_c
    size = b_c + b_r
    rows = ((1, 2), (2, 0), (0, 1))
    centre = np.stack([a.c[i] * b.c[j] - a.c[j] * b.c[i] for i, j in rows])
    radius = np.stack([a_c[i] * b_r[j] + a_r[i] * size[j] + a_c[j] * b_r[i] + a_r[j] * size[i] for i, j in rows])
    return Ball(centre, radius)


def dot(a: Ball, b: Ball) -> Ball:
    """Scalar products of vectors (3, ..., T), without the first axis."""
    a, b = lead(a, b.c.ndim), lead(b, a.c.ndim)
    product = a * b
    return product[0] + product[1] + product[2]


def apply(M: Array, x: Ball) -> Ball:
    """A constant matrix (3, 3), entries up to about one, times vectors (3, ..., T)."""
    slack = EPS * (np.abs(x.c) + x.r).sum(axis=0)
    return Ball(vectors.apply(M, x.c), vectors.apply(np.abs(M), x.r) + slack)


def turn_back(cos: Ball, sin: Ball, x: Ball) -> Ball:
    """Coordinates in a frame that was turned about z, for vectors (3, ..., T)."""
    first = cos * x[0] + sin * x[1]
    second = cos * x[1] - sin * x[0]
    return stack([first, second, x[2]])


def cross_z(x: Ball) -> Ball:
    """The vectors x cross z."""
    return Ball(np.stack([x.c[1], -x.c[0], np.zeros_like(x.c[0])]), np.stack([x.r[1], x.r[0], np.zeros_like(x.r[0])]))


def cos_sin(q: Ball) -> tuple[Ball, Ball]:
    """Cosine and sine of angles: the tight ranges, from those of centre and radius (no reduction of large angles).

    cos over [c - r, c + r] has its largest value at an end, unless a multiple of 2 pi lies inside; for r <= pi that is
    so where cos c >= cos r. Every end is computed to below 16 u, ``EPS`` covers it.
    """
    cos, sin, r = np.cos(q.c), np.sin(q.c), np.minimum(q.reach, np.pi)
    return _wave_range(cos, -sin, r), _wave_range(sin, cos, r)


def _wave_range(value: Array, slope: Array, r: Array) -> Ball:
    """Range over -r..r of a wave with this value and slope at 0; r = pi stands for anything wider, too."""
    middle, swing, least = value * np.cos(r), np.abs(slope * np.sin(r)), np.cos(r) - EPS
    upper = np.where(value >= least, 1.0, np.minimum(middle + swing, 1.0))
    lower = np.where(-value >= least, -1.0, np.maximum(middle - swing, -1.0))
    ball = Ball.between(lower, upper)
    return Ball(ball.c, ball.r + EPS)
