"""Small parts of time scaling: positive parts of quadratics, unions of intervals, the published split."""

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.scaling.feasible import joined_up
from modrob_cli.scaling.forbidden import positive_parts, uncovered
from modrob_cli.scaling.sampled import common, gaps
from modrob_cli.scaling.speed_limits import allowed


def parts_of(A: float, B: float, C: float, low: float = 0.0, high: float = 5.0) -> list[tuple[float, float]]:
    start, end, _ = positive_parts(*(np.array([x]) for x in (A, B, C, low, high)))
    return sorted(zip(start.tolist(), end.tolist(), strict=True))


@pytest.mark.parametrize(
    ("A", "B", "C", "expected"),
    [
        (-1.0, 3.0, -1.0, [(0.38196601125010515, 2.618033988749895)]),  # the case that the published rule leaves out
        (1.0, -3.0, 2.0, [(0.0, 1.0), (2.0, 5.0)]),
        (1.0, 0.0, 1.0, [(0.0, 5.0)]),
        (-1.0, 0.0, -1.0, []),
        (0.0, 2.0, -4.0, [(2.0, 5.0)]),
        (0.0, -2.0, 4.0, [(0.0, 2.0)]),
        (0.0, 0.0, 1.0, [(0.0, 5.0)]),
        (0.0, 0.0, 0.0, []),
        (0.0, 0.0, -1.0, []),
        (1e-30, 1.0, -3.0, [(3.0, 5.0)]),  # no cancellation
    ],
)
def test_positive_parts(A: float, B: float, C: float, expected: list[tuple[float, float]]) -> None:
    assert np.allclose(parts_of(A, B, C), expected, rtol=1e-14, atol=0.0)


def test_positive_parts_of_random_quadratics() -> None:
    """Signs on a fine grid."""
    rng = np.random.default_rng(0)
    A, B, C = rng.normal(size=(3, 300)) * rng.choice([0.0, 1.0, 1e-3], (3, 300))
    start, end, owner = positive_parts(A, B, C, np.zeros(300), np.full(300, 4.0))
    c = np.linspace(0.0, 4.0, 401)[1:-1] + 1e-5
    for k in range(300):
        inside = np.zeros(len(c), dtype=bool)
        for a, b in zip(start[owner == k], end[owner == k], strict=True):
            inside |= (c > a) & (c < b)
        value: Array = (A[k] * c + B[k]) * c + C[k]
        clear = np.abs(value) > 1e-12
        assert (inside[clear] == (value > 0.0)[clear]).all()


def test_unions_of_intervals() -> None:
    assert uncovered(np.array([3.0, 1.0]), np.array([4.0, 2.0]), 0.0, 5.0) == [(0.0, 1.0), (2.0, 3.0), (4.0, 5.0)]
    assert uncovered(np.empty(0), np.empty(0), 0.0, 5.0) == [(0.0, 5.0)]
    assert joined_up([(2.0, 3.0), (0.0, 1.0), (1.0, 2.0)]) == [(0.0, 3.0)]
    assert common([(0.0, 2.0), (3.0, 4.0)], [(1.0, 3.5)]) == [(1.0, 2.0), (3.0, 3.5)]
    assert gaps([(0.5, 1.0), (2.0, 3.0)], 0.1) == [(0.1, 0.5), (1.0, 2.0)]
    assert gaps([(0.1, 1.0)], 0.1) == []


def test_factors_that_speed_limits_allow() -> None:
    assert allowed(-8.0, -1.0, 3) == pytest.approx(2.0)
    assert allowed(-8.0, -1.0, 3) <= 2.0
    assert allowed(-8.0, 1.0, 3) == np.inf
    assert allowed(8.0, 0.0, 1) == np.inf
