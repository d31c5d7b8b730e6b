"""Range of the rigid bodies' torque along recorded runs, and the samples of each joint that bounds are found from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.dynamics.box_bounds import box_bounds
from modrob_cli.dynamics.ddq_bounds import ddq_bounds
from modrob_cli.dynamics.exact_bounds import TorqueBounds, exact_bounds
from modrob_cli.identify.bounded_samples import JointSamples
from modrob_cli.identify.run import Run
from modrob_cli.identify.updated_robot import with_friction
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

MOST_CORNERS = 6
"""Up to this many uncertain accelerations the range is exact at 2^n times the cost; with more it is enclosed."""


@dataclass(frozen=True)
class MotionNoise:
    """Half-widths within which positions, velocities and accelerations are known, shape (n,) each, >= 0."""

    q: Array
    dq: Array
    ddq: Array

    @classmethod
    def none(cls, dof: int) -> "MotionNoise":
        """Motion that is known exactly."""
        return cls(np.zeros(dof), np.zeros(dof), np.zeros(dof))


@dataclass(frozen=True)
class RecordedMotion:
    """Samples of all runs put one after the other: N samples, n joints.

    Attributes
    ----------
    run : number of the run that each sample comes from, shape (N,);  t : time in it, shape (N,), [s]
    q, dq, ddq : shape (N, n);  tau : recorded joint torque, shape (N, n)
    gravity : False if the recorded torque is without gravity
    """

    run: Array
    t: Array
    q: Array
    dq: Array
    ddq: Array
    tau: Array
    gravity: bool

    @classmethod
    def of(cls, runs: Sequence[Run], filtered: bool = False) -> "RecordedMotion":
        """Samples that count of all runs; ``filtered``: the torque passes the low-pass of the motion."""

        def joined(parts: list[Array]) -> Array:
            return np.concatenate([part[run.used] for part, run in zip(parts, runs, strict=True)])

        return cls(
            run=np.concatenate([np.full(np.count_nonzero(run.used), float(k)) for k, run in enumerate(runs)]),
            t=joined([run.t for run in runs]),
            q=joined([run.q for run in runs]),
            dq=joined([run.dq for run in runs]),
            ddq=joined([run.ddq for run in runs]),
            tau=joined([run.filtered(run.tau) if filtered else run.tau for run in runs]),
            gravity=all(run.gravity for run in runs),
        )

    def picked(self, chosen: Indices) -> "RecordedMotion":
        """Some of the samples."""
        arrays: dict[str, Any] = {key: value[chosen] for key, value in vars(self).items() if key != "gravity"}
        return replace(self, **arrays)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.t)

    def model(self, robot: Robot) -> Robot:
        """The robot, without gravity where the recorded torque is without."""
        return robot if self.gravity else replace(robot, gravity=np.zeros(3))

    def bounds(self, robot: Robot, noise: MotionNoise) -> TorqueBounds:
        """Torque bounds of a robot along these samples, as ``modrob bounds`` computes them."""
        model, motion = self.model(robot), (self.q, self.dq, self.ddq)
        if noise.q.any() or noise.dq.any():
            return box_bounds(model, *motion, noise.q, noise.dq, noise.ddq)
        if noise.ddq.any():
            few = np.count_nonzero(noise.ddq) <= MOST_CORNERS
            return ddq_bounds(model, *motion, noise.ddq, "corners" if few else "cheap")
        return exact_bounds(model, *motion)

    def of_joint(self, j: int, rigid: TorqueBounds, noise: MotionNoise, velocity_band: float = 0.0) -> JointSamples:
        """Samples of one joint, with the rigid bodies' range."""
        return JointSamples(
            dq=np.ascontiguousarray(self.dq[:, j]),
            ddq=np.ascontiguousarray(self.ddq[:, j]),
            tau=np.ascontiguousarray(self.tau[:, j]),
            low=np.ascontiguousarray(rigid.lower[:, j]),
            high=np.ascontiguousarray(rigid.upper[:, j]),
            velocity_band=velocity_band,
            dq_noise=float(noise.dq[j]),
            ddq_noise=float(noise.ddq[j]),
        )


def rigid_bodies_of(robot: Robot) -> Robot:
    """The robot without friction, rotors and disturbance."""
    still = [Uncertain.exact(0.0)] * robot.dof
    return with_friction(robot, [Friction()] * robot.dof, still, Interval(np.zeros(robot.dof)))
