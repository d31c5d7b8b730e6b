"""Events by hand-made signals; the observer against its own differential equation; accelerations by closed form."""

from pathlib import Path

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import VelocityKnowledge, measured_acceleration
from modrob_cli.collision.baselines import GAINS, beyond, constant_thresholds, tune_observer
from modrob_cli.collision.events import Band, Contact, Rules, find_events, score
from modrob_cli.collision.observer import MomentumTerms, external_torque, momentum_terms
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.errors import NumericalError
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]


def test_excess_and_residual() -> None:
    one = np.ones((3, 1))
    band = Band(np.arange(3.0), np.array([[2.5], [0.0], [-3.0]]), -one, 2 * one, 0.5 * one)
    assert band.excess[:, 0].tolist() == [0.5, 0.0, -2.0]
    assert band.residual[:, 0].tolist() == [2.0, -0.5, -3.5]


def test_events_merge_and_have_a_shortest_duration() -> None:
    t: Array = np.arange(100, dtype=float) * 0.01
    excess = np.zeros((100, 2))
    excess[10:20, 0] = 1.0
    excess[15, 0] = 4.0
    excess[23:25, 0] = 2.0  # 40 ms behind: one event with the first
    excess[40, 0] = 1.0  # a single sample
    excess[50:60, 1] = -3.0
    found = find_events(t, excess, Rules(0.05, 0.0))
    assert [(event.joint, event.side) for event in found] == [(0, "upper"), (0, "upper"), (1, "lower")]
    assert (found[0].start, found[0].end, found[0].peak, found[0].peak_time) == pytest.approx((0.1, 0.24, 4.0, 0.15))
    assert (found[2].start, found[2].end, found[2].peak) == pytest.approx((0.5, 0.59, 3.0))
    assert len(find_events(t, excess, Rules(0.05, 0.02))) == 2
    assert len(find_events(t, excess, Rules(0.01, 0.0))) == 4
    assert find_events(t, np.zeros((100, 2)), Rules()) == []


def test_score_against_known_contacts() -> None:
    t: Array = np.arange(100, dtype=float) * 0.01
    excess = np.zeros((100, 1))
    for first in (20, 45, 80):
        excess[first : first + 3] = 1.0
    events = find_events(t, excess, Rules(0.05, 0.0))
    contacts = [Contact("a", 0.15, 0.3), Contact("b", 0.4, 0.42), Contact("c", 0.6, 0.7)]
    found = score(t, excess, events, contacts, 0.05)
    assert found.delays[:2] == pytest.approx((0.05, 0.05))
    assert found.delays[2] is None
    assert (found.detected, found.false_alarms) == (2, 1)
    assert found.false_samples == pytest.approx(
        4 / (100 - 20 - 7 - 15)
    )  # the third one, and the last sample of the second
    assert score(t, excess, events, [], 0.05).false_alarms == 3


def test_observer_answers_as_a_first_order_lag() -> None:
    """With the true model, r follows the external torque with the time constant 1 / K."""
    robot = load_robot(ROOT / "assemblies" / "lwa4p-6.yaml").robot
    t: Array = np.arange(0.0, 2.0, 1e-3)
    w: Array = np.arange(1, 7, dtype=float) * 0.7
    angle: Array = np.outer(t, w)
    q, dq, ddq = np.sin(angle), w * np.cos(angle), -w * w * np.sin(angle)
    push = np.where(t[:, None] < 0.5, 0.0, np.array([3.0, -5.0, 2.0, 0.0, 1.0, -0.4]))
    gears = np.array([joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal) for joint in robot.joints])
    viscous = np.array([float(joint.friction.viscous.nominal) for joint in robot.joints])
    coulomb = np.array([float(joint.friction.coulomb.nominal) for joint in robot.joints])
    bands = np.array([joint.friction.velocity_band for joint in robot.joints])
    sign = np.where(np.abs(dq) <= bands, 0.0, np.sign(dq))
    tau = inverse_dynamics(robot, q, dq, ddq) + gears * ddq + viscous * dq + coulomb * sign - push
    r = external_torque(momentum_terms(robot, t, q, dq, tau), 20.0)
    since = np.maximum(t - 0.5, 0.0)[:, None]
    wanted = push * (1.0 - np.exp(-20.0 * since))
    # The trapezoidal rule smears the step over one sample (20 * 5 * 1e-3 / 2); else errors are of order h^2.
    assert np.abs(r - wanted).max() < 0.06
    assert np.allclose(r[-1], push[-1], atol=2e-3)


