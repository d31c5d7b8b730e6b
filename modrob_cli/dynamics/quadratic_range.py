r"""Range of a quadratic function over a box of up to three variables, for many functions at once.

.. math:: f(x) = \sum_k b_k x_k + \sum_{k,l} Q_{kl} x_k x_l, \qquad |x_k| \le r_k.

The largest value is attained at a vertex, or at a stationary point of a face of some dimension: at most 27 candidates
for three variables. Each candidate is moved into the box, so it is the value at an admissible point.

Rounding. Only faces with a definite matrix matter (at an indefinite one the stationary point is a saddle), and for
these elimination without pivoting is backward stable. With an eigenvalue of at least 1e-7 of the matrix's size s the
stationary point is off by less than 1e7 * 20 * 2^-53 = 3e-8 of the box, and the value, which is flat there, by less
than 1e-15 s r^2, which the caller's margin covers. Where an eigenvalue may be smaller, the point may be wrong: along
that eigenvector the function is almost a straight line, so going to the face's border loses at most the eigenvalue
times the squared half-length. A bound of this is added (``slack``); the border may lose its own, so slacks add up
over the dimensions.
"""

from itertools import combinations, product

import numpy as np

from modrob_cli.arrays import Array

SINGULAR = 1e-7
_DET_ERROR = 32.0 * 2.0**-53
_ROOT = 3.0**0.5

_INDEX = {pair: n for n, pair in enumerate(((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))}


def entry(Q: Array, k: int, m: int) -> Array:
    """Entry k, m of symmetric matrices stored as six entries (6, T)."""
    return np.asarray(Q[_INDEX[min(k, m), max(k, m)]])


def quadratic_range(b: Array, Q: Array, r: Array) -> tuple[Array, Array]:
    """Smallest and largest value of f over the box, two arrays of shape (T,).

    Parameters
    ----------
    b : shape (3, T);  Q : entries xx, xy, xz, yy, yz, zz, shape (6, T)
    r : half-widths, shape (3,), >= 0; variables of half-width zero are left out
    """
    free = [k for k in range(3) if r[k] > 0.0]
    low = np.zeros(b.shape[1])
    high = np.zeros(b.shape[1])
    slack = np.zeros(b.shape[1])
    if not free:
        return low, high
    low, high = np.full_like(low, np.inf), np.full_like(high, -np.inf)
    for size in range(len(free) + 1):
        faces = list(combinations(free, size))
        slack += np.maximum.reduce([_slack(Q, face, r) for face in faces])
        for face in faces:
            held = [k for k in free if k not in face]
            for signs in product((-1.0, 1.0), repeat=len(held)):
                x = {k: np.full(b.shape[1], sign * r[k]) for k, sign in zip(held, signs, strict=True)}
                x.update(_stationary(b, Q, face, x, r))
                value = _value(b, Q, x)
                np.minimum(low, value, out=low)
                np.maximum(high, value, out=high)
    return low - slack, high + slack


def _value(b: Array, Q: Array, x: dict[int, Array]) -> Array:
    total = np.zeros(b.shape[1])
    for k, xk in x.items():
        slope = b[k].copy()
        for m, xm in x.items():
            slope += entry(Q, k, m) * xm
        total += slope * xk
    return total


def _stationary(b: Array, Q: Array, face: tuple[int, ...], held: dict[int, Array], r: Array) -> dict[int, Array]:
    """Stationary point of the free variables of a face, moved into the box."""
    rhs = []
    for k in face:
        g = b[k].copy()
        for m, xm in held.items():
            g += 2.0 * entry(Q, k, m) * xm
        rhs.append(-0.5 * g)
    x = _solve([[entry(Q, k, m) for m in face] for k in face], rhs)
    return {k: np.clip(np.nan_to_num(xk, nan=0.0), -r[k], r[k]) for k, xk in zip(face, x, strict=True)}


def _solve(A: list[list[Array]], rhs: list[Array]) -> list[Array]:
    """Solve symmetric systems of size up to three by L D L' without pivoting; non-finite where a pivot is zero."""
    size = len(rhs)
    rows = [[*row, value] for row, value in zip(A, rhs, strict=True)]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(size):
            for i in range(k + 1, size):
                factor = rows[i][k] / rows[k][k]
                rows[i] = [x - factor * y for x, y in zip(rows[i], rows[k], strict=True)]
        x: list[Array] = []
        for k in reversed(range(size)):
            known = sum((rows[k][size - 1 - m] * value for m, value in enumerate(x)), np.zeros_like(rhs[k]))
            x.append((rows[k][size] - known) / rows[k][k])
    return x[::-1]


def _cofactors(A: list[list[Array]]) -> tuple[Array, list[list[Array]]]:
    """Determinant and adjugate of symmetric matrices of size one to three."""
    if len(A) == 1:
        return A[0][0], [[np.ones_like(A[0][0])]]
    if len(A) == 2:
        det = A[0][0] * A[1][1] - A[0][1] * A[0][1]
        return det, [[A[1][1], -A[0][1]], [-A[0][1], A[0][0]]]
    (a, d, e), (_, b, f), (_, _, c) = A
    adj = [
        [b * c - f * f, e * f - d * c, d * f - e * b],
        [e * f - d * c, a * c - e * e, d * e - a * f],
        [d * f - e * b, d * e - a * f, a * b - d * d],
    ]
    return a * adj[0][0] + d * adj[1][0] + e * adj[2][0], adj


def _slack(Q: Array, face: tuple[int, ...], r: Array) -> Array:
    """What a wrong stationary point of a nearly singular face may cost; zero for the others.

    With s the Frobenius norm of the face's matrix and a that of its adjugate, the smallest eigenvalue is at least
    |det| / a, and at most sqrt(3) |det| / a and (for three variables) sqrt(3) a / s. The determinant is off by less
    than ``_DET_ERROR`` s^k, the adjugate by less than ``_DET_ERROR`` s^(k - 1).
    """
    count = len(face)
    if count < 2:
        return np.zeros(Q.shape[1])
    det, adj = _cofactors([[entry(Q, k, m) for m in face] for k in face])
    size = np.sqrt(sum(entry(Q, k, m) ** 2 for k in face for m in face))
    spread = np.sqrt(sum(item**2 for row in adj for item in row))
    error, blur = _DET_ERROR * size**count, _DET_ERROR * size ** (count - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(size > 0.0, (np.abs(det) - error) / (spread + blur), 0.0)
        most = np.where(spread > blur, _ROOT * (np.abs(det) + error) / (spread - blur), size)
        if count == 3:
            most = np.minimum(most, np.where(size > 0.0, _ROOT * (spread + blur) / size, 0.0))
    reach = float(sum(r[k] ** 2 for k in face))
    return np.where(least < SINGULAR * size, most * reach, 0.0)
