"""Drift and outliers of many logs, against SciPy, brute force and planted truth."""

import itertools
import statistics

import numpy as np
import pytest
from scipy.stats import kendalltau, norm, theilslopes

from modrob_cli.arrays import Array
from modrob_cli.workflows import fleet_statistics
from modrob_cli.workflows.fleet_statistics import Trend, high_outliers, low_outliers, significant, spread, trend


def found(t: Array, y: Array) -> Trend:
    out = trend(t, y)
    assert out is not None
    return out


def noise(n: int, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0.0, 300.0, n), rng.standard_t(3, n)


def test_slope_and_interval_are_those_of_scipy() -> None:
    t, y = noise(120, 1)
    y = y + 0.01 * t
    mine, theirs = found(t, y), theilslopes(y, t, 0.95)
    assert mine.slope == pytest.approx(theirs.slope, rel=1e-12)
    # SciPy takes the slopes of whole ranks around those of the interval, here they are interpolated: 7140 slopes.
    width = theirs.high_slope - theirs.low_slope
    assert mine.lower == pytest.approx(theirs.low_slope, abs=0.02 * width)
    assert mine.upper == pytest.approx(theirs.high_slope, abs=0.02 * width)


@pytest.mark.parametrize("ties", [False, True])
def test_p_value_is_that_of_kendalls_test_with_continuity(ties: bool) -> None:
    t, y = noise(60, 2)
    if ties:
        t, y = np.round(t / 40.0), np.round(y + 0.01 * t)
    pairs = itertools.combinations(range(60), 2)
    total = sum(np.sign(t[i] - t[j]) * np.sign(y[i] - y[j]) for i, j in pairs)
    score = norm.isf(kendalltau(t, y, method="asymptotic").pvalue / 2.0)  # of the sum without continuity correction
    assert found(t, y).p == pytest.approx(2.0 * norm.sf(score * (abs(total) - 1.0) / abs(total)), rel=1e-9)


def test_logs_of_one_time_make_no_pair() -> None:
    t = np.repeat([0.0, 1.0, 2.0], 8)
    y = np.random.default_rng(3).normal(size=24) + 5.0 * t
    slopes = [(y[i] - y[j]) / (t[i] - t[j]) for i, j in itertools.combinations(range(24), 2) if t[i] != t[j]]
    assert found(t, y).slope == pytest.approx(statistics.median(slopes), rel=1e-12)


def test_many_logs_take_a_part_of_the_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    t, y = noise(800, 4)
    whole = found(t, y)
    monkeypatch.setattr(fleet_statistics, "MOST_PAIRS", 60_000)
    part = found(t, y)
    assert part == found(t[::-1], y[::-1])  # the order in which they come does not matter, nor does chance
    width = whole.upper - whole.lower
    assert part.slope != whole.slope
    # A fifth of the pairs; the error of the median is far below its own uncertainty.
    assert [part.slope, part.lower, part.upper] == pytest.approx(
        [whole.slope, whole.lower, whole.upper], abs=0.1 * width
    )


def test_interval_holds_the_planted_slope() -> None:
    hits = 0
    for seed in range(300):
        t, y = noise(40, 1000 + seed)
        one = found(t, y + 0.02 * t)
        hits += one.lower <= 0.02 <= one.upper
    # 95 % of 300 is 285 with a standard deviation of 3.8; where neighbours look alike by chance the interval widens.
    assert 274 <= hits <= 297


def test_planted_drift_is_found_and_noise_is_not_called_one() -> None:
    t = np.arange(60.0)
    rng = np.random.default_rng(5)
    claims = sum(
        any(significant([found(t, rng.normal(size=60)).p_alike for _ in range(12)])) for _ in range(100)
    )  # tables of 12 trends
    assert claims <= 12  # 5 % of 100 is 5 with a standard deviation of 2.2
    missed = sum(not significant([found(t, rng.normal(size=60) + 0.04 * t).p_alike] + [0.5] * 11)[0] for _ in range(50))
    assert missed <= 2  # a drift of 2.4 standard deviations from first to last


def test_logs_in_a_row_that_are_alike_are_no_steady_drift() -> None:
    rng = np.random.default_rng(6)
    t, single, steady = np.arange(200.0), 0, 0
    for _ in range(100):
        wander = np.zeros(400)
        for k, step in enumerate(rng.normal(size=399)):
            wander[k + 1] = 0.6 * wander[k] + step
        one = found(t, wander[200:])
        single += one.p < 0.05
        steady += one.p_alike < 0.05
    assert single >= 20  # the plain test is wrong
    assert steady <= 14  # 5 of 100 with a standard deviation of 2.2, and some that this first-order rule misses


def test_step_is_a_change_but_no_steady_drift() -> None:
    rng = np.random.default_rng(7)
    step = found(np.arange(100.0), np.where(np.arange(100) < 50, 1.0, 2.0) + 0.02 * rng.normal(size=100))
    assert step.p < 1e-6
    assert step.p_alike > 0.01


def test_constant_values_do_not_drift() -> None:
    one = found(np.arange(20.0), np.full(20, 0.1))
    assert (one.slope, one.lower, one.upper, one.p, one.p_alike) == (0.0, 0.0, 0.0, 1.0, 1.0)


def test_too_few_logs_or_one_time_have_no_trend() -> None:
    t, y = noise(10, 8)
    assert trend(t, y) is not None
    assert trend(t[:9], y[:9]) is None
    assert trend(np.ones(10), y) is None
    y[3] = np.nan
    assert trend(t, y) is None
    assert trend(np.array([]), np.array([])) is None


def test_holm() -> None:
    # Adjusted by hand: 0.005 x 4 = 0.02, 0.01 x 3 = 0.03, 0.03 x 2 = 0.06, 0.04 x 1 -> 0.06.
    assert significant([0.01, 0.04, 0.03, 0.005]) == [True, False, False, True]
    assert significant([]) == []


def test_outliers_by_the_rule_in_plain_python() -> None:
    rng = np.random.default_rng(9)
    ratios = np.concatenate([np.exp(0.3 * rng.normal(size=200)), [8.0, 0.01, np.nan]])
    logs = [float(np.log(x)) for x in ratios if x == x]
    middle = statistics.median(logs)
    bound = np.exp(middle + 3.0 * 1.4826 * statistics.median([abs(x - middle) for x in logs]))
    assert np.array_equal(high_outliers(ratios), [x == x and x > bound for x in ratios])
    assert high_outliers(ratios)[200:].tolist() == [True, False, False]  # good ones and those without a value are none
    inside = np.concatenate([1.0 - 0.02 * rng.random(50), [0.5, np.nan]])
    assert np.flatnonzero(low_outliers(inside)).tolist() == [50]


def test_logs_that_are_alike_have_no_outliers() -> None:
    assert not high_outliers(0.1 * (1.0 + 1e-3 * np.arange(20.0))).any()
    assert high_outliers(np.array([0.1] * 15 + [0.2])).tolist() == [False] * 15 + [True]
    assert not low_outliers(np.array([1.0] * 15 + [0.99])).any()
    assert not high_outliers(np.array([0.1] * 8 + [9.0])).any()  # too few to tell


def test_spread() -> None:
    values = np.array([4.0, 1.0, np.nan, 3.0, 2.0, 5.0])
    one = spread(values)
    assert one is not None
    assert (one.count, one.least, one.lower, one.median, one.upper, one.largest) == (5, 1.0, 2.0, 3.0, 4.0, 5.0)
    assert spread(np.array([np.nan])) is None
