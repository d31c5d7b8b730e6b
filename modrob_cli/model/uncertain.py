"""A quantity with a nominal value and an interval that is known to hold the true one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import NumericalError
from modrob_cli.interval import Interval


@dataclass(frozen=True)
class Uncertain:
    """Nominal value and bounds, element by element, all of one shape.

    The interval is the promise: bounds of everything derived hold for every value inside it. The nominal value
    need not be its midpoint.
    """

    nominal: Array
    interval: Interval

    def __post_init__(self) -> None:
        """Check that the nominal value is a member."""
        if not np.all(self.interval.contains(self.nominal)):
            raise NumericalError("nominal value outside its interval")

    @classmethod
    def exact(cls, value: ArrayLike) -> "Uncertain":
        """A quantity that is known exactly."""
        nominal = np.asarray(value, dtype=float)
        return cls(frozen(nominal, nominal.shape), Interval(nominal))

    @classmethod
    def stack(cls, parts: "list[Uncertain]") -> "Uncertain":
        """Join quantities along a new first axis."""
        nominal = np.stack([part.nominal for part in parts])
        inf = np.stack([part.interval.inf for part in parts])
        sup = np.stack([part.interval.sup for part in parts])
        return cls(frozen(nominal, nominal.shape), Interval(inf, sup))

    @property
    def is_exact(self) -> bool:
        """True if no element has any width."""
        return bool(np.all(self.interval.is_degenerate))
