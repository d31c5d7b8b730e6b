r"""How much the rigid bodies' boxes would have to grow to take over what friction and rotor leave unexplained.

If the bounds of a body's mass move outward by the share p of its nominal mass, its torque range [low, high] moves
outward by p S_low and p S_high, exactly linearly (the range is the mass times a factor that does not depend on it, see
:mod:`modrob_cli.dynamics.uncertain_body`), until the lower bound of a mass reaches zero. So the least p for which
constant friction, rotor inertia and offset leave no more than a given disturbance is one more linear programme, for all
bodies together or for one alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.identify.bounded_answers import Answers, Known
from modrob_cli.identify.bounded_boxes import is_point, labelled, with_grown_boxes, with_grown_masses
from modrob_cli.identify.bounded_programme import Form, Programme, form
from modrob_cli.identify.bounded_ranges import MotionNoise, RecordedMotion
from modrob_cli.identify.bounded_samples import ENDS, JointSamples
from modrob_cli.model.body import PlacedBody
from modrob_cli.model.robot import Robot

STEP = 0.01
"""Share by which masses are grown to see how the torque ranges move."""

MOST_FACTOR = 64.0
FINE = 0.01


@dataclass(frozen=True, kw_only=True)
class GrowingSamples(JointSamples):
    """Samples whose rigid bodies' range grows: a ninth end, the share p, moves it outward by p times these, (N,)."""

    grow_low: Array
    grow_high: Array

    def edges(self, ends: Array) -> tuple[Array, Array]:
        """Edges of the band, with what the rigid bodies' range has grown."""
        lower, upper = super().edges(ends[:ENDS])
        return lower - ends[ENDS] * self.grow_low, upper + ends[ENDS] * self.grow_high

    def rows(self, at: Indices) -> tuple[Array, Array]:
        """The same as rows, shape (len(at), 9)."""
        lower, upper = super().rows(at)
        return np.column_stack([lower, -self.grow_low[at]]), np.column_stack([upper, self.grow_high[at]])

    def reach(self) -> Array:
        """Largest effect of a unit of each end, shape (9,)."""
        largest = max(float(np.max(self.grow_low, initial=0.0)), float(np.max(self.grow_high, initial=0.0)))
        return np.append(super().reach(), largest or 1.0)


@dataclass(frozen=True)
class MassGrowth:
    """Least growth of masses that leaves no more disturbance than the target.

    Shares of the nominal mass; None where a mass would have to reach zero.

    Attributes
    ----------
    target : half-width of the disturbance that may remain, shape (n,), [N m] or [N]
    all_bodies : of all masses alike, per joint
    one_body : per joint, of the mass of one body alone, by its name
    """

    target: Array
    all_bodies: tuple[float | None, ...]
    one_body: tuple[dict[str, float | None], ...]


def mass_growth(
    robot: Robot,
    motion: RecordedMotion,
    noise: MotionNoise,
    samples: Sequence[JointSamples],
    known: Sequence[Known],
    target: Array,
) -> MassGrowth:
    """Find the growth for each joint; friction, rotor inertia and offset are the constants that ask for least of it.

    Parameters
    ----------
    robot : its rigid bodies alone
    samples : those of each joint along the motion
    known : parameters of each joint that are not sought
    """
    named = [(name, placed) for name, placed in labelled(robot) if placed.link > 0 and not placed.body.is_massless]
    base = motion.bounds(robot, noise)

    def slopes(bodies: Sequence[PlacedBody]) -> tuple[Array, Array]:
        grown = motion.bounds(with_grown_masses(robot, bodies, STEP), noise)
        return np.maximum(base.lower - grown.lower, 0.0) / STEP, np.maximum(grown.upper - base.upper, 0.0) / STEP

    def least(j: int, found: tuple[Array, Array], most: float) -> float | None:
        parts = {**vars(samples[j]), "grow_low": found[0][:, j], "grow_high": found[1][:, j]}
        share = _least_growth(GrowingSamples(**parts), known[j], float(target[j]))
        return None if share is None or share > most else share

    together, most = slopes([placed for _, placed in named]), min((_room(placed) for _, placed in named), default=0.0)
    every = tuple(least(j, together, most) for j in range(robot.dof))
    alone: list[dict[str, float | None]] = [{} for _ in samples]
    for name, placed in named:
        found = slopes([placed])
        for j in range(min(placed.link, robot.dof)):
            alone[j][name] = least(j, found, _room(placed))
    return MassGrowth(target, every, tuple(alone))


def _room(placed: PlacedBody) -> float:
    """Share by which a mass may grow before its lower bound reaches zero; 1 where it is there, so that it stays."""
    mass = placed.body.mass
    return float(mass.interval.inf / mass.nominal) if mass.interval.inf > 0.0 else 1.0


def _least_growth(samples: GrowingSamples, known: Known, target: float) -> float | None:
    constant = form(known, frozenset(), target)
    size = constant.size + 1
    layout = Form(
        matrix=np.block([[constant.matrix, np.zeros((ENDS, 1))], [np.zeros((1, size - 1)), np.ones((1, 1))]]),
        fixed=np.append(constant.fixed, 0.0),
        lower=np.append(constant.lower, 0.0),
        order=np.zeros((0, size)),
        room=np.zeros(0),
    )
    answer = Programme(samples).solve(layout, np.eye(size)[-1])
    return None if answer is None else max(answer.cost, 0.0)


def box_growth(
    robot: Robot,
    motion: RecordedMotion,
    noise: MotionNoise,
    samples: Sequence[JointSamples],
    known: Sequence[Known],
    target: Array,
) -> float | None:
    """Least factor by which all boxes (mass, centre of mass, tensor) must grow about their nominal values.

    To 1 %, rounded up; None if there are no boxes or a factor of 64 is not enough. Parameters as in
    :func:`mass_growth`.
    """
    if all(is_point(placed) for placed in robot.bodies):
        return None

    def enough(factor: float) -> bool:
        grown = motion.bounds(with_grown_boxes(robot, factor), noise)
        for j, part in enumerate(samples):
            wider = replace(part, low=grown.lower[:, j], high=grown.upper[:, j])
            centre = Answers(wider, known[j]).one_value_each().ends
            if 0.5 * (centre[-1] - centre[-2]) > target[j]:
                return False
        return True

    if enough(1.0):
        return 1.0
    low, high = 1.0, MOST_FACTOR
    if not enough(high):
        return None
    while high > low * (1.0 + FINE):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
