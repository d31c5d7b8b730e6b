"""Covariances of correlated residuals against closed forms for AR(1) noise, and Student's t of SciPy."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from modrob_cli.arrays import Array
from modrob_cli.identify.covariance import Timeline, correlations, covariance, effective_samples, quantile
from modrob_cli.identify.robust import robust_fit

COUNT = 4000


def ar1(pole: float, seed: int, count: int = COUNT) -> Array:
    """Noise of unit innovations; its mean has the variance 1 / (1 - pole)^2 / count."""
    driven = np.random.default_rng(seed).normal(size=count + 1000)
    return np.asarray(lfilter([1.0], [1.0, -pole], driven)[1000:])


def timeline(count: int, runs: int = 1) -> Timeline:
    length = count // runs
    index = np.tile(np.arange(length), runs)
    return Timeline(np.repeat(np.arange(runs), length), index, (length,) * runs, (100.0,) * runs)


@pytest.mark.parametrize("pole", [0.0, 0.8, 0.98])
@pytest.mark.parametrize("runs", [1, 4])
def test_standard_error_of_a_mean_of_correlated_noise(pole: float, runs: int) -> None:
    phi = np.ones((COUNT, 1))
    ratios = []
    for seed in range(60):
        x = ar1(pole, seed)
        fit = robust_fit(phi, x, robust=False)
        found = covariance(phi, fit.residual, fit.weights, timeline(COUNT, runs))
        exact = 1.0 / (1.0 - pole) / np.sqrt(COUNT)
        ratios.append(float(found.stderr[0]) ** 2 / exact**2)
    # The variance estimate is chi-square over its degrees of freedom, at least four of them; over 60 noises its mean
    # scatters by at most 9 %; strongly correlated noise in short runs is seen a little too narrow a band.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.27)


def test_t_intervals_of_a_mean_hold_it() -> None:
    """With 0.98 about 40 independent samples are left of 4000: normal quantiles would hold the truth in 88 %."""
    phi = np.ones((COUNT, 1))
    inside = []
    for seed in range(300):
        fit = robust_fit(phi, ar1(0.98, seed), robust=False)
        found = covariance(phi, fit.residual, fit.weights, timeline(COUNT))
        inside.append(abs(float(fit.values[0])) <= float(quantile(0.95, found.dof)[0] * found.stderr[0]))
    # Binomial: +-2.5 % is two standard deviations of 300 trials.
    assert 0.92 <= np.mean(inside) <= 0.985


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9])
def test_effective_samples_of_ar1(pole: float) -> None:
    found = np.mean([effective_samples(ar1(pole, seed), COUNT) for seed in range(20)])
    assert found == pytest.approx(COUNT * (1.0 - pole) / (1.0 + pole), rel=0.12)


def test_effective_samples_at_its_ends() -> None:
    assert effective_samples(np.zeros(10), 10) == 10.0
    assert effective_samples(np.full(1000, 3.0), 1000) == pytest.approx(1.0, abs=3.0)


def test_between_logs() -> None:
    """What differs from log to log but not within one shows in the scatter between logs only."""
    rng = np.random.default_rng(4)
    runs, length = 12, 300
    level = np.repeat(rng.normal(size=runs), length)
    phi = np.ones((runs * length, 1))
    fit = robust_fit(phi, level + 0.01 * rng.normal(size=runs * length), robust=False)
    found = covariance(phi, fit.residual, fit.weights, timeline(runs * length, runs))
    expected = np.std(level[::length], ddof=1) / np.sqrt(runs)
    assert found.stderr[0] == pytest.approx(expected, rel=0.02)
    assert found.dof[0] == pytest.approx(runs - 1.0)


def test_quantile_is_students() -> None:
    for confidence, dof in ((0.95, 4.0), (0.99, 17.5), (0.5, 200.0)):
        expected = student.ppf(0.5 + 0.5 * confidence, dof)
        assert float(quantile(confidence, np.array(dof))) == pytest.approx(expected, rel=1e-12)


def test_correlations() -> None:
    np.testing.assert_allclose(correlations(np.array([[4.0, -3.0], [-3.0, 9.0]])), [[1.0, -0.5], [-0.5, 1.0]])
    np.testing.assert_allclose(correlations(np.zeros((2, 2))), np.zeros((2, 2)))
