"""Controllers in the closed loop, against the equations that their errors must follow."""

import numpy as np
import pytest
from scipy.linalg import expm

from modrob_cli.arrays import Array
from modrob_cli.model.scenario import Channel, Scenario, Sensors
from modrob_cli.simulate.controllers.interface import ControlTask, Desired
from modrob_cli.simulate.controllers.passivity import AdaptivePassivityBased
from modrob_cli.simulate.controllers.shipped import CONTROLLERS, make_controller
from modrob_cli.simulate.recording import Run
from tests.controlled_arms import Equations, Gains, Watched, control_task, controlled, errors, sines
from tests.unit.simulate.arms import shipped, slider, with_friction, with_rotors, without_friction


def companion(t: Array, coefficients: list[float], start: list[float]) -> Array:
    """x(t) with x^(m) + c_(m-1) x^(m-1) + ... + c_0 x = 0 from given x, x', ... at 0; shape of t."""
    m = len(coefficients)
    A = np.eye(m, k=1)
    A[-1] = -np.array(coefficients)
    return np.array([(expm(A * time) @ start)[0] for time in t])


@pytest.mark.parametrize("name", ["lwa4p-6", "scara", "planar-2r"])
@pytest.mark.parametrize(("damping", "integral"), [(0.65, 0.0), (1.4, 0.0), (0.2, 0.0), (0.65, 2000.0)])
def test_id_error_is_that_of_the_chosen_linear_system(name: str, damping: float, integral: float) -> None:
    robot = without_friction(shipped(name))
    motion = sines(robot.dof, 0.3)
    offset = np.linspace(0.02, -0.03, robot.dof)
    first = motion.sample([0.0], 1)[0]
    scenario = Scenario(initial_q=first[0] - offset, initial_dq=first[1])
    gains: Gains = {"frequency": 20.0, "damping": damping, "integral": integral}
    run = controlled(robot, motion, "id", gains, scenario, rate=10000.0)
    e = errors(run)[0][::50]
    times = run.recording.t[::50]
    if integral:
        # e'(0) = 0; e'' + 2 z w e' + w^2 e = -K_I int e = 0 at the start
        shape = companion(times, [integral, 400.0, 40.0 * damping], [1.0, 0.0, -400.0])
    else:
        shape = companion(times, [400.0, 40.0 * damping], [1.0, 0.0])
    # a torque that is held for 0.1 ms comes 0.05 ms late on average: 20 rad/s * 0.05 ms = 0.1 % of the error's size,
    # times what the held gravity and Coriolis torques add; twice the rate halves the difference
    assert np.abs(e - shape[:, None] * offset).max() < 3e-3 * 0.03


def test_id_error_equation_holds_at_every_command() -> None:
    """Just after each command the accelerations are what the law asks for, whatever the rate."""
    robot = with_friction(shipped("lwa4p-6"), 5.0, 0.0)
    scenario = Scenario(initial_q=np.full(6, 0.05), saturation=False)
    run = controlled(robot, sines(6, 1.0), "id", {"frequency": 30.0, "damping": 0.5}, scenario, rate=200.0)
    e, de, dde = errors(run)
    np.testing.assert_allclose(dde + 30.0 * de + 900.0 * e, 0.0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["lwa4p-6", "scara"])
def test_passivity_based_closed_loop(name: str) -> None:
    """[D] (2.33): M r' + C r + Lambda r = 0."""
    robot = with_friction(shipped(name), 3.0 if name == "lwa4p-6" else 0.1, 0.0)
    arm = Equations(robot)
    kr, damping = np.linspace(10.0, 20.0, robot.dof), np.linspace(4.0, 9.0, robot.dof)
    if name == "scara":
        damping[3] = 0.01  # its last axis has an inertia of 0.0014 kg m^2
    scenario = Scenario(initial_q=np.full(robot.dof, 0.02), saturation=False, end_stops=False)
    run = controlled(robot, sines(robot.dof, 1.0), "pb", {"error": tuple(kr), "damping": tuple(damping)}, scenario)
    e, de, dde = errors(run)
    q, dq = (run.recording.values[key] for key in ("q", "dq"))
    for k in range(0, len(q), 50):
        r, rate = de[k] + kr * e[k], dde[k] + kr * de[k]
        left = arm.M(q[k]) @ rate + arm.C(q[k], dq[k]) @ r + damping * r
        scale = np.abs(arm.M(q[k]) @ dde[k]).max() + np.abs(damping * r).max()
        # central differences in C, 1e-9; masses up to a few kg
        assert np.abs(left).max() <= 1e-8 * max(scale, 1.0)


