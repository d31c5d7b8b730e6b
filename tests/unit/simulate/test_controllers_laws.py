"""The torque that each controller gives, against its formula with matrices by Pinocchio and by differences."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler_star import rnea_star
from modrob_cli.model.robot import Robot
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import Desired
from modrob_cli.simulate.controllers.shipped import make_controller
from tests.controlled_arms import Equations, Gains, control_task, sines
from tests.unit.simulate.arms import shipped, without_friction

ARMS = ["planar-2r", "scara", "lwa4p-6", "lwa4p-8"]
CLOSE = 1e-7
"""Of the largest torque: central differences of M are good to about 1e-10 / 1e-11, times velocities below 10."""


def state(robot: Robot, seed: int) -> tuple[Array, Array, Desired]:
    rng = np.random.default_rng(seed)
    q, dq, q_d, dq_d, ddq_d = rng.uniform(-1.0, 1.0, (5, robot.dof))
    return q, dq, Desired(q + 0.01 * q_d, dq_d, 3.0 * ddq_d)


def check(robot: Robot, name: str, gains: Gains, q: Array, dq: Array, desired: Desired, expected: Array) -> None:
    controller = make_controller(name, control_task(robot, sines(robot.dof, 1.0), gains, friction_band=0.0))
    found = controller.torque(0.0, q, dq, desired)
    assert np.abs(found - expected).max() <= CLOSE * np.abs(expected).max()


def friction(arm: Equations, dq: Array) -> Array:
    return np.asarray(arm.viscous * dq + arm.coulomb * np.sign(dq))


@pytest.mark.parametrize("name", ARMS)
def test_id(name: str) -> None:
    robot = shipped(name)
    arm = Equations(robot)
    q, dq, desired = state(robot, 1)
    w, z = np.linspace(20.0, 50.0, robot.dof), 0.4
    y = desired.ddq + 2.0 * z * w * (desired.dq - dq) + w**2 * (desired.q - q)
    expected = arm.M(q) @ y + arm.C(q, dq) @ dq + arm.g(q) + friction(arm, dq)
    check(robot, "id", {"frequency": tuple(w), "damping": z}, q, dq, desired, expected)


@pytest.mark.parametrize("name", ["pb", "pb-afc"])
@pytest.mark.parametrize("arm_name", ARMS)
def test_passivity_based(arm_name: str, name: str) -> None:
    robot = shipped(arm_name)
    arm = Equations(robot)
    q, dq, desired = state(robot, 2)
    kr, damping = np.linspace(10.0, 42.0, robot.dof), np.linspace(5.0, 60.0, robot.dof)
    dq_a = desired.dq + kr * (desired.q - q)
    ddq_a = desired.ddq + kr * (desired.dq - dq)
    rigid = arm.M(q) @ ddq_a + arm.C(q, dq) @ dq_a + arm.g(q)
    expected = rigid + friction(arm, dq) + damping * (dq_a - dq)
    check(robot, name, {"error": tuple(kr), "damping": tuple(damping)}, q, dq, desired, expected)


def test_adaptive_control_starts_from_the_guesses() -> None:
    robot = shipped("lwa4p-6")
    q, dq, desired = state(robot, 3)
    task = control_task(robot, sines(6, 1.0), {"viscous_guess": 2.0, "coulomb_guess": 3.0}, friction_band=0.0)
    without = control_task(robot, sines(6, 1.0), {}, friction="none")
    difference = make_controller("pb-afc", task).torque(0.0, q, dq, desired)
    difference -= make_controller("pb", without).torque(0.0, q, dq, desired)
    np.testing.assert_allclose(difference, 2.0 * dq + 3.0 * np.sign(dq), rtol=0, atol=1e-11)


def test_pid_is_tuned_for_the_actuator_alone() -> None:
    robot = shipped("lwa4p-6")
    arm = Equations(robot)
    J, b = arm.rotors, arm.viscous
    q, dq, desired = state(robot, 4)
    w, z = 30.0, 0.7
    e, de = desired.q - q, desired.dq - dq
    expected = J * desired.ddq + (w**2 * J + 2 * z * w * b) * e + 2 * z * w * J * de + friction(arm, desired.dq)
    check(robot, "pid", {"frequency": w, "damping": z}, q, dq, desired, expected)
    expected += 5.0 * e + (3.0 - 2 * z * w * J) * de - 2 * z * w * b * e - w**2 * J * e
    check(robot, "pid", {"frequency": w, "damping": z, "kp": 5.0, "kd": 3.0}, q, dq, desired, expected)
    expected = 2.0 * desired.ddq + (w**2 * 2.0 + 2 * z * w * b) * e + 4 * z * w * de + friction(arm, desired.dq)
    check(robot, "pid", {"frequency": w, "damping": z, "inertia": 2.0}, q, dq, desired, expected)


@pytest.mark.parametrize("name", ARMS)
def test_feedforward_pd_plans_with_the_whole_model(name: str) -> None:
    robot = shipped(name)
    arm = Equations(robot)
    q, dq, desired = state(robot, 5)
    planned = arm.M(desired.q) @ desired.ddq + arm.C(desired.q, desired.dq) @ desired.dq + arm.g(desired.q)
    e, de = desired.q - q, desired.dq - dq
    expected = planned + friction(arm, dq) + 7.0 * e + 0.5 * de
    check(robot, "feedforward-pd", {"kp": 7.0, "kd": 0.5}, q, dq, desired, expected)
    expected = planned + friction(arm, dq) + 0.3 * (400.0 * e + 28.0 * de)
    check(robot, "feedforward-pd", {"inertia": 0.3, "frequency": 20.0, "damping": 0.7}, q, dq, desired, expected)


@pytest.mark.parametrize("name", ["id", "pb", "pid"])
def test_integral(name: str) -> None:
    """A constant error: the torque grows by gain times error (times inertia) times the period with each command."""
    robot = without_friction(shipped("scara"))  # without torque limits too
    arm = Equations(robot)
    q, dq, desired = state(robot, 6)
    gain = np.array([1.0, 2.0, 3.0, 0.5])
    key = {"id": "integral", "pb": "integral", "pid": "ki"}[name]
    gains: Gains = {key: tuple(gain)}
    with_gain = make_controller(name, control_task(robot, sines(4, 1.0), gains, rate=100.0))
    without = make_controller(name, control_task(robot, sines(4, 1.0), {key: 0.0}, rate=100.0))
    e = desired.q - q
    grown = {"id": arm.M(q) @ (gain * e), "pb": gain * (desired.dq - dq + 42.0 * e), "pid": gain * e}[name]
    for k in range(4):
        added = with_gain.torque(0.01 * k, q, dq, desired) - without.torque(0.01 * k, q, dq, desired)
        np.testing.assert_allclose(added, 0.01 * k * grown, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["id", "pb", "feedforward-pd"])
def test_friction_from_measured_or_desired_velocity_or_not_at_all(name: str) -> None:
    robot = shipped("lwa4p-4")
    arm = Equations(robot)
    q, _, desired = state(robot, 7)
    dq = np.array([0.01, -0.3, 0.2, 0.4])  # the first one by half the band of 0.02
    desired = desired._replace(dq=np.array([-0.02, 0.5, -0.1, 0.3]))  # by all of it

    def torque(source: str) -> Array:
        task = control_task(robot, sines(4, 1.0), {}, friction=source)
        return make_controller(name, task).torque(0.0, q, dq, desired)

    def compensated(velocity: Array, sign: float) -> Array:
        signs = np.concatenate([[sign], np.sign(velocity[1:])])
        return np.asarray(arm.viscous * velocity + arm.coulomb * signs)

    bare = torque("none")
    np.testing.assert_allclose(torque("measured") - bare, compensated(dq, 0.5), rtol=0, atol=1e-11)
    np.testing.assert_allclose(torque("desired") - bare, compensated(desired.dq, -1.0), rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", ARMS)
def test_coriolis_terms_of_passivity_dynamics_are_christoffels(name: str) -> None:
    robot = shipped(name)
    arm, model = Equations(robot), ControlModel(robot)
    rng = np.random.default_rng(8)
    q, dq, x = rng.uniform(-1.0, 1.0, (3, robot.dof))
    zero = np.zeros(robot.dof)
    C = columns(model, q, dq)
    np.testing.assert_allclose(C, arm.C(q, dq), rtol=0, atol=1e-8 * np.abs(arm.M(q)).max())
    rate = (arm.M(q + 1e-5 * dq) - arm.M(q - 1e-5 * dq)) / 2e-5
    size = np.abs(arm.M(q)).max()
    np.testing.assert_allclose(rate - 2.0 * C, -(rate - 2.0 * C).T, rtol=0, atol=1e-8 * size)
    # Pinocchio's C and that of the star recursion are others: the same where both velocities are, the same in x'C x
    others = [pin.computeCoriolisMatrix(arm.model, arm.data, q, dq), star(robot, q, dq)]
    for other in others:
        np.testing.assert_allclose(other @ dq, C @ dq, rtol=0, atol=1e-11 * size)
        assert abs(x @ other @ x - x @ C @ x) <= 1e-11 * size
    assert model.passivity_dynamics(q, dq, zero, zero) == pytest.approx(arm.g(q), rel=0, abs=1e-11 * size)
    # only Christoffel's is symmetric in its two velocities
    np.testing.assert_allclose(C @ x, columns(model, q, x) @ dq, rtol=0, atol=1e-11 * size)


def columns(model: ControlModel, q: Array, dq: Array) -> Array:
    zero = np.zeros(model.dof)
    still = model.passivity_dynamics(q, dq, zero, zero)
    return np.stack([model.passivity_dynamics(q, dq, axis, zero) - still for axis in np.eye(model.dof)], axis=1)


def star(robot: Robot, q: Array, dq: Array) -> Array:
    def torque(dq_a: Array) -> Array:
        rows: Sequence[Array] = [x[None] for x in (q, dq, dq_a, np.zeros(robot.dof))]
        return np.asarray(rnea_star(robot, *rows)[0])

    still = torque(np.zeros(robot.dof))
    return np.stack([torque(axis) - still for axis in np.eye(robot.dof)], axis=1)
