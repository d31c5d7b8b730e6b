"""Tight range of a link's central inertia tensor over its bodies' boxes, by branch and bound.

For each of the six entries and both ends: boxes are shrunk to an end point of a variable where the gradient keeps its
sign, bounded by the mean-value form, dropped where they cannot reach the best value found (up to ``TOLERANCE``), and
divided otherwise: into the two end points of a variable along which the function is convex (its maximum is there), or
into two halves. Where the function is concave in all free variables at once, one climb and its tangent settle the box.

The result always encloses the exact range; it exceeds it by at most ``TOLERANCE`` times the magnitude of the terms, or,
where ``MAX_BOXES`` boxes did not suffice (many free directions at an interior optimum), by the gap that is left then.

Rounding: values and bounds are computed in round-to-nearest. A value is a sum over bodies of products of at most
three rounded factors; with u = 2^-53 it is off by less than 30 u S, where S (``inertia_magnitude``) is at least four
times the sum of the absolute values of all terms. Transforms that are off by 120 u in their entries change it by less
than 2 * 120 u S / 4. ``ROUNDING`` S = 180 u S covers both and is added on each side.
"""

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.assembly.link_box import LinkBox
from modrob_cli.assembly.rounding import ROUNDING, inertia_magnitude
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, tensor

TOLERANCE = 1e-9
MAX_BOXES = 8192
_LONGEST = 200
_CLIMB = 60


def inertia_range(bodies: list[PlacedBody]) -> Interval:
    """Range of the entries xx, xy, xz, yy, yz, zz about the link's centre of mass, shape (6,).

    Parameters
    ----------
    bodies : bodies of one link, posed in the frame of the result
    """
    own = _own_tensors(bodies)
    link = LinkBox.of(bodies)
    low, high = _box(bodies)
    scale = inertia_magnitude(bodies)
    if np.array_equal(low, high):
        spread = Interval(link.value(np.repeat(low[None], 6, axis=0), np.arange(6)))
    else:
        spread = _branch_and_bound(link, low, high, TOLERANCE * scale)
    return (own + spread).widen(ROUNDING * scale)


def _own_tensors(bodies: list[PlacedBody]) -> Interval:
    """Sum of the bodies' own tensors turned into the link's frame: linear, so the sum of the ranges is the range."""
    rows, columns = np.triu_indices(3)
    total = Interval(np.zeros(6))
    for placed in bodies:
        R = placed.pose[:3, :3]
        inertia = placed.body.inertia.interval
        basis = tensor(np.eye(6))
        weights = (R @ basis @ R.T)[:, rows, columns].T
        total = total + (inertia[None, :] * weights).sum()
    return total


def _box(bodies: list[PlacedBody]) -> tuple[Array, Array]:
    """Ends of the box of (masses, centres of mass), shape (4 B,) each."""
    mass = [placed.body.mass.interval for placed in bodies]
    com = [placed.body.com.interval for placed in bodies]
    low = np.concatenate([[item.inf for item in mass], *(item.inf for item in com)])
    high = np.concatenate([[item.sup for item in mass], *(item.sup for item in com)])
    return low, high


def _branch_and_bound(link: LinkBox, low: Array, high: Array, tolerance: float) -> Interval:
    """Largest and smallest value for all six entries at once; problem p is entry p % 6, the largest for p < 6."""
    problem = np.arange(12)
    curvature = link.curvature()
    to_ends = np.concatenate([(curvature >= 0.0) & (curvature < 2.0), curvature <= 0.0])
    low, high = np.repeat(low[None], 12, axis=0), np.repeat(high[None], 12, axis=0)
    best, ceiling = np.full(12, -np.inf), np.full(12, -np.inf)
    for _ in range(_LONGEST):
        entry, sign = problem % 6, np.where(problem < 6, 1.0, -1.0)
        slope = _fix_monotone(link, low, high, entry, sign)
        middle = np.clip(0.5 * (low + high), low, high)
        value = sign * link.value(middle, entry)
        reach = slope * (0.5 * (high - low))
        bound = value + reach.sum(axis=1)
        concave = link.is_concave(low, high, entry, sign) & (low < high).any(axis=1)
        if concave.any():
            box = low[concave], high[concave], entry[concave], sign[concave]
            value[concave], tangent = _climb(link, *box)
            bound[concave] = np.minimum(bound[concave], tangent)
        np.maximum.at(best, problem, value)
        keep = bound > best[problem] + tolerance
        np.maximum.at(ceiling, problem[~keep], bound[~keep])
        if not keep.any() or 2 * keep.sum() > MAX_BOXES:
            np.maximum.at(ceiling, problem, bound)
            break
        low, high, problem = low[keep], high[keep], problem[keep]
        low, high = _divide(low, high, reach[keep], to_ends[problem])
        problem = np.concatenate([problem, problem])
    else:
        np.maximum.at(ceiling, problem, bound)
    top = np.maximum(best, ceiling)
    return Interval(np.minimum(-top[6:], top[:6]), top[:6])


def _fix_monotone(link: LinkBox, low: Array, high: Array, entry: Indices, sign: Array) -> Array:
    """Move variables with a gradient of one sign to their better end, in place; returns the largest |gradient|."""
    slope = np.zeros_like(low)
    for _ in range(2):
        ends = link.gradient(low, high, entry)
        rising = np.where(sign[:, None] > 0.0, ends[0], -ends[1]) >= 0.0
        falling = np.where(sign[:, None] > 0.0, ends[1], -ends[0]) <= 0.0
        slope = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
        np.copyto(low, high, where=rising)
        np.copyto(high, low, where=falling & ~rising)
    return slope


def _climb(link: LinkBox, low: Array, high: Array, entry: Indices, sign: Array) -> tuple[Array, Array]:
    """Value near the largest sign f in boxes where it is concave, and an upper bound from the tangent there.

    Accelerated projected gradient; the curvature is at most twice the largest mass. Wherever it stops, a concave
    function lies below its tangent, so the bound holds.
    """
    mass = high[:, : len(link.t)]
    step = 1.0 / (2.0 * np.maximum(mass.max(axis=1, keepdims=True), np.finfo(float).tiny))
    x = y = np.clip(0.5 * (low + high), low, high)
    for k in range(_CLIMB):
        slope = sign[:, None] * link.gradient(y, y, entry)[0]
        moved = np.clip(y + step * slope, low, high)
        x, y = moved, np.clip(moved + k / (k + 3.0) * (moved - x), low, high)
    value = sign * link.value(x, entry)
    slope = sign[:, None] * link.gradient(x, x, entry)[0]
    return value, value + np.maximum(slope * (low - x), slope * (high - x)).sum(axis=1)


def _divide(low: Array, high: Array, reach: Array, to_ends: Array) -> tuple[Array, Array]:
    """Divide each box in two across the variable that its bound owes most to."""
    rows = np.arange(len(low))
    axis = reach.argmax(axis=1)
    ends = to_ends[rows, axis]
    cut = 0.5 * (low[rows, axis] + high[rows, axis])
    left_high, right_low = high.copy(), low.copy()
    left_high[rows, axis] = np.where(ends, low[rows, axis], cut)
    right_low[rows, axis] = np.where(ends, high[rows, axis], cut)
    return np.concatenate([low, right_low]), np.concatenate([left_high, high])
