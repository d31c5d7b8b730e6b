"""Plant, sensors and controller together: one simulated run."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.errors import UsageError
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Scenario
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.simulate.controllers.interface import BoundsPerturbation, Controller, Desired
from modrob_cli.simulate.perturbation import perturbation_columns
from modrob_cli.simulate.plant import Plant
from modrob_cli.simulate.recording import EnergyBalance, Recorder, Run
from modrob_cli.simulate.sensors import SensorBank
from modrob_cli.simulate.steps import State
from modrob_cli.simulate.truth import TrueRobot

MOST_STEPS = 20_000_000
"""Commands of one run; more would be a slip in the rate or the duration."""
FASTEST = 1e4
"""No joint is that fast [rad/s or m/s]: the closed loop has run away and the run ends."""

_LOOKS = 200
"""How often progress is told and energy is checked."""
_SAME = 1e-6


@dataclass
class ClosedLoop:
    """One arm, one motion, one controller, ready to run.

    Attributes
    ----------
    robot : as its file describes it; its limits count
    effort_factor : logged effort per joint torque of the motor, shape (n,)
    rng : for the noise of the sensors

    Raises
    ------
    UsageError
        If the clocks do not fit together.
    """

    robot: Robot
    truth: TrueRobot
    trajectory: Trajectory
    controller: Controller
    scenario: Scenario
    effort_factor: Array
    rng: np.random.Generator

    def __post_init__(self) -> None:
        """Lay out the clocks."""
        rate = self.scenario.control.rate
        self._period = 1.0 / rate
        self._every = samples_every(self.scenario)
        steps = self.trajectory.duration * rate
        if not steps <= MOST_STEPS:
            raise UsageError(f"{steps:.3g} commands in one run, at most {MOST_STEPS:.0e}; expected a lower rate")
        self._steps = max(int(np.floor(steps + _SAME)), 1)

    def run(self, progress: Callable[[float], None] | None = None) -> Run:
        """Simulate the whole motion, or up to where the closed loop runs away.

        Parameters
        ----------
        progress : is told the part of the motion that is done

        Raises
        ------
        UsageError
            If the controller gives something else than a torque for each joint.
        NumericalError
            If the true robot has an inertia that is not positive.
        """
        with np.errstate(all="ignore"):  # a loop that runs away overflows; it is found out at once
            return self._run(progress or (lambda _: None))

    def _run(self, progress: Callable[[float], None]) -> Run:
        scenario, dof, every = self.scenario, self.robot.dof, self._every
        plant = Plant(self.truth, scenario.contacts, scenario.end_stops)
        times = np.minimum(np.arange(self._steps + 1) * self._period, self.trajectory.duration)
        desired = self.trajectory.sample(times, 2)
        samples = self._steps // every + 1
        bank = SensorBank(scenario.sensors, every * self._period, samples, self.effort_factor, self.rng)
        recorder, state = Recorder(samples, dof), self._start(plant, desired[0])
        disturbance = self._disturbance(len(times))
        balance, look = EnergyBalance(plant, state), max(self._steps // _LOOKS, 1)
        low, high = torque_limits(self.robot) if scenario.saturation else (np.full(dof, -np.inf), np.full(dof, np.inf))
        cut, diverged = np.zeros(dof), None
        applied: Array | None = None
        h = self._period / scenario.sub_steps
        for k, t in enumerate(times.tolist()):
            state.t = t
            sampled = k % every == 0
            if sampled:
                bank.measure(state.q, state.dq)
            commanded = self._command(t, *bank.delayed(), Desired(*desired[k]))
            if not (state.dq.dot(state.dq) < FASTEST**2 and np.count_nonzero(np.isfinite(commanded)) == dof):
                diverged = t
                break
            before, applied = applied, np.minimum(np.maximum(commanded, low), high)
            cut += applied != commanded
            q, dq = state.q, state.dq  # the step makes new ones
            acting = applied if disturbance is None else applied + disturbance[k]
            if k == self._steps:
                ddq = plant.accelerations(state, acting)
            else:
                ddq = plant.advance(state, acting, h)
                for _ in range(1, scenario.sub_steps):
                    plant.advance(state, acting, h)
            if sampled:
                recorder.add(t, (q, dq, ddq, commanded, applied, applied if before is None else before, *bank.latest))
                if isinstance(self.controller, BoundsPerturbation):
                    recorder.perturbations.append(self.controller.perturbation)
            if k % look == 0 or k == self._steps:
                balance.check(state)
                progress(k / self._steps)
        progress(1.0)
        disturbing = None if disturbance is None else disturbance[::every]
        recording = recorder.recording(desired[::every], plant, bank, h, disturbing)
        recording.values.update(perturbation_columns(self.truth, scenario.control.bounds, recorder.perturbations))
        return Run(self.truth, recording, diverged, cut / (k + 1), tuple(plant.hits), balance.relative_error())

    def _disturbance(self, count: int) -> Array | None:
        """Random torques beside the motors', one for each command, shape (count, n); None where there are none."""
        sizes = np.asarray(self.scenario.input_disturbance, dtype=float)
        if sizes.ndim and len(sizes) != self.robot.dof:
            raise UsageError(f"input_disturbance: found {len(sizes)} values for {self.robot.dof} joints")
        return self.rng.uniform(-1.0, 1.0, (count, self.robot.dof)) * sizes if sizes.any() else None

    def _start(self, plant: Plant, first: Array) -> State:
        """State at the beginning; ``first`` is the desired one, shape (3, n)."""
        given = {"q": self.scenario.initial_q, "dq": self.scenario.initial_dq}
        for name, value in given.items():
            if value is not None and not (value.shape == (self.robot.dof,) and np.isfinite(value).all()):
                raise UsageError(f"initial {name}: found {value.tolist()}, expected {self.robot.dof} finite numbers")
        q, dq = (first[k] if value is None else value for k, value in enumerate(given.values()))
        state = plant.start(q, dq)
        rate, steps = plant.dynamics.decay_rate(state.q), self.scenario.sub_steps
        least = int(np.ceil(rate * self._period * (1.0 - _SAME)))
        if least > steps:
            found = f"sub_steps: found {steps}, but viscous friction slows joints down within {1.0 / rate:.3g} s"
            raise UsageError(f"{found}; expected {least} or more, or a higher rate of the controller")
        return state

    def _command(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        try:
            command = np.array(self.controller.torque(t, q, dq, desired), dtype=float)
        except (TypeError, ValueError) as error:
            raise UsageError(f"the controller failed at t = {t:.6g} s: {error}") from error
        if command.shape != (self.robot.dof,):
            found = f"an array of shape {command.shape}"
            raise UsageError(f"the controller gave {found}, expected {self.robot.dof} torques")
        return command


def samples_every(scenario: Scenario) -> int:
    """Commands per sample of the sensors.

    Raises
    ------
    UsageError
        If the rate of the commands is no multiple of that of the sensors.
    """
    rate, control = scenario.sensors.rate, scenario.control.rate
    ratio = 1.0 if rate is None else control / rate
    every = round(ratio)
    if every < 1 or abs(ratio - every) > _SAME * ratio:
        message = f"found sensors at {rate:g} Hz and a controller at {control:g} Hz"
        raise UsageError(f"{message}, expected the rate of the controller to be a multiple of that of the sensors")
    return every
