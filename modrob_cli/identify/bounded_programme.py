r"""Linear programmes over the intervals of one joint, with as many constraints as samples.

A sample matters only if it decides the answer, and few do. So a small programme is solved over some of the samples,
all samples are compared with its answer, the worst of those that are violated join in, and so on until none is left
(constraint generation). The answer is that of the programme over all samples, because it is the best for a part of the
constraints and satisfies the others.
"""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import NumericalError
from modrob_cli.identify.bounded_samples import DISTURBANCE, ENDS, JointSamples

TOLERANCE = 1e-9
"""A constraint counts as satisfied if it is missed by less than this share of the largest torque."""

FARTHEST = 1e4
"""No interval goes beyond this many times what would explain the largest torque by itself: not determined, then."""

BLOCKS = 32
MOST_ROUNDS = 500


@dataclass(frozen=True)
class Form:
    """Which ends are free: ends = matrix @ z + fixed, with ``lower`` <= z and ``order`` @ z <= ``room``.

    Attributes
    ----------
    matrix : shape (8, m);  fixed : shape (8,)
    lower : least values of z, shape (m,), -inf where free
    order, room : rows that keep lower ends below upper ones, shapes (r, m) and (r,)
    """

    matrix: Array
    fixed: Array
    lower: Array
    order: Array
    room: Array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.matrix.shape[1])


@dataclass(frozen=True)
class Active:
    """A sample that holds one edge of the band in place.

    Attributes
    ----------
    index : of the sample;  side : "upper" or "lower"
    multiplier : how much the cost would fall per unit of torque that this sample were closer
    """

    index: int
    side: str
    multiplier: float


@dataclass(frozen=True)
class Answer:
    """Best unknowns, the ends (8,) they make, the cost, and the samples that decide, most important first."""

    z: Array
    ends: Array
    cost: float
    active: tuple[Active, ...]


class Programme:
    """Programmes over the samples of one joint; constraints found for one are kept for the next.

    Parameters
    ----------
    scale : size of the torques that matter, if larger than that of the samples
    """

    def __init__(self, samples: JointSamples, scale: float = 0.0) -> None:
        self.samples = samples
        self._least_upper, self._most_lower = samples.least_upper(), samples.most_lower()
        self._scale = max(samples.scale, scale)
        self._unit = self._scale / samples.reach()
        self._working: dict[str, Indices] = {side: np.empty(0, dtype=np.intp) for side in ("lower", "upper")}
        self._left_out = np.zeros(len(samples), dtype=bool)

    def leave_out(self, at: Indices) -> None:
        """Stop counting these samples."""
        self._left_out[at] = True
        self._working = {side: kept[~self._left_out[kept]] for side, kept in self._working.items()}

    def solve(self, form: Form, cost: Array) -> Answer | None:
        """Least cost @ z such that every sample that counts lies inside the band; None if there is no such z.

        Parameters
        ----------
        cost : shape (m,)

        Raises
        ------
        NumericalError
            If the solver fails.
        """
        unit = np.max(np.abs(form.matrix) * self._unit[:, None], axis=0)
        for _ in range(MOST_ROUNDS):
            found = self._solve_working(form, cost, unit)
            if found is None:
                return None
            if not self._add_violated(found.ends):
                return found
        raise NumericalError("the search for the smallest intervals does not end; the torques may be absurd")

    def _add_violated(self, ends: Array) -> bool:
        """Let the worst violated samples of each stretch of time join in; False if none is violated."""
        lower, upper = self.samples.edges(ends)
        allowed = TOLERANCE * self._scale
        added = False
        for side, excess in (("upper", self._least_upper - upper), ("lower", lower - self._most_lower)):
            excess[self._left_out] = -np.inf
            worst = _worst_of_blocks(excess)
            new = np.setdiff1d(worst[excess[worst] > allowed], self._working[side])
            added |= bool(len(new))
            self._working[side] = np.concatenate([self._working[side], new])
        return added

    def _solve_working(self, form: Form, cost: Array, unit: Array) -> Answer | None:
        """Solve over the samples that have joined in, in units in which all numbers are of order one."""
        from scipy.optimize import linprog

        low, high = self._working["lower"], self._working["upper"]
        rows_low, rows_high = self.samples.rows(low)[0], self.samples.rows(high)[1]
        # lower edge <= tau - low;  -upper edge <= -(tau - high);  order
        A = np.concatenate([rows_low @ form.matrix, -rows_high @ form.matrix])
        b = np.concatenate(
            [self._most_lower[low] - rows_low @ form.fixed, rows_high @ form.fixed - self._least_upper[high]]
        )
        A = np.concatenate([A * unit / self._scale, form.order * unit / np.max(unit)])
        b = np.concatenate([b / self._scale, form.room / np.max(unit)])
        price = cost * unit
        size = np.max(np.abs(price), initial=0.0) or 1.0
        least = np.maximum(form.lower / unit, -FARTHEST)
        result = linprog(
            price / size,
            A_ub=A,
            b_ub=b,
            bounds=np.column_stack([least, np.full(form.size, FARTHEST)]),
            method="highs-ds",
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        if result.status == 2:
            return None
        if result.status != 0:
            raise NumericalError(f"the linear programme for the intervals failed: {result.message}")
        z = result.x * unit
        active = self._active(-result.ineqlin.marginals * size / self._scale)
        return Answer(z, form.matrix @ z + form.fixed, float(cost @ z), active)

    def _active(self, multipliers: Array) -> tuple[Active, ...]:
        sides = [(index, side) for side in ("lower", "upper") for index in self._working[side]]
        found = zip(sides, multipliers[: len(sides)], strict=True)
        size = np.max(multipliers, initial=0.0)
        active = [Active(int(index), side, float(value)) for (index, side), value in found if value > 1e-9 * size]
        return tuple(sorted(active, key=lambda item: -item.multiplier))


def _worst_of_blocks(excess: Array) -> Indices:
    """Index of the largest value in each of up to 32 stretches of equal length."""
    length = -(-len(excess) // BLOCKS)
    starts = np.arange(0, len(excess), length)
    return np.array([start + int(np.argmax(excess[start : start + length])) for start in starts], dtype=np.intp)


def form(known: Mapping[int, Sequence[float]], spread: Set[int], noise: float = 0.0) -> Form:
    """Intervals with both ends free for the parameters in ``spread``, one free value for the others.

    Parameters
    ----------
    known : parameters that are not sought, by their index in ``PARAMETERS``, with their lower and upper ends
    noise : the disturbance reaches at least this far to either side of its middle
    """
    columns, order, room, fixed = [], [], [], np.zeros(ENDS)
    for k in range(ENDS // 2):
        reach = noise if k == DISTURBANCE else 0.0
        if k in known:
            fixed[2 * k : 2 * k + 2] = known[k]
        elif k in spread:
            columns += [[2 * k], [2 * k + 1]]
            order.append((len(columns) - 2, len(columns) - 1))
            room.append(-2.0 * reach)
        else:
            columns.append([2 * k, 2 * k + 1])
            fixed[2 * k : 2 * k + 2] = -reach, reach
    matrix, rows = np.zeros((ENDS, len(columns))), np.zeros((len(order), len(columns)))
    for column, ends in enumerate(columns):
        matrix[ends, column] = 1.0
    for row, (low, high) in enumerate(order):
        rows[row, low], rows[row, high] = 1.0, -1.0
    lower = np.where([ends[0] // 2 == DISTURBANCE for ends in columns], -np.inf, 0.0)
    return Form(matrix, fixed, lower, rows, np.array(room))
