"""Refined friction terms and drive gains against simulated arms with known friction (torques by Pinocchio)."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.identify.friction_terms import FrictionModel
from modrob_cli.identify.regression import JointPrior, RegressionOptions, fit_joint
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.regression_rows import joint_motion
from modrob_cli.identify.regression_units import GAIN, in_torque
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.io.urdf_reader import read_urdf
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from tests.identify_samples import TERMS, TRUTH, URDF, Recording, record

PRIOR = JointPrior({}, 1.0)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("robot") / "three.urdf"
    path.write_text(URDF)
    return read_urdf(path)


def with_effort(recording: Recording, change: Callable[[Recording], Array]) -> JointLog:
    """The log of a noise-free recording with another torque."""
    return replace(recording.log, effort=change(recording))


def fit(run: Run, j: int, friction: str = "viscous,coulomb", prior: JointPrior = PRIOR, **more: Any) -> JointEstimate:
    return fit_joint([run], j, RegressionOptions(FrictionModel.parse(friction), **more), prior)


def test_refinements_are_recovered(robot: Robot) -> None:
    recording = record(11, duration=40.0, noise=0.0, q_noise=0.0)
    noise = 0.05 * np.random.default_rng(1).normal(size=recording.dq.shape)

    def torque(r: Recording) -> Array:
        sign = np.sign(r.dq)
        peak = 4.0 * sign * np.exp(-((r.dq / 0.15) ** 2))
        load = 0.2 * sign * np.abs(r.rigid)
        return r.rigid + 6.0 * sign + 9.0 * r.dq + 0.8 * r.ddq + 0.7 * np.abs(r.dq) + peak + load + noise

    run = prepare_run(robot, with_effort(recording, torque), "torque", 15.0)
    found = fit(run, 1, "viscous,coulomb,asymmetric,stribeck,load")
    expected = {
        "coulomb": 6.0,
        "viscous": 9.0,
        "asymmetric": 0.7,
        "stribeck": 4.0,
        "stribeck_velocity": 0.15,
        "load": 0.2,
        "reflected_inertia": 0.8,
    }
    for term, value in expected.items():
        assert found.value(term) == pytest.approx(value, rel=0.06, abs=0.05), term


def test_friction_in_each_direction(robot: Robot) -> None:
    recording = record(19, duration=40.0, noise=0.0, q_noise=0.0)
    noise = 0.3 * np.random.default_rng(2).normal(size=recording.dq.shape)

    def torque(r: Recording) -> Array:
        forward = r.dq > 0.0
        friction = np.where(forward, 7.0, 5.0) * np.sign(r.dq) + np.where(forward, 9.5, 8.5) * r.dq
        return r.rigid + friction + 0.8 * r.ddq + noise

    run = prepare_run(robot, with_effort(recording, torque), "torque", 10.0)
    found = fit(run, 0, "viscous,coulomb,asymmetric")
    expected = {"coulomb_forward": 7.0, "coulomb_backward": 5.0, "viscous_forward": 9.5, "viscous_backward": 8.5}
    for name, value in expected.items():
        assert found.value(name) == pytest.approx(value, rel=0.03), name
    # The errors of the two directions are those of separate fits to the halves of the samples, about equal.
    errors = [found.estimates[name].stderr or 0.0 for name in expected]
    assert errors[0] == pytest.approx(errors[1], rel=0.5)
    assert set(fit(run, 0, "coulomb,asymmetric").estimates) >= {"coulomb_forward", "coulomb_backward"}
    predicted = found.torque(joint_motion(run, 0))
    left = (run.tau[:, 0] - run.tau_rigid[:, 0] - predicted)[run.used]
    assert np.sqrt(np.mean(left**2)) < 0.6


def test_a_stribeck_term_that_is_not_there_is_not_invented(robot: Robot) -> None:
    invented = 0
    for seed in range(12, 18):
        run = prepare_run(robot, record(seed).log, "torque", 5.0)
        for j in range(3):
            found = fit(run, j, "viscous,coulomb,stribeck")
            invented += found.value("stribeck") is not None
            assert found.value("stribeck") is not None or found.estimates["stribeck"].reason
            assert found.value("coulomb") == pytest.approx(TRUTH[j, 1], rel=0.25)
    # Schwarz's criterion lets chance pass once in some dozens.
    assert invented <= 1


def test_errors_of_the_gain_carry_over_to_the_other_parameters() -> None:
    """To first order; compared with the scatter of many draws."""
    rng = np.random.default_rng(6)
    values = np.array([0.3, 0.2, 1.5])
    root = rng.normal(size=(3, 3)) * [[0.02], [0.004], [0.05]]
    matrix = root @ root.T
    names, found, cov, stderr, scale = in_torque(
        ["offset", GAIN, "viscous"], values, matrix, np.sqrt(np.diag(matrix))
    )  # fmt: skip
    assert names == ["offset", "drive_gain", "viscous"]
    np.testing.assert_allclose(found, [1.5, 5.0, 7.5])
    assert scale == 5.0
    draws = rng.multivariate_normal(values, matrix, size=200_000)
    torque = np.stack([draws[:, 0] / draws[:, 1], 1.0 / draws[:, 1], draws[:, 2] / draws[:, 1]], axis=1)
    # The gain scatters by 4 %, so terms of second order are below 1 % of the covariance.
    scatter = np.cov(torque.T)
    size = np.sqrt(np.diag(scatter))
    np.testing.assert_allclose(cov / np.outer(size, size), scatter / np.outer(size, size), rtol=0, atol=0.03)
    np.testing.assert_allclose(stderr, np.sqrt(np.diag(cov)))


def test_a_gradual_transition_is_found_and_a_sharp_one_stays_sharp(robot: Robot) -> None:
    recording = record(13, noise=0.0, q_noise=0.0)
    noise = 0.1 * np.random.default_rng(3).normal(size=recording.dq.shape)

    def torque(width: float) -> Callable[[Recording], Array]:
        return lambda r: r.rigid + 6.0 * np.tanh(r.dq / width) + 9.0 * r.dq + 0.8 * r.ddq + noise

    gradual = fit(prepare_run(robot, with_effort(recording, torque(0.1)), "torque", 10.0), 0)
    # Sixteen widths are tried, each 1.3 times the one before.
    assert gradual.width == pytest.approx(0.1, rel=0.3)
    assert gradual.value("coulomb") == pytest.approx(6.0, rel=0.03)
    run = prepare_run(robot, with_effort(recording, torque(1e-3)), "torque", 10.0)
    assert fit(run, 0).width == pytest.approx(0.5 * run.standstill[0])


def test_drive_gain(robot: Robot) -> None:
    recording = record(14, duration=40.0)
    gain = np.array([5.0, 8.0, 12.0])
    log = replace(recording.log, effort=recording.log.effort / gain)
    run = prepare_run(robot, log, "torque", 5.0)
    for j in (1, 2):
        found = fit(run, j, drive_gain=True)
        estimate = found.estimates["drive_gain"]
        assert estimate.interval is not None
        assert estimate.value == pytest.approx(gain[j], rel=0.1)
        for k, term in enumerate(TERMS[1:], start=1):
            interval = found.estimates[term].interval
            assert interval is not None
            width = interval[1] - interval[0]
            assert interval[0] - 0.5 * width <= TRUTH[j, k] <= interval[1] + 0.5 * width


@pytest.mark.parametrize("text", ["", "viscous,viscous", "stiction", "stribeck", "viscous,load", "asymmetric"])
def test_friction_terms_are_checked(text: str) -> None:
    with pytest.raises(UsageError, match="--friction"):
        FrictionModel.parse(text)
