"""The complementarity problem of dry friction against the enumeration of all states."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError
from modrob_cli.simulate.box_problem import HIGH, INSIDE, LOW, solve_box_problem

VALUES = st.floats(-10.0, 10.0, allow_subnormal=False).map(lambda x: round(x, 3))
REACH = st.one_of(st.just(0.0), st.just(np.inf), st.floats(0.0, 10.0).map(lambda x: round(x, 3)))


@st.composite
def problems(draw: st.DrawFn) -> tuple[Array, Array, Array, Array]:
    """A positive definite A, and boxes of all kinds: no width, one end or both infinite, not around zero."""
    k = draw(st.integers(1, 4))
    B = np.array(draw(st.lists(VALUES, min_size=k * k, max_size=k * k))).reshape(k, k)
    A = B @ B.T + draw(st.sampled_from([1.0, 1e-2])) * np.eye(k)
    c = np.array(draw(st.lists(VALUES, min_size=k, max_size=k)))
    low = -np.array(draw(st.lists(REACH, min_size=k, max_size=k)))
    high = np.array(draw(st.lists(REACH, min_size=k, max_size=k)))
    shift = np.array(draw(st.lists(st.sampled_from([0.0, 0.0, 1.5]), min_size=k, max_size=k)))
    return A, c, low + shift, high + shift


def violation(A: Array, c: Array, low: Array, high: Array, x: Array) -> float:
    """How far x is from being a solution: of the natural map x = clip(x - A x - c)."""
    return float(np.abs(x - np.clip(x - (A @ x + c), low, high)).max())


def brute_force(A: Array, c: Array, low: Array, high: Array) -> Array:
    """The best of all 3^k states."""
    k = len(c)
    found = []
    for states in product((LOW, INSIDE, HIGH), repeat=k):
        x = np.array([{LOW: low[i], INSIDE: 0.0, HIGH: high[i]}[state] for i, state in enumerate(states)])
        if not np.isfinite(x).all():
            continue
        inside = [i for i, state in enumerate(states) if state == INSIDE]
        if inside:
            x[inside] = np.linalg.solve(A[np.ix_(inside, inside)], -(A @ x + c)[inside])
        found.append((violation(A, c, low, high, x), x))
    return min(found, key=lambda pair: pair[0])[1]


@given(problems())
@settings(max_examples=200)
def test_equals_the_enumeration_of_all_states(problem: tuple[Array, Array, Array, Array]) -> None:
    A, c, low, high = problem
    x, state = solve_box_problem(A, c, low, high)
    size = np.linalg.cond(A) * (1.0 + np.abs(x).max())
    # rounding of the linear systems
    assert np.abs(x - brute_force(A, c, low, high)).max() <= 1e-13 * size
    assert ((low <= x + 1e-12 * size) & (x - 1e-12 * size <= high)).all()
    ends = np.where(np.equal(state, LOW), low, high)
    assert np.array_equal(x[np.not_equal(state, INSIDE)], ends[np.not_equal(state, INSIDE)])


@given(problems(), st.lists(st.sampled_from([LOW, INSIDE, HIGH]), min_size=4, max_size=4))
@settings(max_examples=150)
def test_solutions_at_the_edge_of_two_states(problem: tuple[Array, Array, Array, Array], states: list[int]) -> None:
    # c is made so that x is the solution with g = 0 everywhere: every joint is exactly about to move
    A, _, low, high = problem
    ends = {LOW: np.maximum(low, -1e3), INSIDE: np.clip(0.0, low, high), HIGH: np.minimum(high, 1e3)}
    x = np.array([ends[state][i] for i, state in zip(range(len(low)), states, strict=False)])
    found, _ = solve_box_problem(A, -A @ x, low, high)
    assert np.abs(found - x).max() <= 1e-10 * np.linalg.cond(A) * (1.0 + np.abs(x).max())


def test_one_block_between_two_fingers() -> None:
    # x + c with |x| <= 2: holds, slides up, slides down
    one, two = np.eye(1), np.full(1, 2.0)
    cases = ((1.5, -1.5, INSIDE), (3.0, -2.0, LOW), (-3.0, 2.0, HIGH), (2.001, -2.0, LOW), (-2.001, 2.0, HIGH))
    for c, x, state in cases:
        found, states = solve_box_problem(one, np.array([c]), -two, two)
        assert found[0] == x
        assert states == [state]


def test_no_joint_at_all() -> None:
    x, states = solve_box_problem(np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0))
    assert x.shape == (0,)
    assert states == []


def test_many_joints() -> None:
    rng = np.random.default_rng(2)
    for k in (10, 20, 30):
        B = rng.normal(size=(k, k))
        A, c, reach = B @ B.T + 0.1 * np.eye(k), rng.normal(size=k), rng.uniform(0.0, 0.5, k)
        x, _ = solve_box_problem(A, c, -reach, reach)
        assert violation(A, c, -reach, reach, x) < 1e-9


def test_a_singular_matrix_is_named() -> None:
    with pytest.raises(NumericalError, match="inertias"):
        solve_box_problem(np.zeros((2, 2)), np.ones(2), -np.ones(2), np.ones(2))


def test_what_is_not_a_number_comes_out_as_such() -> None:
    x, _ = solve_box_problem(np.full((2, 2), np.nan), np.ones(2), -np.ones(2), np.ones(2))
    assert np.isnan(x).all()
