"""Whose fault it is: coupled joints and missing gravity, in simulations where the answer is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.identify.effort import EffortKind
from modrob_cli.identify.friction_diagnosis import coupling, gravity_share
from modrob_cli.identify.regression import JointPrior, RegressionOptions, fit_joint
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.io.urdf_reader import read_urdf
from modrob_cli.model.robot import Robot
from tests.identify_samples import URDF, Recording, record, rigid_torque

OPTIONS = RegressionOptions()


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    path = tmp_path / "three.urdf"
    path.write_text(URDF)
    return read_urdf(path)


def test_a_coupled_joint_is_named(robot: Robot) -> None:
    recording = record(1)
    effort = recording.log.effort.copy()
    effort[:, 2] += 6.0 * recording.dq[:, 1] + 3.0 * np.sign(recording.dq[:, 1] + recording.dq[:, 2])
    run = prepare_run(robot, replace(recording.log, effort=effort), "torque", 5.0)
    train, test = [run.between(0.0, 12.0)], [run.between(12.0, 30.0)]
    estimate = fit_joint(train, 2, OPTIONS, JointPrior({}, 1.0))
    for judge in (test, [run.between(0.0, 0.0)]):
        found = coupling(train, judge, 2, estimate)
        assert found is not None
        assert found.joint == 1
        assert found.share > 0.6
    other = fit_joint(train, 0, OPTIONS, JointPrior({}, 1.0))
    assert coupling(train, test, 0, other) is None


def test_noise_names_nobody(robot: Robot) -> None:
    for seed in range(2, 6):
        run = prepare_run(robot, record(seed).log, "torque", 5.0)
        train, test = [run.between(0.0, 12.0)], [run.between(12.0, 30.0)]
        for j in range(3):
            assert coupling(train, test, j, fit_joint(train, j, OPTIONS, JointPrior({}, 1.0))) is None


def test_a_small_influence_is_no_coupling(robot: Robot) -> None:
    recording = record(1)
    effort = recording.log.effort.copy()
    effort[:, 2] += 0.3 * recording.dq[:, 1]
    run = prepare_run(robot, replace(recording.log, effort=effort), "torque", 5.0)
    estimate = fit_joint([run], 2, OPTIONS, JointPrior({}, 1.0))
    assert coupling([run], [run.between(0.0, 0.0)], 2, estimate) is None


def _without_gravity(recording: Recording) -> Recording:
    still = np.zeros_like(recording.q)
    gravity = rigid_torque(recording.q, still, still)
    return replace(recording, log=replace(recording.log, effort=recording.log.effort - gravity))


@pytest.mark.parametrize("effort", ["torque", "net-torque"])
@pytest.mark.parametrize("present", [True, False])
def test_share_of_gravity_in_the_record(robot: Robot, effort: EffortKind, present: bool) -> None:
    recording = record(9) if present else _without_gravity(record(9))
    run: Run = prepare_run(robot, recording.log, effort, 5.0)
    estimates = [fit_joint([run], j, OPTIONS, JointPrior({}, 1.0)) for j in range(3)]
    still = np.zeros_like(run.q)
    found = gravity_share([run], [rnea(robot, run.q, still, still)], estimates, OPTIONS)
    assert found is not None
    assert found.joints == (1, 2)  # the axis of the first joint is vertical
    assert found.value == pytest.approx(1.0 if present else 0.0, abs=0.1)
    assert found.interval[0] < found.value < found.interval[1]


def test_no_gravity_no_verdict(robot: Robot) -> None:
    floating = replace(robot, gravity=np.zeros(3))
    run = prepare_run(floating, _without_gravity(record(3)).log, "torque", 5.0)
    estimates = [fit_joint([run], j, OPTIONS, JointPrior({}, 1.0)) for j in range(3)]
    assert gravity_share([run], [np.zeros_like(run.q)], estimates, OPTIONS) is None
