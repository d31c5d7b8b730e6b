"""No admissible robot leaves its filtered band without contact; torques by Pinocchio, friction written out here."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.collision.bands import UncertainMotion, torque_band
from modrob_cli.collision.filters import SignalFilter
from modrob_cli.dynamics.box_bounds import box_bounds
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.robots import load_robot
from tests.box_members import random_parameters, with_parameters

ROOT = Path(__file__).parents[2]
FILTERS = [
    SignalFilter(),
    SignalFilter("first-order", 1, 10.0),
    SignalFilter("first-order", 2, 10.0),
    *(SignalFilter("butterworth", order, 15.0) for order in (1, 2, 3, 4, 6, 8)),
]
RATE, SAMPLES, MEMBERS = 200.0, 100, 1000


def arm(name: str = "lwa4p-6-payload") -> Robot:
    """A shipped arm with uncertain drives and a disturbance."""
    robot = load_robot(ROOT / "assemblies" / f"{name}.yaml").robot

    def around(value: float, share: float) -> Uncertain:
        return Uncertain(np.asarray(value), Interval((1 - share) * value, (1 + share) * value))

    joints = tuple(
        replace(
            joint,
            friction=Friction(around(9.0, 0.2), around(5.0, 0.3), coulomb_band=0.1, velocity_band=0.01),
            drive=Drive(around(4e-5, 0.1), gear_ratio=120.0),
        )
        for joint in robot.joints
    )
    return replace(robot, joints=joints, disturbance=Interval(np.full(robot.dof, -0.3), np.full(robot.dof, 0.2)))


def motion(dof: int, rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """Sums of two sines, with reversals."""
    t = np.arange(SAMPLES) / RATE
    w, a, phase = rng.uniform(1.0, 12.0, (2, dof)), rng.uniform(0.05, 0.4, (2, dof)), rng.uniform(0, 6.3, (2, dof))
    angle = w * t[:, None, None] + phase
    q = (a * np.sin(angle)).sum(axis=1) + rng.uniform(-2, 2, dof)
    return t, q, (a * w * np.cos(angle)).sum(axis=1), (-a * w * w * np.sin(angle)).sum(axis=1)


def member_torque(robot: Robot, q: Array, dq: Array, ddq: Array, rng: np.random.Generator) -> Array:
    """Motor torques of a random member: half of its values at an end; signs within the velocity band are anything."""
    model = build_model(with_parameters(robot, random_parameters(robot, rng)))
    data = model.createData()
    tau = np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])

    def draw(low: float, high: float) -> float:
        return float(rng.choice([low, high, rng.uniform(low, high)]))

    for i, joint in enumerate(robot.joints):
        friction, drive = joint.friction, joint.drive
        ends = [(float(part.interval.inf), float(part.interval.sup)) for part in (friction.viscous, friction.coulomb)]
        rotor = draw(float(drive.rotor_inertia.interval.inf), float(drive.rotor_inertia.interval.sup))
        still = np.abs(dq[:, i]) <= friction.velocity_band
        sign = np.where(still, rng.choice([-1.0, 0.3, 1.0], len(q)), np.sign(dq[:, i]))
        tau[:, i] += draw(*ends[0]) * dq[:, i] + draw(*ends[1]) * sign + rotor * drive.gear_ratio**2 * ddq[:, i]
        band, own = friction.coulomb_band, robot.disturbance[i]
        tau[:, i] += draw(-band, band) + draw(float(own.inf), float(own.sup))
    return tau


def assert_inside(tau: Array, lower: Array, upper: Array) -> None:
    # Pinocchio's own rounding, a thousand units of the largest torque of 1e3 N m.
    assert (tau >= lower - 1e-10).all()
    assert (tau <= upper + 1e-10).all()


def links_of(robot: Robot) -> LinkBoxes:
    frames = dh_table(robot).frames
    tight = tight_intervals(robot, frames)
    return LinkBoxes(tight.mass, tight.com, tight.inertia_com, frames)


def test_a_thousand_members_stay_inside_for_every_filter() -> None:
    """Noise-free motions, 1000 members of the box, every kind of filter."""
    robot, rng, zero = arm(), np.random.default_rng(8), np.zeros(6)
    running = [wanted.at(RATE) for wanted in FILTERS]
    for _ in range(20):
        t, q, dq, ddq = motion(robot.dof, rng)
        band = torque_band(robot, UncertainMotion(t, q, dq, ddq, zero, zero, zero))
        bounds = [one.bounds(band.lower, band.upper) for one in running]
        for _ in range(MEMBERS // 20):
            tau = member_torque(robot, q, dq, ddq, rng)
            for one, (lower, upper) in zip(running, bounds, strict=True):
                assert_inside(one.apply(tau), lower, upper)


@pytest.mark.parametrize("published", [False, True], ids=["exact", "ianea"])
@pytest.mark.parametrize("varying", [False, True], ids=["one tolerance", "tolerance over time"])
def test_members_stay_inside_with_noise_in_all_states(published: bool, varying: bool) -> None:
    """What is measured differs from the truth by up to the stated half-widths, often by just these."""
    robot, rng = arm(), np.random.default_rng(9)
    q_rad, dq_rad, ddq_rad = np.full(6, 2e-3), np.array([0.03, 0.02, 0.01, 0.03, 0.02, 0.05]), np.full(6, 1.5)
    links = links_of(robot) if published else None
    running = SignalFilter("butterworth", 2, 15.0).at(RATE)
    for _ in range(15):
        t, q, dq, ddq = motion(robot.dof, rng)
        most = ddq_rad * rng.uniform(0.2, 2.0, (SAMPLES, 6)) if varying else ddq_rad
        shifts = [np.clip(1.3 * rng.uniform(-1, 1, (SAMPLES, 6)), -1, 1) for _ in range(3)]
        measured = (q + shifts[0] * q_rad, dq + shifts[1] * dq_rad, ddq + shifts[2] * most)
        band = torque_band(robot, UncertainMotion(t, *measured, q_rad, dq_rad, most), links)
        lower, upper = running.bounds(band.lower, band.upper)
        for _ in range(6):
            tau = member_torque(robot, q, dq, ddq, rng)
            assert_inside(tau, band.lower, band.upper)
            assert_inside(running.apply(tau), lower, upper)


def test_without_any_width_it_is_the_exact_range() -> None:
    robot, rng, zero = arm(), np.random.default_rng(10), np.zeros(6)
    t, q, dq, ddq = motion(6, rng)
    band = torque_band(robot, UncertainMotion(t, q, dq, ddq, zero, zero, zero))
    exact = exact_bounds(robot, q, dq, ddq)
    # Both are outward by a proven margin, put together in another order.
    for one, other in ((band.lower, exact.lower), (band.upper, exact.upper), (band.nominal, exact.nominal)):
        assert np.allclose(one, other, rtol=0, atol=1e-9)


def test_little_wider_than_bounds_of_each_samples_own_box() -> None:
    """The cells cost a few percent: below 15 % for every joint of these arms, with motions of 1 rad/s."""
    for name in ("lwa4p-6-payload", "lwa4p-table34", "lwa4p-6-tol5"):
        robot, rng = load_robot(ROOT / "assemblies" / f"{name}.yaml").robot, np.random.default_rng(11)
        t: Array = np.arange(0.0, 0.4, 1e-3)
        w, phase = rng.uniform(0.5, 2.0, 6), rng.uniform(0, 6.3, 6)
        angle = np.outer(t, w) + phase
        states = np.sin(angle) / w, np.cos(angle), -w * np.sin(angle)
        rads = np.full(6, 1e-4), np.full(6, 1e-3), np.full(6, 0.2)
        band, own = torque_band(robot, UncertainMotion(t, *states, *rads)), box_bounds(robot, *states, *rads)
        ratio = (band.upper - band.lower).mean(axis=0) / (own.upper - own.lower).mean(axis=0)
        assert (ratio > 0.999).all()
        assert (ratio < 1.15).all(), name


def test_friction_is_open_where_noise_straddles_zero() -> None:
    """A joint measured at 0.01 rad/s +- 0.02 may move either way; beyond, it cannot."""
    robot = arm()
    still = np.zeros((2, 6))
    dq = np.array([[0.01] * 6, [0.05] * 6])
    rads = np.zeros(6), np.full(6, 0.02), np.zeros(6)
    t = np.array([0.0, 0.001])
    without = replace(robot, joints=tuple(replace(joint, friction=Friction()) for joint in robot.joints))
    band, bare = (torque_band(one, UncertainMotion(t, still, dq, still, *rads)) for one in (robot, without))
    # Coulomb friction 3.5 .. 6.5, viscous 7.2 .. 10.8 at the ends of dq +- 0.02, friction band 0.1.
    assert np.allclose((band.lower - bare.lower)[0], -6.5 - 10.8 * 0.01 - 0.1, atol=1e-9)
    assert np.allclose((band.lower - bare.lower)[1], 3.5 + 7.2 * 0.03 - 0.1, atol=1e-9)
    assert np.allclose((band.upper - bare.upper)[1], 6.5 + 10.8 * 0.07 + 0.1, atol=1e-9)


def test_refuses_what_does_not_fit() -> None:
    t, zero = np.arange(3.0), np.zeros(6)
    state = np.zeros((3, 6))
    with pytest.raises(ShapeError):
        UncertainMotion(t, state, state, state[:2], zero, zero, zero)
    with pytest.raises(ShapeError):
        UncertainMotion(t, state, state, state, zero[:1], zero, zero)
    with pytest.raises(NumericalError):
        UncertainMotion(t, state, state, state, zero, zero - 1.0, zero)
    with pytest.raises(NumericalError, match="not finite"):
        torque_band(arm(), UncertainMotion(t, state, state + 1e200, state, zero, zero, zero))
