"""Bounds at single states are those of the batch code, and enclose what members of the box need."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.exact_point import ExactPoint
from modrob_cli.dynamics.exact_star import exact_bounds_star
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.ianea_point import IaneaPoint
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.dynamics.newton_euler_star import rnea_star
from modrob_cli.dynamics.quadratic_faces import Faces
from modrob_cli.errors import ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.simulation_study import published_links
from tests.unit.simulate.arms import shipped

# one and seven uncertain bodies, one to three free coordinates, tensors about both points, prismatic joints
ROBOTS = ("lwa4p-rtable1", "lwa4p-6-tol5", "lwa4p-6-payload", "planar-2r", "scara", "lwa4p-table34", "tol5 with drives")
TOLERANCE = 1e-9
"""Both sides are moved outward, by up to 3e-10 N m for these arms."""


def robot_of(name: str) -> Robot:
    if name != "tol5 with drives":
        return shipped(name)
    robot = shipped("lwa4p-6-tol5")
    around = Uncertain(np.array(2.0), Interval(np.array(1.0), np.array(3.0)))
    rotor = Uncertain(np.array(1e-4), Interval(np.array(0.9e-4), np.array(2e-4)))
    friction = Friction(around, around, coulomb_band=0.3, velocity_band=0.2)
    joints = tuple(replace(joint, friction=friction, drive=Drive(rotor, gear_ratio=50.0)) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.full(6, -1.0), np.full(6, 2.0)))


def states(dof: int, count: int = 40) -> Array:
    """q, dq, dq_a, ddq, shape (4, count, dof); some joints stand still."""
    rng = np.random.default_rng(1)
    out = rng.uniform(-3.0, 3.0, (4, count, dof))
    out[1, ::7, 0] = 0.0
    out[1, ::9] *= 0.05
    return out


@pytest.mark.parametrize("name", ROBOTS)
def test_exact_point_is_the_exact_range(name: str) -> None:
    robot = robot_of(name)
    q, dq, dq_a, ddq = states(robot.dof)
    point = ExactPoint(robot)
    expected = exact_bounds_star(robot, q, dq, dq_a, ddq)
    plain = exact_bounds(robot, q, dq, ddq)
    for k in range(len(q)):
        found = point(q[k], dq[k], dq_a[k], ddq[k])
        np.testing.assert_allclose(found.lower, expected.lower[k], rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(found.upper, expected.upper[k], rtol=0, atol=TOLERANCE)
        same = point(q[k], dq[k], dq[k], ddq[k])
        np.testing.assert_allclose(same.lower, plain.lower[k], rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(same.upper, plain.upper[k], rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("name", ROBOTS)
def test_ianea_point_is_the_published_enclosure(name: str) -> None:
    robot = robot_of(name)
    q, dq, dq_a, ddq = states(robot.dof)
    links = published_links(robot)
    point = IaneaPoint(robot, links)
    expected = ianea(robot, q, dq, ddq, links, dq_a)
    nominal = rnea_star(robot, q, dq, dq_a, ddq)
    rotors = np.array([j.drive.gear_ratio**2 * float(j.drive.rotor_inertia.nominal) for j in robot.joints])
    for k in range(len(q)):
        found = point(q[k], dq[k], dq_a[k], ddq[k])
        np.testing.assert_allclose(found.lower, expected.lower[k], rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(found.upper, expected.upper[k], rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(found.nominal, nominal[k] + rotors * ddq[k], rtol=0, atol=TOLERANCE)


def test_nominal_torque_of_the_exact_point() -> None:
    robot = robot_of("tol5 with drives")
    q, dq, _, ddq = states(6, 5)
    expected = rnea(robot, q, dq, ddq) + 50.0**2 * 1e-4 * ddq
    point = ExactPoint(robot)
    found = [point(q[k], dq[k], dq[k], ddq[k]).nominal for k in range(5)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("k", [0, 1, 2, 3])
@pytest.mark.parametrize("form", ["flat", "any", "definite"])
def test_quadratic_range_against_a_fine_grid(k: int, form: str) -> None:
    rng = np.random.default_rng(k)
    faces, upper = Faces.of(k), np.triu_indices(k)
    axis = np.linspace(-1.0, 1.0, 41)
    z = np.stack(np.meshgrid(*[axis] * k, indexing="ij"), axis=-1).reshape(-1, k) if k else np.zeros((1, 0))
    for trial in range(40):
        A = rng.normal(size=(k, k)) * (form != "flat")
        # definite with small slopes: the extreme value is often within the box or a face
        Q = (-1.0) ** trial * A @ A.T if form == "definite" else A + A.T
        s, b = rng.normal(), (0.5 if form == "definite" else 1.0) * rng.normal(size=k)
        values = s + z @ b + np.einsum("ti,ij,tj->t", z, Q, z)
        low, high = faces.value_range(np.array([s, *b, *Q[upper]]) @ faces.matrix)
        # the grid has points within 1/40 of the extreme one in each direction, where the function is flat
        missed = np.abs(Q).sum() / 40.0**2 + 1e-12
        assert values.min() - missed <= low <= values.min() + 1e-12
        assert values.max() - 1e-12 <= high <= values.max() + missed


def test_links_must_be_as_many_as_joints() -> None:
    with pytest.raises(ShapeError, match="2 links for 6 joints"):
        IaneaPoint(shipped("lwa4p-6"), published_links(shipped("planar-2r")))
