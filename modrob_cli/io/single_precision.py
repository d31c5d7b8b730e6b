"""Single-precision numbers on a module, and what they stand for when they are read back."""

import math

import numpy as np

from modrob_cli.interval import Interval

Triple = tuple[float, float, float]

_MAX_STEPS = 48
"""Angles are recognised up to 48 pi/12, two turns either way."""


def shortest_decimal(value: float) -> float:
    """The decimal number with the fewest digits that rounds to this single-precision value, as a double.

    A number that was written with at most 6 significant digits comes back as it was written.
    """
    return float(np.format_float_scientific(np.float32(value), unique=True))


def twelfth_of_pi(steps: int) -> tuple[float, str]:
    """The angle steps * pi/12 as a double and as text, the fraction reduced first (so that 6 steps give pi/2)."""
    if steps == 0:
        return 0.0, "0"
    divisor = math.gcd(steps, 12)
    top, bottom = abs(steps) // divisor, 12 // divisor
    text = ("-" if steps < 0 else "") + (f"{top}*" if top > 1 else "") + "pi" + (f"/{bottom}" if bottom > 1 else "")
    return math.copysign(top * math.pi / bottom, steps), text


def restore_angle(value: float) -> float:
    """An angle [rad]: the exact double of k pi/12 where single precision cannot tell the two apart.

    Without this, axes meant to be parallel would be so to 4e-8 only, and their common normal would be far away.
    """
    steps = round(value * 12 / math.pi)
    exact = twelfth_of_pi(steps)[0]
    if abs(steps) <= _MAX_STEPS and np.float32(exact) == np.float32(value):
        return exact
    return shortest_decimal(value)


def outward_triple(nominal: float, interval: Interval) -> Triple:
    """Nominal value and bounds in single precision, the bounds rounded outward.

    Equal numbers stand for a value that is exact, and only where :func:`shortest_decimal` gives back just that value;
    any other exact value gets bounds around it.
    """
    low, high = float(interval.inf), float(interval.sup)
    centre = float(np.float32(nominal)) + 0.0  # no negative zeros
    if low == high and shortest_decimal(centre) == nominal:
        return centre, centre, centre
    down, up = np.float32(low), np.float32(high)
    if float(down) > low or low == high == float(down):
        down = np.nextafter(down, np.float32(-np.inf))
    if float(up) < high or low == high == float(up):
        up = np.nextafter(up, np.float32(np.inf))
    return centre, float(down) + 0.0, float(up) + 0.0


def read_triple(nominal: float, low: float, high: float) -> tuple[float, float, float]:
    """Inverse of :func:`outward_triple`: nominal value and bounds as doubles, for low <= nominal <= high."""
    value = shortest_decimal(nominal)
    if low == high:
        return value, value, value
    return min(max(value, low), high), low, high
