"""Robust controllers: their laws against independent formulas, adaptation, and the perturbation within its bounds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.exact_star import exact_bounds_star
from modrob_cli.errors import UsageError
from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import Limits
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import BoundsMethod, Channel, Control, Scenario, Sensors, Truth
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import Controller, ControlTask, Desired
from modrob_cli.simulate.controllers.interval_passivity import IntervalPassivityBased
from modrob_cli.simulate.controllers.sampled_constants import sampled_constants
from modrob_cli.simulate.controllers.shipped import bounds_perturbation, make_controller
from modrob_cli.simulate.perturbation import violations
from modrob_cli.simulate.recording import Run
from modrob_cli.workflows.simulation_study import published_links
from tests.controlled_arms import Equations, Gains, control_task, controlled, sines
from tests.unit.simulate.arms import shipped, with_friction

RNG = 5


def state(dof: int) -> tuple[Array, Array, Desired]:
    """A state beside the motion."""
    q, dq, qd, dqd, ddqd = np.random.default_rng(RNG).uniform(-0.5, 0.5, (5, dof))
    return q, dq, Desired(qd, dqd, ddqd)


def rows_of_p(kp: float, kd: float, weight: float) -> Array:
    """B'P with A'P + PA = -weight 1, by SciPy."""
    A = np.array([[0.0, 1.0], [-kp, -kd]])
    return np.asarray(solve_continuous_lyapunov(A.T, -weight * np.eye(2))[1])


def worst(lower: Array, upper: Array, nominal: Array) -> float:
    return float(np.linalg.norm(np.maximum(np.abs(lower - nominal), np.abs(upper - nominal))))


@pytest.mark.parametrize("name", ["planar-2r", "lwa4p-rtable1"])
def test_ia_id_is_its_law(name: str) -> None:
    robot = shipped(name)
    arm, (q, dq, desired) = Equations(robot), state(robot.dof)
    gains: Gains = {"frequency": 12.0, "damping": 0.7, "robustness": 1.5, "weight": 2.0}
    found = make_controller("ia-id", control_task(robot, sines(robot.dof, 1.0), gains)).torque(0.0, q, dq, desired)
    e, de = desired.q - q, desired.dq - dq
    y = desired.ddq + 2.0 * 0.7 * 12.0 * de + 144.0 * e
    nominal = arm.M(q) @ y + arm.C(q, dq) @ dq + arm.g(q)
    bounds = exact_bounds(robot, q[None], dq[None], y[None])
    p = rows_of_p(144.0, 16.8, 2.0)
    expected = nominal + 1.5 * worst(bounds.lower[0], bounds.upper[0], nominal) ** 2 * (p[0] * e + p[1] * de)
    # central differences in C
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", ["planar-2r", "lwa4p-rtable1"])
def test_ia_pb_is_its_law_and_grows(name: str) -> None:
    robot = shipped(name)
    arm, (q, dq, desired) = Equations(robot), state(robot.dof)
    gains: Gains = {"error": 3.0, "robustness": 1.5, "robustness_growth": 4.0, "damping": 7.0, "damping_growth": 5.0}
    task = control_task(robot, sines(robot.dof, 1.0), {**gains, "precision": 0.01, "after_entry": 0.0}, rate=100.0)
    controller = make_controller("ia-pb", task)
    e, de = desired.q - q, desired.dq - dq
    dq_a, ddq_a = desired.dq + 3.0 * e, desired.ddq + 3.0 * de
    nominal = arm.M(q) @ ddq_a + arm.C(q, dq) @ dq_a + arm.g(q)
    bounds = exact_bounds_star(robot, q[None], dq[None], dq_a[None], ddq_a[None])
    rho = worst(bounds.lower[0], bounds.upper[0], nominal)
    for k in range(3):
        grown = k * 0.01 * np.linalg.norm(e)
        expected = nominal + ((1.5 + 4.0 * grown) * rho + 7.0 + 5.0 * grown) * (dq_a - dq)
        np.testing.assert_allclose(controller.torque(0.01 * k, q, dq, desired), expected, rtol=1e-7, atol=1e-7)


def growing(robot: Robot, gains: Gains) -> IntervalPassivityBased:
    return IntervalPassivityBased(control_task(robot, sines(robot.dof, 1.0), gains))


def off_by(controller: Controller, size: float) -> None:
    zero = np.zeros(2)
    controller.torque(0.0, np.array([size, 0.0]), zero, Desired(zero, zero, zero))


def test_growth_waits_for_the_first_entry_and_rests_within_the_precision() -> None:
    controller = growing(shipped("planar-2r"), {"precision": 0.01})
    off_by(controller, 0.05)
    assert controller.growth == 0.0
    off_by(controller, 0.005)
    assert controller.growth == 0.0
    off_by(controller, 0.05)
    assert controller.growth == pytest.approx(0.05e-3)
    off_by(controller, 0.009)
    assert controller.growth == pytest.approx(0.05e-3)


def test_growth_rests_at_a_torque_limit() -> None:
    robot = shipped("planar-2r")
    joints = tuple(replace(joint, limits=Limits(torque=(-1.0, 1.0))) for joint in robot.joints)
    controller = growing(replace(robot, joints=joints, gravity=np.zeros(3)), {"after_entry": 0.0})
    off_by(controller, 0.05)
    assert controller.growth == 0.0


def test_growth_rests_while_commands_chatter() -> None:
    robot = shipped("planar-2r")
    loud, quiet = (growing(robot, {"after_entry": 0.0, "chatter": limit}) for limit in (1.0, 1e4))
    for k in range(50):
        for controller in (loud, quiet):
            off_by(controller, 0.1 if k % 2 else -0.1)
    # the first command has no fast part yet
    assert loud.growth <= 1.01 * 0.1e-3
    assert quiet.growth == pytest.approx(50 * 0.1e-3)


def test_cr_is_its_law() -> None:
    robot = shipped("planar-2r")
    arm, (q, dq, desired) = Equations(robot), state(2)
    constants: Gains = {"inverse_inertia": 1.2, "alpha": 0.6, "eta": 50.0, "acceleration": 9.0}
    for smoothing in (1e-6, 0.5):
        gains: Gains = {"frequency": 12.0, "damping": 0.7, "weight": 1.0, "smoothing": smoothing, **constants}
        task = control_task(robot, sines(2, 1.0), gains)
        found = make_controller("cr", task).torque(0.0, q, dq, desired)
        e, de = desired.q - q, desired.dq - dq
        p = rows_of_p(144.0, 16.8, 1.0)
        z, xi = p[0] * e + p[1] * de, np.concatenate([e, de])
        size = np.linalg.norm(np.hstack([144.0 * np.eye(2), 16.8 * np.eye(2)]), 2)
        rho = (0.6 * 9.0 + 0.6 * size * np.linalg.norm(xi) + 1.2 * 50.0) / 0.4
        nu = rho * z / np.linalg.norm(z) if np.linalg.norm(z) >= smoothing else rho * z / smoothing
        expected = arm.M(q) @ (desired.ddq + 16.8 * de + 144.0 * e + nu) + arm.C(q, dq) @ dq + arm.g(q)
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7)


def test_cr_does_not_exist_for_a_nominal_robot_far_from_others() -> None:
    with pytest.raises(UsageError, match="below 1"):
        make_controller("cr", control_task(shipped("lwa4p-rtable1"), sines(6, 1.0), {}))


def test_r_alpha_dominates_every_torque_up_to_rho() -> None:
    robot = shipped("planar-2r")
    q, dq, desired = state(2)
    constants: Gains = {"least_inertia": 0.8, "most_inertia": 30.0, "coriolis": 9.0, "gravity": 200.0}
    gains: Gains = {"error": 2.0, "damping": 35.0, "smoothing": 1e-3, **constants}
    found = make_controller("r-alpha", control_task(robot, sines(2, 1.0), gains)).torque(0.0, q, dq, desired)
    dq_a = desired.dq + 2.0 * (desired.q - q)
    ddq_a = desired.ddq + 2.0 * (desired.dq - dq)
    r = dq_a - dq
    rho = 30.0 * np.linalg.norm(ddq_a) + 9.0 * np.linalg.norm(dq_a) * np.linalg.norm(dq) + 200.0
    robust = found - 35.0 * r
    assert np.linalg.norm(robust) <= rho
    # r'u exceeds what a perturbation of size rho can do, but for the smoothing
    assert r @ robust >= rho * np.linalg.norm(r) - 1e-3
    np.testing.assert_allclose(robust / np.linalg.norm(robust), r / np.linalg.norm(r), rtol=1e-12)


def test_sampled_constants_of_the_planar_arm() -> None:
    """[D] 3.5 with M11 of physics; extremes over the box in closed form, which fewer samples approach from inside."""
    motion = sines(2, 3.0)
    found = sampled_constants(control_task(shipped("planar-2r"), motion, {}))
    q2 = np.linspace(0.0, np.pi, 2001)
    m, J, c = 10.0, 25.0 / 12.0, 0.525
    M = np.array([[10.0 / 12.0 + J + 2.5 + m * (1 + c**2 + 2 * c * np.cos(q2)), J + m * (c**2 + c * np.cos(q2))]] * 2)
    M[1, 0], M[1, 1] = M[0, 1], J + m * c**2
    largest = np.linalg.eigvalsh(np.moveaxis(M, 2, 0))[:, 1].max()
    assert 0.85 * largest <= found["most_inertia"] <= largest
    assert 170.0 <= found["gravity"] <= (5 + 10 * 1.525) * 9.81 + 10 * 0.525 * 9.81
    assert 0.662 <= found["least_inertia"] <= 0.85  # the sampled one of benchmarks.papers_bounds
    assert found["inverse_inertia"] == pytest.approx(1.0 / found["least_inertia"])
    assert 0.8 <= found["alpha"] < 1.0
    planned = motion.sample(np.linspace(0.0, 3.0, 200), 2)[:, 2]
    assert found["acceleration"] == pytest.approx(np.linalg.norm(planned, axis=1).max())


def noisy_run(robot: Robot, name: str, bounds: BoundsMethod, scenario: Scenario) -> Run:
    """With noise, friction and a delay; commands are cut at no limit."""
    said = Control(bounds=bounds)
    motion = sines(robot.dof, 0.4)
    task = ControlTask(ControlModel(robot), motion, 1e-3, said, published_links(robot))
    sensors = Sensors(velocity=Channel(noise=1e-3), delay=1e-3)
    scenario = replace(scenario, sensors=sensors, saturation=False, end_stops=False)
    return controlled(robot, motion, make_controller(name, task), scenario=scenario, bounds=bounds)


@pytest.mark.parametrize("name", ["ia-id", "ia-pb"])
@pytest.mark.parametrize("bounds", ["exact", "ianea"])
@pytest.mark.parametrize("arm", ["lwa4p-6-tol5", "planar-2r", "lwa4p-table34"])
def test_true_perturbation_is_within_its_bounds(arm: str, bounds: BoundsMethod, name: str) -> None:
    robot = shipped(arm)
    for seed in range(2):
        run = noisy_run(robot, name, bounds, Scenario(truth=Truth(draw="vertices" if seed else "uniform"), seed=seed))
        values = run.recording.values
        w, lower, upper = (values[key] for key in ("perturbation", "phi_lower", "phi_upper"))
        assert run.diverged is None
        assert w.shape == values["q"].shape
        assert violations(w, lower, upper)[0].sum() == 0
        # not trivially so: the truth uses a good part of the bounds somewhere
        assert (np.abs(w) > 0.1 * np.maximum(np.abs(lower), np.abs(upper))).any()


def test_recorded_perturbation_is_what_the_true_arm_lacks() -> None:
    """M (y - ddq) = w - what the robust part adds, at every command, from the true arm's own motion. [D] (3.4)."""
    robot = with_friction(shipped("planar-2r"), 1.0, 0.0)
    truth = Truth(draw="vertices")
    said: Gains = {"frequency": 20.0, "damping": 0.9, "robustness": 0.0}
    run = controlled(robot, sines(2, 0.3), "ia-id", said, Scenario(truth=truth, seed=3))
    values, arm = run.recording.values, Equations(run.truth.robot)
    for k in range(0, len(run.recording.t), 30):
        q, dq, ddq = (values[key][k] for key in ("q", "dq", "ddq"))
        desired = run.recording.desired[k]
        y = desired[2] + 36.0 * (desired[1] - dq) + 400.0 * (desired[0] - q)
        np.testing.assert_allclose(arm.M(q) @ (y - ddq), values["perturbation"][k], rtol=0, atol=1e-8)


