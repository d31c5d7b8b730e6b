"""How long residuals stay correlated, and what that does to sums over them."""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array

_FEWEST_BLOCKS = 48
_LARGEST_PART = 0.1
"""The correlation time is at most this part of the recordings, so that enough independent pieces remain."""
_WIDER = 2.0
"""Andrews' width makes the mean square error of the variance small; for intervals its bias weighs more than its scatter
(Y. Sun, P. Phillips, S. Jin, Econometrica 76 (2008)), and a wider kernel has less bias."""


def bandwidth(residuals: Sequence[Array], steps: Sequence[float]) -> float:
    """Width of the Bartlett kernel for residuals, [s].

    Andrews' rule for a first-order autoregressive process (D. Andrews, Econometrica 59 (1991), eqs. 6.2-6.4:
    1.1447 (alpha T)^(1/3)), applied to the residuals and to their means over 2, 4, 8, ... samples; the longest time
    counts. The means reveal a slow error of the model below fast measuring noise, which the plain rule misses.
    Correlations within three standard errors of zero count as zero.

    Parameters
    ----------
    residuals : one array (N, n) per run, of unit variance, 0 where a sample does not count
    steps : time between samples of each run, [s]
    """
    longest, total = 0.0, sum(len(x) * step for x, step in zip(residuals, steps, strict=True))
    for residual, step in zip(residuals, steps, strict=True):
        size = 1
        while len(residual) // size >= _FEWEST_BLOCKS:
            means = residual[: len(residual) // size * size].reshape(-1, size, residual.shape[1]).mean(axis=1)
            longest = max(longest, _andrews(means, total / (step * size)) * size * step)
            size *= 2
    return min(_WIDER * longest, _LARGEST_PART * total)


def critical_95(part: float) -> float:
    """Half-width of 95 % intervals in standard errors, when the kernel is as wide as a part of the recordings.

    N. Kiefer, T. Vogelsang, Econometric Theory 21 (2005), table 1, Bartlett kernel: 1.96 for part 0.
    """
    return 1.96 + 2.9694 * part + 0.4160 * part**2 - 0.5324 * part**3


def _andrews(x: Array, count: float) -> float:
    """Andrews' bandwidth in samples, from the columns of x (N, n) together, for ``count`` samples in all."""
    x = x - x.mean(axis=0)
    before, after = x[:-1], x[1:]
    energy = (before**2).sum(axis=0)
    moving = energy > 0.0
    if not moving.any():
        return 0.0
    rho = np.clip((before * after).sum(axis=0)[moving] / energy[moving], -0.97, 0.97)
    rho = np.where(np.abs(rho) > 3.0 / np.sqrt(len(x)), rho, 0.0)
    variance = ((after[:, moving] - rho * before[:, moving]) ** 2).mean(axis=0)
    above = (4.0 * rho**2 * variance**2 / ((1.0 - rho) ** 6 * (1.0 + rho) ** 2)).sum()
    below = (variance**2 / (1.0 - rho) ** 4).sum()
    return float(1.1447 * (above / below * count) ** (1.0 / 3.0)) if below > 0.0 else 0.0


def long_run_covariance(scores: Array, width: int) -> Array:
    """Sum over all pairs of samples of s_t s_u', weighted by 1 - |t - u| / width, shape (k, k).

    The Bartlett kernel is the mean over overlapping blocks of ``width`` samples; sums over blocks come from one
    running sum.

    Parameters
    ----------
    scores : shape (N, k)
    width : >= 1; 1 for uncorrelated samples
    """
    width = min(width, len(scores))
    running = np.vstack([np.zeros((width, scores.shape[1])), np.cumsum(scores, axis=0)])
    running = np.vstack([running, np.repeat(running[-1:], width - 1, axis=0)])
    blocks = running[width:] - running[:-width]
    return np.asarray(blocks.T @ blocks / width)
