"""Measurements: noise, quantisation, delay, time stamps that jitter."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.scenario import Channel, NoiseShape, Sensors

_MOST_JITTER = 0.49
"""Stamps are moved by less than half a period, so that they never go back."""
_SAME = 1e-6


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
    """

    def __init__(
        self, sensors: Sensors, period: float, samples: int, effort_factor: Array, rng: np.random.Generator
    ) -> None:
        n = len(effort_factor)
        self._sensors = sensors
        self._period = period
        self._factor = effort_factor
        shape = (samples, n)
        self._noise = {
            key: _draw(getattr(sensors, key).noise, sensors.noise, shape, rng)
            for key in ("position", "velocity", "effort")
        }
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
        q_measured = _quantised(q + self._noise["position"][k], sensors.position)
        if sensors.velocity_source == "differentiated" and k:
            dq = (q_measured - self.latest[0]) / self._period
        dq_measured = _quantised(dq + self._noise["velocity"][k], sensors.velocity)
        self._samples.append((q_measured, dq_measured))
        del self._samples[: -self._delay - 1]
        self._count += 1

    def measure_effort(self, tau: Array) -> Array:
        """Measured effort of the last sample, shape (n,), for this joint torque of the motors."""
        noise = self._noise["effort"][self._count - 1]
        return _quantised(tau * self._factor + noise, self._sensors.effort)


def _draw(size: float, shape_of: NoiseShape, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    """Noise; the numbers are drawn also where the size is zero, so that one channel does not change another."""
    raw = rng.standard_normal(shape) if shape_of == "gaussian" else rng.uniform(-1.0, 1.0, shape)
    return np.asarray(size * raw)


def _quantised(value: Array, channel: Channel) -> Array:
    if channel.resolution == 0.0:
        return value
    return np.asarray(channel.resolution * np.round(value / channel.resolution))
