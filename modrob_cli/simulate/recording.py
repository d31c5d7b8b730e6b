"""What a simulated run leaves behind."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.plant import Plant, State, StopHit
from modrob_cli.simulate.truth import TrueRobot

FIELDS = ("q", "dq", "ddq", "friction", "external", "commanded", "applied", "q_measured", "dq_measured", "effort")


@dataclass(frozen=True)
class Recording:
    """What was recorded, one row for each sample of the sensors, K of them.

    Attributes
    ----------
    t : true times, shape (K,), [s];  stamps : as the log has them
    desired : position, velocity, acceleration, shape (K, 3, n)
    values : shape (K, n) by name: true ``q``, ``dq``, ``ddq``; ``friction``, torque against the motor, with the
        constant torque of disturbance and friction band and what holds joints at rest or at their end stops;
        ``external``, torque of contacts; ``commanded`` and ``applied`` motor torque; ``q_measured``, ``dq_measured`` and
        ``effort`` as logged. ``ddq``, ``friction``, ``external``, ``commanded`` and ``applied`` are those just after
        the sample; ``effort`` is measured just before the new command acts.
    """

    t: Array
    stamps: Array
    desired: Array
    values: dict[str, Array]


@dataclass(frozen=True)
class Run:
    """A simulated run.

    Attributes
    ----------
    diverged : time at which the closed loop had run away [s]; None if it did not
    saturated : part of the commands that were cut, for each joint, shape (n,)
    hits : end stops met
    energy_error : energy that came from nowhere, relative to the largest energy or work, [-]
    """

    truth: TrueRobot
    recording: Recording
    diverged: float | None
    saturated: Array
    hits: tuple[StopHit, ...]
    energy_error: float


class Recorder:
    """Collects samples into arrays that are made once."""

    def __init__(self, samples: int, dof: int) -> None:
        self._values = {key: np.empty((samples, dof)) for key in FIELDS}
        self._t = np.empty(samples)
        self._desired = np.empty((samples, 3, dof))
        self._count = 0

    def add(self, t: float, desired: Array, **values: Array) -> None:
        """Take one sample: desired (3, n), values (n,) for each of :data:`FIELDS`."""
        k = self._count
        self._t[k] = t
        self._desired[k] = desired
        for key, value in values.items():
            self._values[key][k] = value
        self._count += 1

    def recording(self, jitter: Array) -> Recording:
        """What was collected; ``jitter`` (K or more) is added to the stamps."""
        k = self._count
        values = {key: value[:k] for key, value in self._values.items()}
        return Recording(self._t[:k], self._t[:k] + jitter[:k], self._desired[:k], values)


class EnergyBalance:
    """Compares the energy of the arm with the work that was done on it."""

    def __init__(self, plant: Plant, state: State) -> None:
        self._plant = plant
        self._start = self._energy(state)[1]
        self._error = 0.0
        self._largest = 0.0

    def check(self, state: State) -> None:
        """Look at the balance now."""
        kinetic, energy = self._energy(state)
        gained = energy - self._start
        self._error = max(self._error, abs(gained - state.work + state.lost))
        self._largest = max(self._largest, kinetic, abs(gained), abs(state.work), state.lost)

    def relative_error(self) -> float:
        """Largest error so far, relative to the largest energy or work; 0 where nothing has moved."""
        return self._error / self._largest if self._largest > 0.0 else 0.0

    def _energy(self, state: State) -> tuple[float, float]:
        dynamics = self._plant.dynamics
        kinetic = dynamics.kinetic_energy(state.q, state.dq)
        return kinetic, kinetic + dynamics.potential_energy(state.q)
