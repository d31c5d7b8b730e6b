"""Huber's estimate against SciPy's general minimiser, and what outliers may do."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from modrob_cli.errors import NumericalError
from modrob_cli.identify.robust import THRESHOLD, robust_fit, spread


def test_minimises_hubers_loss() -> None:
    rng = np.random.default_rng(1)
    phi = np.column_stack([np.ones(400), rng.normal(size=(400, 2)) * [1.0, 100.0]])
    target = phi @ [1.0, -2.0, 0.03] + rng.standard_t(2, size=400)
    found = robust_fit(phi, target)
    # At the solution the threshold is a fixed number; SciPy minimises the loss with that number.
    limit = THRESHOLD * spread(found.residual)
    reference = least_squares(lambda x: phi @ x - target, [0.0, 0.0, 0.0], loss="huber", f_scale=limit, xtol=1e-14)
    np.testing.assert_allclose(found.values, reference.x, rtol=1e-4)
    assert 0.0 < found.outliers < 0.2


def test_without_outliers_it_is_least_squares() -> None:
    rng = np.random.default_rng(2)
    phi = rng.normal(size=(200, 3))
    target = phi @ [1.0, 2.0, 3.0] + rng.uniform(-1.0, 1.0, 200)
    # Uniform noise never reaches three robust standard deviations.
    expected = np.linalg.lstsq(phi, target, rcond=None)[0]
    np.testing.assert_allclose(robust_fit(phi, target).values, expected, rtol=1e-12)
    np.testing.assert_allclose(robust_fit(phi, target, robust=False).values, expected, rtol=1e-12)


def test_a_tenth_of_gross_errors() -> None:
    rng = np.random.default_rng(3)
    phi = np.column_stack([np.ones(500), np.linspace(-1, 1, 500)])
    target = phi @ [1.0, 2.0] + 0.1 * rng.normal(size=500)
    target[rng.choice(500, 50, replace=False)] += 1e4
    # The influence of each outlier is bounded: 10 % of them shift the estimate by about 0.1 * 3 standard deviations.
    np.testing.assert_allclose(robust_fit(phi, target).values, [1.0, 2.0], rtol=0, atol=0.1)


def test_an_exact_fit_and_a_single_lie() -> None:
    phi = np.column_stack([np.ones(50), np.arange(50.0)])
    target = phi @ [1.0, 2.0]
    np.testing.assert_allclose(robust_fit(phi, target).values, [1.0, 2.0], rtol=1e-12)
    target[10] = 1e6
    # Reweighting stops when what most residuals leave is rounding.
    np.testing.assert_allclose(robust_fit(phi, target).values, [1.0, 2.0], rtol=0, atol=0.05)


def test_too_few_samples() -> None:
    with pytest.raises(NumericalError, match="do not determine"):
        robust_fit(np.ones((1, 2)), np.ones(1))
