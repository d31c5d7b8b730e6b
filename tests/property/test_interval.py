"""Interval operations against exact rationals: doubles are rationals, so the true results are known."""

import copy
import math
import pickle
import sys
from collections.abc import Callable
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval

MAX = sys.float_info.max
TINY = 5e-324
EDGES = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    TINY,
    -TINY,
    2.0**-1022,
    -(2.0**-1022),
    MAX,
    -MAX,
    1.0 + 2.0**-52,
    1.0 - 2.0**-53,
    0.1,
    3.0,
]

numbers = st.one_of(
    st.sampled_from(EDGES),
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(-10, 10),
    st.floats(-1e-300, 1e-300),
    st.integers(-(2**60), 2**60).map(float),
)


@st.composite
def intervals(draw: st.DrawFn) -> Interval:
    """Degenerate, one-ulp, and wide intervals."""
    low = draw(numbers)
    kind = draw(st.sampled_from(["point", "ulp", "wide"]))
    high = low if kind == "point" else math.nextafter(low, math.inf) if kind == "ulp" else draw(numbers)
    assume(math.isfinite(high))
    return Interval(min(low, high), max(low, high))


def members(box: Interval) -> list[Fraction]:
    """End points, midpoint and points between, exact."""
    low, high = Fraction(float(box.inf)), Fraction(float(box.sup))
    return [low + (high - low) * Fraction(k, 7) for k in (0, 2, 3, 7)]


def ends(box: Interval) -> tuple[float, float]:
    return float(box.inf), float(box.sup)


def holds(box: Interval, exact: Fraction) -> bool:
    low, high = float(box.inf), float(box.sup)
    return (low == -math.inf or Fraction(low) <= exact) and (high == math.inf or exact <= Fraction(high))


def steps(low: float, high: float, most: int) -> bool:
    """Whether ``high`` is at most this many doubles above ``low``."""
    for _ in range(most):
        low = math.nextafter(low, math.inf)
    return low >= high


BINARY: list[tuple[Callable[[Any, Any], Any], int]] = [
    (lambda a, b: a + b, 1),  # sums are correctly rounded on both sides: one double apart at most
    (lambda a, b: a - b, 1),
    (lambda a, b: a * b, 2),  # one step on each side
]


@pytest.mark.parametrize(("operation", "width"), BINARY, ids=["add", "subtract", "multiply"])
@settings(max_examples=400, deadline=None)
@given(a=intervals(), b=intervals())
def test_sums_and_products_contain_the_exact_results(
    operation: Callable[[Any, Any], Any], width: int, a: Interval, b: Interval
) -> None:
    found = operation(a, b)
    assert all(holds(found, operation(x, y)) for x, y in product(members(a), members(b)))
    if a.is_degenerate and b.is_degenerate:
        assert steps(float(found.inf), float(found.sup), width)
        exact = operation(members(a)[0], members(b)[0])
        if float(found.inf) == float(found.sup):
            assert Fraction(float(found.inf)) == exact


@settings(max_examples=400, deadline=None)
@given(a=intervals(), b=intervals())
def test_quotients(a: Interval, b: Interval) -> None:
    found = a / b
    if b.contains(0.0):
        assert ends(found) == (-math.inf, math.inf)
        return
    assert all(holds(found, x / y) for x, y in product(members(a), members(b)))
    if a.is_degenerate and b.is_degenerate:
        assert steps(float(found.inf), float(found.sup), 2)


@settings(max_examples=400, deadline=None)
@given(a=intervals())
def test_squares(a: Interval) -> None:
    found = a.sqr()
    assert all(holds(found, x * x) for x in members(a))
    assert found.inf >= 0.0
    assert (a * a).encloses(found)
    if a.contains(0.0):
        assert found.inf == 0.0
    if a.is_degenerate:
        assert steps(float(found.inf), float(found.sup), 2)


@settings(max_examples=200, deadline=None)
@given(parts=st.lists(intervals(), min_size=1, max_size=8))
def test_sums_over_an_axis(parts: list[Interval]) -> None:
    box = Interval([part.inf for part in parts], [part.sup for part in parts])
    found = box.sum()
    for k in range(4):
        assert holds(found, sum((members(part)[k] for part in parts), Fraction(0)))
    mixed = sum((members(part)[3 * (n % 2)] for n, part in enumerate(parts)), Fraction(0))
    assert holds(found, mixed)


def test_products_of_matrices_contain_the_exact_results() -> None:
    rng = np.random.default_rng(7)
    for _ in range(40):
        size = 10.0 ** rng.integers(-200, 150, size=(2, 3, 3))
        mid, rad = rng.normal(size=(2, 2, 3, 3)) * size
        A, B = (Interval(m - abs(r), m + abs(r)) for m, r in zip(mid, rad * rng.choice([0, 1e-16, 1]), strict=True))
        found, mixed = A @ B, A.mid @ B
        assert isinstance(mixed, Interval)
        for i, j in product(range(3), range(3)):
            for pick in ("inf", "sup", "mid"):
                left, right = getattr(A, pick), getattr(B, pick)
                exact = sum(Fraction(float(left[i, k])) * Fraction(float(right[k, j])) for k in range(3))
                assert holds(found[i, j], Fraction(exact))
                exact = sum(Fraction(float(A.mid[i, k])) * Fraction(float(right[k, j])) for k in range(3))
                assert holds(mixed[i, j], Fraction(exact))
    assert A.T.shape == (3, 3)
    assert (A.T.inf == A.inf.T).all()


