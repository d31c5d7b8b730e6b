"""Parameters that are written back belong to real bodies, and give the torques that were identified."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_inertia import LinearParameters
from modrob_cli.dynamics.newton_euler import nominal_links
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.errors import ShapeError
from modrob_cli.identify.base_report import base_parameter_report
from modrob_cli.identify.physical_fit import physical_robot, with_links
from modrob_cli.identify.physical_inertia import (
    SMALLEST_RADIUS,
    body_from,
    from_parameter_vector,
    linear_parameters,
    nearest_consistent,
    pseudo_inertia,
)
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.realizable import realizability
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import parallel_axis
from modrob_cli.workflows.robots import load_robot
from tests.identification_data import recording, with_scaled_mass


def shipped(name: str) -> Robot:
    return load_robot(shipped_folder("assemblies") / f"{name}.yaml").robot


def random_link(rng: np.random.Generator) -> LinearParameters:
    """A body of twenty point masses."""
    points, masses = rng.normal(size=(20, 3)) * [0.2, 0.05, 0.1] + [0.1, 0.0, -0.2], rng.uniform(0.01, 0.3, 20)
    inertia = (masses[:, None, None] * parallel_axis(points)).sum(axis=0)
    return LinearParameters(float(masses.sum()), masses @ points, inertia)


def test_pseudo_inertia_is_the_sum_over_points() -> None:
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(5, 3)), rng.uniform(0.1, 1.0, 5)
    inertia = (masses[:, None, None] * parallel_axis(points)).sum(axis=0)
    ahead = np.column_stack([points, np.ones(5)])
    J = pseudo_inertia(LinearParameters(float(masses.sum()), masses @ points, inertia))
    np.testing.assert_allclose(J, ahead.T @ (masses[:, None] * ahead), rtol=1e-13, atol=1e-13)


def test_linear_parameters_are_pinocchios() -> None:
    link = random_link(np.random.default_rng(2))
    wanted = pin.Inertia(*link.central()).toDynamicParameters()
    pi = linear_parameters(pseudo_inertia(link))
    np.testing.assert_allclose(pi, wanted, rtol=1e-12, atol=1e-14)
    back = from_parameter_vector(pi)
    np.testing.assert_allclose(pseudo_inertia(back), pseudo_inertia(link), rtol=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_any_ten_numbers_make_a_real_body(seed: int) -> None:
    """Positive definite whatever theta; the derivatives against central differences; theta = 0 is the given body."""
    rng = np.random.default_rng(seed)
    link = random_link(rng)
    root = np.asarray(np.linalg.cholesky(pseudo_inertia(link)))
    np.testing.assert_allclose(body_from(np.zeros(10), root)[0], linear_parameters(pseudo_inertia(link)), rtol=1e-12)
    theta = rng.normal(scale=1.5, size=10)
    pi, slopes = body_from(theta, root)
    assert np.linalg.eigvalsh(pseudo_inertia(from_parameter_vector(pi)))[0] > 0.0
    numerical = np.empty((10, 10))
    for k in range(10):
        h = 1e-6 * np.eye(10)[k]
        numerical[:, k] = (body_from(theta + h, root)[0] - body_from(theta - h, root)[0]) / 2e-6
    np.testing.assert_allclose(slopes, numerical, rtol=1e-6, atol=1e-8 * np.abs(slopes).max())


def test_impossible_tensor_is_mended_as_little_as_possible() -> None:
    """Principal moments 1, 1, 3 break the triangle inequality; second moments 1.5, 1.5, -0.5 become 1.5, 1.5, ~0."""
    mended = nearest_consistent(LinearParameters(2.0, np.zeros(3), np.diag([1.0, 1.0, 3.0])))
    least = 2.0 * SMALLEST_RADIUS**2
    np.testing.assert_allclose(mended.inertia, np.diag([1.5 + least, 1.5 + least, 3.0]), rtol=1e-12)
    assert mended.mass == 2.0
    good = random_link(np.random.default_rng(3))
    np.testing.assert_allclose(nearest_consistent(good).inertia, good.inertia, rtol=1e-12, atol=1e-14)


def rms_error(robot: Robot, true: Robot, seed: int) -> Array:
    q, dq, ddq = np.random.default_rng(seed).uniform(-1.5, 1.5, size=(3, 100, robot.dof))
    difference = inverse_dynamics(robot, q, dq, ddq) - inverse_dynamics(true, q, dq, ddq)
    return np.asarray(np.sqrt(np.mean(difference**2, axis=0)))


def test_identified_links_are_real_and_predict_new_motions() -> None:
    robot = shipped("lwa4p-6")
    true = with_scaled_mass(robot, 5, 1.3)
    run = recording(true, np.random.default_rng(1), noise=0.01, duration=40.0)
    fit = base_parameter_report(robot, [run]).physical
    assert fit is not None
    assert fit.misfit < 1.5
    identified = with_links(robot, fit.links)
    for placed in identified.bodies:
        assert realizability(placed.body).nominal
        assert placed.body.mass.nominal > 0.0 or placed.link == 0
    for values in (fit.coulomb, fit.viscous, fit.armature):
        assert (values >= 0.0).all()
    before, after = rms_error(robot, true, 2), rms_error(identified, true, 2)
    assert after[1] < 0.1 * before[1]
    assert after.sum() < 0.2 * before.sum()
    np.testing.assert_allclose(identified.link_frames(np.ones(6)), robot.link_frames(np.ones(6)))


def test_robot_of_a_fit_predicts_the_recorded_torque() -> None:
    """Friction, rotor and links together; the offset is the middle of the disturbance."""
    robot = shipped("lwa4p-6")
    run = recording(with_scaled_mass(robot, 3, 1.2), np.random.default_rng(6), noise=0.01)
    fit = base_parameter_report(robot, [run]).physical
    assert fit is not None
    new = physical_robot(robot, fit)
    tau = inverse_dynamics(new, run.q, run.dq, run.ddq) + new.disturbance.mid
    for j, joint in enumerate(new.joints):
        friction = joint.friction.viscous.nominal * run.dq[:, j] + joint.friction.coulomb.nominal * np.sign(
            run.dq[:, j]
        )
        rotor = joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal)
        error = (run.tau[:, j] - tau[:, j] - friction - rotor * run.ddq[:, j])[run.use[:, j]]
        assert np.sqrt(np.mean(error**2)) < 0.015 * np.sqrt(np.mean(run.tau[:, j] ** 2))
        assert joint.friction.viscous.is_exact
    np.testing.assert_allclose(new.disturbance.mid, fit.offset, atol=1e-12)


def test_impossible_data_are_mended_before_the_fit() -> None:
    robot = shipped("planar-2r")
    wrong = Uncertain.exact([0.1, 0.0, 0.0, 0.1, 0.0, 0.9])
    body = RigidBody("wrong", Uncertain.exact(5.0), Uncertain.exact([-0.5, 0.0, 0.0]), wrong)
    bodies = (*(placed for placed in robot.bodies if placed.link < 2), PlacedBody(2, np.eye(4), body))
    broken = replace(robot, bodies=bodies)
    assert not realizability(body).nominal
    run = recording(robot, np.random.default_rng(4), noise=0.01)
    fit = base_parameter_report(broken, [run]).physical
    assert fit is not None
    assert fit.adjusted == (2,)
    assert all(realizability(placed.body).nominal for placed in with_links(broken, fit.links).bodies)


def test_massless_links_stay_massless() -> None:
    """The axis part of a link without a body has no parameters to fit."""
    robot = shipped("planar-2r")
    bare = replace(robot, bodies=tuple(placed for placed in robot.bodies if placed.link != 1))
    run = recording(bare, np.random.default_rng(5), noise=0.01)
    fit = base_parameter_report(bare, [run]).physical
    assert fit is not None
    assert fit.links[0].mass == 0.0
    assert fit.links[1].mass > 0.0
    assert nominal_links(with_links(bare, fit.links))[0].mass == 0.0


def test_as_many_links_as_joints() -> None:
    robot = shipped("planar-2r")
    with pytest.raises(ShapeError, match="1 links for 2 joints"):
        with_links(robot, nominal_links(robot)[:1])
