"""Arms under control, and their equations of motion written with Pinocchio's matrices, for tests of controllers."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pinocchio as pin

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Control, GainValue, Scenario
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import SineCurve
from modrob_cli.simulate.closed_loop import ClosedLoop
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import Controller, ControlTask, Desired
from modrob_cli.simulate.controllers.shipped import make_controller
from modrob_cli.simulate.recording import Run
from modrob_cli.simulate.truth import true_robot

Gains = dict[str, GainValue]
STEP = 1e-5
"""Step of central differences; their error is of the order STEP^2 = 1e-10, their rounding 1e-16 / STEP = 1e-11."""


class Equations:
    """M, C, g and friction of an arm, put together without the package's own dynamics."""

    def __init__(self, robot: Robot) -> None:
        self.model: Any = build_model(robot)
        self.data: Any = self.model.createData()
        drives = [joint.drive for joint in robot.joints]
        self.rotors = np.array([drive.gear_ratio**2 * float(drive.rotor_inertia.nominal) for drive in drives])
        self.viscous = np.array([float(joint.friction.viscous.nominal) for joint in robot.joints])
        self.coulomb = np.array([float(joint.friction.coulomb.nominal) for joint in robot.joints])

    def M(self, q: Array) -> Array:
        upper = np.triu(pin.crba(self.model, self.data, q))
        return np.asarray(upper + np.triu(upper, 1).T + np.diag(self.rotors))

    def g(self, q: Array) -> Array:
        return np.array(pin.computeGeneralizedGravity(self.model, self.data, q))

    def slopes(self, q: Array) -> Array:
        """dM_ij / dq_k by central differences, shape (n, n, n)."""
        steps = STEP * np.eye(len(q))
        return np.stack([(self.M(q + step) - self.M(q - step)) / (2 * STEP) for step in steps], axis=-1)

    def C(self, q: Array, dq: Array) -> Array:
        """Christoffel's C: C_ij = sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) dq_k / 2."""
        D = self.slopes(q)
        return np.asarray(0.5 * (D + D.transpose(0, 2, 1) - D.transpose(2, 1, 0)) @ dq)


def sines(
    dof: int, duration: float, amplitude: float = 0.5, slowest: float = 1.0, size: Array | None = None
) -> Trajectory:
    """A smooth motion; each joint with a frequency [rad/s] of its own; ``size`` scales joints, shape (n,)."""
    scale = np.ones(dof) if size is None else size
    curves = [
        SineCurve(
            duration, 0.0, np.array([amplitude * scale[k]]), np.array([slowest * (1 + 0.3 * k)]), np.array([0.4 * k])
        )
        for k in range(dof)
    ]
    return Trajectory("sines", tuple(curves))


def control_task(robot: Robot, motion: Trajectory, gains: Gains, **control: Any) -> ControlTask:
    said = Control(gains=gains, **control)
    return ControlTask(ControlModel(robot), motion, 1.0 / said.rate, said)


@dataclass
class Watched:
    """A controller, and what one of its attributes was before each of its commands."""

    inner: Any
    attributes: tuple[str, ...] = ()
    times: list[float] = field(default_factory=list)
    seen: list[Array] = field(default_factory=list)

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        self.times.append(t)
        self.seen.append(np.array([np.copy(getattr(self.inner, name)) for name in self.attributes]))
        return np.asarray(self.inner.torque(t, q, dq, desired))


def controlled(
    robot: Robot,
    motion: Trajectory,
    controller: str | Controller,
    gains: Gains | None = None,
    scenario: Scenario | None = None,
    **control: Any,
) -> Run:
    """One run; the true robot is the nominal one unless the scenario says otherwise."""
    said = Control(gains=gains or {}, **control)
    scenario = replace(scenario or Scenario(), control=said)
    if isinstance(controller, str):
        controller = make_controller(controller, ControlTask(ControlModel(robot), motion, 1.0 / said.rate, said))
    rng = np.random.default_rng(scenario.seed)
    truth = true_robot(robot, scenario.truth, rng, scenario.payload)
    return ClosedLoop(robot, truth, motion, controller, scenario, np.ones(robot.dof), rng).run()


def errors(run: Run) -> tuple[Array, Array, Array]:
    """e, de, dde at each sample, shape (K, n) each: desired minus true."""
    desired, values = run.recording.desired, run.recording.values
    return tuple(desired[:, k] - values[key] for k, key in enumerate(("q", "dq", "ddq")))  # type: ignore[return-value]
