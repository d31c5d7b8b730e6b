r"""Range of one quadratic function over a box, for functions that are linear in a few numbers: fast for few of them.

The functions s + b.z + z'Qz of variables in [-1, 1] are those of :mod:`modrob_cli.dynamics.quadratic_range`, with the
same candidates: vertices, and stationary points of edges, faces and the interior, moved into the box. There, candidates
are worked out one after the other over many samples; here, all candidates of one kind at once. What they need of
(s, b, Q) is linear, so the caller can fold it into a matrix of its own (:meth:`Faces.matrix`).

Round to nearest, without the proven allowance of the other module.
"""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from modrob_cli.arrays import Array


@dataclass(frozen=True)
class Faces:
    """Candidates for k variables, 0 to 3.

    A function is given by its features, a vector of length 1 + k + k (k + 1) / 2: s, b, and the upper triangle of Q row
    by row.

    Attributes
    ----------
    matrix : shape (features, columns); features times this are what :meth:`value_range` takes
    """

    k: int
    matrix: Array
    counts: tuple[int, ...]

    @classmethod
    def of(cls, k: int) -> "Faces":
        """Prepare for k variables."""
        blocks, counts = [], []
        for size in range(k + 1):
            found = [_face(k, free, signs) for free, signs in _faces(k, size)]
            counts.append(len(found))
            blocks += [np.stack(part, axis=1) for part in zip(*found, strict=True)]
        return cls(k, np.hstack(blocks), tuple(counts))

    def value_range(self, columns: Array) -> tuple[Array, Array]:
        """Smallest and largest value, shape (...), from ``features @ matrix`` of shape (..., columns)."""
        values, start = [], 0
        with np.errstate(divide="ignore", invalid="ignore"):
            for size, count in enumerate(self.counts):
                width = 1 + size + size * (size + 1) // 2
                parts = [columns[..., start + j * count : start + (j + 1) * count] for j in range(width)]
                values.append(_AT[size](*parts))
                start += width * count
        # a candidate without a value (a function that is flat in its variables) does not count
        found = np.concatenate(values, axis=-1)
        return np.fmin.reduce(found, axis=-1), np.fmax.reduce(found, axis=-1)


def _faces(k: int, size: int) -> list[tuple[tuple[int, ...], dict[int, float]]]:
    """Free variables and signs of the others, of all faces of one dimension."""
    out: list[tuple[tuple[int, ...], dict[int, float]]] = []
    for free in combinations(range(k), size):
        held = [i for i in range(k) if i not in free]
        out += [(free, dict(zip(held, signs, strict=True))) for signs in product((-1.0, 1.0), repeat=len(held))]
    return out


def _face(k: int, free: tuple[int, ...], held: dict[int, float]) -> list[Array]:
    """Features to value, slopes and upper triangle of Q on one face, a vector each."""
    place = {pair: 1 + k + n for n, pair in enumerate((i, j) for i in range(k) for j in range(i, k))}
    width = 1 + k + len(place)
    value = np.zeros(width)
    value[0] = 1.0
    slopes = {i: np.eye(width)[1 + i] for i in free}
    for i, sign in held.items():
        value[1 + i] += sign
        for j, other in held.items():
            value[place[min(i, j), max(i, j)]] += sign * other
        for j in free:
            slopes[j][place[min(i, j), max(i, j)]] += 2.0 * sign
    curves = [np.eye(width)[place[i, j]] for n, i in enumerate(free) for j in free[n:]]
    return [value, *slopes.values(), *curves]


def _clipped(x: Array) -> Array:
    return np.minimum(np.maximum(x, -1.0), 1.0)


def _vertex(f: Array) -> Array:
    return f


def _edge(f: Array, g: Array, a: Array) -> Array:
    x = _clipped(-0.5 * g / a)
    return np.asarray(f + x * (g + a * x))


def _side(f: Array, g: Array, h: Array, a: Array, c: Array, b: Array) -> Array:
    """Q = ((a, c), (c, b)); elimination without pivoting."""
    factor = c / a
    y = 0.5 * (factor * g - h) / (b - factor * c)
    x = _clipped(-(0.5 * g + c * y) / a)
    y = _clipped(y)
    return np.asarray(f + x * (g + a * x + 2.0 * c * y) + y * (h + b * y))


def _inside(
    f: Array, g: Array, h: Array, i: Array, a: Array, d: Array, e: Array, b: Array, k: Array, c: Array
) -> Array:
    """Q = ((a, d, e), (d, b, k), (e, k, c)); elimination without pivoting."""
    first, second = d / a, e / a
    bb, kk, cc = b - first * d, k - first * e, c - second * e
    hh, ii = h - first * g, i - second * g
    third = kk / bb
    z = -0.5 * (ii - third * hh) / (cc - third * kk)
    y = -(0.5 * hh + kk * z) / bb
    x = _clipped(-(0.5 * g + d * y + e * z) / a)
    y, z = _clipped(y), _clipped(z)
    return np.asarray(f + x * (g + a * x + 2.0 * (d * y + e * z)) + y * (h + b * y + 2.0 * k * z) + z * (i + c * z))


_AT = (_vertex, _edge, _side, _inside)
