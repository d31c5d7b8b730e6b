"""The choice of the cut-off on motions of known bandwidth, and the noise that the low-pass leaves."""

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.identify.signal_cutoff import choose_cutoff, motion_noise
from modrob_cli.identify.signals import prepare
from modrob_cli.model.log import JointLog


def make_log(q: Array, rate: float, dq: Array | None = None) -> JointLog:
    t = np.arange(len(q)) / rate
    return JointLog("log", tuple(f"j{k}" for k in range(q.shape[1])), t, q, dq, np.zeros_like(q))


@pytest.mark.parametrize("recorded", [False, True])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_five_times_the_bandwidth(recorded: bool, noise: float) -> None:
    rate = 500.0
    t = np.arange(0.0, 20.0, 1.0 / rate)
    w = 2.0 * np.pi * np.array([2.0, 2.5, 3.0])
    q = np.sin(t[:, None] * w) + noise * np.random.default_rng(1).normal(size=(len(t), 3))
    dq = w * np.cos(t[:, None] * w) if recorded else None
    found = choose_cutoff(make_log(q, rate, dq))
    # Eight half-overlapping windows over 20 s resolve 0.22 Hz, and a Hann window is two such bins wide.
    np.testing.assert_allclose(found.bandwidth, [2.0, 2.5, 3.0], rtol=0, atol=0.5)
    assert found.cutoff == pytest.approx(12.5, abs=2.5)
    assert "99.9%" in found.reason


def test_limits_of_the_choice() -> None:
    t = np.arange(0.0, 20.0, 0.002)
    slow, fast = np.sin(0.5 * t)[:, None], np.sin(2 * np.pi * 30.0 * t)[:, None]
    assert choose_cutoff(make_log(slow, 500.0)).cutoff == 5.0
    assert choose_cutoff(make_log(fast, 500.0)).cutoff == 40.0
    assert choose_cutoff(make_log(slow[::40], 12.5)).cutoff == pytest.approx(12.5 / 4)
    assert choose_cutoff(make_log(np.zeros_like(slow), 500.0)).cutoff == 5.0


def test_one_noisy_encoder_does_not_decide() -> None:
    t = np.arange(0.0, 20.0, 0.002)
    q = np.sin(2.0 * np.pi * 2.0 * t)[:, None] * np.ones(5)
    q[:, 4] += 0.05 * np.random.default_rng(2).normal(size=len(t))
    assert choose_cutoff(make_log(q, 500.0)).cutoff == pytest.approx(10.0, abs=2.5)


@pytest.mark.parametrize("recorded", [False, True])
def test_noise_that_the_low_pass_leaves(recorded: bool) -> None:
    rate, cutoff = 500.0, 12.0
    t = np.arange(0.0, 60.0, 1.0 / rate)
    rng = np.random.default_rng(3)
    q, dq = np.sin(t)[:, None], np.cos(t)[:, None]
    noisy_q = q + 1e-4 * rng.normal(size=q.shape)
    noisy_dq = dq + 1e-2 * rng.normal(size=q.shape) if recorded else None
    log = make_log(noisy_q, rate, noisy_dq)
    signals = prepare(log, cutoff)
    left = [(signals.dq - dq)[signals.used], (signals.ddq + q)[signals.used]]
    for mine, error in zip(motion_noise(log, cutoff), left, strict=True):
        # About 1400 independent samples pass the filter in 60 s: a standard deviation is known to 2 %.
        assert mine[0] == pytest.approx(float(np.sqrt(np.mean(error**2))), rel=0.1)
