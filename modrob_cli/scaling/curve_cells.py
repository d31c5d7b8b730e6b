r"""Enclosures of a planned motion over cells of time.

Over t_m -+ r the k-th derivative is within the Taylor sum about t_m,

.. math:: |x^{(k)}(t) - x^{(k)}(t_m)| \le \sum_{j=1}^{K-k} |x^{(k+j)}(t_m)| \frac{r^j}{j!}
          + \sup |x^{(K+1)}| \frac{r^{K+1-k}}{(K+1-k)!},

where the last term is zero for polynomials up to order K. A cell lies within one piece of every joint's curve.

Rounding: a value computed in round-to-nearest is off by at most ``ROUNDINGS`` u times the sum of the absolute values
of its terms, u = 2^-53: a polynomial of order p passes through 2 p roundings in Horner's rule, 3 p in the powers of s
(which is off by 3 u, relative), and fewer than 25 in coefficients and powers of the piece's length, in all below 100
for p <= 15. A cosine of 2 pi s is off by 2 pi 3 u + 4 u. A sine of w t + phi is off by 2 u (|w t| + |phi|) + 4 u, so
its term counts 1 + |w t| + |phi| times; sums of N terms add N u. Radii are sums of products of non-negative numbers
with fewer than 100 roundings; :data:`~modrob_cli.dynamics.ball.GROW` covers them.
"""

import math
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import GROW, TINY, Ball, stack
from modrob_cli.dynamics.margin import UNIT
from modrob_cli.errors import ShapeError
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve, PiecewiseCurve, SineCurve

ROUNDINGS = 128.0
_HIGHEST = 7
_MOST_COEFFICIENTS = 16
STATES = 4
"""Position, velocity, acceleration and jerk are enclosed."""


@dataclass(frozen=True)
class Cells:
    """Cells of time, one after the other.

    Attributes
    ----------
    start, end : shape (K,), [s]
    """

    start: Array
    end: Array

    @property
    def middle(self) -> Array:
        """A double within each cell, shape (K,)."""
        return 0.5 * self.start + 0.5 * self.end

    @property
    def radius(self) -> Array:
        """Largest distance from ``middle``, rounded up, shape (K,)."""
        middle = self.middle
        return np.maximum(self.end - middle, middle - self.start) * GROW

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.start)


@dataclass(frozen=True)
class CellStates:
    """Enclosures of the motion, balls of shape (4, n, K): q, dq, ddq and dddq of each joint.

    Attributes
    ----------
    middle : at the middle of each cell (a ball because of rounding)
    whole : over all of each cell
    radius : of the cells, shape (K,), [s]
    """

    middle: Ball
    whole: Ball
    radius: Array


def all_knots(trajectory: Trajectory) -> Array:
    """Times at which a piece of any joint's curve ends, in order, from 0 to the duration."""
    return np.unique(np.concatenate([curve.knots for curve in trajectory.curves]))


def cell_states(trajectory: Trajectory, cells: Cells) -> CellStates:
    """Enclose the motion over cells; each must lie between two neighbouring knots of all joints.

    Raises
    ------
    ShapeError
        If a curve is of a kind whose derivatives have no bound here.
    """
    pairs = [_enclosed(curve, cells) for curve in trajectory.curves]
    middle, whole = (stack([pair[side] for pair in pairs], axis=1) for side in (0, 1))
    return CellStates(middle, whole, cells.radius)


def _enclosed(curve: Curve, cells: Cells) -> tuple[Ball, Ball]:
    """Middle and whole enclosure of the first ``STATES`` derivatives of one curve, shape (4, K) each."""
    t, r = cells.middle, cells.radius
    highest = max(_HIGHEST, _order(curve))
    centre = np.stack([curve.derivative(t, k) for k in range(highest + 1)])
    size = np.stack([_magnitude(curve, t, k) for k in range(highest + 2)])
    error = _roundings(curve) * UNIT * size[:-1] + TINY
    reach = np.abs(centre) + error
    spread = np.zeros((STATES, len(t)))
    for k in range(STATES):
        for j in range(1, highest - k + 1):
            spread[k] += reach[k + j] * r**j / math.factorial(j)
        if not _is_polynomial(curve):
            left = highest + 1 - k
            spread[k] += size[-1] * r**left / math.factorial(left)
    known, error = centre[:STATES], error[:STATES]
    return Ball(known, error), Ball(known, (error + spread) * GROW)


def _is_polynomial(curve: Curve) -> bool:
    return isinstance(curve, PiecewiseCurve) and not curve.ripple.any()


def _order(curve: Curve) -> int:
    return curve.coefficients.shape[1] - 1 if isinstance(curve, PiecewiseCurve) else 0


def _roundings(curve: Curve) -> float:
    return ROUNDINGS + (len(curve.amplitude) if isinstance(curve, SineCurve) else 0)


def _magnitude(curve: Curve, t: Array, order: int) -> Array:
    """Sum of the absolute values of a derivative's terms, anywhere in the piece for waves, shape (K,)."""
    if isinstance(curve, SineCurve):
        size = np.abs(curve.amplitude) * np.abs(curve.frequency) ** order
        turn = 1.0 + np.abs(t[:, None] * curve.frequency) + np.abs(curve.phase)
        total = (size * turn).sum(axis=1)
        return np.asarray(total + abs(curve.offset) if order == 0 else total)
    if not isinstance(curve, PiecewiseCurve) or curve.coefficients.shape[1] > _MOST_COEFFICIENTS:
        raise ShapeError(f"no enclosure is known for a curve of type {type(curve).__name__}")
    piece = np.clip(np.searchsorted(curve.knots, t, "right") - 1, 0, len(curve.knots) - 2)
    length = np.diff(curve.knots)[piece]
    s = (t - curve.knots[piece]) / length
    out = np.zeros_like(s)
    for k in range(curve.coefficients.shape[1] - 1, order - 1, -1):
        out = out * s + math.perm(k, order) * np.abs(curve.coefficients[piece, k])
    wave = 2.0 if order == 0 else 1.0
    return np.asarray((out + wave * (2.0 * math.pi) ** order * np.abs(curve.ripple[piece])) / length**order)
