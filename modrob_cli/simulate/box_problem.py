r"""Forces within bounds that keep joints at rest as far as they can: the complementarity problem of dry friction."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError

LOW, INSIDE, HIGH = -1, 0, 1

_FAILED = "the friction forces at rest could not be found; are some inertias zero?"
_SLACK = 1e-12
"""Rounding of forces, and of the terms whose sum an acceleration is, relative to the largest."""


def solve_box_problem(A: Array, c: Array, low: Array, high: Array) -> tuple[Array, list[int]]:
    r"""Forces x within [low, high] and the accelerations g = A x + c that go with them.

    Where low < x < high there is no motion, g = 0; at the upper end the force does not suffice to hold, g <= 0; at the
    lower end g >= 0. For a symmetric positive definite A (the inverse of an inertia matrix) there is exactly one
    solution, which Murty's rule, "change the first that is wrong", reaches in finitely many steps (Judice, Pires,
    "Basic-set algorithm for a generalized linear complementarity problem", 1992).

    Parameters
    ----------
    A : shape (k, k);  c : shape (k,)
    low, high : shape (k,), low <= high; ends may be infinite

    Returns
    -------
    x : shape (k,)
    state : for each force :data:`LOW`, :data:`INSIDE` or :data:`HIGH`

    Raises
    ------
    NumericalError
        If A is singular, or rounding keeps the rule from an end. (NaN is no error and comes out as NaN.)
    """
    k = len(c)
    state, size = [INSIDE] * k, np.abs(A)
    for _ in range(4 * 3 ** min(k, 8)):
        x = np.where(np.equal(state, HIGH), high, low)
        inside = np.equal(state, INSIDE)
        x[inside] = 0.0
        if inside.any():
            x[inside] = _solved(A[np.ix_(inside, inside)], -(A @ x + c)[inside])
        slack = _SLACK * (size @ np.abs(x) + np.abs(c))
        wrong = _first_wrong(state, x, A @ x + c, slack, low, high)
        if wrong is None:
            return x, state
        state[wrong[0]] = wrong[1]
    raise NumericalError(_FAILED)


def _solved(A: Array, b: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(A, b))
    except np.linalg.LinAlgError as error:
        raise NumericalError(_FAILED) from error


def _first_wrong(state: list[int], x: Array, g: Array, slack: Array, low: Array, high: Array) -> tuple[int, int] | None:
    """First force that breaks a condition and the state it should have; None if all are right."""
    for i, now in enumerate(state):
        if now == INSIDE:
            reach = _SLACK * abs(x[i])
            if x[i] > high[i] + reach:
                return i, HIGH
            if x[i] < low[i] - reach:
                return i, LOW
        elif (now == HIGH and g[i] > slack[i]) or (now == LOW and g[i] < -slack[i]):
            return i, INSIDE
    return None
