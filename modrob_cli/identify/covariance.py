r"""Standard errors that hold when the residuals are correlated in time.

The variance of the sum of the scores z_i = phi_i psi(r_i) is estimated from their lowest cosine transforms,

.. math:: \hat\Omega = \frac1B \sum_{b=1}^{B} \Lambda_b \Lambda_b^T, \quad
   \Lambda_b = \sqrt2 \sum_i z_i \cos(\pi b (i + 1/2) / N),

the equal-weighted cosine estimator (U. K. Mueller, J. Econometrics 141 (2007); E. Lazarus, D. J. Lewis, J. H. Stock,
M. W. Watson, J. Bus. Econ. Stat. 36 (2018)). Its ratio to the estimate follows Student's t with B degrees of freedom,
so that a short record widens the intervals as it should; a kernel estimator with normal quantiles does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices

Mask = NDArray[np.bool_]

FEWEST = 4
"""Cosines at least; fewer degrees of freedom would make any interval useless."""

FEWEST_LOGS = 5
"""From this many logs on, the scatter between them is looked at too."""


@dataclass(frozen=True)
class Timeline:
    """Where the samples of a regression come from: M samples out of several runs.

    Attributes
    ----------
    run : number of the run, shape (M,), not decreasing
    index : place in the evenly sampled run, shape (M,); what was left out shows as a hole
    lengths : samples of each run, holes included
    rate : [Hz], of each run
    """

    run: Indices
    index: Indices
    lengths: tuple[int, ...]
    rate: tuple[float, ...]

    def spans(self) -> list[tuple[int, slice]]:
        """Number of each run that has samples, and where they are."""
        numbers, starts = np.unique(self.run, return_index=True)
        ends = [*starts[1:].tolist(), len(self.run)]
        return [(k, slice(a, b)) for k, a, b in zip(numbers.tolist(), starts.tolist(), ends, strict=True)]


@dataclass(frozen=True)
class Covariance:
    """Covariance of p estimates.

    Attributes
    ----------
    matrix : shape (p, p)
    stderr : standard errors, shape (p,); never less than the root of the diagonal of ``matrix``
    dof : degrees of freedom of Student's t for each, shape (p,)
    effective_samples : independent samples that carry as much as the correlated residuals do
    bandwidth : frequency up to which the scores' spectrum was averaged, [Hz]; of several runs the smallest
    """

    matrix: Array
    stderr: Array
    dof: Array
    effective_samples: float
    bandwidth: float


def covariance(phi: Array, residual: Array, weights: Array, timeline: Timeline) -> Covariance:
    """Covariance of a (robust) least-squares fit.

    Parameters
    ----------
    phi : columns, shape (M, p);  residual, weights : shape (M,), as :func:`modrob_cli.identify.robust.robust_fit`
        leaves them
    """
    scale = np.linalg.norm(phi, axis=0)
    scaled = phi / scale
    inverse = np.linalg.pinv(_gram(scaled, weights >= 1.0))
    basis = np.linalg.qr(scaled)[0]
    clipped = weights * residual
    parts, kept, sums, degrees, effective, bandwidths = [], [], [], [], 0.0, []
    for k, mine in timeline.spans():
        index, length = timeline.index[mine], timeline.lengths[k]
        series = np.zeros(length)
        series[index] = clipped[mine]
        independent = effective_samples(series, len(index))
        cosines = max(FEWEST, round(0.4 * independent ** (2.0 / 3.0)))
        influence = scaled[mine] @ inverse
        part, share = _cosine_variance(influence, clipped[mine], basis[mine], (index + 0.5) / length, cosines)
        sums.append(clipped[mine] @ influence)
        parts.append(part)
        kept.append(share)
        degrees.append(cosines)
        effective += independent
        bandwidths.append(0.5 * cosines * timeline.rate[k] / length)
    root = 1.0 / np.sqrt(np.mean(kept, axis=0))
    small = effective / max(effective - phi.shape[1], 1.0)
    matrix = small * np.sum(parts, axis=0) * np.outer(root, root)
    variance, dof = np.diag(matrix).copy(), _satterthwaite(np.array([np.diag(part) for part in parts]), degrees)
    if len(parts) >= FEWEST_LOGS:
        between = _between_logs(np.array(sums))
        larger = between > variance
        variance, dof = np.where(larger, between, variance), np.where(larger, len(parts) - 1.0, dof)
    return Covariance(matrix / np.outer(scale, scale), np.sqrt(variance) / scale, dof, effective, min(bandwidths))


def _gram(scaled: Array, counted: Mask) -> Array:
    """Normal matrix of the samples that count in full, shape (p, p).

    The derivative of Huber's influence function is 1 for them and 0 for the others.
    """
    full = scaled[counted]
    return np.asarray(full.T @ full)


def effective_samples(series: Array, count: int) -> float:
    """Number of independent samples that average as well as ``count`` correlated ones, from 1 to ``count``.

    ``count`` over the integrated autocorrelation, summed up to five times itself (A. Sokal's window); ``series`` has
    zeros where samples were left out.
    """
    size = 1 << (2 * len(series) - 1).bit_length()
    transform = np.fft.rfft(series, size)
    correlation = np.fft.irfft(np.abs(transform) ** 2, size)[: len(series)]
    if correlation[0] <= 0.0:
        return float(count)
    time = 2.0 * np.cumsum(correlation / correlation[0]) - 1.0
    window = np.flatnonzero(np.arange(len(time)) >= 5.0 * time)
    total = time[window[0]] if len(window) else time[-1]
    return float(np.clip(count / max(float(total), 1.0), 1.0, count))


def quantile(confidence: float, dof: Array) -> Array:
    """Half-width of the interval in standard errors: Student's t."""
    from scipy.special import stdtrit

    return np.asarray(stdtrit(dof, 0.5 + 0.5 * confidence))


def correlations(matrix: Array) -> Array:
    """Correlation matrix of a covariance matrix, shape (p, p)."""
    root = np.sqrt(np.diag(matrix))
    safe = np.where(root > 0.0, root, 1.0)
    return np.asarray(np.clip(matrix / np.outer(safe, safe), -1.0, 1.0))


def _cosine_variance(
    influence: Array, residual: Array, basis: Array, place: Array, cosines: int
) -> tuple[Array, Array]:
    """Variance (p, p) of the sum of one run's scores, and the share of it (p,) that the fit left, were they white.

    The fit draws the residuals toward its columns and so takes from the very frequencies that are looked at. What it
    takes is known, and dividing by the rest removes the bias: I - P in the place of I, P the projection on the columns.

    Parameters
    ----------
    influence, basis : shape (m, p);  residual : shape (m,);  place : in the run, from 0 to 1, shape (m,)
    """
    count = influence.shape[1]
    total, whole, lost = np.zeros((count, count)), np.zeros(count), np.zeros(count)
    for b in range(1, cosines + 1):
        waves = np.sqrt(2.0) * np.cos(np.pi * b * place)[:, None] * influence
        transform = residual @ waves
        total += np.outer(transform, transform) / cosines
        whole += np.einsum("mk,mk->k", waves, waves)
        lost += np.sum((waves.T @ basis) ** 2, axis=1)
    taken = np.divide(lost, whole, out=np.zeros(count), where=whole > 0.0)
    return total, np.clip(1.0 - taken, 0.1, 1.0)


def _satterthwaite(shares: Array, degrees: Sequence[int]) -> Array:
    """Degrees of freedom of a sum of variance estimates, shape (p,)."""
    squares = (shares**2 / np.asarray(degrees, dtype=float)[:, None]).sum(axis=0)
    total = shares.sum(axis=0) ** 2
    return np.where(squares > 0.0, total / np.where(squares > 0.0, squares, 1.0), float(sum(degrees)))


def _between_logs(sums: Array) -> Array:
    """Variances, shape (p,), from the scatter between logs, which sees what stays the same throughout one log.

    Parameters
    ----------
    sums : of the scores of each log, shape (logs, p)
    """
    return np.asarray(len(sums) / (len(sums) - 1.0) * (sums**2).sum(axis=0))
