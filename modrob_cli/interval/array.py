"""Arrays of closed intervals with outward rounding."""

from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import rounding

Pairwise = Callable[[Array, Array], tuple[Array, Array]]


class Interval:
    """An array of closed real intervals [inf, sup]; immutable.

    Every operation encloses the exact real result for all members of its operands: the end points are rounded
    outward (see :mod:`modrob_cli.interval.rounding`). Shapes broadcast as in NumPy.

    Parameters
    ----------
    inf, sup : array_like of one shape (or broadcastable), inf <= sup, no NaN; infinite end points are allowed, but
        an interval of nothing but infinity is not. With ``sup`` left out the intervals are degenerate (points).

    Raises
    ------
    ShapeError
        If the two shapes do not broadcast.
    NumericalError
        If an end point is NaN, or inf > sup, or an interval holds no real number, somewhere.
    """

    __slots__ = ("inf", "sup")
    __array_ufunc__ = None  # makes ``ndarray op Interval`` call Interval's reflected operator

    inf: Array
    sup: Array

    def __init__(self, inf: ArrayLike, sup: ArrayLike | None = None) -> None:
        lower = np.asarray(inf, dtype=float)
        upper = lower if sup is None else np.asarray(sup, dtype=float)
        if lower.shape != upper.shape:
            lower, upper = _broadcast(lower, upper)
        if not np.all((lower <= upper) & (lower < np.inf) & (upper > -np.inf)):  # also false for NaN
            raise NumericalError("an interval needs inf <= sup, no NaN, and a real number in it")
        lower, upper = lower.copy(), upper.copy()
        lower.setflags(write=False)
        upper.setflags(write=False)
        object.__setattr__(self, "inf", lower)
        object.__setattr__(self, "sup", upper)

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse: intervals are immutable."""
        raise AttributeError(f"Interval is immutable: {name}")

    def __delattr__(self, name: str) -> None:
        """Refuse: intervals are immutable."""
        raise AttributeError(f"Interval is immutable: {name}")

    def __reduce__(self) -> tuple[type["Interval"], tuple[Array, Array]]:
        """Copy and pickle through the constructor."""
        return Interval, (self.inf, self.sup)

    @classmethod
    def _of_ends(cls, inf: ArrayLike, sup: ArrayLike) -> "Interval":
        """From end points that an operation of this class has made, which need no check and no copy."""
        out = object.__new__(cls)
        for name, end in (("inf", np.asarray(inf)), ("sup", np.asarray(sup))):
            end.setflags(write=False)
            object.__setattr__(out, name, end)
        return out

    @classmethod
    def of(cls, value: "Interval | ArrayLike") -> "Interval":
        """Return ``value`` itself if it is an Interval, else the degenerate interval of it."""
        return value if isinstance(value, Interval) else cls(value)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.inf.shape

    @property
    def mid(self) -> Array:
        """Midpoint, rounded to nearest; always a finite member (0 for the whole line, the largest double of a ray)."""
        largest = np.finfo(float).max
        with np.errstate(invalid="ignore", under="ignore"):
            middle = 0.5 * self.inf + 0.5 * self.sup
        middle = np.clip(np.where(np.isnan(middle), 0.0, middle), -largest, largest)
        return np.clip(middle, self.inf, self.sup)

    @property
    def rad(self) -> Array:
        """Radius about ``mid``, rounded up: mid - rad <= inf and sup <= mid + rad hold exactly."""
        middle = self.mid
        return np.maximum(rounding.add(middle, -self.inf)[1], rounding.add(self.sup, -middle)[1])

    @property
    def wid(self) -> Array:
        """Width, rounded up."""
        return rounding.add(self.sup, -self.inf)[1]

    @property
    def mag(self) -> Array:
        """Largest absolute value of a member."""
        return np.maximum(np.abs(self.inf), np.abs(self.sup))

    @property
    def is_degenerate(self) -> Array:
        """True where the interval is a single point."""
        return np.asarray(self.inf == self.sup)

    def contains(self, value: ArrayLike) -> Array:
        """True where the value lies inside."""
        value = np.asarray(value, dtype=float)
        return np.asarray((self.inf <= value) & (value <= self.sup))

    def encloses(self, other: "Interval | ArrayLike") -> Array:
        """True where all of ``other`` lies inside."""
        other = Interval.of(other)
        return np.asarray((self.inf <= other.inf) & (other.sup <= self.sup))

    def hull(self, other: "Interval | ArrayLike") -> "Interval":
        """Smallest interval that holds both."""
        other = Interval.of(other)
        return Interval(np.minimum(self.inf, other.inf), np.maximum(self.sup, other.sup))

    def widen(self, margin: ArrayLike) -> "Interval":
        """Both ends moved outward by ``margin`` >= 0, rounded outward."""
        margin = np.asarray(margin, dtype=float)
        return Interval(rounding.add(self.inf, -margin)[0], rounding.add(self.sup, margin)[1])

    def __getitem__(self, key: Any) -> "Interval":
        """Index or slice as an ndarray."""
        return Interval._of_ends(self.inf[key], self.sup[key])

    def __len__(self) -> int:
        """Length of the first axis."""
        return len(self.inf)

    def __neg__(self) -> "Interval":
        """Exact negation."""
        return Interval._of_ends(-self.sup, -self.inf)

    def __pos__(self) -> Self:
        """Return itself."""
        return self

    def __add__(self, other: "Interval | ArrayLike") -> "Interval":
        """Sum."""
        other = Interval.of(other)
        return Interval._of_ends(rounding.add(self.inf, other.inf)[0], rounding.add(self.sup, other.sup)[1])

    __radd__ = __add__

    def __sub__(self, other: "Interval | ArrayLike") -> "Interval":
        """Difference of independent members."""
        return self + (-Interval.of(other))

    def __rsub__(self, other: ArrayLike) -> "Interval":
        """Difference with a number."""
        return Interval.of(other) - self

    def __mul__(self, other: "Interval | ArrayLike") -> "Interval":
        """Product of independent members."""
        return _over_ends(self, Interval.of(other), rounding.multiply)

    __rmul__ = __mul__

    def __truediv__(self, other: "Interval | ArrayLike") -> "Interval":
        """Quotient; the whole line where the divisor contains zero."""
        other = Interval.of(other)
        singular = other.contains(0.0)
        safe = Interval(np.where(singular, 1.0, other.inf), np.where(singular, 1.0, other.sup))
        out = _over_ends(self, safe, rounding.divide)
        return Interval(np.where(singular, -np.inf, out.inf), np.where(singular, np.inf, out.sup))

    def __rtruediv__(self, other: ArrayLike) -> "Interval":
        """Quotient of a number."""
        return Interval.of(other) / self

    def sqr(self) -> "Interval":
        """Square; non-negative, and narrower than the product of two independent members."""
        low = np.where(self.contains(0.0), 0.0, np.minimum(np.abs(self.inf), np.abs(self.sup)))
        down = np.maximum(rounding.multiply(low, low)[0], 0.0)
        return Interval(down, rounding.multiply(self.mag, self.mag)[1])

    def sum(self, axis: int = -1) -> "Interval":
        """Sum over one axis, rounded outward at each addition."""
        parts = range(self.inf.shape[axis])
        total = Interval(np.zeros(np.delete(self.shape, axis)))
        for k in parts:
            total = total + Interval._of_ends(self.inf.take(k, axis), self.sup.take(k, axis))
        return total

    def __matmul__(self, other: "Interval | ArrayLike") -> "Interval":
        """Product of two matrices of intervals, (..., m, k) @ (..., k, n)."""
        other = Interval.of(other)
        return (self.reshape_last(1) * other[..., None, :, :]).sum(axis=-2)

    def __rmatmul__(self, other: ArrayLike) -> "Interval":
        """Product of a matrix of numbers with a matrix of intervals."""
        return Interval.of(other) @ self

    def reshape_last(self, new_axes: int) -> "Interval":
        """Append ``new_axes`` axes of length one."""
        shape = self.shape + (1,) * new_axes
        return Interval._of_ends(self.inf.reshape(shape), self.sup.reshape(shape))

    @property
    def T(self) -> "Interval":  # noqa: N802 - NumPy's name
        """Transpose of the last two axes."""
        return Interval._of_ends(np.swapaxes(self.inf, -1, -2), np.swapaxes(self.sup, -1, -2))

    def __repr__(self) -> str:
        """Show both ends."""
        return f"Interval({self.inf.tolist()!r}, {self.sup.tolist()!r})"


def _broadcast(lower: Array, upper: Array) -> tuple[Array, Array]:
    try:
        lower, upper = np.broadcast_arrays(lower, upper)
    except ValueError as error:
        raise ShapeError(f"interval end points of shapes {lower.shape} and {upper.shape}") from error
    return lower, upper


def _over_ends(a: Interval, b: Interval, operation: Pairwise) -> Interval:
    """Hull of an operation that is monotone in each operand over the four pairs of end points."""
    pairs = [operation(x, y) for x in (a.inf, a.sup) for y in (b.inf, b.sup)]
    inf = np.minimum.reduce([down for down, _ in pairs])
    sup = np.maximum.reduce([up for _, up in pairs])
    return Interval._of_ends(inf, sup)
