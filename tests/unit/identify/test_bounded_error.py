"""Bounded-error identification of one joint: what it promises, on samples with known truth and on arbitrary ones."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modrob_cli.arrays import Indices
from modrob_cli.identify.bounded_answers import PARSIMONY, Answers
from modrob_cli.identify.bounded_error import JointRequest, Spread, bound_joint
from modrob_cli.identify.bounded_reliability import independent_samples, outside_at_most
from modrob_cli.identify.bounded_rounding import DIGITS, nearest, outward
from modrob_cli.identify.bounded_samples import JointSamples
from modrob_cli.identify.bounded_velocity import narrowest_velocity_band
from tests.joint_samples import Truth, fourier_motion, random_samples, random_truth

SPREADS: tuple[Spread, ...] = ("disturbance", "least", "consistent")


def counted(samples: JointSamples, left_out: Indices) -> JointSamples:
    return samples.picked(np.setdiff1d(np.arange(len(samples)), left_out))


def test_consistent_intervals_hold_the_truth_in_every_run() -> None:
    rng = np.random.default_rng(10)
    for trial in range(60):
        truth = random_truth(rng)
        samples = random_samples(rng, truth, 400, rigid_width=(0.0, 0.5)[trial % 2])
        found = bound_joint(samples, JointRequest("consistent", truth.noise, details=False))
        assert found.agrees
        assert found.spread == "consistent"
        values = truth.values()
        assert np.all((found.ends[:, 0] <= values) & (values <= found.ends[:, 1])), (trial, found.ends, values)
        assert found.ends[3, 0] <= truth.offset - truth.noise
        assert found.ends[3, 1] >= truth.offset + truth.noise


def test_consistent_intervals_hold_the_truth_when_the_motion_is_noisy_too() -> None:
    rng = np.random.default_rng(11)
    for _ in range(20):
        truth = random_truth(rng)
        made = random_samples(rng, truth, 400)
        # The recorded motion is off by up to these; the torque is that of the true one.
        dq_noise, ddq_noise = 0.02, 0.3
        samples = replace(
            made,
            dq=made.dq + rng.uniform(-dq_noise, dq_noise, 400),
            ddq=made.ddq + rng.uniform(-ddq_noise, ddq_noise, 400),
            dq_noise=dq_noise,
            ddq_noise=ddq_noise,
        )
        found = bound_joint(samples, JointRequest("consistent", truth.noise, details=False))
        assert found.agrees
        values = truth.values()
        assert np.all((found.ends[:, 0] <= values) & (values <= found.ends[:, 1]))


def test_consistent_intervals_shrink_to_the_truth_with_more_samples() -> None:
    """With uniform noise the consistent set shrinks as 1 / N."""
    truth = Truth(5.0, 2.0, 0.4, 0.3, 0.5)
    widths = []
    for count in (100, 1000, 10000):
        rng = np.random.default_rng(12)
        dq, ddq = fourier_motion(rng, count)
        noise = truth.noise * rng.uniform(-1.0, 1.0, count)
        tau = truth.viscous * dq + truth.coulomb * np.sign(dq) + truth.armature * ddq + truth.offset + noise
        zero = np.zeros(count)
        samples = JointSamples(dq=dq, ddq=ddq, tau=tau, low=zero, high=zero, velocity_band=0.0)
        found = bound_joint(samples, JointRequest("consistent", truth.noise, details=False))
        widths.append(found.ends[:3, 1] - found.ends[:3, 0])
    assert np.all(widths[1] < 0.5 * widths[0])
    assert np.all(widths[2] < 0.5 * widths[1])


@pytest.mark.parametrize("spread", SPREADS)
def test_every_sample_lies_inside_in_every_run(spread: Spread) -> None:
    rng = np.random.default_rng(13)
    for trial in range(24):
        truth = random_truth(rng)
        samples = random_samples(rng, truth, 300, rigid_width=(0.0, 0.5)[trial % 2])
        noise, ratio = (0.0, truth.noise, 2.0 * truth.noise)[trial % 3], (1.0, 160.0)[trial % 2]
        request = JointRequest(spread, noise, gear_ratio=ratio, details=False)
        found = bound_joint(samples, request)
        assert np.all(samples.outside(found.ends.ravel()) <= 0.0)
        assert np.all(found.ends[:3] >= 0.0)
        assert np.all((found.ends[:, 0] <= found.nominal) & (found.nominal <= found.ends[:, 1]))
        # The rotor inertia at the motor that is written gives this armature.
        np.testing.assert_allclose(found.rotor * request.gear_ratio**2, found.ends[2], rtol=1e-14)


def test_no_other_intervals_make_the_bounds_narrower() -> None:
    """Random intervals around and far from the answer, each with the disturbance that closes them by definition."""
    rng = np.random.default_rng(14)
    for trial in range(10):
        samples = random_samples(rng, random_truth(rng), 300, rigid_width=(0.0, 0.5)[trial % 2])
        found = bound_joint(samples, JointRequest(details=False))
        for reach in (1e-3, 0.1, 1.0):
            for _ in range(30):
                other = found.ends * rng.uniform(1.0 - reach, 1.0 + reach, (4, 2))
                other[:3] = np.sort(np.maximum(other[:3], 0.0), axis=1)
                other[3] = 0.0
                lower, upper = samples.edges(other.ravel())
                high = np.max(samples.least_upper() - upper)
                low = np.min(samples.most_lower() - lower)
                other[3] = (low, high) if low <= high else (0.5 * (low + high),) * 2
                # Parsimony may cost its share; ends are written with six digits.
                assert found.mean_width <= samples.mean_width(other.ravel()) * (1.0 + PARSIMONY) + 1e-4


def test_the_ends_cannot_shrink() -> None:
    """Moving any end of an interval with a width inward by 3 % of it leaves a sample outside (1 % is rounding)."""
    rng = np.random.default_rng(15)
    for _ in range(20):
        samples = random_samples(rng, random_truth(rng), 300)
        found = bound_joint(samples, JointRequest(details=False))
        for k in range(4):
            for side, sign in enumerate((1.0, -1.0)):
                wide = found.ends[k, 1] - found.ends[k, 0]
                if wide <= 0.0:
                    continue
                ends = found.ends.copy()
                ends[k, side] += 0.03 * sign * wide
                assert np.any(samples.outside(ends.ravel()) > 0.0), (k, side)


def test_intervals_narrow_from_one_value_to_least_and_the_table_of_widths_says_where() -> None:
    """Viscous friction that varies between 4 and 6: the answer opens that interval and no other."""
    rng = np.random.default_rng(16)
    dq, ddq = fourier_motion(rng, 2000)
    tau = rng.uniform(4.0, 6.0, 2000) * dq + 2.0 * np.sign(dq) + 0.5 * ddq
    zero = np.zeros(2000)
    samples = JointSamples(dq=dq, ddq=ddq, tau=tau, low=zero, high=zero, velocity_band=0.0)
    found = bound_joint(samples, JointRequest())
    np.testing.assert_allclose(found.ends[0], [4.0, 6.0], atol=0.02)
    assert found.ends[3, 1] - found.ends[3, 0] < 0.02
    widths = found.widths
    assert widths["disturbance + viscous"] < 0.6 * widths["disturbance"]
    assert widths["disturbance + viscous"] == pytest.approx(
        widths["disturbance + viscous + coulomb + armature"], rel=0.01
    )
    one = bound_joint(samples, JointRequest(spread="disturbance"))
    assert np.all(one.ends[:3, 0] == one.ends[:3, 1])
    assert one.mean_width > found.mean_width


def test_glitches_are_left_out_and_nothing_else_is_needed() -> None:
    rng = np.random.default_rng(17)
    truth = Truth(5.0, 2.0, 0.4, 0.3, 0.2)
    for spread in SPREADS:
        samples = random_samples(rng, truth, 1000)
        hit = np.sort(rng.choice(1000, 12, replace=False))
        tau = samples.tau.copy()
        tau[hit] += 30.0 * rng.choice([-1.0, 1.0], 12)
        samples = replace(samples, tau=tau)
        found = bound_joint(samples, JointRequest(spread, truth.noise, outliers=20, details=False))
        assert set(hit) <= set(found.left_out)
        assert len(found.left_out) <= 20
        assert np.all(counted(samples, found.left_out).outside(found.ends.ravel()) <= 0.0)
        assert found.width_with_all > 5.0 * found.mean_width
        if spread == "consistent":
            # Once the noise explains the rest, no more samples are spent.
            assert set(found.left_out) == set(hit)
            assert np.all((found.ends[:, 0] <= truth.values()) & (truth.values() <= found.ends[:, 1]))


def test_samples_that_were_left_out_lie_outside() -> None:
    rng = np.random.default_rng(18)
    samples = random_samples(rng, random_truth(rng), 500)
    found = bound_joint(samples, JointRequest(outliers=15))
    assert len(found.left_out)
    assert np.all(samples.outside(found.ends.ravel())[found.left_out] > 0.0)


def test_a_noise_that_is_too_small_is_told() -> None:
    rng = np.random.default_rng(19)
    truth = Truth(5.0, 2.0, 0.4, 0.3, 1.0)
    samples = random_samples(rng, truth, 1000)
    found = bound_joint(samples, JointRequest("consistent", 0.1))
    assert found.agrees is False
    assert found.spread == "least"
    assert 0.8 < found.least_disturbance <= 1.0
    # The noise is part of the disturbance in any case.
    assert found.ends[3, 1] - found.ends[3, 0] >= 0.2


def test_joints_that_do_not_move_keep_their_own_values() -> None:
    rng = np.random.default_rng(20)
    own = np.array([[1.0, 2.0], [0.5, 0.6], [0.1, 0.2]])
    zero = np.zeros(50)
    still = JointSamples(dq=zero, ddq=zero, tau=rng.normal(size=50), low=zero, high=zero, velocity_band=0.01)
    found = bound_joint(still, JointRequest(own=own))
    assert found.kept == ("viscous", "coulomb", "armature")
    np.testing.assert_array_equal(found.ends[:3], own)
    assert np.all(still.outside(found.ends.ravel()) <= 0.0)
    trembling = replace(still, dq=rng.normal(size=50), ddq=rng.normal(size=50))
    assert bound_joint(trembling, JointRequest(own=own, moves=False)).kept == found.kept


def test_coulomb_friction_needs_both_directions() -> None:
    rng = np.random.default_rng(21)
    dq, ddq = fourier_motion(rng, 200)
    forward, zero = np.abs(dq) + 0.1, np.zeros(200)
    samples = JointSamples(dq=forward, ddq=ddq, tau=forward + 1.0, low=zero, high=zero, velocity_band=0.01)
    found = bound_joint(samples, JointRequest())
    assert found.kept == ("coulomb",)
    np.testing.assert_allclose(found.ends[0], 1.0, atol=1e-5)
    np.testing.assert_allclose(found.ends[3], 1.0, atol=1e-5)


finite = st.floats(-1e3, 1e3, allow_subnormal=False)


@settings(max_examples=40)
@given(
    st.lists(st.tuples(finite, finite, finite, st.floats(0.0, 10.0)), min_size=1, max_size=30),
    st.sampled_from(SPREADS),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([1e-6, 1.0, 1e6]),
)
def test_every_sample_lies_inside_for_any_samples(
    rows: list[tuple[float, float, float, float]], spread: Spread, noise: float, size: float
) -> None:
    dq, ddq, tau, width = np.array(rows).T
    samples = JointSamples(
        dq=dq, ddq=ddq, tau=tau * size, low=np.zeros(len(dq)), high=width * size, velocity_band=0.1
    )  # fmt: skip
    found = bound_joint(samples, JointRequest(spread, noise * size, details=False))
    assert np.all(samples.outside(found.ends.ravel()) <= 0.0)
    assert np.all(np.isfinite(found.ends))
    assert np.all(found.ends[:, 0] <= found.ends[:, 1])


@given(st.floats(-1e9, 1e9), st.floats(0.0, 1e9))
def test_rounding_goes_outward_and_not_far(low: float, width: float) -> None:
    high = low + width
    found = outward(low, high)
    assert Fraction(found[0]) <= Fraction(low)
    assert Fraction(found[1]) >= Fraction(high)
    size = max(abs(low), abs(high))
    # One step of the last digit at most at each end.
    assert found[1] - found[0] - (high - low) <= 2.0 * size * 10.0 ** (1 - DIGITS) * (1.0 + 1e-9)
    assert nearest(low) == pytest.approx(low, rel=10.0 ** (1 - DIGITS), abs=0.0)
    assert repr(nearest(low)) == repr(float(f"{low:.5e}")) or abs(low) == 0.0


def test_reliability_has_the_closed_form_without_samples_left_out() -> None:
    from scipy.stats import beta

    for samples, unknowns in ((1000, 5), (50, 8), (9, 8)):
        expected = beta.ppf(0.95, unknowns, samples - unknowns + 1)
        assert outside_at_most(samples, unknowns, 0) == pytest.approx(expected, rel=1e-9)
    assert outside_at_most(7, 8, 0) == 1.0
    assert outside_at_most(1000, 5, 10) > outside_at_most(1000, 5, 0)


def test_reliability_holds_on_independent_samples() -> None:
    """Least-width intervals of 200 samples: the chance of a later one outside exceeds its bound in few runs."""
    rng = np.random.default_rng(22)
    exceeded = 0
    for _ in range(60):
        truth = Truth(5.0, 2.0, 0.4, 0.3, 0.5)

        def made(count: int, truth: Truth = truth) -> JointSamples:
            dq, ddq, zero = rng.uniform(-2.0, 2.0, count), rng.uniform(-5.0, 5.0, count), np.zeros(count)
            tau = truth.viscous * dq + truth.coulomb * np.sign(dq) + truth.armature * ddq + rng.normal(0.0, 0.5, count)
            return JointSamples(dq=dq, ddq=ddq, tau=tau, low=zero, high=zero, velocity_band=0.0)

        ends = Answers(made(200), {}).least_width(frozenset(range(4))).ends
        outside = np.mean(made(5000).outside(ends) > 0.0)
        exceeded += int(outside > outside_at_most(200, 8, 0))
    # With a chance of at most 5 % each, more than 8 of 60 would come up once in 200 times.
    assert exceeded <= 8


def test_independent_samples_of_a_first_order_process() -> None:
    rng = np.random.default_rng(23)
    for memory in (0.0, 0.5, 0.9):
        x = rng.normal(size=40_000)
        for k in range(1, len(x)):
            x[k] += memory * x[k - 1]
        expected = 40_000 * (1.0 - memory) / (1.0 + memory)
        # The estimate of the correlation time itself varies by a few percent at this length.
        assert independent_samples([x[:25_000], x[25_000:]]) == pytest.approx(expected, rel=0.15)
    assert independent_samples([np.zeros(10)]) == 10.0


def test_the_narrowest_velocity_band_is_that_of_the_friction() -> None:
    """Friction whose sign turns over linearly within 0.2 rad/s: a band of about that size is the narrowest."""
    rng = np.random.default_rng(24)
    dq, ddq = fourier_motion(rng, 4000)
    dq *= 1.0 / np.sqrt(np.mean(dq**2))
    tau = 2.0 * dq + 5.0 * np.clip(dq / 0.2, -1.0, 1.0) + rng.uniform(-0.1, 0.1, 4000)
    zero = np.zeros(4000)
    samples = JointSamples(dq=dq, ddq=ddq, tau=tau, low=zero, high=zero, velocity_band=0.0)
    assert narrowest_velocity_band(samples, JointRequest()) in (0.14, 0.2)