def test_degenerate_matrix_product_is_narrow() -> None:
    # three products and two sums: at most 5 roundings of one ulp of the largest term on each side
    A, B = np.random.default_rng(8).uniform(0.5, 1.0, (2, 3, 3))
    found = Interval(A) @ Interval(B)
    assert (found.wid <= 10 * np.spacing(3.0)).all()


@settings(max_examples=300, deadline=None)
@given(a=intervals(), b=intervals())
def test_midpoint_radius_width_magnitude_hull(a: Interval, b: Interval) -> None:
    low, high = Fraction(float(a.inf)), Fraction(float(a.sup))
    middle = Fraction(float(a.mid))
    assert low <= middle <= high
    for value, exact in ((a.rad, max(middle - low, high - middle)), (a.wid, high - low)):
        assert float(value) == math.inf or Fraction(float(value)) >= exact
        assert float(value) == math.inf or steps(float(exact), float(value), 1)
    assert Fraction(float(a.mag)) == max(abs(low), abs(high))
    both = a.hull(b)
    assert both.encloses(a)
    assert both.encloses(b)
    assert ends(both) == (min(ends(a)[0], ends(b)[0]), max(ends(a)[1], ends(b)[1]))
    assert a.contains(a.mid)
    assert a.contains(a.inf)
    assert a.contains(a.sup)
    assert not a.contains(math.nan)
    outside = math.nextafter(float(a.sup), math.inf)
    assert not a.contains(outside)


@settings(max_examples=200, deadline=None)
@given(a=intervals(), margin=st.floats(0, MAX))
def test_widened_intervals_contain_the_exact_ends(a: Interval, margin: float) -> None:
    wide = a.widen(margin)
    assert holds(wide, Fraction(float(a.inf)) - Fraction(margin))
    assert holds(wide, Fraction(float(a.sup)) + Fraction(margin))


def test_overflow_keeps_a_finite_inner_bound() -> None:
    for box in (Interval(MAX) + MAX, Interval(MAX) * 2.0, Interval(MAX) / 0.5, Interval(MAX).sqr()):
        assert ends(box) == (MAX, math.inf)
    below = -Interval(MAX) * 2.0
    assert ends(below) == (-math.inf, -MAX)


def test_underflow_is_not_lost() -> None:
    for box in (Interval(TINY) * 0.5, Interval(TINY) / 3.0, Interval(TINY).sqr()):
        assert box.inf <= 0.0 < box.sup


def test_infinite_ends() -> None:
    ray, line = Interval(1.0, math.inf), Interval(-math.inf, math.inf)
    assert (ray + 1).sup == math.inf
    assert ends(ray * -1) == (-math.inf, -1.0)
    assert ends(ray * 0) == (0.0, 0.0)
    assert ends(ray - ray) == (-math.inf, math.inf)
    assert ends(1 / ray) == (0.0, 1.0)
    assert ends(ray / ray) == (0.0, math.inf)
    assert [line.mid, line.rad] == [0.0, math.inf]
    for box in (ray, -ray):
        assert math.isfinite(float(box.mid))
        assert box.contains(box.mid)
        assert box.rad == math.inf


@pytest.mark.parametrize(
    ("inf", "sup"),
    [(math.nan, None), (0.0, math.nan), (math.nan, 1.0), (1.0, 0.0), (math.inf, None), (-math.inf, -math.inf),
     ([0.0, 2.0], [1.0, 1.0])],
)  # fmt: skip
def test_what_is_no_interval_is_refused(inf: Any, sup: Any) -> None:
    with pytest.raises(NumericalError):
        Interval(inf, sup)


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ShapeError):
        Interval([0.0, 1.0], [1.0, 2.0, 3.0])


def test_immutable_and_independent_of_its_input() -> None:
    source = np.array([1.0, 2.0])
    box = Interval(source)
    source[0] = 9.0
    assert box.inf.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        box.inf[0] = 0.0
    with pytest.raises(AttributeError, match="immutable"):
        box.inf = source
    with pytest.raises(AttributeError, match="immutable"):
        del box.sup


def test_copies_and_pickles() -> None:
    box = Interval([1.0, 2.0], [3.0, 4.0])
    for twin in (copy.copy(box), copy.deepcopy(box), pickle.loads(pickle.dumps(box))):
        assert (twin.inf.tolist(), twin.sup.tolist()) == ([1.0, 2.0], [3.0, 4.0])


def test_numbers_and_arrays_on_the_left() -> None:
    box = Interval([1.0, 2.0], [2.0, 3.0])
    for left in (2.0, np.float64(2.0), np.array([2.0, 2.0]), [2.0, 2.0], 2):
        for found, low, high in (
            (left + box, [3, 4], [4, 5]),
            (left - box, [0, -1], [1, 0]),
            (left * box, [2, 4], [4, 6]),
        ):
            assert isinstance(found, Interval)
            assert found.encloses(Interval(low, high)).all()
            assert np.allclose([found.inf, found.sup], [low, high], rtol=1e-15)
