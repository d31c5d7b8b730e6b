"""Safe factors of a motion at its samples: all limits together, gaps, and what decides."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.scaling.curve_cells import all_knots
from modrob_cli.scaling.feasible import Intervals, free_factors, limit_rows
from modrob_cli.scaling.scaled_torque import TorqueRanges, bounds_at
from modrob_cli.scaling.speed_limits import Side, SpeedLimit

CHUNK = 8192
"""Samples worked on at once, so that memory does not grow with the motion."""
BEYOND = 1e-7
"""What decides is the limit that is broken most at a factor larger by this, relative."""

MakeRanges = Callable[[Array, Array, Array], TorqueRanges]


@dataclass(frozen=True)
class States:
    """Samples of a motion: times (T,), and q, dq, ddq of shape (T, n). Times need not differ: jumps have two sides."""

    t: Array
    q: Array
    dq: Array
    ddq: Array

    @classmethod
    def of(cls, trajectory: Trajectory, t: Array) -> "States":
        """Sample a motion at increasing times, and at its knots from both sides."""
        knots = all_knots(trajectory)[1:-1]
        after = np.union1d(t, knots)
        left = [np.stack([c.derivative(knots, k, before=True) for c in trajectory.curves], axis=-1) for k in range(3)]
        values = np.concatenate([trajectory.sample(after, 2), np.stack(left, axis=1)])
        times = np.concatenate([after, knots])
        order = np.argsort(times, kind="stable")
        values = values[order]
        return cls(times[order], values[:, 0], values[:, 1], values[:, 2])

    def pieces(self, size: int = CHUNK) -> Iterator["States"]:
        """In pieces of at most ``size`` samples."""
        for k in range(0, len(self.t), size):
            part = slice(k, k + size)
            yield States(self.t[part], self.q[part], self.dq[part], self.ddq[part])


@dataclass(frozen=True)
class Critical:
    """A limit and where the motion comes closest to it, or breaks it most.

    Attributes
    ----------
    joint : number from 0;  quantity : torque, velocity, acceleration or jerk;  side : of its range
    time : of the unscaled motion, [s]
    limit, value : of the quantity, at the factor in question
    """

    joint: int
    quantity: str
    side: Side
    time: float
    limit: float
    value: float

    @property
    def excess(self) -> float:
        """How far the value is beyond the limit; negative within."""
        return (self.value - self.limit) if self.side == "upper" else (self.limit - self.value)


@dataclass(frozen=True)
class SampledFactors:
    """Result at the samples.

    Attributes
    ----------
    free : safe factors within the given range, in order; their last end is the answer
    critical : what forbids more; None if the largest factor that was asked for is safe
    """

    free: Intervals
    critical: Critical | None

    @property
    def factor(self) -> float | None:
        """The largest safe factor."""
        return self.free[-1][1] if self.free else None


def sampled_factors(
    make: MakeRanges,
    states: States,
    limits: tuple[Array, Array],
    speeds: list[SpeedLimit],
    span: tuple[float, float],
) -> SampledFactors:
    """Find all factors of a range that are safe at the samples.

    Parameters
    ----------
    make : torque ranges from q, dq, ddq (T, n)
    limits : of the torque, lower and upper, shape (n,) each, infinite where there is none
    speeds : limits that the motion's own extremes set, see ``speed_limits.speed_limits``
    span : smallest and largest factor
    """
    low, high = span
    slowest = min(speeds, key=lambda limit: limit.factor, default=None)
    top = high if slowest is None else min(high, slowest.factor)
    if top <= low:
        return SampledFactors([], None if slowest is None else _speed_critical(slowest, low))
    free: Intervals = [(low, top)]
    for piece in states.pieces():
        torques = make(piece.q, piece.dq, piece.ddq)
        rows = limit_rows(torques, *limits)
        if len(rows.side) and free:
            free = common(free, free_factors(torques, rows, low, free[-1][1]))
    if not free:
        return SampledFactors([], worst_torque(make, states, limits, low))
    found = free[-1][1]
    if found >= top:
        critical = None if slowest is None or slowest.factor > high else _speed_critical(slowest, found)
    else:
        critical = worst_torque(make, states, limits, found * (1.0 + BEYOND))
    return SampledFactors(free, critical)


def _speed_critical(limit: SpeedLimit, c: float) -> Critical:
    order = ("velocity", "acceleration", "jerk").index(limit.quantity) + 1
    return Critical(limit.joint, limit.quantity, limit.side, limit.time, limit.limit, limit.value * c**order)


def worst_torque(make: MakeRanges, states: States, limits: tuple[Array, Array], c: float) -> Critical | None:
    """Torque limit that is broken most at a factor, or comes closest to it, relative to the joint's larger limit."""
    ends = np.stack([limits[1], -limits[0]])
    scale = np.maximum(np.abs(np.where(np.isfinite(ends), ends, 0.0)).max(axis=0), np.finfo(float).tiny)
    best: tuple[float, Critical] | None = None
    for piece in states.pieces():
        values = bounds_at(make(piece.q, piece.dq, piece.ddq), c)
        excess = (values - ends[..., None]) / scale[:, None]
        side, joint, sample = np.unravel_index(int(excess.argmax()), excess.shape)
        if not np.isfinite(excess[side, joint, sample]) or (best and excess[side, joint, sample] <= best[0]):
            continue
        sign = (1.0, -1.0)[int(side)]
        name: Side = ("upper", "lower")[int(side)]
        value, limit = sign * float(values[side, joint, sample]), sign * float(ends[side, joint])
        found = Critical(int(joint), "torque", name, float(piece.t[sample]), limit, value)
        best = (float(excess[side, joint, sample]), found)
    return best[1] if best else None


def common(first: Intervals, second: Intervals) -> Intervals:
    """Parts that two unions of intervals have in common, in order; single points do not count."""
    parts = [(max(a, x), min(b, y)) for a, b in first for x, y in second]
    return sorted((a, b) for a, b in parts if a < b)


def gaps(free: Intervals, low: float) -> Intervals:
    """What lies between ``low``, the intervals, and their last end."""
    edges = [low, *(edge for part in free for edge in part)]
    return [(a, b) for a, b in zip(edges[:-1:2], edges[1::2], strict=False) if a < b]
