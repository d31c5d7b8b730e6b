"""Gains: names, lengths, signs; what is left out; integrals at a torque limit."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.errors import UsageError
from modrob_cli.model.joint import Limits
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Scenario
from modrob_cli.simulate.controllers.interface import Desired
from modrob_cli.simulate.controllers.passivity import AdaptivePassivityBased
from modrob_cli.simulate.controllers.shipped import CONTROLLERS, make_controller
from tests.controlled_arms import Equations, Gains, control_task, controlled, errors, sines
from tests.unit.simulate.arms import one_joint, shipped, slider, with_friction, with_rotors

NAMES = sorted(CONTROLLERS)


def refused(name: str, gains: Gains, robot: Robot, **control: str) -> str:
    with pytest.raises(UsageError) as caught:
        make_controller(name, control_task(robot, sines(robot.dof, 1.0), gains, **control))
    return str(caught.value)


def test_unknown_controller_names_the_known_ones() -> None:
    message = refused("lqr", {}, shipped("scara"))
    assert "'lqr'" in message
    assert all(name in message for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_unknown_gain_names_the_known_ones(name: str) -> None:
    message = refused(name, {"stiffness": 1.0, "damping": 1.0}, shipped("scara"))
    assert "stiffness" in message.split("expected")[0]
    assert "damping" in message.split("expected")[1]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [(1.0, 2.0), (1.0,), (), float("nan"), (1.0, 2.0, float("inf"), 3.0), -1.0])
def test_wrong_values_are_named(name: str, bad: float | tuple[float, ...]) -> None:
    message = refused(name, {"damping": bad}, shipped("scara"))
    assert "damping" in message
    if isinstance(bad, tuple) and len(bad) != 4:
        assert f"{len(bad)} values for 4 joints" in message


@pytest.mark.parametrize(
    ("name", "gain"),
    [("id", "frequency"), ("pid", "frequency"), ("pb", "error"), ("pb", "damping"), ("pb-afc", "adaptation")],
)
def test_zero_is_refused_where_it_makes_no_sense(name: str, gain: str) -> None:
    assert "expected numbers > 0" in refused(name, {gain: 0.0}, shipped("scara"))


def test_gain_without_default_that_is_missing_is_named() -> None:
    task = control_task(shipped("scara"), sines(4, 1.0), {})
    with pytest.raises(UsageError, match="stiffness is missing"):
        task.gain("stiffness")


def test_adaptive_control_without_friction_makes_no_sense() -> None:
    assert "friction" in refused("pb-afc", {}, shipped("scara"), friction="none")


def test_inertia_that_a_joint_feels() -> None:
    """Two links in a plane: 1 / (M^-1)_11 = det M / M_22; smallest where the second link is stretched, or folded."""
    robot = shipped("planar-2r")
    task = control_task(robot, sines(2, 20.0, amplitude=np.pi), {})  # q2 passes all angles
    arm = Equations(robot)
    q2 = np.linspace(-np.pi, np.pi, 2001)
    M = np.stack([arm.M(np.array([0.0, angle])) for angle in q2])
    det = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] ** 2
    expected = [(det / M[:, 1, 1]).min(), (det / M[:, 0, 0]).min()]
    # 50 states along the motion come near to the extreme, at which the function is flat
    np.testing.assert_allclose(task.joint_inertia(), expected, rtol=0.02)


@pytest.mark.parametrize("name", ["feedforward-pd", "pb", "pb-afc", "pid"])
def test_left_out_gains_come_from_that_inertia(name: str) -> None:
    """A block of 3 kg without a rotor: the force for an error of position, or of velocity, is 3 times a known one."""
    robot = slider(3.0)
    task = control_task(robot, sines(1, 1.0), {})
    kp, kd = {"pid": (2500.0, 65.0), "feedforward-pd": (35.0**2, 45.5)}.get(name, (42.0**2, 84.0))
    zero, one = np.zeros(1), np.ones(1)
    stiff = make_controller(name, task).torque(0.0, zero, zero, Desired(one, zero, zero))
    damped = make_controller(name, task).torque(0.0, zero, zero, Desired(zero, one, zero))
    assert stiff == pytest.approx([3.0 * kp], rel=1e-12)
    assert damped == pytest.approx([3.0 * kd], rel=1e-12)


def test_pid_takes_the_rotor_where_there_is_one() -> None:
    robot = with_friction(with_rotors(slider(3.0), 0.5), 2.0, 0.0)
    zero, one = np.zeros(1), np.ones(1)
    torque = make_controller("pid", control_task(robot, sines(1, 1.0), {})).torque(
        0.0, zero, zero, Desired(one, zero, zero)
    )
    assert torque == pytest.approx([0.5 * 2500.0 + 2 * 0.65 * 50.0 * 2.0], rel=1e-12)


@pytest.mark.parametrize("name", ["pid", "feedforward-pd", "pb"])
def test_arm_without_any_inertia_is_refused(name: str) -> None:
    robot = one_joint("revolute", np.eye(4), 0.0, inertia=0.0)
    message = refused(name, {}, robot)
    assert "inertia" in message or "damping" in message


def limited(robot: Robot, torque: float) -> Robot:
    limits = Limits(torque=(-torque, torque))
    return replace(robot, joints=tuple(replace(joint, limits=limits) for joint in robot.joints))


@pytest.mark.parametrize(("name", "gain"), [("pid", "ki"), ("id", "integral"), ("pb", "integral")])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_integral_stands_still_at_a_torque_limit(name: str, gain: str, side: float) -> None:
    """While the command is beyond the limit and the error pushes it further; the other way it moves on at once."""
    robot = limited(slider(2.0), 10.0)
    controller = make_controller(name, control_task(robot, sines(1, 1.0), {gain: 100.0}))
    zero = np.zeros(1)

    def torque(position: float) -> float:
        return float(controller.torque(0.0, zero, zero, Desired(np.array([position]), zero, zero))[0])

    far = [side * torque(side) for _ in range(100)]
    assert min(far) > 10.0
    assert far[0] == far[-1]
    at_rest = torque(0.0)
    assert abs(at_rest) < 1e-9  # nothing was summed up at the limit
    torque(side * 1e-4)
    torque(side * 1e-4)
    assert side * torque(0.0) > 0.0  # below it the integral works


def test_long_saturation_leaves_little_overshoot_behind() -> None:
    """A block 3 m away, whose motor may give a sixtieth of what it is asked for."""
    gains: Gains = {"kp": 100.0, "kd": 60.0, "ki": 40.0}
    scenario = Scenario(initial_q=np.array([-3.0]))
    run = controlled(limited(slider(2.0), 5.0), sines(1, 12.0, amplitude=0.0), "pid", gains, scenario)
    assert run.saturated[0] > 0.1
    # an integral that goes on summing at the limit overshoots by 1.4 m
    assert -errors(run)[0].min() < 0.1 * 3.0


def test_what_is_learned_stands_still_at_a_torque_limit() -> None:
    robot = limited(with_friction(slider(2.0), 1.0, 1.0), 10.0)
    controller = make_controller("pb-afc", control_task(robot, sines(1, 1.0), {}))
    assert isinstance(controller, AdaptivePassivityBased)
    dq, zero = np.ones(1), np.zeros(1)
    far, back = Desired(np.ones(1), dq, zero), Desired(-np.ones(1), dq, zero)
    controller.torque(0.0, zero, dq, far)
    assert [controller.viscous.item(), controller.coulomb.item()] == [1.0, 1.0]
    controller.torque(0.0, zero, dq, back)  # r = -42, for 1 ms; at the lower limit too: friction would push down
    assert [controller.viscous.item(), controller.coulomb.item()] == [1.0, 1.0]
    near = Desired(np.array([1e-3]), dq, zero)
    controller.torque(0.0, zero, dq, near)  # 3.5 N and friction
    assert controller.viscous == pytest.approx(1.0 + 1e-3 * 0.042, rel=1e-12)
    assert controller.coulomb == pytest.approx(1.0 + 1e-3 * 0.042, rel=1e-12)


def test_learned_friction_never_pushes() -> None:
    controller = make_controller("pb-afc", control_task(slider(2.0), sines(1, 1.0), {"adaptation": 1e-3}))
    assert isinstance(controller, AdaptivePassivityBased)
    dq, zero = np.ones(1), np.zeros(1)
    controller.torque(0.0, zero, dq, Desired(zero, 0.5 * dq, zero))  # faster than desired: less friction than known
    assert [controller.viscous.item(), controller.coulomb.item()] == [0.0, 0.0]
