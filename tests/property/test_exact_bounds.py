"""Exact torque bounds: nothing outside, every bound reached, the rounding covered.

References: Pinocchio for torques of sampled and constructed parameters, 60-digit arithmetic for the rounding
(tests/high_precision.py), both independent of the package's Newton-Euler code.
"""

import os
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.dynamics import margin
from modrob_cli.dynamics.ddq_bounds import ddq_bounds
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.exact_star import exact_bounds_star
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.robots import load_robot
from tests.box_members import many_torques, random_parameters, rigid_torque, with_parameters, worst_parameters
from tests.high_precision import cos_sin, nominal_parameters, rigid_torques
from tests.random_chains import random_chain

ROOT = Path(__file__).parents[2]
STATES = int(os.environ.get("MODROB_STATES", "25"))
UNCERTAIN = ("lwa4p-table34", "lwa4p-6-tol5", "lwa4p-6-payload", "lwa4p-rtable1", "scara", "planar-2r")


def shipped(name: str) -> Robot:
    return load_robot(ROOT / "assemblies" / f"{name}.yaml").robot


def without_drives(robot: Robot) -> Robot:
    """The rigid bodies alone."""
    joints = tuple(replace(joint, friction=Friction(), drive=Drive()) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))


def states(robot: Robot, seed: int, count: int = STATES) -> tuple[Array, Array, Array]:
    q, dq, ddq = np.random.default_rng(seed).uniform(-3.0, 3.0, (3, count, robot.dof))
    return q, dq, ddq


@pytest.mark.parametrize("name", UNCERTAIN)
def test_no_member_is_outside(name: str) -> None:
    robot = without_drives(shipped(name))
    rng = np.random.default_rng(1)
    q, dq, ddq = states(robot, 2)
    bounds = exact_bounds(robot, q, dq, ddq)
    for k in range(STATES):
        for _ in range(20):
            tau = rigid_torque(robot, random_parameters(robot, rng), q[k], dq[k], ddq[k])
            # Pinocchio's own rounding: a relative 1e-13 of torques up to some 100 N m
            assert np.all(tau >= bounds.lower[k] - 1e-11)
            assert np.all(tau <= bounds.upper[k] + 1e-11)


@pytest.mark.parametrize("name", UNCERTAIN)
def test_no_member_of_a_thousand_per_state_is_outside(name: str) -> None:
    robot = without_drives(shipped(name))
    rng = np.random.default_rng(101)
    q, dq, ddq = states(robot, 102)
    bounds = exact_bounds(robot, q, dq, ddq)
    for k in range(STATES):
        tau = many_torques(robot, q[k], dq[k], ddq[k], rng, 1000)
        assert np.all(tau >= bounds.lower[k] - 1e-11)
        assert np.all(tau <= bounds.upper[k] + 1e-11)


@pytest.mark.parametrize("name", UNCERTAIN)
def test_every_bound_is_reached_by_an_admissible_member(name: str) -> None:
    robot = without_drives(shipped(name))
    q, dq, ddq = states(robot, 3)
    bounds = exact_bounds(robot, q, dq, ddq)
    scale = max(1.0, float(np.abs(bounds.upper).max()))
    for k in range(STATES):
        for j in range(robot.dof):
            for sign, bound in ((1.0, bounds.upper[k, j]), (-1.0, bounds.lower[k, j])):
                member = worst_parameters(robot, j, q[k], dq[k], ddq[k], sign)
                tau = rigid_torque(robot, member, q[k], dq[k], ddq[k])[j]
                assert abs(tau - bound) <= 1e-9 * scale


def high_precision_error(robot: Robot, q: Array, dq: Array, ddq: Array, bounds: Any) -> tuple[float, float]:
    """How far the 60-digit torque of the nominal member is outside the bounds, and how wide they are, relative to S."""
    worst = widest = -np.inf
    magnitude = margin.torque_magnitude(robot, q.T, dq.T, ddq.T).T
    for k in range(len(q)):
        tau = rigid_torques(robot, q[k], dq[k], ddq[k], nominal_parameters(robot))
        for j in range(robot.dof):
            below = Decimal(float(bounds.lower[k, j])) - tau[j]
            above = tau[j] - Decimal(float(bounds.upper[k, j]))
            worst = max(worst, float(max(below, above)))
            width = float(bounds.upper[k, j] - bounds.lower[k, j])
            widest = max(widest, width / max(float(magnitude[k, j]), 1e-280))
    return worst, widest


def point_robot(robot: Robot) -> Robot:
    """The robot with every box collapsed to its nominal value."""
    return without_drives(with_parameters(robot, nominal_parameters(robot)))


