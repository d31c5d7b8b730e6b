"""The plant against energy, closed forms, and independent right-hand sides under an independent integrator."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.joint import Limits
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Contact
from modrob_cli.simulate.steps import State
from tests.unit.simulate.arms import GRAVITY, plant_of, run, shipped, with_friction, with_rotors, without_friction

Rates = Callable[[float, Array, Array], Array]


@pytest.mark.parametrize("name", ["planar-2r", "2r-side", "scara", "lwa4p-4", "lwa4p-6", "lwa4p-8"])
def test_free_motion_keeps_its_energy(name: str) -> None:
    robot = without_friction(shipped(name))
    if name == "planar-2r":
        robot = with_rotors(robot, 0.3)
    plant = plant_of(robot)
    rng = np.random.default_rng(3)
    state = plant.start(rng.uniform(-1.0, 1.0, robot.dof), rng.uniform(-1.0, 1.0, robot.dof))
    # energies by Pinocchio, the rotors added here
    model = build_model(robot)
    data = model.createData()
    rotors = np.array([float(j.drive.gear_ratio**2 * j.drive.rotor_inertia.nominal) for j in robot.joints])

    def energies() -> tuple[float, float]:
        kinetic = pin.computeKineticEnergy(model, data, state.q, state.dq) + 0.5 * rotors @ state.dq**2
        return float(kinetic), float(kinetic + pin.computePotentialEnergy(model, data, state.q))

    start, largest, error = energies()[1], 0.0, 0.0
    for _ in range(100):
        run(plant, state, np.zeros(robot.dof), state.t + 0.1, 1e-3)
        kinetic, total = energies()
        largest, error = max(largest, kinetic), max(error, abs(total - start))
    assert largest > 0.1  # it moves
    assert error <= 1e-6 * largest


def reference(rates: Rates, state: State, ends: list[float]) -> tuple[Array, Array]:
    """Position and velocity at the last of these times; the rates are smooth between them."""
    n, t = len(state.q), state.t
    x = np.concatenate([state.q, state.dq])
    for end in ends:
        f = lambda t, x: np.concatenate([x[n:], rates(t, x[:n], x[n:])])  # noqa: E731
        x = solve_ivp(f, (t, end), x, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        t = end
    return x[:n], x[n:]


def planar_rates(tau: Array, viscous: float, armature: float) -> Rates:
    """Closed form of the planar arm of the catalogue: two links of 1 m, 10 kg and 5 kg, in a vertical plane."""
    l1, c1, c2, m1, m2, I1, I2 = 1.0, 0.5, 0.5, 10.0, 5.0, 10.0 / 12.0, 10.0 / 12.0

    def rates(t: float, q: Array, dq: Array) -> Array:
        h = m2 * l1 * c2
        M12 = I2 + m2 * c2**2 + h * np.cos(q[1])
        M11 = I1 + I2 + m1 * c1**2 + m2 * (l1**2 + c2**2) + 2.0 * h * np.cos(q[1])
        M = np.array([[M11 + armature, M12], [M12, I2 + m2 * c2**2 + armature]])
        c = h * np.sin(q[1]) * np.array([-(2.0 * dq[0] + dq[1]) * dq[1], dq[0] ** 2])
        second = m2 * c2 * GRAVITY * np.cos(q[0] + q[1])
        g = np.array([(m1 * c1 + m2 * l1) * GRAVITY * np.cos(q[0]) + second, second])
        return np.asarray(np.linalg.solve(M, tau - viscous * dq - c - g))

    return rates


def test_planar_arm_moves_as_its_closed_form() -> None:
    robot = with_rotors(with_friction(shipped("planar-2r"), 2.0, 0.0), 0.3)
    tau = np.array([40.0, -5.0])
    plant = plant_of(robot)
    state = plant.start(np.array([0.4, -1.0]), np.array([0.5, 1.5]))
    q, dq = reference(planar_rates(tau, 2.0, 0.3), state, [3.0])
    run(plant, state, tau, 3.0, 1e-3)
    assert np.abs(state.q - q).max() < 1e-6
    assert np.abs(state.dq - dq).max() < 1e-5


HIT = Contact("hit", 6, np.array([0.02, -0.03, 0.1]), np.array([30.0, -20.0, 45.0]), 0.3137, 0.21, "link", "half-sine")
PUSH = Contact("push", 4, np.array([0.0, 0.05, 0.02]), np.array([-15.0, 25.0, 10.0]), 0.4, 1.0001)


def finite_difference_torque(robot: Robot, contact: Contact, t: float, q: Array) -> Array:
    """J^T f with J from central differences of where the point is."""
    link, d = contact.link - 1, 1e-6
    steps = np.concatenate([q + d * np.eye(len(q)), q - d * np.eye(len(q)), q[None]])
    frames = robot.link_frames(steps)[:, link]
    points = frames[:, :3, :3] @ contact.point + frames[:, :3, 3]
    J = (points[: len(q)] - points[len(q) : -1]) / (2.0 * d)
    force = contact.force if contact.frame == "base" else frames[-1, :3, :3] @ contact.force
    size = np.sin(np.pi * (t - contact.start) / contact.duration) if contact.shape == "half-sine" else 1.0
    return np.asarray(J @ (size * force))


def pinocchio_rates(robot: Robot, tau: Array, contacts: tuple[Contact, ...]) -> Rates:
    """M(q) from crba with the rotors added by hand, solved as a linear system."""
    model = build_model(robot)
    data = model.createData()
    armature = np.diag([float(j.drive.gear_ratio**2 * j.drive.rotor_inertia.nominal) for j in robot.joints])
    viscous = np.array([float(j.friction.viscous.nominal) for j in robot.joints])

    def rates(t: float, q: Array, dq: Array) -> Array:
        upper = np.triu(pin.crba(model, data, q))
        M = upper + np.triu(upper, 1).T + armature
        net = tau - viscous * dq - pin.nonLinearEffects(model, data, q, dq)
        for contact in contacts:
            net = net + finite_difference_torque(robot, contact, t, q)
        return np.asarray(np.linalg.solve(M, net))

    return rates


@pytest.mark.parametrize("h", [1e-3, 0.9973e-3])
def test_six_axes_move_as_the_independent_integrator_says(h: float) -> None:
    # windows of the contacts that are not on the grid of the steps
    robot = without_friction(shipped("lwa4p-6"))
    robot = with_friction(robot, 1.3, 0.0)
    tau = np.array([4.0, -30.0, 12.0, 3.0, -2.0, 1.0])
    plant = plant_of(robot, (HIT, PUSH))
    state = plant.start(np.array([0.2, 0.5, -0.9, 0.4, 1.1, -0.3]), np.array([0.3, -0.5, 0.8, -1.0, 0.4, 2.0]))
    q, dq = state.q.copy(), state.dq.copy()
    pieces = [(HIT.start, ()), (PUSH.start, (HIT,)), (HIT.end, (HIT, PUSH)), (PUSH.end, (PUSH,)), (2.0, ())]
    t = 0.0
    for end, active in pieces:
        q, dq = reference(pinocchio_rates(robot, tau, active), State(t, q, dq), [end])
        t = end
    run(plant, state, tau, 2.0, h)
    assert np.abs(state.q - q).max() < 1e-6
    assert np.abs(state.dq - dq).max() < 1e-5


def test_halving_the_step_divides_the_error_by_sixteen() -> None:
    tau = np.array([40.0, -5.0])
    robot = with_friction(shipped("planar-2r"), 2.0, 0.0)
    errors = []
    for h in (0.02, 0.01, 0.005):
        plant = plant_of(robot)
        state = plant.start(np.array([0.4, -1.0]), np.array([0.5, 1.5]))
        q, _ = reference(planar_rates(tau, 2.0, 0.0), state, [1.0])
        run(plant, state, tau, 1.0, h)
        errors.append(np.abs(state.q - q).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (np.abs(orders - 4.0) < 0.4).all(), (errors, orders)  # higher terms still show at these steps


def test_limits_do_not_act_without_end_stops() -> None:
    robot = with_friction(shipped("planar-2r"), 2.0, 0.0)
    joints = tuple(replace(joint, limits=Limits((-0.1, 0.1))) for joint in robot.joints)
    limited = replace(robot, joints=joints)
    states = []
    for arm, stops in ((robot, True), (limited, False)):
        plant = plant_of(arm, end_stops=stops)
        states.append(run(plant, plant.start(np.zeros(2), np.zeros(2)), np.zeros(2), 0.5, 1e-3))
    assert np.array_equal(states[0].q, states[1].q)
    assert abs(states[0].q[0]) > 0.1
