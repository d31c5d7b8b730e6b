"""What a simulated run leaves behind."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.controllers.interface import Perturbation
from modrob_cli.simulate.plant import Plant, StopHit
from modrob_cli.simulate.sensors import SensorBank
from modrob_cli.simulate.steps import State
from modrob_cli.simulate.truth import TrueRobot

FIELDS = ("q", "dq", "ddq", "commanded", "applied", "before", "q_measured", "dq_measured")
"""What is recorded while the arm moves; ``before`` is the motor torque until the sample."""


@dataclass(frozen=True)
class Recording:
    """What was recorded, one row for each sample of the sensors, K of them.

    Attributes
    ----------
    t : true times, shape (K,), [s];  stamps : as the log has them
    desired : position, velocity, acceleration, shape (K, 3, n)
    values : shape (K, n) by name: true ``q``, ``dq``, ``ddq``; ``friction``, torque against the motor, with the
        constant torque of disturbance and friction band and what holds joints at rest or at their end stops;
        ``external``, torque of contacts and random disturbances; ``commanded`` and ``applied`` motor torque;
        ``q_measured``, ``dq_measured`` and ``effort`` as logged. ``ddq``, ``friction``, ``external``, ``commanded`` and
        ``applied`` are those just after the sample; ``effort`` is measured just before the new command acts. Where the
        controller bounds its perturbation: ``perturbation``, ``phi_lower`` and ``phi_upper``, see
        :mod:`modrob_cli.simulate.perturbation`.
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
        self.values = {key: np.zeros((samples, dof)) for key in FIELDS}
        self.t = np.empty(samples)
        self.count = 0
        self.perturbations: list[Perturbation] = []

    def add(self, t: float, rows: tuple[Array, ...]) -> None:
        """Take one sample: shape (n,) for each of :data:`FIELDS`."""
        k = self.count
        self.t[k] = t
        for values, row in zip(self.values.values(), rows, strict=True):
            values[k] = row
        self.count += 1

    def recording(
        self, desired: Array, plant: Plant, bank: SensorBank, h: float, disturbance: Array | None = None
    ) -> Recording:
        """What was collected, with what follows from it.

        Parameters
        ----------
        desired : of all samples or more, shape (K, 3, n)
        h : length of a step [s]
        disturbance : random torque at all samples or more, shape (K, n)
        """
        t = self.t[: self.count]
        values = {key: value[: self.count] for key, value in self.values.items()}
        effort = bank.measure_effort(values.pop("before"))
        external = np.zeros_like(effort)
        if plant.contacts:
            external[:] = [plant.external_torque(*row, h) for row in zip(t.tolist(), values["q"], strict=True)]
        if disturbance is not None:
            external += disturbance[: self.count]
        states = zip(values["q"], values["dq"], values["ddq"], strict=True)
        moving = np.reshape([plant.dynamics.inverse(*state) for state in states], effort.shape)
        friction = values["applied"] + external - moving
        values |= {"friction": friction, "external": external, "effort": effort}
        return Recording(t, t + bank.jitter[: self.count], desired[: self.count], values)


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
