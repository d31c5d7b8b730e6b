"""The programmes behind bounded-error identification, and what their answers say about each parameter."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from itertools import combinations

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import NumericalError
from modrob_cli.identify.bounded_programme import TOLERANCE, Active, Answer, Programme, form
from modrob_cli.identify.bounded_samples import DISTURBANCE, PARAMETERS, JointSamples

PARSIMONY = 1e-3
"""A width in friction or rotor has to save this share more than the same width in the disturbance; settles ties."""

ROUNDS = 40
"""Samples are left out in about so many rounds, at least one in each."""

Known = Mapping[int, Sequence[float]]


class Answers:
    """Answers for one joint.

    Parameters
    ----------
    known : lower and upper end of parameters that are not sought, by index
    noise : largest noise of the torque that will be asked for
    """

    def __init__(self, samples: JointSamples, known: Known, noise: float = 0.0) -> None:
        self.samples = samples
        self.slack = TOLERANCE * max(samples.scale, noise)
        self.known = known
        self.sought = frozenset(range(len(PARAMETERS))) - set(known)
        self._programme = Programme(samples, noise)

    def one_value_each(self, noise: float = 0.0) -> Answer:
        """One value for each parameter, and the least disturbance that explains all samples, at least the noise.

        Of values that need the same disturbance, those that make the bounds narrowest.
        """
        first = self._least({DISTURBANCE}, noise, np.concatenate([np.zeros(6), [-1.0, 1.0]]))
        reach = 0.5 * float(first.ends[-1] - first.ends[-2]) + self.slack
        layout = form(self.known, frozenset(), reach)
        second = self._programme.solve(layout, self.samples.width_weights() @ layout.matrix)
        return first if second is None else replace(first, ends=second.ends)

    def least_width(self, spread: Set[int], noise: float = 0.0) -> Answer:
        """Intervals for the parameters in ``spread``: the least mean width over the samples."""
        effect = self.samples.mean_effects()
        cost = self.samples.width_weights()
        for k in range(DISTURBANCE):
            cost[2 * k : 2 * k + 2] += PARSIMONY * effect[k] * np.array([-1.0, 1.0])
        return self._least(spread, noise, cost)

    def _least(self, spread: Set[int], noise: float, cost: Array) -> Answer:
        layout = form(self.known, spread, noise)
        answer = self._programme.solve(layout, cost @ layout.matrix)
        if answer is None:  # the disturbance is free, so there is always an answer
            raise NumericalError("no intervals explain the samples; the recorded torques may be absurd")
        return answer

    def widths(self, noise: float) -> dict[str, float]:
        """Mean width of the bounds with the disturbance and any choice of the others as intervals, widest first."""
        others = sorted(self.sought - {DISTURBANCE})
        found = {}
        for count in range(len(others) + 1):
            for chosen in combinations(others, count):
                answer = self.least_width({*chosen, DISTURBANCE}, noise)
                name = " + ".join(PARAMETERS[k] for k in (DISTURBANCE, *chosen))
                found[name] = self.samples.mean_width(answer.ends)
        return found

    def consistent(self, noise: float) -> tuple[Array, tuple[Active, ...]] | None:
        """Smallest box that holds all constant parameters which agree with all samples to within the noise.

        Returns
        -------
        ends, active : shape (4, 2), that of the disturbance without the noise, moved outward by what the solver's
            tolerance may hide; the samples that decide. None if no parameters agree.
        """
        layout = form(self.known, set(), noise)
        box = np.zeros((len(PARAMETERS), 2))
        for k, ends in self.known.items():
            box[k] = ends
        active: dict[tuple[int, str], Active] = {}
        for column in range(layout.size):
            k = int(np.argmax(layout.matrix[:, column])) // 2
            for side, sign in enumerate((1.0, -1.0)):
                answer = self._programme.solve(layout, sign * np.eye(layout.size)[column])
                if answer is None:
                    return None
                # Missing each constraint by the tolerance changes the end by the multipliers times as much.
                hidden = self.slack * sum(item.multiplier for item in answer.active)
                box[k, side] = sign * (answer.cost - hidden)
                active.update({(item.index, item.side): item for item in answer.active})
        box[:DISTURBANCE] = np.maximum(box[:DISTURBANCE], 0.0)
        return box, tuple(sorted(active.values(), key=lambda item: item.index))

    def leave_out_worst(self, most: int, spread: Set[int], enough: float = 0.0) -> Indices:
        """Leave out up to so many samples that make the bounds wide; the others' answer is found without them.

        Round by round, of the samples that decide (of those nearest to an edge, where many are left out in a round)
        those go that are farthest from a robust fit. The best choice of all would need a search over all subsets.
        Samples that lie inside in the end count again.

        Parameters
        ----------
        spread : parameters that have an interval while looking for them
        enough : with an interval of the disturbance alone, stop when its half-width is down to this

        Returns
        -------
        left_out : indices, increasing
        """
        left = np.empty(0, dtype=np.intp)
        answer = self.driver(spread)
        far = np.abs(robust_rest(self.samples)) if most else np.empty(0)
        few = max(1, most // ROUNDS)
        while len(left) < most and answer.active and 0.5 * (answer.ends[-1] - answer.ends[-2]) > enough:
            near = np.array([item.index for item in answer.active], dtype=np.intp)
            if few > 1:
                outside = self.samples.outside(answer.ends)
                outside[left] = -np.inf
                near = np.argpartition(-outside, min(4 * few, len(outside) - 1))[: 4 * few]
            worst = near[np.argsort(-far[near])][: min(few, most - len(left))]
            left = np.union1d(left, worst)
            self._programme.leave_out(worst)
            answer = self.driver(spread)
        return left[self.samples.outside(answer.ends)[left] > self.slack]

    def driver(self, spread: Set[int]) -> Answer:
        """The answer that decides which samples cost most: ``spread`` says which parameters have an interval."""
        return self.one_value_each() if spread == {DISTURBANCE} else self.least_width(spread)


def robust_rest(samples: JointSamples, rounds: int = 20) -> Array:
    """What constant friction, rotor inertia and offset leave, shape (N,), fitted to the least absolute deviations.

    By iteratively reweighted least squares; a sample far away hardly moves the fit, so it stands out.
    """
    target = samples.tau - 0.5 * (samples.low + samples.high)
    sign = np.where(np.abs(samples.dq) <= samples.velocity_band, 0.0, np.sign(samples.dq))
    columns = np.column_stack([samples.dq, sign, samples.ddq, np.ones(len(samples))]) / samples.reach()[:8:2]
    rest = target - np.median(target)
    for _ in range(rounds):
        weight = 1.0 / np.sqrt(np.maximum(np.abs(rest), 1e-6 * samples.scale))
        solution = np.linalg.lstsq(columns * weight[:, None], target * weight, rcond=None)[0]
        rest = target - columns @ solution
    return np.asarray(rest)
