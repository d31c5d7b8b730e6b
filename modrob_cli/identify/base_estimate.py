r"""Base parameters of a robot from recordings: weighted least squares of all joints at once.

Each joint's rows are divided by the standard deviation of its residual, which is estimated in turn (M. Gautier, Ph.
Poignet, "Extended Kalman filtering and weighted least squares dynamic identification of robot", Control Engineering
Practice 9 (2001), section 4). Standard errors take the correlation of residuals over time and between joints into
account: the covariance of the estimate is :math:`(W'W)^{-1} \Omega (W'W)^{-1}` with the Bartlett kernel in
:math:`\Omega` (W. Newey, K. West, Econometrica 55 (1987)).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.base_correlation import bandwidth, critical_95, long_run_covariance
from modrob_cli.identify.base_grouping import group
from modrob_cli.identify.base_parameters import BaseModel
from modrob_cli.identify.base_runs import Factors, Mask, TorqueRun, chunks, condense, thinned
from modrob_cli.model.robot import Robot

EXCITED = 1e-3
"""Least share of a column in the data that the columns before it must leave."""

_ROUNDS = 4


@dataclass(frozen=True)
class BaseEstimate:
    """Deviations of the base parameters from those of the robot file.

    Attributes
    ----------
    deviation, stderr : shape (p,); 0 and NaN for parameters that the motion does not excite
    covariance : of the excited deviations, shape (k, k)
    excited : shape (p,)
    sigma : standard deviation of each joint's residual, shape (n,), [N m] or [N]
    sigma_before : the same before anything was fitted
    samples : usable samples of each joint, shape (n,)
    condition : of the weighted regressor with columns of equal length
    correlation_time : time over which residuals were taken as correlated, [s]
    critical : half-width of 95 % intervals in standard errors
    inflation : by how much that makes variances larger than those of uncorrelated residuals (geometric mean)
    factor : triangular factor of the weighted rows [W, r], shape (p + 1, p + 1)
    """

    deviation: Array
    stderr: Array
    covariance: Array
    excited: Mask
    sigma: Array
    sigma_before: Array
    samples: Array
    condition: float
    correlation_time: float
    critical: float
    inflation: float
    factor: Array


def estimate(robot: Robot, model: BaseModel, runs: Sequence[TorqueRun]) -> BaseEstimate:
    """Estimate all base parameters from all runs together.

    Raises
    ------
    NumericalError
        If there are too few samples.
    """
    runs = thinned(runs)
    factors = condense(robot, model, runs)
    p = model.count
    before = _residual_sigma(factors, np.zeros(p), 0)
    sigma = before
    excited = np.ones(p, dtype=bool)
    for _ in range(_ROUNDS):
        factor = factors.weighted(sigma)
        chosen = group(factor[:, :p], np.arange(p), EXCITED, negligible=1e-9).independent
        excited = np.isin(np.arange(p), chosen)
        deviation = np.zeros(p)
        deviation[excited] = np.linalg.lstsq(factor[:, :p][:, excited], factor[:, p], rcond=None)[0]
        sigma = _residual_sigma(factors, deviation, len(chosen))
    factor = factors.weighted(sigma)
    covariance, time, inflation = _covariance(robot, model, runs, deviation, sigma, factor[:, :p], excited)
    stderr = np.full(p, np.nan)
    stderr[excited] = np.sqrt(np.diag(covariance))
    scaled = factor[:, :p][:, excited]
    singular = np.linalg.svd(scaled / np.linalg.norm(scaled, axis=0), compute_uv=False)
    condition = float(singular[0] / singular[-1])
    duration = sum(float(np.ptp(run.t)) for run in runs)
    critical = critical_95(time / duration)
    return BaseEstimate(
        deviation,
        stderr,
        covariance,
        excited,
        sigma,
        before,
        factors.samples,
        condition,
        time,
        critical,
        inflation,
        factor,
    )


def _residual_sigma(factors: Factors, deviation: Array, fitted: int) -> Array:
    """Standard deviation of each joint's residual; the parameters are counted evenly over the rows."""
    residual = factors.blocks[:, :, -1] - factors.blocks[:, :, :-1] @ deviation
    free = factors.samples * max(1.0 - fitted / factors.samples.sum(), 1e-3)
    sigma = np.sqrt((residual**2).sum(axis=1) / np.maximum(free, 1.0))
    # A joint without error (or samples) would have infinite weight.
    return np.asarray(np.maximum(sigma, 1e-9 * max(float(sigma.max()), 1e-9)))


def _covariance(
    robot: Robot, model: BaseModel, runs: Sequence[TorqueRun], deviation: Array, sigma: Array, R: Array, excited: Mask
) -> tuple[Array, float, float]:
    """Covariance (k, k) of the excited parameters, correlation time, geometric mean of the variance inflation."""
    bread = np.linalg.pinv(R[:, excited].T @ R[:, excited], rcond=1e-14, hermitian=True)
    steps = [float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0 for run in runs]
    residuals = [np.zeros_like(run.tau) for run in runs]
    for run, residual in zip(runs, residuals, strict=True):
        for part, W, rest in chunks(robot, model, run):
            residual[part] = np.where(run.use[part], (rest - W @ deviation) / sigma, 0.0)
    time = bandwidth(residuals, steps)
    meat = np.zeros_like(bread)
    for run, residual, step in zip(runs, residuals, steps, strict=True):
        scores = np.empty((len(run.t), int(np.count_nonzero(excited))))
        for part, W, _ in chunks(robot, model, run):
            scores[part] = np.einsum("tjp,tj->tp", W[:, :, excited], residual[part] / sigma)
        meat += long_run_covariance(scores, max(1, round(time / step)))
    covariance = bread @ meat @ bread
    growth = np.diag(covariance) / np.diag(bread)
    inflation = float(np.exp(np.mean(np.log(np.maximum(growth, 1e-12)))))
    # Residuals are smaller than errors by what the parameters take up, counted in independent samples.
    independent = sum(np.count_nonzero(run.use) for run in runs) / max(inflation, 1.0)
    covariance = covariance / max(1.0 - len(bread) / independent, 0.1)
    return np.asarray(0.5 * (covariance + covariance.T)), time, inflation
