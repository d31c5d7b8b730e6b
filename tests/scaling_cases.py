"""Random arms, motions and limits for tests of time scaling."""

from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve, SineCurve
from modrob_cli.model.trajectory_pieces import quintic_spline, rest_to_rest
from modrob_cli.model.uncertain import Uncertain
from tests.property.test_box_bounds import around, random_arm


@dataclass(frozen=True)
class Case:
    """An arm, a motion, and torque limits (lower, upper), shape (n,) each."""

    robot: Robot
    trajectory: Trajectory
    limits: tuple[Array, Array]


def random_case(seed: int) -> Case:
    """Revolute and prismatic joints, uncertain bodies, friction from none to very large, limits near the torques."""
    rng = np.random.default_rng(seed)
    robot = random_arm(seed)
    joints = []
    for joint in robot.joints:
        viscous, coulomb = float(rng.choice([0.0, 3.0, 40.0])), float(rng.choice([0.0, 1.0]))
        band = float(rng.choice([0.0, 0.1]))
        joints.append(replace(joint, friction=Friction(around(viscous, 0.1), around(coulomb, 0.2), 0.1, band)))
    if rng.random() < 0.3:
        bodies = tuple(
            replace(p, body=replace(p.body, mass=Uncertain.exact(p.body.mass.nominal))) for p in robot.bodies
        )
        robot = replace(robot, bodies=bodies)
    spread = rng.uniform(0.0, 0.3, robot.dof)
    robot = replace(robot, joints=tuple(joints), disturbance=Interval(-spread, spread))
    trajectory = Trajectory("random", tuple(_curve(rng, k) for k in range(robot.dof)))
    return Case(robot, trajectory, _limits(rng, robot, trajectory))


def _curve(rng: np.random.Generator, k: int) -> Curve:
    """Sines, rest-to-rest polynomials or quintic splines of 2 s."""
    kind = rng.integers(3)
    if kind == 0:
        return SineCurve(2.0, float(rng.normal()), rng.normal(size=2), rng.uniform(0.5, 4.0, 2), rng.uniform(-3, 3, 2))
    t = np.array([0.0, float(rng.uniform(0.5, 1.5)), 2.0])
    q = rng.normal(size=3)
    if kind == 1:
        return rest_to_rest(t, q, 5 if k % 2 else 7)
    return quintic_spline(t, q, rng.normal(size=3), 3.0 * rng.normal(size=3))


def _limits(rng: np.random.Generator, robot: Robot, trajectory: Trajectory) -> tuple[Array, Array]:
    """A little more than the torques at some factor or at rest, so that small and large factors may both be unsafe."""
    x = trajectory.sample(np.linspace(0.0, trajectory.duration, 50), 2)
    c = float(rng.uniform(0.3, 1.5))
    ends = [exact_bounds(robot, x[:, 0], s * x[:, 1], s * s * x[:, 2]) for s in (0.0, c)]
    low = np.min([bounds.lower.min(axis=0) for bounds in ends], axis=0)
    high = np.max([bounds.upper.max(axis=0) for bounds in ends], axis=0)
    share = rng.uniform(0.95, 1.1) * rng.uniform(0.98, 1.1, (2, robot.dof))
    return np.minimum(low * share[0], -0.1), np.maximum(high * share[1], 0.1)