def test_thresholds_are_the_largest_plus_a_margin() -> None:
    residuals = [np.array([[1.0, -2.0], [0.5, 1.0]]), np.array([[-3.0, 0.0]])]
    limits = constant_thresholds(residuals, 0.2)
    assert limits == pytest.approx([3.6, 2.4])
    assert beyond(np.array([[4.0, -3.0], [-3.6, 2.0]]), limits) == pytest.approx(np.array([[0.4, -0.6], [0.0, 0.0]]))


def test_the_gain_is_low_for_noise_and_high_for_a_slow_error() -> None:
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 5.0, 1e-3)
    noisy = MomentumTerms(t, rng.normal(size=(len(t), 1)) * 1e-3, np.zeros((len(t), 1)))
    slow = MomentumTerms(t, np.zeros((len(t), 1)), np.ones((len(t), 1)))
    assert tune_observer([noisy], 0.2).gain <= 10.0
    assert tune_observer([slow], 0.2).gain == GAINS[-1]
    assert tune_observer([slow], 0.2).thresholds == pytest.approx([1.2], rel=1e-6)


def known(noise: float, jerk: float, jump: float = 0.0, still: float = 0.0) -> VelocityKnowledge:
    return VelocityKnowledge(*(np.array([value]) for value in (noise, jerk, jump, still)))


def test_accelerations_lie_within_their_tolerance() -> None:
    """dq = sin(3 t): jerk at most 9; noise at its bound with random signs."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 3.0, 1e-3)
    dq = np.sin(3.0 * t)[:, None]
    noise = 2e-4
    measured = dq + noise * rng.choice([-1.0, 1.0], dq.shape)
    ddq, tolerance, first = measured_acceleration(t, measured, known(noise, 9.0))
    assert first == 9  # 2 sqrt(2e-4 / 9) / 1e-3
    error = np.abs(ddq - 3.0 * np.cos(3.0 * t)[:, None])[first:]
    assert (error <= tolerance[first:]).all()
    assert tolerance[first:].max() == pytest.approx(2.0 * np.sqrt(noise * 9.0), rel=0.02)  # whole windows
    assert error.max() > 0.7 * tolerance[first:].max()


def test_a_jump_is_allowed_where_a_joint_may_reverse() -> None:
    """The velocity is a triangle: its acceleration jumps from -1 to 1 where it is zero."""
    t = np.arange(0.0, 2.0, 1e-2)
    dq = np.abs(t - 1.0)[:, None]
    ddq, tolerance, first = measured_acceleration(t, dq, known(1e-3, 1.0, 2.0, 0.02))
    true = np.where(t < 1.0 - 1e-9, -1.0, 1.0)[:, None]
    assert (np.abs(ddq - true) <= tolerance)[first:].all()
    without = measured_acceleration(t, dq, known(1e-3, 1.0))[1]
    assert not (np.abs(ddq - true) <= without)[first:].all()
    assert (tolerance > 2.0).mean() < 0.15


def test_refuses_accelerations_without_a_bound() -> None:
    t, dq = np.arange(4.0), np.zeros((4, 1))
    with pytest.raises(NumericalError, match="jerk"):
        measured_acceleration(t, dq, known(1e-3, 0.0))
    with pytest.raises(NumericalError, match="shorter"):
        measured_acceleration(t, dq, known(100.0, 1.0))
