"""Exciting motions: Fourier series within the limits of a robot that tell as much as possible about its parameters.

The search is sequential linear programming (R. Fletcher, E. Sainz de la Maza, Mathematical Programming 43 (1989)):
limits of position, velocity, acceleration and jerk are linear in the coefficients of one joint, so a step that follows
the gradient within a trust region is one small linear programme per joint, and every iterate keeps these limits.
Torques of the nominal robot beyond their limits are penalised, the harder the longer they stay.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError
from modrob_cli.identify.base_columns import nominal_values
from modrob_cli.identify.base_parameters import BaseModel, base_model
from modrob_cli.identify.excitation_information import Information, Measure, condition, measure_of
from modrob_cli.identify.excitation_limits import LimitedJoint, MotionLimits, within_limits
from modrob_cli.identify.excitation_series import FourierMotion, RestingSeries
from modrob_cli.model.robot import Robot

SAMPLES_PER_HARMONIC = 20
"""Times per harmonic and period at which the regressor is taken."""

_FIRST_TRUST, _LEAST_TRUST = 0.2, 1e-4
"""Trust region relative to the size of the motion: at the start, and where the search ends."""

_WORTH, _ENOUGH = 0.05, 2e-5
"""A step is taken if it gains this part of what its slope promises; the search ends below this relative gain."""

_SETTLED, _PRESSES = 0.9, 4
"""Fraction of the work when torques are pressed back, and how often the penalty grows tenfold for that."""

_TORQUE_ROOM = 0.98
"""Part of the torque limits that the measure aims at, for what the torque does between its times."""

_SOFT = 0.02
"""Part of the largest velocity over which the sign of the friction changes in the measure."""

Report = Callable[[float], None]
"""Takes the fraction done."""


@dataclass(frozen=True)
class ExcitationOptions:
    """How to search.

    Attributes
    ----------
    period : of the motion, [s];  harmonics : K >= 2
    measure : see :mod:`modrob_cli.identify.excitation_information`
    seed : of the random motions to start from;  candidates : how many of them are compared
    starts : how many of the best are improved;  iterations : at most, for each of these
    seconds : the search ends after this time at the latest, None for no such end
    """

    period: float = 20.0
    harmonics: int = 5
    measure: Measure = "log-det"
    seed: int = 0
    candidates: int = 100
    starts: int = 6
    iterations: int = 100
    seconds: float | None = None


@dataclass(frozen=True)
class ExcitationResult:
    """A motion and what it tells.

    Attributes
    ----------
    motion : within the limits;  model : base parameters whose information was measured
    log_det, condition : measures of the motion
    random_log_det, random_condition : of those random motions that keep the torque limits; half to fully as large as
        the other limits allow; may be empty
    shrunk : factor on the amplitudes, joint by joint, that took them from the grid to the exact limits, shape (n,)
    iterations : that were made in all;  stopped : True if time ran out
    """

    motion: FourierMotion
    model: BaseModel
    log_det: float
    condition: float
    random_log_det: Array
    random_condition: Array
    shrunk: Array
    iterations: int
    stopped: bool


def optimize_excitation(
    robot: Robot,
    limits: MotionLimits,
    options: ExcitationOptions,
    moving: Sequence[int] | None = None,
    rest: Array | None = None,
    report: Report = lambda fraction: None,
) -> ExcitationResult:
    """Find a motion within the limits that tells much about the base parameters; at rest at both ends.

    The result is a local optimum; the same for the same options unless ``seconds`` ends the search.

    Parameters
    ----------
    moving : joints (from 0) that move, None for all;  rest : positions of the others, shape (n,), [rad] or [m]
    report : called with the fraction done

    Raises
    ------
    NumericalError
        If no random motion tells the parameters apart, or the nominal torques are beyond their limits.
    """
    search = _Search(robot, limits, options, moving, rest)
    best: tuple[float, Array] | None = None
    starts = search.starts()
    for k, x in enumerate(starts):
        found = search.improve(x, lambda part, k=k: report(_SETTLED * (k + part) / len(starts)))  # type: ignore[misc]
        best = found if best is None or found[0] < best[0] else best
        if search.out_of_time():
            break
    if best is None:
        raise NumericalError("no motion was tried")
    x = search.settle(best[1], lambda part: report(_SETTLED + (1.0 - _SETTLED) * part))
    motion, shrunk = within_limits(robot, limits, search.series.motion(x), search.moving)
    log_det, number = search.measures(search.numbers_of(motion))
    randoms = np.array([search.measures(x) for x in search.candidates if search.keeps_torques(x)]).reshape(-1, 2)
    report(1.0)
    return ExcitationResult(
        motion, search.information.model, log_det, number, randoms[:, 0], randoms[:, 1], shrunk,
        search.iterations, search.stopped,
    )  # fmt: skip


class _Search:
    """One search: the candidates, the measure, the steps."""

    def __init__(
        self, robot: Robot, limits: MotionLimits, options: ExcitationOptions, moving: Sequence[int] | None,
        rest: Array | None,
    ) -> None:  # fmt: skip
        self.options, self.robot = options, robot
        self.series = RestingSeries(options.period, options.harmonics)
        self.moving = tuple(range(robot.dof)) if moving is None else tuple(moving)
        self.rest = np.zeros(robot.dof) if rest is None else rest
        self.joints = {j: LimitedJoint(self.series, limits, j) for j in self.moving}
        self.matrices = self.series.matrices(SAMPLES_PER_HARMONIC * options.harmonics)
        self.reach = 0.5 * np.ptp(limits.position, axis=1)
        rng = np.random.default_rng(options.seed)
        self.candidates = [self._random(rng) for _ in range(options.candidates)]
        self.information = self._information(limits, moving)
        self.iterations, self.stopped = 0, False
        self.end = None if options.seconds is None else time.monotonic() + options.seconds

    def _random(self, rng: np.random.Generator) -> Array:
        x = np.zeros((self.robot.dof, self.series.size))
        x[:, 0] = self.rest
        for j, joint in self.joints.items():
            x[j] = joint.inside(rng.normal(size=self.series.size), rng.uniform(0.5, 1.0), rng.uniform())
        return x

    def _information(self, limits: MotionLimits, moving: Sequence[int] | None) -> Information:
        """Measure; torques are scaled by their nominal RMS over the candidates, joints at rest do not count."""
        n = self.robot.dof
        model = base_model(self.robot, moving=moving, rest=self.rest)
        speed = np.max([np.abs(self.states(x)[1]).max(axis=0) for x in self.candidates], axis=0)
        soft = np.maximum(_SOFT * speed, 1e-9)
        torque = _TORQUE_ROOM * limits.torque
        plain = Information(self.robot, model, self.options.measure, np.ones(n), soft, torque)
        nominal = nominal_values(self.robot)
        squares = [np.mean((plain.columns(*self.states(x)) @ nominal) ** 2, axis=0) for x in self.candidates]
        scale = np.sqrt(np.mean(squares, axis=0))
        scale = np.maximum(scale, 1e-3 * max(float(scale.max()), 1e-9))
        scale[np.setdiff1d(np.arange(n), self.moving)] = np.inf
        return Information(self.robot, model, self.options.measure, scale, soft, torque)

    def states(self, x: Array) -> tuple[Array, Array, Array]:
        """Positions, velocities and accelerations (T, n) of free numbers (n, m)."""
        position, velocity, acceleration = (A @ x.T for A in self.matrices)
        return position, velocity, acceleration

    def measures(self, x: Array) -> tuple[float, float]:
        """Log-det measure and condition number."""
        M = self.information.matrix(self.information.columns(*self.states(x)))
        return measure_of(M, "log-det")[0], condition(M)

    def numbers_of(self, motion: FourierMotion) -> Array:
        """Free numbers (n, m) of a motion of this series."""
        values = np.column_stack([motion.offset, motion.sin, motion.cos])
        return values @ self.series.spread()

    def starts(self) -> list[Array]:
        """The best candidates.

        Raises
        ------
        NumericalError
            If none tells the parameters apart.
        """
        values = np.array([self.information.value(*self.states(x)) for x in self.candidates])
        order = [k for k in np.argsort(values, kind="stable") if np.isfinite(values[k])]
        if not order:
            raise NumericalError(
                f"none of {len(values)} random motions tells the {self.information.model.count} parameters apart; "
                "allow more harmonics or wider limits"
            )
        return [self.candidates[k] for k in order[: self.options.starts]]

    def keeps_torques(self, x: Array) -> bool:
        """Whether the nominal torques keep their limits at the times of the measure."""
        return self.information.penalty(*self.states(x)) == 0.0

    def settle(self, x: Array, report: Report) -> Array:
        """Press torques that are still beyond their limits back, with a penalty that grows."""
        for k in range(_PRESSES):
            if self.keeps_torques(x) or self.out_of_time():
                break
            self.information = replace(self.information, strength=10.0 * self.information.strength)
            _, x = self.improve(x, lambda part, k=k: report((k + part) / _PRESSES))  # type: ignore[misc]
        return x

    def improve(self, x: Array, report: Report) -> tuple[float, Array]:
        """Follow the gradient from x within the limits; returns the value reached and where."""
        value, trust = self.information.value(*self.states(x)), _FIRST_TRUST
        for k in range(self.options.iterations):
            report(k / self.options.iterations)
            _, slopes = self.information.gradient(*self.states(x))
            slope = sum(A.T @ part for A, part in zip(self.matrices, slopes, strict=True)).T  # type: ignore[union-attr]
            self.iterations += 1
            while True:
                step, expected = self._step(x, slope, trust)
                gain = value - self.information.value(*self.states(x + step)) if expected > 0.0 else 0.0
                if gain > _WORTH * expected or trust < _LEAST_TRUST or self.out_of_time():
                    break
                trust *= 0.5
            if not gain > _ENOUGH * abs(value):
                break
            x, value = x + step, value - gain
            trust *= 1.5 if gain > 0.5 * expected else 1.0 if gain > 0.2 * expected else 0.7
        return value, x

    def _step(self, x: Array, slope: Array, trust: float) -> tuple[Array, float]:
        step = np.zeros_like(x)
        for j, joint in self.joints.items():
            step[j] = joint.best_step(x[j], slope[j], np.full(self.series.size, trust * self.reach[j]))
        return step, float(-(slope * step).sum())

    def out_of_time(self) -> bool:
        """Whether the time is over; remembers it."""
        self.stopped = self.stopped or (self.end is not None and time.monotonic() > self.end)
        return self.stopped
