"""Causal filters and the inclusion that they keep, against SciPy, closed forms and brute force."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from modrob_cli.collision.filters import SignalFilter
from modrob_cli.errors import NumericalError, ShapeError

RATE = 500.0
FILTERS = [
    SignalFilter(),
    SignalFilter("first-order", 1, 10.0),
    SignalFilter("first-order", 3, 10.0),
    *(SignalFilter("butterworth", order, 20.0) for order in range(1, 9)),
    SignalFilter("butterworth", 2, 0.5),
    SignalFilter("butterworth", 4, 200.0),
]


def switching(rng: np.random.Generator, samples: int, joints: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bounds that wander, and a signal that jumps between them."""
    lower = np.cumsum(rng.normal(size=(samples, joints)), axis=0)
    upper = lower + rng.uniform(0.0, 3.0, (samples, joints))
    holds = np.repeat(rng.random((samples, joints)).round()[:: int(rng.integers(1, 40))], 40, axis=0)[:samples]
    return lower, upper, lower + holds * (upper - lower)


@pytest.mark.parametrize("wanted", FILTERS, ids=str)
def test_no_signal_between_the_bounds_leaves_the_filtered_bounds(wanted: SignalFilter) -> None:
    """Random signals, most of them at an end; from the first sample on, with no tolerance."""
    rng = np.random.default_rng(5)
    running = wanted.at(RATE)
    for _ in range(20):
        lower, upper, x = switching(rng, 1200, 2)
        low, high = running.bounds(lower, upper)
        y = running.apply(x)
        assert (y >= low).all()
        assert (y <= high).all()


@pytest.mark.parametrize("wanted", FILTERS, ids=str)
def test_the_bounds_are_attained(wanted: SignalFilter) -> None:
    """The signal that follows the sign of the impulse response backwards from one sample reaches the bound there."""
    rng = np.random.default_rng(6)
    running = wanted.at(RATE)
    lower, upper, _ = switching(rng, 800, 1)
    at = 799
    back = np.sign(running.response[: at + 1])
    signs = np.zeros(800)
    signs[at - len(back) + 1 :] = back[::-1]
    worst = (0.5 * (lower + upper))[:, 0] + signs * (0.5 * (upper - lower))[:, 0]
    reached = running.apply(worst[:, None])[at, 0]
    high = running.bounds(lower, upper)[1][at, 0]
    # A slow filter still remembers the time before the first sample, where the signal must be constant.
    before = np.abs(running.response[at + 1 :]).sum() * (upper - lower)[0, 0]
    # The allowance for rounding is 1e-9 of the largest value, below 200 here.
    assert high - reached <= before + 1e-6


def test_the_published_way_is_left_by_a_torque_that_jumps() -> None:
    """Why bounds are not just filtered: a Butterworth filter overshoots.

    [S] III.B applies the filter of the measured current to both bounds. Bounds -1 and 1 stay -1 and 1. A torque that
    jumps from -1 to 1, both admissible, overshoots to 1.09 behind a Butterworth filter of order 2: a false alarm.
    """
    running = SignalFilter("butterworth", 2, 20.0).at(RATE)
    ends = np.ones((200, 1))
    step = np.where(np.arange(200)[:, None] < 50, -1.0, 1.0)
    filtered = running.apply(step)
    assert filtered.max() > running.apply(ends).max() + 0.08
    assert filtered.max() <= running.bounds(-ends, ends)[1].max()
    # A cascade of first-order stages cannot overshoot: there the published way is right.
    smooth = SignalFilter("first-order", 2, 20.0).at(RATE)
    assert smooth.apply(step).max() <= 1.0 + 1e-12
    assert np.allclose(smooth.bounds(-ends, ends)[1], 1.0, rtol=0, atol=1e-8)  # allowance for rounding


@pytest.mark.parametrize("order", range(1, 9))
def test_butterworth_is_scipys(order: int) -> None:
    x = np.random.default_rng(order).normal(size=(400, 3))
    x[0] = 0.0  # so that the signal before the first sample is the zero that SciPy starts with
    sections = butter(order, 20.0, fs=RATE, output="sos")
    wanted = SignalFilter("butterworth", order, 20.0).at(RATE).apply(x)
    assert np.allclose(wanted, sosfilt(sections, x, axis=0), rtol=0, atol=1e-12)  # rounding of two orders of sums


def test_first_order_is_the_exponential_average() -> None:
    x = np.random.default_rng(1).normal(size=200)
    a = 1.0 - np.exp(-2.0 * np.pi * 10.0 / RATE)
    y = [x[0]]
    for value in x[1:]:
        y.append(y[-1] + a * (value - y[-1]))
    assert np.allclose(SignalFilter("first-order", 1, 10.0).at(RATE).apply(x[:, None])[:, 0], y, rtol=0, atol=1e-13)


@pytest.mark.parametrize("wanted", FILTERS[1:], ids=str)
def test_the_rest_of_the_impulse_response_is_bounded(wanted: SignalFilter) -> None:
    """Five times as many samples, as SciPy's filter gives them, hold no more than the bound of the rest."""
    running = wanted.at(RATE)
    length = len(running.response)
    impulse = np.zeros(5 * length)
    impulse[0] = 1.0
    whole = sosfilt(running.sections, impulse)
    assert np.abs(whole[length:]).sum() <= running.rest <= 1e-11
    assert np.allclose(whole[:length], running.response, rtol=0, atol=1e-15)


def test_a_constant_stays_and_starts_without_a_transient() -> None:
    for wanted in FILTERS:
        assert np.allclose(wanted.at(RATE).apply(np.full((50, 1), 7.0)), 7.0, rtol=1e-11)  # gain 1 at rest


def test_causal() -> None:
    """What comes later changes nothing before."""
    rng = np.random.default_rng(2)
    x = rng.normal(size=(300, 1))
    changed = x.copy()
    changed[150:] += 5.0
    for wanted in FILTERS:
        running = wanted.at(RATE)
        assert np.array_equal(running.apply(x)[:150], running.apply(changed)[:150])


def test_refuses_what_does_not_fit() -> None:
    with pytest.raises(NumericalError, match="half the sampling rate, 250 Hz"):
        SignalFilter("butterworth", 2, 250.0).at(RATE)
    with pytest.raises(NumericalError, match="too low"):
        SignalFilter("butterworth", 2, 1e-6).at(RATE)
    with pytest.raises(ShapeError):
        SignalFilter("first-order", 1, 10.0).at(RATE).bounds(np.zeros((3, 2)), np.zeros((3, 1)))
