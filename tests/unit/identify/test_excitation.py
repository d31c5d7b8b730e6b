"""Exciting motions: derivatives of the measures, limits, rest at the ends, what they are worth."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.identify.base_columns import complete_regressor
from modrob_cli.identify.base_parameters import base_model
from modrob_cli.identify.excitation import ExcitationOptions, ExcitationResult, optimize_excitation
from modrob_cli.identify.excitation_information import Information, Measure, condition, measure_of
from modrob_cli.identify.excitation_limits import LimitedJoint, MotionLimits, within_limits
from modrob_cli.identify.excitation_series import FourierMotion, RestingSeries
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.joint import Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.excitation_limits import motion_limits
from modrob_cli.workflows.robots import load_robot

QUICK = ExcitationOptions(period=10.0, harmonics=4, candidates=20, starts=1, iterations=15)


def shipped(name: str) -> Robot:
    return load_robot(shipped_folder("assemblies") / f"{name}.yaml").robot


def limits_of(robot: Robot, **overrides: list[tuple[float, float]]) -> MotionLimits:
    return motion_limits(robot, overrides, 0.9, range(robot.dof))[1]


def sampled(motion: FourierMotion, count: int = 20_001) -> list[Array]:
    """Position to jerk over one period by plain sums of sines, (count, n) each."""
    t = np.linspace(0.0, motion.period, count)[:, None]
    out = [np.zeros((count, len(motion.offset))) for _ in range(4)]
    out[0] += motion.offset
    for k in range(1, motion.sin.shape[1] + 1):
        w = 2.0 * np.pi * k / motion.period
        a, b = motion.sin[:, k - 1], motion.cos[:, k - 1]
        for order in range(4):
            shift = 0.5 * np.pi * order
            out[order] += w**order * (a * np.sin(w * t + shift) + b * np.cos(w * t + shift))
    return out


@pytest.mark.parametrize("harmonics", [2, 3, 5, 9])
def test_series_rest_at_both_ends(harmonics: int) -> None:
    series = RestingSeries(7.0, harmonics)
    x = np.random.default_rng(harmonics).normal(size=(3, series.size))
    states = sampled(series.motion(x))
    for ends in (states[1][[0, -1]], states[2][[0, -1]]):
        np.testing.assert_allclose(ends, 0.0, atol=1e-11)
    trajectory = series.motion(x).trajectory("motion", periods=2)
    assert trajectory.duration == 14.0
    values = trajectory.sample(np.array([0.0, 7.0, 14.0]), 2)
    np.testing.assert_allclose(values[:, 1:], 0.0, atol=1e-11)
    # The matrices of the search and the curve are the same motion.
    for order, A in enumerate(series.matrices(20, 3)):
        np.testing.assert_allclose(A @ x.T, states[order][:-1:1000], atol=1e-9)


def test_one_harmonic_cannot_rest() -> None:
    with pytest.raises(ShapeError, match="2 harmonics"):
        RestingSeries(1.0, 1)


@pytest.mark.parametrize("measure", ["log-det", "condition"])
@pytest.mark.parametrize("name", ["lwa4p-6", "scara"])
def test_gradient_equals_differences(measure: Measure, name: str) -> None:
    """Along random directions in all states at once, where torques are beyond their limits too."""
    robot = shipped(name)
    friction = Friction(Uncertain.exact(5.0), Uncertain.exact(3.0))
    robot = replace(robot, joints=tuple(replace(joint, friction=friction) for joint in robot.joints))
    n = robot.dof
    rng = np.random.default_rng(1)
    torque = np.tile([-4.0, 5.0], (n, 1))
    information = Information(robot, base_model(robot), measure, rng.uniform(1, 9, n), np.full(n, 0.1), torque)
    states = [rng.normal(size=(40, n)) for _ in range(3)]
    value, slopes = information.gradient(states[0], states[1], states[2])
    assert value == pytest.approx(information.value(states[0], states[1], states[2]), rel=1e-12)
    assert value > measure_of(information.matrix(information.columns(states[0], states[1], states[2])), measure)[0]
    for which in range(3):
        direction = rng.normal(size=(40, n))
        ends = []
        for sign in (1.0, -1.0):
            moved = [x + sign * 1e-6 * direction if k == which else x for k, x in enumerate(states)]
            ends.append(information.value(moved[0], moved[1], moved[2]))
        # Rounding 1e-16 * value / 1e-6 with a penalty of 1e5; truncation of the tanh 1e-8.
        assert (slopes[which] * direction).sum() == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-4, abs=1e-3)


def test_condition_is_that_of_normalised_columns() -> None:
    rng = np.random.default_rng(2)
    W = rng.normal(size=(80, 7)) * np.logspace(-3, 3, 7)
    assert condition(W.T @ W) == pytest.approx(np.linalg.cond(W / np.linalg.norm(W, axis=0)), rel=1e-9)
    assert measure_of(W.T @ W, "log-det")[0] == pytest.approx(-np.linalg.slogdet(W.T @ W)[1], rel=1e-9)
    W[:, 3] = W[:, 2]
    assert measure_of(W.T @ W, "log-det")[0] == np.inf


def test_random_motions_are_as_large_as_asked() -> None:
    limits = limits_of(shipped("lwa4p-6"))
    series = RestingSeries(10.0, 4)
    joint = LimitedJoint(series, limits, 0)
    rng = np.random.default_rng(3)
    for place in (0.0, 0.5, 1.0):
        x = joint.inside(rng.normal(size=series.size), 1.0, place)
        # The largest motion touches a limit at a time of the grid and leaves none.
        assert 0.999 < (joint.A @ x / joint.b).max() <= 1.0 + 1e-12


def check_limits(motion: FourierMotion, limits: MotionLimits) -> None:
    for values, ranges in zip(sampled(motion), limits.motion, strict=True):
        room = 1e-9 * (1.0 + np.where(np.isfinite(ranges), np.abs(ranges), 0.0))
        assert (values >= ranges[:, 0] - room[:, 0]).all()
        assert (values <= ranges[:, 1] + room[:, 1]).all()


def search(name: str, options: ExcitationOptions = QUICK, **overrides: list[tuple[float, float]]) -> ExcitationResult:
    robot = shipped(name)
    limits = limits_of(robot, **overrides)
    found = optimize_excitation(robot, limits, options)
    check_limits(found.motion, limits)
    states = sampled(found.motion, 2001)
    np.testing.assert_allclose(states[1][[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(states[2][[0, -1]], 0.0, atol=1e-9)
    return found


def test_search_beats_random_motions_and_keeps_limits() -> None:
    found = search("lwa4p-6")
    # Half the natural logarithm of the volume by 2 x 58 parameters: standard errors smaller by a factor of 1.4 or more.
    assert found.log_det < found.random_log_det.min() - 2.0 * 58 * np.log(1.2)
    assert found.condition < np.median(found.random_condition)
    assert (found.shrunk > 0.97).all()
    assert not found.stopped
    # The condition number, recomputed from the motion alone with the true sign: the soft one changes it little.
    model = base_model(shipped("lwa4p-6"))
    q, dq, ddq = (x[:-1:100] for x in sampled(found.motion)[:3])
    W = model.regressor(complete_regressor(shipped("lwa4p-6"), q, dq, ddq)).reshape(-1, model.count)
    scale = np.linalg.norm(W, axis=0)
    assert np.linalg.cond(W / scale) < 3.0 * found.condition


def test_objective_condition() -> None:
    options = replace(QUICK, measure="condition", iterations=25)
    by_condition, by_volume = search("2r-folded", options), search("2r-folded")
    assert by_condition.condition < by_volume.condition
    assert by_condition.log_det > by_volume.log_det


def test_same_seed_same_motion_other_seed_another() -> None:
    first, second, other = (search("2r-folded", replace(QUICK, seed=seed)).motion for seed in (4, 4, 5))
    np.testing.assert_array_equal(first.sin, second.sin)
    np.testing.assert_array_equal(first.offset, second.offset)
    assert not np.allclose(first.sin, other.sin)


def test_torque_limits_are_kept_by_true_friction_signs() -> None:
    """Nominal torque by Pinocchio plus friction with its jump, at 4000 times."""
    from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics

    robot = shipped("lwa4p-6-payload")
    found = search("lwa4p-6-payload", replace(QUICK, iterations=30))
    q, dq, ddq = (x[::5] for x in sampled(found.motion)[:3])
    tau = inverse_dynamics(robot, q, dq, ddq)
    for j, joint in enumerate(robot.joints):
        rotor = joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal)
        friction = joint.friction.viscous.nominal * dq[:, j] + joint.friction.coulomb.nominal * np.sign(dq[:, j])
        torque = tau[:, j] + friction + rotor * ddq[:, j]
        assert np.abs(torque).max() <= 0.9 * joint.limits.torque[1] * (1.0 + 1e-3)  # type: ignore[index]
    assert (found.shrunk > 0.9).all()  # the search kept them, not the final shrinking


def test_jerk_and_prismatic_limits() -> None:
    found = search("scara", jerk=[(-20.0, 20.0)])
    jerk = np.abs(sampled(found.motion)[3]).max(axis=0)
    assert (jerk > 0.5 * 18.0).any()


def test_some_joints_rest() -> None:
    robot = shipped("lwa4p-6")
    rest = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    found = optimize_excitation(robot, limits_of(robot), QUICK, moving=[1, 3], rest=rest)
    assert found.motion.offset[2] == 0.5
    still = [0, 2, 4, 5]
    assert (found.motion.sin[still] == 0.0).all()
    assert (found.motion.cos[still] == 0.0).all()
    assert (np.abs(found.motion.sin[[1, 3]]).max(axis=1) > 0.1).all()
    assert found.model.count < 36


def test_time_ends_the_search() -> None:
    found = search("lwa4p-6", replace(QUICK, seconds=1e-9))
    assert found.stopped
    assert found.iterations <= 2  # one step of the search, one that would press torques back


def test_arm_that_cannot_be_held() -> None:
    robot = shipped("planar-2r")
    ranges = {"position": [(-0.5, 0.5)], "velocity": [(-1.0, 1.0)], "acceleration": [(-4.0, 4.0)]}
    limits = limits_of(robot, **ranges, torque=[(-3.0, 3.0)])
    with pytest.raises(NumericalError, match="more than the torque limits of q1, q2"):
        optimize_excitation(robot, limits, QUICK)


def test_shrinking_is_exact_and_no_more_than_needed() -> None:
    robot = shipped("2r-folded")
    limits = limits_of(robot)
    series = RestingSeries(10.0, 4)
    x = np.random.default_rng(6).normal(size=(2, series.size))
    motion, factors = within_limits(robot, limits, series.motion(x), (0, 1))
    check_limits(motion, limits)
    used = np.max([np.abs(v).max(axis=0) / r[:, 1] for v, r in zip(sampled(motion)[1:3], limits.motion[1:3], strict=True)], axis=0)  # fmt: skip  # noqa: E501
    assert (factors < 1.0).all()
    sway = np.abs(sampled(motion)[0]).max(axis=0) / limits.position[:, 1]
    assert np.maximum(used, sway) == pytest.approx(1.0, abs=1e-4)