def test_unknown_payload_shows_as_violations() -> None:
    inertia = Uncertain.exact(0.01 * np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0]))
    payload = RigidBody("unknown", Uncertain.exact(3.0), Uncertain.exact(np.zeros(3)), inertia)
    run = noisy_run(shipped("lwa4p-6-tol5"), "ia-pb", "exact", Scenario(payload=payload))
    values = run.recording.values
    counts, beyond = violations(*(values[key] for key in ("perturbation", "phi_lower", "phi_upper")))
    assert counts.sum() > 0
    assert beyond.max() > 1.0


def test_published_bounds_need_link_parameters() -> None:
    with pytest.raises(UsageError, match="links"):
        make_controller("ia-pb", control_task(shipped("planar-2r"), sines(2, 1.0), {}, bounds="ianea"))


def test_which_controllers_bound_their_perturbation() -> None:
    assert [name for name in ("id", "pb", "ia-id", "ia-pb", "cr", "mine.py") if bounds_perturbation(name)] == [
        "ia-id",
        "ia-pb",
    ]


def test_input_disturbance_is_uniform_within_its_bounds_and_counts_as_external() -> None:
    robot = with_friction(shipped("planar-2r"), 0.0, 0.0)
    scenario = Scenario(input_disturbance=(3.0, 7.0), seed=2)
    run = controlled(robot, sines(2, 1.0), "id", {}, scenario)
    d = run.recording.values["external"]
    assert (np.abs(d) <= [3.0, 7.0]).all()
    # standard deviation of a uniform variable; 1000 samples give it to 3 %
    np.testing.assert_allclose(d.std(axis=0), np.array([3.0, 7.0]) / np.sqrt(3.0), rtol=0.1)
    np.testing.assert_allclose(run.recording.values["friction"], 0.0, atol=1e-9)
    assert run.energy_error < 1e-6
    with pytest.raises(UsageError, match="found 3 values for 2 joints"):
        controlled(robot, sines(2, 1.0), "id", {}, Scenario(input_disturbance=(1.0, 1.0, 1.0)))
