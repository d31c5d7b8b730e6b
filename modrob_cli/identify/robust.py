"""Least squares that a few bad samples do not decide. P. J. Huber, Ann. Math. Statist. 35 (1964)."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError

THRESHOLD = 3.0
"""Residuals beyond this many robust standard deviations get less weight; of normal ones 0.3 % are.

The textbook's 1.345 suits noise with a normal core. What a friction model leaves is no noise: it bulges where the
model's form is wrong, and a tight threshold would fit the easy speeds and disregard the others.
"""

ITERATIONS = 200


@dataclass(frozen=True)
class RobustFit:
    """Result of a linear fit with p columns to M samples.

    Attributes
    ----------
    values : shape (p,)
    residual : shape (M,)
    weights : 1 for a sample that counts in full, less for an outlier, shape (M,)
    """

    values: Array
    residual: Array
    weights: Array

    @property
    def outliers(self) -> float:
        """Share of the samples whose weight was reduced."""
        return float(np.mean(self.weights < 1.0))

    @property
    def influence(self) -> Array:
        """Residuals cut off at the threshold, shape (M,): what enters the normal equations."""
        return self.weights * self.residual


def robust_fit(phi: Array, target: Array, robust: bool = True) -> RobustFit:
    """Huber's M-estimate by iteratively reweighted least squares; ordinary least squares if not ``robust``.

    Parameters
    ----------
    phi : columns, shape (M, p), of full rank;  target : shape (M,)

    Raises
    ------
    NumericalError
        If there are fewer samples than columns, or the iteration does not settle.
    """
    if len(phi) < phi.shape[1]:
        raise NumericalError(f"{len(phi)} samples do not determine {phi.shape[1]} parameters")
    scale = np.linalg.norm(phi, axis=0)
    scaled = phi / scale
    weights = np.ones(len(phi))
    values = _solve(scaled, target, weights)
    residual = target - scaled @ values
    for _ in range(ITERATIONS if robust and phi.shape[1] else 0):
        limit = THRESHOLD * spread(residual)
        if limit <= 1e-12 * float(np.max(np.abs(target), initial=0.0)):
            break  # all but a few samples fit exactly
        weights = np.minimum(1.0, limit / np.maximum(np.abs(residual), np.finfo(float).tiny))
        before, values = values, _solve(scaled, target, weights)
        residual = target - scaled @ values
        if np.linalg.norm(values - before) <= 1e-9 * np.linalg.norm(values):
            break
    return RobustFit(values / scale, residual, weights)


def spread(residual: Array) -> float:
    """Robust standard deviation: the median absolute value over that of a normal variable with unit variance."""
    return float(np.median(np.abs(residual))) / 0.674489750196082


def _solve(scaled: Array, target: Array, weights: Array) -> Array:
    root = np.sqrt(weights)
    return np.asarray(np.linalg.lstsq(scaled * root[:, None], target * root, rcond=None)[0])