def adaptive_run(controller: AdaptivePassivityBased, task: ControlTask) -> tuple[Run, Watched]:
    watched = Watched(controller, ("viscous", "coulomb"))
    # starts far from the motion
    scenario = Scenario(initial_q=np.full(task.model.dof, 0.1), saturation=False)
    robot, motion = task.model.robot, task.trajectory
    return controlled(robot, motion, watched, {}, scenario, rate=1.0 / task.period), watched


def test_adaptive_closed_loop_and_its_lyapunov_function() -> None:
    """M r' + C r + Lambda r = -Y b with b = beta_hat - beta; V = r'M r / 2 + b'K b / 2 falls at the rate r'Lambda r."""
    robot = shipped("lwa4p-4")
    arm = Equations(robot)
    gains: Gains = {"error": 10.0, "damping": 20.0, "adaptation": 0.5, "viscous_guess": 0.0, "coulomb_guess": 0.0}
    task = control_task(robot, sines(4, 2.0, slowest=2.0), gains, rate=2000.0, friction_band=0.0)
    controller = AdaptivePassivityBased(task)
    run, watched = adaptive_run(controller, task)
    e, de, dde = errors(run)
    q, dq = (run.recording.values[key] for key in ("q", "dq"))
    guesses = np.array(watched.seen)
    wrong = guesses - np.stack([arm.viscous, arm.coulomb])
    r = de + 10.0 * e
    V = []
    for k in range(len(q)):
        V.append(0.5 * r[k] @ arm.M(q[k]) @ r[k] + 0.5 * 0.5 * (wrong[k] ** 2).sum())
        if k % 200 == 0 and np.abs(dq[k]).min() > 0.0:
            left = arm.M(q[k]) @ (dde[k] + 10.0 * de[k]) + arm.C(q[k], dq[k]) @ r[k] + 20.0 * r[k]
            right = -wrong[k, 0] * dq[k] - wrong[k, 1] * np.sign(dq[k])
            np.testing.assert_allclose(left, right, rtol=0, atol=1e-6)
    lost = V[0] - np.array(V)
    damped = np.cumsum(20.0 * (r**2).sum(axis=1)) / 2000.0
    assert lost[-1] > 0.3 * V[0]
    # commands every 0.5 ms: V may be off by about that part of how fast it changes
    assert np.abs(lost[1:] - damped[:-1]).max() < 0.02 * V[0]
    assert np.diff(V).max() < 1e-3 * V[0]


def test_friction_is_learned() -> None:
    """Under excitation and without a wrong model the estimates approach the truth, from nothing."""
    robot = without_friction(with_rotors(shipped("2r-side"), 0.2))
    robot = with_friction(robot, 2.5, 1.8)
    gains: Gains = {"adaptation": 0.05, "viscous_guess": 0.0, "coulomb_guess": 0.0}
    task = control_task(robot, sines(2, 20.0, amplitude=1.0, slowest=1.5), gains)
    controller = make_controller("pb-afc", task)
    assert isinstance(controller, AdaptivePassivityBased)
    run = controlled(robot, task.trajectory, controller)
    # within the band of 0.02 rad/s the true friction jumps and the learned one does not; with the holding of commands
    # that leaves some hundredths
    np.testing.assert_allclose(controller.viscous, 2.5, rtol=0.1)
    np.testing.assert_allclose(controller.coulomb, 1.8, rtol=0.1)
    size = np.linalg.norm(errors(run)[0], axis=1)
    assert size[-4000:].max() < 0.2 * size[:4000].max()


