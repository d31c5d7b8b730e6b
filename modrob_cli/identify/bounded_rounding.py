"""Numbers as a file shows them: a few decimal digits, on the safe side."""

from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Decimal

DIGITS = 6
"""Significant digits of the ends that are written."""

WIDTH_DIGITS = 3
"""At least so many of their difference."""


def outward(low: float, high: float) -> tuple[float, float]:
    """Ends with few digits, not above ``low`` and not below ``high``.

    Rounding a decimal to the nearest double keeps order, so the double of a decimal that is not above ``low`` is not
    above it either.
    """
    step = _step(max(abs(low), abs(high)), DIGITS)
    if high > low:
        step = min(step, _step(high - low, WIDTH_DIGITS))
    return _rounded(low, step, ROUND_FLOOR), _rounded(high, step, ROUND_CEILING)


def nearest(value: float) -> float:
    """The value with few digits."""
    return _rounded(value, _step(abs(value), DIGITS), ROUND_HALF_EVEN)


def _step(size: float, digits: int) -> Decimal:
    """Weight of the last of so many digits of numbers up to this size."""
    return Decimal(1).scaleb(Decimal(size).adjusted() - digits + 1) if size > 0.0 else Decimal(1)


def _rounded(value: float, step: Decimal, rounding: str) -> float:
    return float((Decimal(value) / step).to_integral_value(rounding) * step) + 0.0
