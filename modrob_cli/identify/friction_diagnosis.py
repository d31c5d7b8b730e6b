"""Whose fault it is that a joint's torque remains unexplained: another joint, or gravity that is not in the record."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.covariance import covariance, quantile
from modrob_cli.identify.friction_terms import FrictionShape, columns
from modrob_cli.identify.regression import RegressionOptions
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.regression_rows import joint_motion, joint_rows, picked_runs, row_mask
from modrob_cli.identify.robust import robust_fit
from modrob_cli.identify.run import Run

COUPLED = 0.5
"""Share of the residual's power that another joint's motion has to explain to be named."""

LEAST_GRAVITY = 0.1
"""Joints on which gravity is less than this share of the torque (RMS) do not tell whether it is in the record."""


@dataclass(frozen=True)
class Coupling:
    """Another joint whose motion explains what is left: its number and the share of the residual's power."""

    joint: int
    share: float


@dataclass(frozen=True)
class GravityShare:
    """How much of the model's gravity is in the recorded torque: 1 if all, 0 if none; with its interval."""

    value: float
    interval: tuple[float, float]
    joints: tuple[int, ...]


def coupling(train: Sequence[Run], test: Sequence[Run], j: int, estimate: JointEstimate) -> Coupling | None:
    """Joint whose motion explains most of what is left of joint j, if it is more than half of its power.

    Friction and inertia of the other joint alone, and Coulomb friction of sum and difference of both velocities (as in
    wrists with coupled gears) are fitted to the residual together with the joint's own terms on ``train``, judged on
    ``test`` (on ``train`` where that is empty).

    Parameters
    ----------
    train, test : the same logs, with other samples used
    """
    judge = test if any(run.used.any() for run in test) else train
    own = _both(train, judge, j, lambda run: _own(run, j, estimate))
    residual = _both(train, judge, j, lambda run: _residual(run, j, estimate))
    left = [float(np.sum((r - x @ _solve(own[0], residual[0])) ** 2)) for x, r in zip(own, residual, strict=True)]
    best: Coupling | None = None
    for k in range(train[0].dq.shape[1]):
        if k == j or not any(run.signals.moving[k] for run in train):
            continue
        others = _both(train, judge, j, partial(_other, j=j, k=k, estimate=estimate))
        solution = _solve(np.column_stack([own[0], others[0]]), residual[0])
        count = own[0].shape[1]
        shares = [
            1.0
            - float(np.sum((r - x @ solution[:count] - y @ solution[count:]) ** 2)) / max(before, np.finfo(float).tiny)
            for x, y, r, before in zip(own, others, residual, left, strict=True)
        ]
        if min(shares) > COUPLED and (best is None or min(shares) > best.share):
            best = Coupling(k, min(shares))
    return best


def gravity_share(
    runs: Sequence[Run], gravity: Sequence[Array], estimates: Sequence[JointEstimate], options: RegressionOptions
) -> GravityShare | None:
    """Fit a factor of the model's gravity beside the terms of each joint; None where gravity hardly matters.

    Parameters
    ----------
    gravity : for each run the torque that carries the arm at rest, shape (N, n), with gravity even if the recorded
        torque is said to be without
    """
    values, weights, dofs, joints = [], [], [], []
    for j, estimate in enumerate(estimates):
        weight = np.sqrt(np.mean(np.concatenate([g[run.used, j] for run, g in zip(runs, gravity, strict=True)]) ** 2))
        size = np.sqrt(np.mean(np.concatenate([run.tau[run.used, j] for run in runs]) ** 2))
        if not weight > LEAST_GRAVITY * max(size, np.finfo(float).tiny):
            continue
        found = _gravity_factor(runs, gravity, j, estimate)
        if found is not None:
            values.append(found[0])
            weights.append(found[1] ** -2)
            dofs.append(found[2])
            joints.append(j)
    if not values:
        return None
    total = float(np.sum(weights))
    value = float(np.dot(values, weights)) / total
    # Joints that disagree more than their errors allow widen the interval of the mean (as in a meta-analysis).
    excess = float(np.dot(weights, (np.array(values) - value) ** 2)) / max(len(values) - 1, 1)
    half = float(quantile(options.confidence, np.array(min(dofs)))) * np.sqrt(max(excess, 1.0) / total)
    return GravityShare(value, (value - half, value + half), tuple(joints))


def _gravity_factor(
    runs: Sequence[Run], gravity: Sequence[Array], j: int, estimate: JointEstimate
) -> tuple[float, float, float] | None:
    """Factor, standard error and degrees of freedom; None if a joint's gravity looks like its other terms."""
    terms = [term for term in estimate.model() if term in ("offset", "coulomb", "viscous", "reflected_inertia")]
    targets = []
    for run, torque in zip(runs, gravity, strict=True):
        held = torque[:, j] if run.gravity else np.zeros(len(run.t))
        targets.append(run.tau[:, j] - (run.tau_rigid[:, j] - held))
    rows = joint_rows(runs, j, terms, FrictionShape(estimate.width), targets)
    parts = [runs[k].filtered(gravity[k][:, j])[row_mask(runs[k], j)] for k in picked_runs(runs, j)]
    column = np.concatenate(parts)
    rest = column - rows.phi @ _solve(rows.phi, column)
    if np.linalg.norm(rest) < 0.05 * np.linalg.norm(column):
        return None
    rows = rows.joined("gravity", column)
    fit = robust_fit(rows.phi, rows.target)
    cov = covariance(rows.phi, fit.residual, fit.weights, rows.timeline)
    return float(fit.values[-1]), max(float(cov.stderr[-1]), 1e-12), float(cov.dof[-1])


def _both(train: Sequence[Run], judge: Sequence[Run], j: int, signal: Callable[[Run], Array]) -> tuple[Array, Array]:
    """A signal at the rows of joint j of either set; of each log it is made and filtered once."""
    picked = [set(picked_runs(runs, j)) for runs in (train, judge)]
    found: tuple[list[Array], list[Array]] = ([], [])
    for k in sorted(picked[0] | picked[1]):
        filtered = train[k].filtered(signal(train[k]))
        for parts, runs, chosen in zip(found, (train, judge), picked, strict=True):
            if k in chosen:
                parts.append(filtered[row_mask(runs[k], j)])
    return np.concatenate(found[0]), np.concatenate(found[1])


def _own(run: Run, j: int, estimate: JointEstimate) -> Array:
    """The joint's own linear columns, shape (N, p)."""
    terms = [term for term in estimate.model() if term in ("offset", "coulomb", "viscous", "reflected_inertia")]
    return columns(terms, joint_motion(run, j), FrictionShape(estimate.width))


def _residual(run: Run, j: int, estimate: JointEstimate) -> Array:
    """What the joint's estimate leaves, shape (N,)."""
    return np.asarray(run.tau[:, j] - run.tau_rigid[:, j] - estimate.torque(joint_motion(run, j)))


def _other(run: Run, j: int, k: int, estimate: JointEstimate) -> Array:
    """Columns of the other joint, shape (N, 5)."""
    width = 0.5 * max(float(run.standstill[k]), np.finfo(float).tiny)
    alone = columns(["viscous", "coulomb", "reflected_inertia"], joint_motion(run, k), FrictionShape(width))
    both = max(width, estimate.width)
    sums = [np.tanh((run.dq[:, j] + sign * run.dq[:, k]) / both) for sign in (1.0, -1.0)]
    return np.column_stack([alone, *sums])


def _solve(phi: Array, target: Array) -> Array:
    scale = np.linalg.norm(phi, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    return np.asarray(np.linalg.lstsq(phi / scale, target, rcond=1e-8)[0]) / scale
