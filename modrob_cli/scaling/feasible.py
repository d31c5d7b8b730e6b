"""Factors for which no admissible parameter lets a torque exceed its limits, at given samples of a motion.

Between two factors a and b, the convex function R of :mod:`modrob_cli.scaling.scaled_torque` lies below its chord and
above the prolongations of the chords beside it. Both are linear in c^2, so both turn each limit into a quadratic in c,
whose positive parts are known in closed form: those of the chord hold all factors that are forbidden, those of the
prolongations only such. Where the two leave a difference that matters, the interval is halved, for those limits that
are not kept all over it.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.scaling.forbidden import positive_parts, uncovered
from modrob_cli.scaling.scaled_torque import TorqueRanges

TOLERANCE = 1e-9
"""Factors are found to this accuracy, relative; always on the safe side."""

LIMIT_ROUNDING = 2.0**-46
"""Limits are taken this much tighter: computed roots are those of quadratics whose coefficients are off by a few u,
and the rounding margins of the torques cover all coefficients but the limit itself."""
_FIRST_KNOTS = 9
Intervals = list[tuple[float, float]]


@dataclass(frozen=True)
class Rows:
    """Limits at samples, K of them, as polynomials: R(c^2) + alpha c^2 + beta c + gamma <= 0.

    Attributes
    ----------
    side, joint, sample : which they are, shape (K,)
    alpha, beta : shape (K,)
    gamma, gamma_moving, slow : constant up to c = slow, and beyond it, shape (K,)
    """

    side: Indices
    joint: Indices
    sample: Indices
    alpha: Array
    beta: Array
    gamma: Array
    gamma_moving: Array
    slow: Array

    def picked(self, which: Indices) -> "Rows":
        """Some of the rows."""
        return Rows(*(getattr(self, key)[which] for key in self.__dataclass_fields__))


@dataclass(frozen=True)
class _Piece:
    """Rows over factors a to b: R at the ends, slopes of R in c^2 just before a and after b (NaN: unknown)."""

    a: float
    b: float
    rows: Rows
    at_a: Array
    at_b: Array
    before: Array
    after: Array

    @property
    def slope(self) -> Array:
        """Slope of the chord in c^2."""
        return (self.at_b - self.at_a) / (self.b**2 - self.a**2)

    def forbidden(self, slope: Array, through: Array, u: float) -> tuple[Array, Array, Indices]:
        """Parts where the limits are broken by lines in c^2 with these slopes through R = ``through`` at c^2 = u."""
        A, C = self.rows.alpha + slope, through - slope * u
        # Most limits are kept all over the piece: with the larger constant, at both ends and at the vertex between.
        gamma = np.maximum(self.rows.gamma, self.rows.gamma_moving)
        near = np.flatnonzero(_largest(A, self.rows.beta, C + gamma, self.a, self.b) > 0.0)
        rows, A, C = self.rows.picked(near), A[near], C[near]
        edge = np.clip(rows.slow, self.a, self.b)
        low, high = np.full_like(edge, self.a), np.full_like(edge, self.b)
        parts = [
            positive_parts(A, rows.beta, C + rows.gamma, low, edge),
            positive_parts(A, rows.beta, C + rows.gamma_moving, edge, high),
        ]
        start, end, owner = (np.concatenate(group) for group in zip(*parts, strict=True))
        return start, end, near[owner]


def _largest(A: Array, B: Array, C: Array, a: float, b: float) -> Array:
    """Largest value of A c^2 + B c + C over [a, b], shape (K,)."""
    ends = np.maximum((A * a + B) * a, (A * b + B) * b)
    with np.errstate(all="ignore"):
        vertex = -0.5 * B / A
        inside = (A < 0.0) & (vertex > a) & (vertex < b)
        return np.where(inside, np.maximum(ends, 0.5 * B * vertex), ends) + C


def limit_rows(torques: TorqueRanges, low: Array, high: Array) -> Rows:
    """All limits of torque that are known; ``low`` and ``high`` of shape (n,), infinite where there is none."""
    polynomial = torques.polynomial
    ends = np.stack([high, -low])
    side, joint, sample = np.nonzero(np.broadcast_to(np.isfinite(ends)[:, :, None], polynomial.alpha.shape))
    limit = ends[side, joint]
    parts = [getattr(polynomial, key)[side, joint, sample] for key in ("alpha", "beta", "gamma", "gamma_moving")]
    slow = polynomial.slow[joint, sample]
    limit = limit - LIMIT_ROUNDING * np.abs(limit)
    return Rows(side, joint, sample, parts[0], parts[1], parts[2] - limit, parts[3] - limit, slow)


def free_factors(torques: TorqueRanges, rows: Rows, low: float, high: float) -> Intervals:
    """Factors of [low, high] that keep all limits, as intervals in order.

    Every factor in them is safe; what is left out is unsafe, or nearer to it than :data:`TOLERANCE`.
    """
    knots = np.linspace(low, high, _FIRST_KNOTS)
    values = [_rigid(torques, rows, c) for c in knots]
    slopes = [np.diff(pair, axis=0)[0] / np.diff(ends**2)[0] for pair, ends in _neighbours(values, knots)]
    unknown = np.full(len(rows.side), np.nan)
    around = [unknown, *slopes, unknown]
    found: Intervals = []
    for k in range(len(knots) - 1):
        piece = _Piece(knots[k], knots[k + 1], rows, values[k], values[k + 1], around[k], around[k + 2])
        found += _free_in(torques, piece)
    return joined_up(found)


def _neighbours(values: list[Array], knots: Array) -> list[tuple[Array, Array]]:
    return [(np.stack(values[k : k + 2]), knots[k : k + 2]) for k in range(len(knots) - 1)]


def _rigid(torques: TorqueRanges, rows: Rows, c: float) -> Array:
    """R of each row at a factor, shape (K,)."""
    which, place = np.unique(rows.sample, return_inverse=True)
    values = torques.rigid(c * c, None if len(which) == torques.samples else which)
    return np.asarray(values[rows.side, rows.joint, place])


def _free_in(torques: TorqueRanges, first: _Piece) -> Intervals:
    """Free factors of one piece; pieces with a difference that matters are halved."""
    found, stack = [], [first]
    while stack:
        piece = stack.pop()
        start, end, owner = piece.forbidden(piece.slope, piece.at_a, piece.a**2)
        safe = uncovered(start, end, piece.a, piece.b)
        open_ = _difference(_possible(piece), safe)
        if not open_ or piece.b - piece.a <= TOLERANCE * piece.b:
            found += safe
            continue
        # The longest open part matters most; its middle, but not too near to an end of the piece.
        longest = max(open_, key=lambda part: part[1] - part[0])
        margin = 0.05 * (piece.b - piece.a)
        middle = float(np.clip(0.5 * (longest[0] + longest[1]), piece.a + margin, piece.b - margin))
        stack += _halves(torques, piece, np.unique(owner), middle)
    return found


def _halves(torques: TorqueRanges, piece: _Piece, which: Indices, middle: float) -> list[_Piece]:
    """Both parts of a piece, with only those rows that are not kept all over it."""
    rows = piece.rows.picked(which)
    at_a, at_b, before, after = (part[which] for part in (piece.at_a, piece.at_b, piece.before, piece.after))
    at = _rigid(torques, rows, middle)
    left = (at - at_a) / (middle**2 - piece.a**2)
    right = (at_b - at) / (piece.b**2 - middle**2)
    return [
        _Piece(middle, piece.b, rows, at, at_b, left, after),
        _Piece(piece.a, middle, rows, at_a, at, before, right),
    ]


def _possible(piece: _Piece) -> Intervals:
    """Factors that the prolonged neighbouring chords do not forbid."""
    starts, ends = [np.empty(0)], [np.empty(0)]
    for slope, through, u in ((piece.before, piece.at_a, piece.a**2), (piece.after, piece.at_b, piece.b**2)):
        known = ~np.isnan(slope)
        if known.all():
            start, end, _ = piece.forbidden(slope, through, u)
            starts.append(start)
            ends.append(end)
    return uncovered(np.concatenate(starts), np.concatenate(ends), piece.a, piece.b)


def _difference(possible: Intervals, safe: Intervals) -> Intervals:
    """Parts that are possible but not safe and longer than the tolerance."""
    parts: Intervals = []
    for a, b in possible:
        inside = [(max(a, x), min(b, y)) for x, y in safe if max(a, x) < min(b, y)]
        edges = [a, *(edge for part in inside for edge in part), b]
        parts += zip(edges[::2], edges[1::2], strict=True)
    return [(a, b) for a, b in parts if b - a > TOLERANCE * b]


def joined_up(parts: Intervals) -> Intervals:
    """Intervals in order, those that touch made one."""
    out: Intervals = []
    for a, b in sorted(parts):
        if out and a <= out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], b))
        else:
            out.append((a, b))
    return out
