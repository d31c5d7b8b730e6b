import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modrob_cli.interval import Interval
from modrob_cli.io.single_precision import outward_triple, read_triple, restore_angle, shortest_decimal, twelfth_of_pi
from modrob_cli.schema.base import parse_angle

SINGLES = st.floats(width=32, allow_nan=False, allow_infinity=False)
NUMBERS = st.floats(-1e30, 1e30)


@pytest.mark.parametrize("number", [0.1013, -0.082, 5.23e-5, 3.9, 42799e-6, 0.0, 160.0, 1e-6])
def test_short_decimals_come_back_as_written(number: float) -> None:
    assert shortest_decimal(float(np.float32(number))) == number


@given(SINGLES)
def test_shortest_decimal_rounds_to_the_stored_value(value: float) -> None:
    assert float(np.float32(shortest_decimal(value))) == value


def test_twelfths_of_pi_are_what_their_text_says() -> None:
    for steps in range(-48, 49):
        angle, text = twelfth_of_pi(steps)
        assert parse_angle(text if steps else 0.0) == angle
        assert angle == pytest.approx(steps * math.pi / 12, rel=1e-15)


def test_twelfths_of_pi_survive_single_precision() -> None:
    for angle in (math.pi, -math.pi / 2, math.pi / 4, 3 * math.pi / 4, 2 * math.pi / 3, -math.pi / 12, 0.0):
        assert restore_angle(float(np.float32(angle))) == angle


def test_other_angles_are_left_alone() -> None:
    # the next single-precision number after pi/2 is 1.2e-7 away and means something else
    beside = float(np.nextafter(np.float32(math.pi / 2), np.float32(4)))
    assert restore_angle(beside) == shortest_decimal(beside)
    assert restore_angle(0.35) == shortest_decimal(0.35)


@given(NUMBERS, NUMBERS, NUMBERS)
def test_bounds_round_outward(a: float, b: float, c: float) -> None:
    low, nominal, high = sorted((a, b, c))
    triple = outward_triple(nominal, Interval(low, high))
    assert all(float(np.float32(value)) == value for value in triple)
    value, inf, sup = read_triple(*triple)
    assert inf <= low
    assert high <= sup
    assert inf <= value <= sup
    assert float(np.float32(value)) == float(np.float32(nominal))
    assert outward_triple(value, Interval(inf, sup)) == triple  # storing again changes nothing
    if low < high:  # at most one step of single precision is lost on either side
        assert float(np.nextafter(np.float32(inf), np.float32(np.inf))) > low
        assert float(np.nextafter(np.float32(sup), np.float32(-np.inf))) < high


@given(NUMBERS)
def test_exact_values_stay_inside(value: float) -> None:
    back, low, high = read_triple(*outward_triple(value, Interval(value)))
    assert low <= value <= high
    assert low <= back <= high


def test_decimals_stay_exact_and_other_doubles_get_bounds() -> None:
    assert read_triple(*outward_triple(0.1013, Interval(0.1013))) == (0.1013, 0.1013, 0.1013)
    _, low, high = read_triple(*outward_triple(1 / 3, Interval(1 / 3)))
    assert low < 1 / 3 < high
    # a single-precision number whose shortest decimal is another double
    stored = float(np.float32(0.1013))
    _, low, high = read_triple(*outward_triple(stored, Interval(stored)))
    assert low < stored < high
