r"""How often later samples may fall outside bounds that were found from recorded ones.

Intervals that are the best of all that hold N independent samples are the answer of a convex programme with random
constraints. Whatever the distribution, with d unknowns and k samples left out, the chance V that one more sample falls
outside satisfies, with confidence 1 - beta, V <= v, where v solves

.. math:: \binom{k + d - 1}{k} \sum_{i=0}^{k+d-1} \binom{N}{i} v^i (1 - v)^{N-i} = \beta

(Campi, Garatti, *A sampling-and-discarding approach to chance-constrained optimization*, JOTA 2011, theorem 2.1).
Samples of one motion are not independent; N is replaced by the number of independent samples that would average as
well, which is an approximation. The statement is about more of the same motion, not about other motions.
"""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array

CONFIDENCE = 0.95


def outside_at_most(samples: float, unknowns: int, left_out: int, confidence: float = CONFIDENCE) -> float:
    """Bound of the chance that one more sample falls outside; 1 where there are too few samples.

    Parameters
    ----------
    samples : independent ones, left-out ones included
    """
    from scipy.optimize import bisect
    from scipy.special import betainc, gammaln

    count, most = int(samples), left_out + unknowns - 1
    if most >= count:
        return 1.0
    # Number of ways, as a logarithm: (k + d - 1 choose k), for d unknowns and k left out.
    ways = gammaln(most + 1) - gammaln(left_out + 1) - gammaln(unknowns)

    def excess(v: float) -> float:
        # The sum is the chance of at most that many successes, an incomplete beta function; it may underflow to 0.
        with np.errstate(divide="ignore"):
            return float(ways + np.log(betainc(count - most, most + 1.0, 1.0 - v)) - np.log1p(-confidence))

    return float(bisect(excess, 0.0, 1.0)) if excess(1.0) < 0.0 else 1.0


def independent_samples(series: Sequence[Array]) -> float:
    """Number of independent samples whose mean varies as much as that of these series (one for each log).

    N / (1 + 2 sum rho_k), the autocorrelations summed over pairs of neighbouring lags as long as their sum is positive
    and falls (Geyer, *Practical Markov chain Monte Carlo*, 1992). The series' common mean is taken out.
    """
    mean = np.mean(np.concatenate(series))
    length = max(len(x) for x in series)
    size = 1 << (2 * length - 1).bit_length()
    covariance = np.zeros(length)
    for x in series:
        spectrum = np.fft.rfft(x - mean, size)
        covariance[: len(x)] += np.fft.irfft(spectrum * np.conj(spectrum), size)[: len(x)]
    total = sum(len(x) for x in series)
    if covariance[0] <= 0.0:
        return float(total)
    pairs = covariance[: length // 2 * 2].reshape(-1, 2).sum(axis=1) / covariance[0]
    falling = np.minimum.accumulate(pairs)
    stop = int(np.argmax(falling <= 0.0)) if np.any(falling <= 0.0) else len(falling)
    time = 2.0 * float(np.sum(falling[:stop])) - 1.0
    return float(total / max(time, 1.0))