@pytest.mark.parametrize("name", ["lwa4p-6", "scara", "lwa4p-8"])
@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-6, 1.0, 1e6])
def test_degenerate_boxes_enclose_the_60_digit_value(name: str, size: float) -> None:
    """States from zero and denormal velocities to angles of 1e6 rad."""
    robot = point_robot(shipped(name))
    q, dq, ddq = states(robot, 4, 10)
    q, dq = q * size, dq * min(size, 10.0)
    worst, widest = high_precision_error(robot, q, dq, ddq, exact_bounds(robot, q, dq, ddq))
    assert worst <= 0.0
    assert widest < 1e-11


@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("length", [1e-4, 1.0, 1e2])
def test_extreme_magnitudes_enclose_the_60_digit_value(mass: float, length: float) -> None:
    """Random revolute and prismatic chains with masses 1e-6..1e6 kg and lengths 1e-4..1e2 m."""
    rng = np.random.default_rng([int(np.log10(mass) + 10), int(np.log10(length) + 10)])
    for _ in range(3):
        robot = synthesize(random_chain(rng, most_joints=5)[0])
        joints = []
        for joint in robot.joints:
            placement = joint.placement.copy()
            placement[:3, 3] *= length
            joints.append(replace(joint, placement=placement))
        parameters = [
            (m * mass, com * length, inertia * mass * length**2) for m, com, inertia in nominal_parameters(robot)
        ]
        robot = with_parameters(replace(robot, joints=tuple(joints)), parameters)
        q, dq, ddq = states(robot, 5, 4)
        worst, _ = high_precision_error(robot, q, dq, ddq, exact_bounds(robot, q, dq, ddq))
        assert worst <= 0.0


