"""A factor that is safe at every time of a motion, proven cell by cell.

Cells of time are divided until the bounds over each (:mod:`modrob_cli.scaling.cell_torques`) keep all limits at a
target a little below the factor found at samples. Then all factors that these cells prove are found, which raises the
answer to what they really prove. The bounds at the answer are computed once more and compared with the limits directly:
that comparison is the proof, the search before it need not be trusted.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.scaling.cell_torques import CellTorques
from modrob_cli.scaling.curve_cells import Cells, all_knots
from modrob_cli.scaling.feasible import Intervals, Rows, free_factors, limit_rows
from modrob_cli.scaling.sampled import common
from modrob_cli.scaling.speed_limits import enclosed_factor

FIRST_CELLS = 96
MOST_CELLS = 200_000
"""More would not fit into a certificate that anybody keeps."""
CHUNK = 1024
"""Cells worked on at once."""
_AIM = 0.8
"""Part of the allowed gap that the target uses up; the rest is for what cannot be foreseen."""
_SHORTEST, _SHORT = 1e-7, 1e-5
"""A cell that is this small a part of the motion and fails is broken, not badly enclosed; the second, if it fails
without what is of second order, too. It is not divided further, and the answer falls to what it proves."""
_MOST_PARTS = 8
_SLACK = 1.0 - 1e-9
"""The answer stays this much below what the cells prove: machines that round otherwise must find it true, too."""


@dataclass(frozen=True)
class Proof:
    """What was proven.

    Attributes
    ----------
    cells : from 0 to the duration, one after the other
    factor : the largest proven factor; None if there is none
    free : all proven factors of the range that was asked for
    lower, upper : bounds of the torque over each cell at ``factor``, shape (n, K), [N m] or [N]
    speed : largest |velocity|, |acceleration| and |jerk| of the unscaled motion, as its range: shape (2, 3, n)
    tried : cells that were looked at, those that were divided included
    """

    cells: Cells
    factor: float | None
    free: Intervals
    lower: Array
    upper: Array
    speed: Array
    tried: int


@dataclass(frozen=True)
class _Group:
    """Some of the cells of one evaluation that are not divided further."""

    torques: CellTorques
    kept: Indices

    def rows(self, limits: tuple[Array, Array]) -> Rows:
        """Limits at both ends of the kept cells."""
        wanted = np.zeros(self.torques.samples, dtype=bool)
        wanted[self.kept] = wanted[self.kept + self.torques.cells.count] = True
        rows = limit_rows(self.torques, *limits)
        return rows.picked(np.flatnonzero(wanted[rows.sample]))


def certify(
    robot: Robot,
    trajectory: Trajectory,
    limits: tuple[Array, Array],
    span: tuple[float, float],
    gap: float,
    progress: Callable[[float], None] = lambda _: None,
) -> Proof:
    """Prove a factor for all times of a motion and all admissible parameters.

    Parameters
    ----------
    limits : of the torque, shape (n,) each
    span : smallest factor of interest, and the largest that is safe at samples
    gap : how far below the latter the result may be, relative
    progress : told the part of the motion that is proven at the target

    Returns
    -------
    Proof
        Its factor is at least (1 - gap) span[1], unless the motion between samples allows less.
    """
    low, high = span
    target = high * (1.0 - _AIM * gap)
    groups: list[_Group] = []
    waiting, tried, proven = first_cells(trajectory), 0, 0.0
    while waiting.count:
        divided = []
        for cells in chunks(waiting):
            tried += cells.count
            torques = CellTorques(robot, trajectory, cells)
            parts, broken = _parts(robot, torques, limits, target)
            shortest = np.where(broken, _SHORT, _SHORTEST) * trajectory.duration
            kept = np.flatnonzero((parts == 1) | (cells.end - cells.start <= shortest) | (tried > MOST_CELLS))
            groups.append(_Group(torques, kept))
            proven += float((cells.end - cells.start)[kept].sum())
            progress(min(proven / trajectory.duration, 1.0))
            open_ = np.setdiff1d(np.arange(cells.count), kept)
            divided.append(_divided(cells, parts, open_))
        waiting = Cells(*(np.concatenate([getattr(part, key) for part in divided]) for key in ("start", "end")))
    return _concluded(robot, groups, limits, (low, high), tried)


def first_cells(trajectory: Trajectory) -> Cells:
    """Cells of equal length, divided where pieces of the motion end."""
    edges = np.union1d(all_knots(trajectory), np.linspace(0.0, trajectory.duration, FIRST_CELLS + 1))
    return Cells(edges[:-1], edges[1:])


def chunks(cells: Cells) -> Iterator[Cells]:
    """In pieces of at most ``CHUNK`` cells."""
    for k in range(0, cells.count, CHUNK):
        yield Cells(cells.start[k : k + CHUNK], cells.end[k : k + CHUNK])


def _parts(
    robot: Robot, torques: CellTorques, limits: tuple[Array, Array], target: float
) -> tuple[Indices, NDArray[np.bool_]]:
    """Into how many parts each cell should be divided; 1 where it keeps all limits at the target; and which break one.

    What the second-order rest adds falls with the square of the length: it has to become as small as what is left
    without it.
    """
    lower, upper = torques.bounds(target)
    excess = np.stack([upper - limits[1][:, None], limits[0][:, None] - lower])
    rest = torques.rest[0] + target**2 * torques.rest[1]
    room = np.maximum(rest[:, : torques.cells.count], rest[:, torques.cells.count :]) - excess
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = np.ceil(np.sqrt((room + excess) / room) * (1.0 + 1e-6))
    wanted = np.where((room > 0.0) & np.isfinite(wanted), wanted, 2.0)
    wanted = np.where(excess > 0.0, np.clip(wanted, 2, _MOST_PARTS), 1.0).max(axis=(0, 1))
    speeds = speed_ends(torques)
    fast = enclosed_factor(robot, *speeds)[1] < target
    parts = np.asarray(np.where(fast, np.maximum(wanted, 2.0), wanted), dtype=np.intp)
    return parts, np.asarray((room < 0.0).any(axis=(0, 1)))


def speed_ends(torques: CellTorques) -> tuple[Array, Array]:
    """Lower and upper ends of velocity, acceleration and jerk of the unscaled motion over cells, shape (3, n, K)."""
    whole = torques.states.whole[1:]
    return whole.c - whole.reach, whole.c + whole.reach


def _divided(cells: Cells, parts: Indices, which: Indices) -> Cells:
    """Cells in equal parts."""
    starts, ends = [np.empty(0)], [np.empty(0)]
    for k in which:
        edges = np.linspace(cells.start[k], cells.end[k], int(parts[k]) + 1)
        starts.append(edges[:-1])
        ends.append(edges[1:])
    return Cells(np.concatenate(starts), np.concatenate(ends))


def _concluded(
    robot: Robot, groups: list[_Group], limits: tuple[Array, Array], span: tuple[float, float], tried: int
) -> Proof:
    """Find all factors that the final cells prove, and the bounds at the largest."""
    low, high = span
    speeds = [tuple(end[..., group.kept] for end in speed_ends(group.torques)) for group in groups]
    slowest, most = np.concatenate([pair[0] for pair in speeds], -1), np.concatenate([pair[1] for pair in speeds], -1)
    top = min(high, enclosed_factor(robot, slowest, most)[0])
    free: Intervals = [(low, top)] if top > low else []
    for group in groups:
        rows = group.rows(limits)
        if free and len(rows.side):
            free = common(free, free_factors(group.torques, rows, low, free[-1][1]))
    start, end = (np.concatenate([getattr(g.torques.cells, key)[g.kept] for g in groups]) for key in ("start", "end"))
    order = np.argsort(start, kind="stable")
    cells = Cells(start[order], end[order])
    speed = np.stack([slowest.min(axis=-1), most.max(axis=-1)])
    factor = free[-1][1] * _SLACK if free else None
    while factor is not None and factor > free[-1][0]:
        pairs = [[part[:, group.kept] for part in group.torques.bounds(factor)] for group in groups]
        lower, upper = (np.concatenate([pair[k] for pair in pairs], axis=1)[:, order] for k in range(2))
        if kept(lower, upper, limits):
            return Proof(cells, factor, [*free[:-1], (free[-1][0], factor)], lower, upper, speed, tried)
        factor *= _SLACK
    none = np.full((robot.dof, cells.count), np.nan)
    return Proof(cells, None, [], none, none, speed, tried)


def kept(lower: Array, upper: Array, limits: tuple[Array, Array]) -> bool:
    """True if all bounds (n, K) are within the limits."""
    return bool((lower >= limits[0][:, None]).all() and (upper <= limits[1][:, None]).all())
