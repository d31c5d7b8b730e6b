"""The regression of one joint against simulated arms with known friction (torques by Pinocchio)."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import NumericalError
from modrob_cli.identify.friction_terms import FrictionModel
from modrob_cli.identify.regression import JointPrior, RegressionOptions, fit_joint
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.regression_rows import joint_motion
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.io.urdf_reader import read_urdf
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from tests.identify_samples import TERMS, TRUTH, URDF, record

PRIOR = JointPrior({}, 1.0)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("robot") / "three.urdf"
    path.write_text(URDF)
    return read_urdf(path)


def fit(run: Run, j: int, friction: str = "viscous,coulomb", prior: JointPrior = PRIOR, **more: Any) -> JointEstimate:
    return fit_joint([run], j, RegressionOptions(FrictionModel.parse(friction), **more), prior)


@pytest.mark.parametrize("recorded_velocity", [False, True])
def test_known_terms_are_found_without_noise(robot: Robot, recorded_velocity: bool) -> None:
    recording = record(1, noise=0.0, q_noise=0.0, recorded_velocity=recorded_velocity)
    run = prepare_run(robot, recording.log, "torque", 8.0)
    for j in range(3):
        found = fit(run, j)
        values = [found.value(term) or 0.0 for term in TERMS]
        # The sign changes like tanh over 1 % of the RMS velocity instead of at once: a few thousandths of the Coulomb
        # torque; noise of the recorded velocity (1e-3 rad/s) adds as much.
        np.testing.assert_allclose(values, TRUTH[j], rtol=0.01, atol=0.03)
        assert found.constrained is None
        assert found.condition < 10.0


def test_intervals_hold_the_truth_as_often_as_they_say(robot: Robot) -> None:
    """30 runs, 12 parameters each; benchmarks/identify_coverage.py does 500."""
    inside, errors = [], []
    for seed in range(30):
        run = prepare_run(robot, record(1000 + seed).log, "torque", 5.0)
        for j in range(3):
            found = fit(run, j)
            for k, term in enumerate(TERMS):
                estimate = found.estimates[term]
                assert estimate.value is not None
                assert estimate.interval is not None
                assert estimate.stderr is not None
                inside.append(estimate.interval[0] <= TRUTH[j, k] <= estimate.interval[1])
                errors.append((estimate.value - TRUTH[j, k]) / estimate.stderr)
    # 360 intervals, those of one joint and run correlated: the share scatters by about 2 %.
    assert 0.90 <= np.mean(inside) <= 0.99
    # Unbiased: the mean of 360 errors, each of about one standard error, scatters by 0.05 (0.1 if correlated).
    assert abs(float(np.mean(errors))) < 0.3


def test_standard_errors_of_white_residuals_would_be_far_too_small(robot: Robot) -> None:
    """The reason for the covariance estimator: ordinary least squares counts every sample as independent."""
    run = prepare_run(robot, record(7).log, "torque", 5.0)
    found = fit(run, 0)
    assert found.effective_samples < 0.1 * found.samples


def test_several_logs_narrow_the_intervals(robot: Robot) -> None:
    runs = [prepare_run(robot, record(seed).log, "torque", 5.0) for seed in range(20, 26)]
    pooled = fit_joint(runs, 1, RegressionOptions(), PRIOR)
    alone = [fit_joint([run], 1, RegressionOptions(), PRIOR) for run in runs]
    for k, term in enumerate(TERMS):
        stderr = pooled.estimates[term].stderr
        assert stderr is not None
        assert stderr < 0.8 * np.mean([a.estimates[term].stderr or np.nan for a in alone])
        assert abs((pooled.value(term) or np.nan) - TRUTH[1, k]) < 4.0 * stderr


def test_offset_per_log(robot: Robot) -> None:
    runs = []
    for k in range(3):
        truth = TRUTH.copy()
        truth[:, 0] = 2.0 * k
        recording = record(40 + k, truth=truth, noise=0.2)
        runs.append(replace(prepare_run(robot, recording.log, "torque", 5.0), name=f"log{k}"))
    found = fit_joint(runs, 1, RegressionOptions(offset_per_log=True), PRIOR)
    assert found.offsets == pytest.approx({"log0": 0.0, "log1": 2.0, "log2": 4.0}, abs=0.15)
    assert found.value("coulomb") == pytest.approx(TRUTH[1, 1], rel=0.02)
    predicted = found.torque(joint_motion(runs[2], 1), "log2")
    left = (runs[2].tau[:, 1] - runs[2].tau_rigid[:, 1] - predicted)[runs[2].used]
    assert abs(float(np.mean(left))) < 0.1


def test_contacts_and_glitches_do_not_decide(robot: Robot) -> None:
    recording = record(3)
    effort = recording.log.effort.copy()
    effort[2000:2120] += 60.0  # a contact of 0.6 s
    effort[[500, 900, 3100]] -= 2000.0  # lost bits
    run = prepare_run(robot, replace(recording.log, effort=effort), "torque", 5.0)
    for j in range(3):
        robust, plain = fit(run, j), fit(run, j, robust=False)
        errors = [[abs((x.value(t) or 0.0) - TRUTH[j, k]) for k, t in enumerate(TERMS)] for x in (robust, plain)]
        assert np.sum(errors[0]) < 0.35 * np.sum(errors[1])
        assert robust.outliers > 0.02


def test_slow_motion_does_not_excite_the_rotor(robot: Robot) -> None:
    """At a hundredth of the speed accelerations are 1e-4 of what they were: no number for the rotor, but a reason."""
    t = np.arange(0.0, 60.0, 0.01)
    q = np.stack([np.sin(0.15 * t + k) for k in range(3)], axis=1)
    dq = np.stack([0.15 * np.cos(0.15 * t + k) for k in range(3)], axis=1)
    noise = np.random.default_rng(5).normal(size=q.shape)
    effort = 3.0 * np.sign(dq) + 5.0 * dq + 0.5 * noise
    log = JointLog("slow", ("waist", "shoulder", "elbow"), t, q, None, effort)
    run = prepare_run(replace(robot, gravity=np.zeros(3), bodies=()), log, "torque", 5.0)
    found = fit(run, 0, prior=JointPrior({"reflected_inertia": 0.4}, 0.1))
    assert found.value("reflected_inertia") is None
    assert "all that can be said" in found.estimates["reflected_inertia"].reason
    assert found.held == {"reflected_inertia": 0.4}
    assert found.value("coulomb") == pytest.approx(3.0, abs=0.2)


def test_noise_instead_of_acceleration_is_recognised(robot: Robot) -> None:
    """Positions with so much noise that the low-pass leaves more of it than of the acceleration."""
    recording = record(8, q_noise=2e-3)
    run = prepare_run(robot, recording.log, "torque", 20.0)
    found = fit(run, 0)
    assert found.value("reflected_inertia") is None
    assert "is noise" in found.estimates["reflected_inertia"].reason


def test_one_direction_and_standstill(robot: Robot) -> None:
    t = np.arange(0.0, 20.0, 0.005)
    q = np.stack([0.2 * t + 0.05 * np.sin(2.0 * t), 0.5 * np.sin(t), np.full_like(t, 0.3)], axis=1)
    effort = np.random.default_rng(2).normal(size=q.shape) * 0.1 + [3.0, 0.0, 4.0]
    log = JointLog("odd", ("waist", "shoulder", "elbow"), t, q, None, effort)
    run = prepare_run(replace(robot, gravity=np.zeros(3), bodies=()), log, "torque", 10.0)
    one_way = fit(run, 0)
    assert one_way.value("coulomb") is None
    assert "does not tell it from" in one_way.estimates["coulomb"].reason
    still = fit(run, 2, prior=JointPrior({"coulomb": 2.0, "viscous": 0.0}, 1.0))
    assert still.value("offset") == pytest.approx(4.0, abs=0.05)
    assert {still.value(term) for term in TERMS[1:]} == {None}
    assert "hardly moves" in still.estimates["viscous"].reason
    assert still.held == {}  # at rest friction may be anything up to the Coulomb torque


def test_a_low_cut_off_does_not_bias_the_coulomb_torque(robot: Robot) -> None:
    """The low-pass blurs the jump at reversals over a third of a second; model and record pass it alike."""
    run = prepare_run(robot, record(18, noise=0.0, q_noise=0.0).log, "torque", 1.5)
    for j in range(3):
        assert fit(run, j).value("coulomb") == pytest.approx(TRUTH[j, 1], rel=0.01)


def test_negative_terms_get_a_fit_without(robot: Robot) -> None:
    """The bound is active at zero, so the constrained fit is the one without that term."""
    truth = TRUTH.copy()
    truth[0, 3] = -0.4
    run = prepare_run(robot, record(15, truth=truth, noise=0.1).log, "torque", 5.0)
    found = fit(run, 0)
    assert found.value("reflected_inertia") == pytest.approx(-0.4, abs=0.05)
    assert found.constrained is not None
    assert found.constrained["reflected_inertia"] == pytest.approx(0.0, abs=1e-9)
    assert "negative" in found.notes[0]
    assert found.model(physical=True)["coulomb"] == found.constrained["coulomb"]
    assert found.constrained["coulomb"] == pytest.approx(TRUTH[0, 1], rel=0.1)


def test_the_curve_has_a_band_of_the_right_width(robot: Robot) -> None:
    """At zero velocity on either side the curve is offset +- Coulomb; its band follows from their covariance."""
    run = prepare_run(robot, record(16).log, "torque", 5.0)
    found = fit(run, 0)
    curve, half = found.curve(np.array([-0.5, 0.5]))
    truth = TRUTH[0, 0] + TRUTH[0, 1] * np.array([-1.0, 1.0]) + TRUTH[0, 2] * np.array([-0.5, 0.5])
    assert np.all(np.abs(curve - truth) < 2.0 * half)
    assert np.all(half < 1.5)


def test_too_few_samples(robot: Robot) -> None:
    run = prepare_run(robot, record(17).log, "torque", 5.0)
    with pytest.raises(NumericalError, match=r"only \d+ samples are left for joint 1"):
        fit_joint([run.between(3.0, 3.1)], 0, RegressionOptions(), PRIOR)
