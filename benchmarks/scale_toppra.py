"""``modrob scale`` beside TOPP-RA, on the motion of [S] IV.A: duration, time to compute, and broken limits.

    pip install toppra
    python -m benchmarks.scale_toppra

TOPP-RA finds the time-optimal speed along a path, for nominal parameters: another problem (the speed may change along
the path) with another promise (one parameter vector, grid points). Its constraints are linear in acceleration and
squared velocity of the path, which holds no viscous friction, large on this arm. So it runs twice: without viscous
friction, and with limits that leave room for the viscous torque at a largest speed, the best one. Then true parameters
are drawn from the box of the robot's file, and the torques of each plan are compared with the limits.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.model.body import PlacedBody
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.scaling.certify import certify
from modrob_cli.workflows.scale import find
from modrob_cli.workflows.scale_problem import ScaleOptions, ScaleProblem, read_problem

ROOT = Path(__file__).parents[1]
CURRENTS = (8.0, 8.0, 8.0, 8.0, 2.0, 2.0)
DRAWN = 1000
GRID = 400
SHARES = np.linspace(0.05, 0.95, 19)
"""Of the largest speeds without viscous friction: the share that gives the shortest duration counts."""


@dataclass(frozen=True)
class Plan:
    """States of a plan, shape (T, n) each, and what it cost."""

    name: str
    duration: float
    seconds: float
    states: tuple[Array, Array, Array]


def member(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot with bodies drawn from their boxes."""

    def drawn(part: Uncertain) -> Uncertain:
        ends = part.interval
        value = ends.inf + rng.random(part.nominal.shape) * (ends.sup - ends.inf)
        return Uncertain.exact(np.clip(value, ends.inf, ends.sup))

    def of(placed: PlacedBody) -> PlacedBody:
        body = placed.body
        drawn_body = replace(body, mass=drawn(body.mass), com=drawn(body.com), inertia=drawn(body.inertia))
        return replace(placed, body=drawn_body)

    return replace(robot, bodies=tuple(map(of, robot.bodies)))


def torques(robot: Robot, states: tuple[Array, Array, Array], viscous: bool = True) -> Array:
    """Motor torques (T, n) of a robot without uncertainty, Coulomb friction by the sign of the velocity."""
    q, dq, ddq = states
    tau = rnea(robot, q, dq, ddq)
    for j, joint in enumerate(robot.joints):
        friction, drive = joint.friction, joint.drive
        tau[:, j] += drive.gear_ratio**2 * drive.rotor_inertia.nominal * ddq[:, j]
        tau[:, j] += friction.coulomb.nominal * np.sign(dq[:, j])
        if viscous:
            tau[:, j] += friction.viscous.nominal * dq[:, j]
    return np.asarray(tau)


def scaled(trajectory: Trajectory, c: float, name: str, seconds: float) -> Plan:
    """The whole motion at a constant factor."""
    x = trajectory.sample(np.linspace(0.0, trajectory.duration, 4000), 2)
    return Plan(name, trajectory.duration / c, seconds, (x[:, 0], c * x[:, 1], c * c * x[:, 2]))


def time_optimal(problem: ScaleProblem, limits: Array, fastest: Array, name: str) -> Plan | None:
    """Plan with TOPP-RA for torque limits (n, 2) and largest speeds (n,); None if there is no plan."""
    import toppra
    import toppra.algorithm
    import toppra.constraint

    trajectory, robot = problem.trajectory, problem.robot
    # The motion is a straight line between two points; its own speed is zero at the ends, which TOPP-RA cannot take.
    first, last = trajectory.sample(np.array([0.0, trajectory.duration]), 0)[:, 0]
    s = np.linspace(0.0, 1.0, 11)
    path = toppra.SplineInterpolator(s, first + s[:, None] * (last - first))

    def inverse(q: Array, dq: Array, ddq: Array) -> Array:
        still = np.zeros_like(dq)
        rotor = np.array([j.drive.gear_ratio**2 * float(j.drive.rotor_inertia.nominal) for j in robot.joints])
        tau = rnea(robot, q[None], (dq + still)[None], ddq[None])[0]
        return np.asarray(tau + rotor * ddq)

    coulomb = np.array([float(joint.friction.coulomb.nominal) for joint in robot.joints])
    begun = time.perf_counter()
    constraint: Any = toppra.constraint.JointTorqueConstraint(inverse, limits, coulomb)
    speed: Any = toppra.constraint.JointVelocityConstraint(np.stack([-fastest, fastest], axis=1))
    problem_of = toppra.algorithm.TOPPRA([constraint, speed], path, gridpoints=np.linspace(0.0, 1.0, GRID))
    plan: Any = problem_of.compute_trajectory(0.0, 0.0)
    seconds = time.perf_counter() - begun
    if plan is None:
        return None
    t = np.linspace(0.0, plan.duration, 4000)
    return Plan(name, float(plan.duration), seconds, (plan(t), plan(t, 1), plan(t, 2)))


def main() -> None:
    """Plan in four ways and draw true parameters."""
    limits = (("current", tuple((-x, x) for x in CURRENTS)), ("velocity", (None,)), ("acceleration", (None,)))
    files = (ROOT / "assemblies" / "lwa4p-table34.yaml", ROOT / "trajectories" / "s-iv-a.yaml")
    problem = read_problem(*files, ScaleOptions(limits=limits))
    low, high = torque_limits(problem.robot)
    plain = time_optimal(problem, np.stack([low, high], axis=1), np.full(6, 100.0), "TOPP-RA, no viscous friction")
    assert plain is not None
    plans = [plain]
    viscous = np.array([float(joint.friction.viscous.nominal) for joint in problem.robot.joints])
    found = []
    for share in SHARES:
        fastest = share * np.abs(plain.states[1]).max(axis=0)
        tight = np.stack([low + viscous * fastest, high - viscous * fastest], axis=1)
        found.append(time_optimal(problem, tight, fastest + 1e-3, "TOPP-RA, room for viscous friction"))
    plans.append(min((plan for plan in found if plan is not None), key=lambda plan: plan.duration))
    begun = time.perf_counter()
    answer = find(problem)
    sampling = time.perf_counter() - begun
    nominal, exact = answer.compared["nominal"], answer.sampled.factor
    assert nominal is not None
    assert exact is not None
    begun = time.perf_counter()
    proof = certify(problem.robot, problem.trajectory, problem.limits, (0.01, exact), 0.005)
    proving = time.perf_counter() - begun
    assert proof.factor is not None
    plans.append(scaled(problem.trajectory, nominal, "constant factor, nominal", sampling / 4))
    plans.append(scaled(problem.trajectory, proof.factor, "constant factor, certified", sampling / 4 + proving))
    rng = np.random.default_rng(0)
    robots = [member(problem.robot, rng) for _ in range(DRAWN)]
    print(f"{'plan':34} {'duration':>9} {'to compute':>11} {'robots that break a limit':>26} {'worst':>8}")
    for plan in plans:
        broken, worst = 0, 0.0
        for robot in robots:
            use = float((np.abs(torques(robot, plan.states)) / high).max())
            broken += use > 1.0 + 1e-9
            worst = max(worst, use)
        print(f"{plan.name:34} {plan.duration:7.2f} s {plan.seconds:9.3f} s {broken / DRAWN:25.1%} {worst:8.2f}")


if __name__ == "__main__":
    main()
