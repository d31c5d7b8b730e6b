"""Noise and quantisation with a size for each joint."""

import numpy as np

from modrob_cli.model.scenario import Channel, Sensors
from modrob_cli.simulate.sensors import SensorBank


def bank(sensors: Sensors, samples: int = 4000) -> SensorBank:
    return SensorBank(sensors, 1e-3, samples, np.array([1.0, 10.0]), np.random.default_rng(5))


def test_each_joint_has_its_own_noise() -> None:
    sensors = Sensors(position=Channel(noise=(0.1, 0.0)), velocity=Channel(noise=0.2), effort=Channel(noise=(0.0, 3.0)))
    measured = bank(sensors)
    rows = []
    for _ in range(4000):
        measured.measure(np.zeros(2), np.zeros(2))
        rows.append(measured.latest)
    deviation = [*np.std(rows, axis=0), np.std(measured.measure_effort(np.zeros((4000, 2))), axis=0)]
    wanted = np.array([[0.1, 0.0], [0.2, 0.2], [0.0, 3.0]])
    # The standard deviation of 4000 normal numbers scatters by 1 / sqrt(8000) = 1.1 %; five times that.
    np.testing.assert_allclose(deviation, wanted, rtol=0.056)


def test_each_joint_has_its_own_step() -> None:
    sensors = Sensors(position=Channel(resolution=(0.25, 0.0)), effort=Channel(resolution=(0.5, 4.0)))
    measured = bank(sensors, 1)
    measured.measure(np.array([0.6, 0.6]), np.array([0.123, 0.456]))
    q, dq = measured.latest
    np.testing.assert_array_equal(q, [0.5, 0.6])
    np.testing.assert_array_equal(dq, [0.123, 0.456])
    np.testing.assert_array_equal(measured.measure_effort(np.array([[1.3, 0.7]])), [[1.5, 8.0]])  # 10 * 0.7: step 4


def test_one_number_is_that_of_all_joints() -> None:
    one, each = (
        bank(Sensors(position=Channel(noise, step)), 3) for noise, step in ((0.1, 0.01), ((0.1, 0.1), (0.01,) * 2))
    )
    for _ in range(3):
        for sensors in (one, each):
            sensors.measure(np.array([0.3, 0.4]), np.zeros(2))
        np.testing.assert_array_equal(one.latest[0], each.latest[0])
