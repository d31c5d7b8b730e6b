"""Measurements: noise, quantisation, delay, time stamps that jitter."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.model.scenario import GainValue, NoiseShape, Sensors

_MOST_JITTER = 0.49
"""Stamps are moved by less than half a period, so that they never go back."""
_SAME = 1e-6
_CHANNELS = ("position", "velocity", "effort")


class SensorBank:
    """Measures the state sample by sample, with noise that is drawn in advance.

    Parameters
    ----------
    period : time between two samples [s]
    samples : how many there will be
    effort_factor : logged effort per joint torque of the motor, shape (n,)

    Attributes
    ----------
    jitter : errors of the time stamps, shape (samples,), [s]

    Raises
    ------
    UsageError
        If a channel has another number of values than there are joints.
    """

    def __init__(
        self, sensors: Sensors, period: float, samples: int, effort_factor: Array, rng: np.random.Generator
    ) -> None:
        n = len(effort_factor)
        self._sensors = sensors
        self._period = period
        self._factor = effort_factor
        shape = (samples, n)
        channels = {key: getattr(sensors, key) for key in _CHANNELS}
        noise = {key: _for_joints(key, channel.noise, n) for key, channel in channels.items()}
        steps = {key: _for_joints(key, channel.resolution, n) for key, channel in channels.items()}
        self._noise = {key: _draw(size, sensors.noise, shape, rng) for key, size in noise.items()}
        self._step = {key: step if step.any() else None for key, step in steps.items()}
        jitter = _draw(sensors.jitter, sensors.noise, (samples, 1), rng)[:, 0]
        self.jitter = np.clip(jitter, -_MOST_JITTER * period, _MOST_JITTER * period)
        self._delay = max(int(np.ceil(sensors.delay / period - _SAME)), 0)
        self._samples: list[tuple[Array, Array]] = []
        self._count = 0

    @property
    def latest(self) -> tuple[Array, Array]:
        """Measured position and velocity of the last sample, shape (n,) each."""
        return self._samples[-1]

    def delayed(self) -> tuple[Array, Array]:
        """Measured position and velocity that the controller has by now; at the start the first ones."""
        return self._samples[0]

    def measure(self, q: Array, dq: Array) -> None:
        """Take the next sample of true position and velocity, shape (n,) each."""
        k, sensors = self._count, self._sensors
        q_measured = _quantised(q + self._noise["position"][k], self._step["position"])
        if sensors.velocity_source == "differentiated" and k:
            dq = (q_measured - self.latest[0]) / self._period
        dq_measured = _quantised(dq + self._noise["velocity"][k], self._step["velocity"])
        self._samples.append((q_measured, dq_measured))
        del self._samples[: -self._delay - 1]
        self._count += 1

    def measure_effort(self, tau: Array) -> Array:
        """Measured effort of the first K samples, shape (K, n), for these joint torques of the motors."""
        return _quantised(tau * self._factor + self._noise["effort"][: len(tau)], self._step["effort"])


def _for_joints(channel: str, value: GainValue, n: int) -> Array:
    """One number for each joint, shape (n,)."""
    values = np.asarray(value, dtype=float)
    if values.ndim and len(values) != n:
        raise UsageError(f"sensors: {channel}: found {len(values)} values for {n} joints")
    return np.array(np.broadcast_to(values, (n,)))


def _draw(size: Array | float, shape_of: NoiseShape, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    """Noise; the numbers are drawn also where the size is zero, so that one channel does not change another."""
    raw = rng.standard_normal(shape) if shape_of == "gaussian" else rng.uniform(-1.0, 1.0, shape)
    return np.asarray(size * raw)


def _quantised(value: Array, step: Array | None) -> Array:
    """Nearest multiple of the step of each joint, shape (..., n); the value itself where the step is 0."""
    if step is None:
        return value
    positive = step > 0.0
    return np.where(positive, step * np.round(value / np.where(positive, step, 1.0)), value)
