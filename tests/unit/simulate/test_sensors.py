"""Sensors: statistics of the noise, bounds that hold, quantisation, delay, time stamps."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.model.scenario import Channel, Sensors
from modrob_cli.simulate.sensors import SensorBank

PERIOD, SAMPLES, N = 2e-3, 20_000, 3
FACTOR = np.array([1.0, 0.5, -2.0])


def bank_of(sensors: Sensors, seed: int = 0, samples: int = SAMPLES) -> SensorBank:
    return SensorBank(sensors, PERIOD, samples, FACTOR, np.random.default_rng(seed))


def measured(bank: SensorBank, q: Array, dq: Array) -> tuple[Array, Array]:
    """What is measured of q, dq (K, n): (K, n) each."""
    rows = []
    for row in zip(q, dq, strict=True):
        bank.measure(*row)
        rows.append(bank.latest)
    first, second = zip(*rows, strict=True)
    return np.array(first), np.array(second)


def test_ideal_sensors_measure_the_truth() -> None:
    rng = np.random.default_rng(1)
    q, dq, tau = rng.normal(size=(3, 50, N))
    bank = bank_of(Sensors())
    found = measured(bank, q, dq)
    assert np.array_equal(found[0], q)
    assert np.array_equal(found[1], dq)
    assert np.array_equal(bank.measure_effort(tau), tau * FACTOR)
    assert not bank.jitter.any()


@pytest.mark.parametrize("joint_sizes", [False, True])
def test_gaussian_noise(joint_sizes: bool) -> None:
    sizes = (0.01, 0.02, 0.04) if joint_sizes else (0.02, 0.02, 0.02)
    channel = Channel(sizes if joint_sizes else 0.02)
    bank = bank_of(Sensors(position=channel, velocity=channel, effort=channel, jitter=1e-5))
    zero = np.zeros((SAMPLES, N))
    parts = [*measured(bank, zero, zero), bank.measure_effort(zero)]
    for part in parts:
        # 5 standard deviations of the estimates from 20000 numbers
        assert (np.abs(part.mean(axis=0)) < 5.0 * np.array(sizes) / np.sqrt(SAMPLES)).all()
        assert (np.abs(part.std(axis=0) / sizes - 1.0) < 5.0 / np.sqrt(2.0 * SAMPLES)).all()
        assert (np.abs(part) > 2.0 * np.array(sizes)).any()
    stacked = np.hstack(parts)
    assert np.abs(np.corrcoef(stacked.T) - np.eye(9)).max() < 5.0 / np.sqrt(SAMPLES)  # channels are independent
    assert np.abs(np.corrcoef(stacked[:-1].T, stacked[1:].T)[:9, 9:]).max() < 5.0 / np.sqrt(SAMPLES)  # white
    assert bank.jitter.std() == pytest.approx(1e-5, rel=5.0 / np.sqrt(2.0 * SAMPLES))


def test_uniform_noise_keeps_its_bound_and_fills_it() -> None:
    channel = Channel(0.02)
    bank = bank_of(Sensors(position=channel, velocity=channel, effort=channel, noise="uniform", jitter=1e-5))
    zero = np.zeros((SAMPLES, N))
    for part in (*measured(bank, zero, zero), bank.measure_effort(zero)):
        assert np.abs(part).max() <= 0.02
        assert np.abs(part).max() > 0.0199
        assert part.std() == pytest.approx(0.02 / np.sqrt(3.0), rel=0.02)
    assert 0.99e-5 < np.abs(bank.jitter).max() <= 1e-5


def test_noise_of_one_channel_does_not_change_another() -> None:
    zero = np.zeros((50, N))
    full = Sensors(position=Channel(0.1), velocity=Channel(0.1), effort=Channel(0.1), jitter=1e-4)
    first = bank_of(full, samples=50)
    second = bank_of(replace(full, position=Channel()), samples=50)
    assert measured(first, zero, zero)[1].tobytes() == measured(second, zero, zero)[1].tobytes()
    assert first.measure_effort(zero).tobytes() == second.measure_effort(zero).tobytes()
    assert first.jitter.tobytes() == second.jitter.tobytes()


def test_same_seed_same_bits() -> None:
    sensors = Sensors(position=Channel(0.1), velocity=Channel(0.1, 1e-3), jitter=1e-4, delay=0.003)
    zero = np.zeros((50, N))
    found = [measured(bank_of(sensors, seed, 50), zero, zero) for seed in (3, 3, 4)]
    assert found[0][0].tobytes() == found[1][0].tobytes()
    assert found[0][1].tobytes() == found[1][1].tobytes()
    assert found[0][0].tobytes() != found[2][0].tobytes()


@pytest.mark.parametrize("resolution", [0.01, (0.01, 0.0, 0.3)])
def test_quantisation(resolution: float | tuple[float, ...]) -> None:
    channel = Channel(0.0, resolution)
    bank = bank_of(Sensors(position=channel, velocity=channel, effort=channel), samples=500)
    q, dq, tau = np.random.default_rng(2).normal(size=(3, 500, N))
    steps = np.broadcast_to(np.array(resolution), (N,))
    pairs = [*zip((q, dq), measured(bank, q, dq), strict=True), (tau * FACTOR, bank.measure_effort(tau))]
    for true, found in pairs:
        for j, step in enumerate(steps.tolist()):
            if step == 0.0:
                assert np.array_equal(found[:, j], true[:, j])
                continue
            assert np.abs(found[:, j] - true[:, j]).max() <= 0.5 * step * (1.0 + 1e-12)
            whole = found[:, j] / step
            assert np.abs(whole - np.round(whole)).max() < 1e-9
            assert len(np.unique(found[:, j])) > 3


@pytest.mark.parametrize(
    ("delay", "samples"), [(0.0, 0), (1e-9, 0), (0.002, 1), (0.0020000001, 1), (0.0021, 2), (0.01, 5)]
)
def test_delay_counts_in_samples(delay: float, samples: int) -> None:
    bank = bank_of(Sensors(delay=delay), samples=30)
    for k in range(30):
        bank.measure(np.full(N, float(k)), np.full(N, -float(k)))
        q, dq = bank.delayed()
        assert q[0] == max(k - samples, 0)
        assert dq[0] == -max(k - samples, 0)
        assert bank.latest[0][0] == k


def test_differentiated_velocity() -> None:
    t = PERIOD * np.arange(200)
    q = np.sin(np.outer(t, [1.0, 2.0, 3.0]))
    dq = np.cos(np.outer(t, [1.0, 2.0, 3.0])) * [1.0, 2.0, 3.0]
    channel = Channel(1e-5, 1e-4)
    bank = bank_of(Sensors(position=channel, velocity_source="differentiated"), samples=200)
    found_q, found_dq = measured(bank, q, dq)
    assert np.array_equal(found_dq[0], dq[0])
    assert found_dq[1:] == pytest.approx(np.diff(found_q, axis=0) / PERIOD, abs=1e-12)
    assert np.abs(found_dq - dq).max() > 1e-3  # the noise of positions is in it


@pytest.mark.parametrize("noise", ["gaussian", "uniform"])
@pytest.mark.parametrize("jitter", [1e-4, 1e-2, 1.0])
def test_stamps_never_go_back(noise: str, jitter: float) -> None:
    bank = bank_of(Sensors(noise=noise, jitter=jitter))  # type: ignore[arg-type]
    stamps = PERIOD * np.arange(SAMPLES) + bank.jitter
    assert (np.diff(stamps) > 0.0).all()


def test_channels_for_another_number_of_joints_are_refused() -> None:
    for channel in (Channel((0.1, 0.1)), Channel(0.0, (0.1, 0.1))):
        with pytest.raises(UsageError, match="sensors: position: found 2 values for 3 joints"):
            bank_of(Sensors(position=channel))
