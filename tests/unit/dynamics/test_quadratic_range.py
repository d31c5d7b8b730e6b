"""Range of quadratics over boxes against rational arithmetic, well- and ill-conditioned."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.quadratic_range import quadratic_range

ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
Rational = list[Fraction]

SLACK = 1.1e-6
"""What nearly singular matrices of size near 1 may cost in a box of half-widths up to 1: sqrt(3) times an eigenvalue
(up to 1e-7) times a squared length of at most 3, once for faces of two and once of three
dimensions."""


def solve(A: list[Rational], b: Rational) -> Rational | None:
    """Gauss elimination in rationals; None if singular."""
    rows = [[*row, value] for row, value in zip(A, b, strict=True)]
    size = len(rows)
    for k in range(size):
        pivot = next((i for i in range(k, size) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [item / rows[k][k] for item in rows[k]]
        for i in range(size):
            if i != k:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[-1] for row in rows]


def exact_range(b: Array, Q: Array, r: Array) -> tuple[Fraction, Fraction]:
    """Smallest and largest value over the box, all in rationals: vertices and stationary points of all faces.

    A face with a singular matrix needs no point of its own: along its null direction the function is a straight
    line, so the same values are found on its border.
    """
    fb, fr = [Fraction(float(x)) for x in b], [Fraction(float(x)) for x in r]
    fQ = [[Fraction(0)] * 3 for _ in range(3)]
    for (i, j), number in zip(ENTRIES, Q, strict=True):
        fQ[i][j] = fQ[j][i] = Fraction(float(number))

    def value(x: Rational) -> Fraction:
        square = sum((x[i] * fQ[i][j] * x[j] for i in range(3) for j in range(3)), Fraction(0))
        return square + sum((fb[i] * x[i] for i in range(3)), Fraction(0))

    values = []
    for choice in product((-1, 0, 1), repeat=3):
        free = [k for k in range(3) if choice[k] == 0 and fr[k] > 0]
        x = [choice[k] * fr[k] for k in range(3)]
        if free:
            rhs = [-fb[k] - sum(2 * fQ[k][m] * x[m] for m in range(3)) for k in free]
            inner = solve([[2 * fQ[k][m] for m in free] for k in free], rhs)
            if inner is None or any(abs(item) > fr[k] for item, k in zip(inner, free, strict=True)):
                continue
            for item, k in zip(inner, free, strict=True):
                x[k] = item
        values.append(value(x))
    return min(values), max(values)


def matrix(rng: np.random.Generator, eigenvalues: tuple[float, float, float]) -> Array:
    U, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    full = U @ np.diag(eigenvalues) @ U.T
    full = 0.5 * (full + full.T)
    return np.array([full[i, j] for i, j in ENTRIES])


@pytest.mark.parametrize(
    "eigenvalues",
    [
        (1.0, 2.0, 3.0),
        (-1.0, -2.0, -3.0),
        (1.0, -2.0, 0.5),
        (1.0, 1.0, 0.0),
        (1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (-1.0, -1e-7, -1e-7),
        (-1.0, -1e-9, -1e-9),
        (-1.0, -1e-9, -1e-12),
        (-1.0, -1e-12, 1e-12),
        (-1.0, -1.0, -1e-10),
        (-1.0, -1e-16, -1e-16),
    ],
)
@pytest.mark.parametrize("slope", [1.0, 1e-8, 0.0])
def test_range_holds_the_exact_one_and_is_close(eigenvalues: tuple[float, float, float], slope: float) -> None:
    rng = np.random.default_rng(17)
    for _ in range(20):
        Q = matrix(rng, eigenvalues)
        b = slope * rng.normal(size=3)
        r = rng.choice([0.0, 0.3, 1.0], 3)
        low, high = quadratic_range(b[:, None], Q[:, None], r)
        exact_low, exact_high = exact_range(b, Q, r)
        # Rounding is the caller's margin: it allows more than 100 units of 2^-53 of the terms, which are below 12.
        rounding = 100 * 2.0**-53 * 12
        assert low[0] <= float(exact_low) + rounding
        assert high[0] >= float(exact_high) - rounding
        assert low[0] >= float(exact_low) - SLACK
        assert high[0] <= float(exact_high) + SLACK


def test_matrices_aligned_with_the_axes() -> None:
    """Interior, edge and vertex optima in closed form."""
    r = np.array([1.0, 2.0, 0.0])
    b = np.array([[1.0], [0.5], [7.0]])
    Q = np.array([-1.0, 0.0, 0.0, -0.01, 0.0, 5.0])[:, None]
    low, high = quadratic_range(b, Q, r)
    # x - x^2 over [-1, 1]: 1/4 at 1/2, -2 at -1;  y/2 - y^2/100 over [-2, 2]: 0.96 at 2, -1.04 at -2
    assert high[0] == pytest.approx(0.25 + 0.96, abs=1e-14)
    assert low[0] == pytest.approx(-2.0 - 1.04, abs=1e-14)


def test_no_free_variable_gives_zero() -> None:
    low, high = quadratic_range(np.ones((3, 2)), np.ones((6, 2)), np.zeros(3))
    assert low.tolist() == high.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    "eigenvalues", [(-1.0, -1e-6, -2e-8), (-1.0, -1e-7, -1e-7), (-1.0, -3e-8, -2e-8), (-1.0, -1e-3, -1e-7)]
)
def test_ill_conditioned_interior_optimum_is_not_missed(eigenvalues: tuple[float, float, float]) -> None:
    """The optimum is put inside the box on purpose, with a large part along the stiff direction."""
    rng = np.random.default_rng(23)
    r = np.ones(3)
    for _ in range(200):
        Q = matrix(rng, eigenvalues)
        full = np.zeros((3, 3))
        for (i, j), value in zip(ENTRIES, Q, strict=True):
            full[i, j] = full[j, i] = value
        b = -2.0 * full @ rng.uniform(-0.5, 0.5, 3)
        for sign in (1.0, -1.0):
            low, high = quadratic_range(sign * b[:, None], sign * Q[:, None], r)
            exact_low, exact_high = exact_range(sign * b, sign * Q, r)
            rounding = 100 * 2.0**-53 * 12  # the caller's margin, as above
            assert low[0] <= float(exact_low) + rounding
            assert high[0] >= float(exact_high) - rounding
            assert low[0] >= float(exact_low) - SLACK
            assert high[0] <= float(exact_high) + SLACK