def test_rounding_check_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the margin the 60-digit value is outside somewhere, so the checks above do see a missing one."""
    robot = point_robot(shipped("lwa4p-6"))
    q, dq, ddq = states(robot, 6, 20)
    monkeypatch.setattr(margin, "roundings", lambda dof: 0.0)
    worst, _ = high_precision_error(robot, q, dq, ddq, exact_bounds(robot, q, dq, ddq))
    assert worst > 0.0


@pytest.mark.parametrize("name", ["lwa4p-table34", "lwa4p-6-tol5", "scara"])
def test_worst_members_with_60_digits_stay_inside(name: str) -> None:
    """The bound of an uncertain robot holds for its own worst member in exact arithmetic, and is tight."""
    robot = without_drives(shipped(name))
    q, dq, ddq = states(robot, 7, 4)
    bounds = exact_bounds(robot, q, dq, ddq)
    for k in range(4):
        for j in range(robot.dof):
            member = worst_parameters(robot, j, q[k], dq[k], ddq[k], 1.0)
            tau = rigid_torques(robot, q[k], dq[k], ddq[k], member)[j]
            gap = Decimal(float(bounds.upper[k, j])) - tau
            assert 0 <= gap <= Decimal("1e-9")


def test_friction_rotor_and_disturbance_are_exact_ranges() -> None:
    friction = Friction(
        Uncertain(np.asarray(2.0), Interval(1.0, 3.0)), Uncertain(np.asarray(5.0), Interval(4.0, 6.0)), 0.5, 0.1
    )
    drive = Drive(Uncertain(np.asarray(1e-4), Interval(0.5e-4, 2e-4)), 100.0)
    base = without_drives(shipped("planar-2r"))
    joints = tuple(replace(joint, friction=friction, drive=drive) for joint in base.joints)
    robot = replace(base, joints=joints, disturbance=Interval([-1.0, -2.0], [3.0, 2.0]))
    q = np.zeros((5, 2))
    dq = np.array([[-1.0, 1.0], [0.05, -0.05], [0.1, -0.1], [0.2, 0.0], [0.0, 0.0]])
    ddq = np.array([[1.0, -1.0], [0.0, 0.0], [2.0, 0.0], [0.0, 0.0], [0.0, 3.0]])
    rigid, full = exact_bounds(base, q, dq, ddq), exact_bounds(robot, q, dq, ddq)
    viscous = np.minimum(1.0 * dq, 3.0 * dq), np.maximum(1.0 * dq, 3.0 * dq)
    armature = np.minimum(0.5 * ddq, 2.0 * ddq), np.maximum(0.5 * ddq, 2.0 * ddq)
    coulomb_low = np.where(dq > 0.1, 4.0, -6.0)
    coulomb_high = np.where(dq < -0.1, -4.0, 6.0)
    low = viscous[0] + armature[0] + coulomb_low - 0.5 + np.array([-1.0, -2.0])
    high = viscous[1] + armature[1] + coulomb_high + 0.5 + np.array([3.0, 2.0])
    np.testing.assert_allclose(full.lower - rigid.lower, low, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(full.upper - rigid.upper, high, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("name", ["lwa4p-table34", "scara"])
def test_auxiliary_velocity(name: str) -> None:
    """dq_a = dq gives the plain bounds; otherwise C is the symmetric one, from Pinocchio's torques."""
    robot = without_drives(shipped(name))
    q, dq, ddq = states(robot, 8)
    same = exact_bounds_star(robot, q, dq, dq, ddq)
    plain = exact_bounds(robot, q, dq, ddq)
    # the rounding margin is taken for |dq| + |dq_a|, up to four times as large: 2e-13 of sums up to 1000 N m
    np.testing.assert_allclose(same.upper, plain.upper, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(same.lower, plain.lower, rtol=0.0, atol=1e-9)
    dq_a = np.random.default_rng(9).uniform(-2.0, 2.0, dq.shape)
    bounds = exact_bounds_star(robot, q, dq, dq_a, ddq)
    rng = np.random.default_rng(10)
    for k in range(min(STATES, 10)):
        member = random_parameters(robot, rng)

        def torque(v: Array, a: Array, k: int = k, member: Any = member) -> Array:
            return rigid_torque(robot, member, q[k], v, a)

        still = np.zeros(robot.dof)
        # c((v+w)/2) - c((v-w)/2) = C(v) w for the symmetric bilinear C; gravity cancels
        coriolis = torque((dq[k] + dq_a[k]) / 2, still) - torque((dq[k] - dq_a[k]) / 2, still)
        tau = torque(still, ddq[k]) + coriolis
        assert np.all(tau >= bounds.lower[k] - 1e-10)
        assert np.all(tau <= bounds.upper[k] + 1e-10)


@pytest.mark.parametrize("name", ["lwa4p-table34", "scara"])
def test_uncertain_accelerations(name: str) -> None:
    """Corners hold every sampled acceleration and member and are reached; the cheap form encloses them."""
    robot = shipped(name)
    q, dq, ddq = states(robot, 11, 6)
    tolerance = np.linspace(0.0, 0.8, robot.dof)
    exact = ddq_bounds(robot, q, dq, ddq, tolerance, "corners")
    cheap = ddq_bounds(robot, q, dq, ddq, tolerance, "cheap")
    assert np.all(cheap.lower <= exact.lower + 1e-10)
    assert np.all(cheap.upper >= exact.upper - 1e-10)
    width = exact.upper - exact.lower
    assert np.all(cheap.upper - cheap.lower <= 1.5 * width)
    rng = np.random.default_rng(12)
    for _ in range(200):
        inside = exact_bounds(robot, q, dq, ddq + rng.uniform(-1.0, 1.0, ddq.shape) * tolerance)
        assert np.all(inside.lower >= exact.lower - 1e-10)
        assert np.all(inside.upper <= exact.upper + 1e-10)


def test_sines_and_cosines_are_as_good_as_the_proof_asks() -> None:
    """Within 4 units of 2^-53 absolutely, in the vectorised code paths, up to angles of 1e6 rad."""
    rng = np.random.default_rng(13)
    angles = rng.uniform(-1.0, 1.0, 3000) * rng.choice([1.0, 100.0, 1e6], 3000)
    cos, sin = np.cos(angles), np.sin(angles)
    for k, angle in enumerate(angles):
        exact = cos_sin(float(angle))
        for got, true in zip((cos[k], sin[k]), exact, strict=True):
            assert abs(Decimal(float(got)) - true) <= 4 * Decimal(2) ** -53


def test_more_bodies_than_the_proof_covers_are_refused() -> None:
    robot = shipped("planar-2r")
    crowded = replace(robot, bodies=robot.bodies * 200)
    state = np.zeros((1, 2))
    with pytest.raises(NumericalError, match="bodies"):
        exact_bounds(crowded, state, state, state)


def test_bad_shapes_and_absurd_motions_are_refused() -> None:
    robot = shipped("planar-2r")
    good = np.zeros((3, 2))
    with pytest.raises(ShapeError):
        exact_bounds(robot, np.zeros((3, 3)), good, good)
    with pytest.raises(ShapeError):
        exact_bounds(robot, good, np.zeros((2, 2)), good)
    with pytest.raises(NumericalError):
        exact_bounds(robot, good, good + 1e200, good)
    with pytest.raises(ShapeError):
        ddq_bounds(robot, good, good, good, np.zeros(3))
    with pytest.raises(NumericalError):
        ddq_bounds(robot, good, good, good, np.array([-1.0, 0.0]))
    assert exact_bounds(robot, good[:0], good[:0], good[:0]).upper.shape == (0, 2)