def test_pid_leaves_the_chosen_second_order_system_and_the_pole_of_the_motor() -> None:
    """One axis that is its actuator alone: (J s + b)(s^2 + 2 z w s + w^2) e = 0."""
    J, b, w, z = 0.4, 6.0, 25.0, 0.6
    robot = with_friction(with_rotors(slider(0.0), J), b, 0.0)
    motion = sines(1, 0.6)
    first = motion.sample([0.0], 1)[0]
    scenario = Scenario(initial_q=first[0] - 0.1, initial_dq=first[1])
    run = controlled(robot, motion, "pid", {"frequency": w, "damping": z}, scenario, rate=10000.0)
    product = np.polymul([1.0, b / J], [1.0, 2 * z * w, w * w])
    # int e = 0 at the start: e'' = -(K_P e) / J
    start = [0.1, 0.0, -0.1 * (w * w + 2 * z * w * b / J)]
    expected = companion(run.recording.t[::50], product[:0:-1].tolist(), start)
    # held for 0.1 ms, 0.05 ms late: 25 / s * 0.05 ms of 0.1
    assert np.abs(errors(run)[0][::50, 0] - expected).max() < 4e-3 * 0.1


class Clock:
    """Counts, and gives a torque that is the number of the call."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        self.times.append(t)
        return np.array([float(len(self.times))])


@pytest.mark.parametrize("rate", [250.0, 1000.0])
def test_commands_are_held(rate: float) -> None:
    """A block of 2 kg: its velocity is the sum of the held forces times the period over the mass."""
    clock = Clock()
    run = controlled(slider(2.0), sines(1, 0.1, amplitude=0.0), clock, rate=rate)
    count = round(0.1 * rate)
    np.testing.assert_allclose(clock.times, np.arange(count + 1) / rate, rtol=0, atol=1e-12)
    summed = np.concatenate([[0.0], np.cumsum(np.arange(1.0, count + 1))]) / rate / 2.0
    np.testing.assert_allclose(run.recording.values["dq"][:, 0], summed, rtol=0, atol=1e-12)


def test_slower_commands_make_larger_errors_but_still_work() -> None:
    robot = without_friction(shipped("lwa4p-6"))
    sizes = [
        np.abs(errors(controlled(robot, sines(6, 2.0), "id", rate=rate))[0]).max() for rate in (125.0, 250.0, 1000.0)
    ]
    assert sizes[0] > 1.5 * sizes[1] > 4.0 * sizes[2]
    assert sizes[0] < 0.01


NOISY = Sensors(position=Channel(2e-6, 1e-5), velocity=Channel(1e-3), delay=0.002)


# cr and r-alpha dominate the worst case everywhere: they need gains, and a rate, for each arm
@pytest.mark.parametrize("name", sorted(set(CONTROLLERS) - {"cr", "r-alpha"}))
@pytest.mark.parametrize(
    "arm_name", ["2r-folded", "lwa4p-4-balls", "lwa4p-6", "lwa4p-8", "lwa4p-rtable1", "planar-2r", "scara"]
)
def test_default_gains_follow_on_every_kind_of_arm(arm_name: str, name: str) -> None:
    """With noise and 2 ms of delay. Errors come from stiction and the delay; an unstable loop has far larger ones."""
    robot = shipped(arm_name)
    size = np.array([1.0 if joint.type == "revolute" else 0.05 for joint in robot.joints])
    motion = sines(robot.dof, 1.5, amplitude=0.3, size=size)
    start = motion.sample([0.0], 0)[0, 0]
    gains: Gains = {}
    if (arm_name, name) == ("scara", "pid"):
        # its links weigh far more than its rotors: gains for the actuators alone make it unstable
        gains = {"inertia": tuple(np.diag(Equations(robot).M(start)))}
    scenario = Scenario(sensors=NOISY, end_stops=False)
    run = controlled(robot, motion, name, gains, scenario)
    assert run.diverged is None
    late = np.abs(errors(run)[0][1000:]).max()
    assert late < 0.06
