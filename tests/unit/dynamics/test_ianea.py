"""The published interval algorithm: encloses what it must, and is as wide as published.

References: a plain transcription of [D] Algorithm 4 with D-H rows and outward-rounding intervals
(tests/published_ianea.py), which shares with the batch code nothing but the formulas; torques of sampled parameters;
60-digit arithmetic for rounding.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.bounds_width import bodies_alone, link_boxes, widened, width_ratio
from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.exact_star import exact_bounds_star
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.dynamics.interval_vectors import Box, cross_parameter, times
from modrob_cli.dynamics.margin import rounding_margin, torque_magnitude
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.dynamics.newton_euler_star import rnea_star
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.robots import load_robot
from tests.box_members import random_parameters, with_parameters
from tests.high_precision import nominal_parameters, rigid_torques
from tests.published_ianea import transcribed
from tests.random_chains import random_chain

ASSEMBLIES = Path(__file__).parents[3] / "assemblies"
SHIPPED = sorted(path.stem for path in ASSEMBLIES.glob("*.yaml"))


def shipped(name: str) -> Robot:
    return load_robot(ASSEMBLIES / f"{name}.yaml").robot


def states(robot: Robot, seed: int, count: int, kinds: int = 3) -> Array:
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (kinds, count, robot.dof))


def joint_frames(robot: Robot) -> Array:
    return np.tile(np.eye(4), (robot.dof, 1, 1))


def assert_same(actual: Array, expected: Array) -> None:
    # Ends differ by rounding: the batch code's margin is 3000 units of 1e-16 times up to 1e3 N m of magnitudes.
    np.testing.assert_allclose(actual, expected, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("tolerance", [0.0, 0.5])
@pytest.mark.parametrize("share", [None, 0.1])
def test_equals_the_transcription_of_the_published_algorithm(share: float | None, tolerance: float) -> None:
    robot = bodies_alone(shipped("lwa4p-table34"))
    robot = robot if share is None else widened(robot, share)
    links = link_boxes(robot)
    q, dq, dq_a, ddq = states(robot, 3, 5, 4)
    bounds = ianea(robot, q, dq, ddq, links, dq_a, np.full(robot.dof, tolerance))
    for k in range(5):
        box = Interval(ddq[k] - tolerance, ddq[k] + tolerance)
        expected = transcribed(robot, links, q[k], dq[k], dq_a[k], box)
        assert_same(bounds.lower[k], expected.inf)
        assert_same(bounds.upper[k], expected.sup)


def test_equals_the_transcription_with_a_prismatic_joint() -> None:
    robot = bodies_alone(shipped("scara"))
    links = link_boxes(robot)
    q, dq, dq_a, ddq = states(robot, 4, 10, 4)
    bounds = ianea(robot, q, dq, ddq, links, dq_a)
    for k in range(10):
        expected = transcribed(robot, links, q[k], dq[k], dq_a[k], Interval(ddq[k]))
        assert_same(bounds.lower[k], expected.inf)
        assert_same(bounds.upper[k], expected.sup)


FRAMES: dict[str, Callable[[Robot], Array]] = {"joint": joint_frames, "dh": lambda robot: dh_table(robot).frames}


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize("name", SHIPPED)
def test_encloses_the_exact_bounds(name: str, frames: str) -> None:
    robot = shipped(name)
    q, dq, ddq = states(robot, 5, 200)
    dq[::7] = 0.0  # standstill: Coulomb friction on both sides
    exact = exact_bounds(robot, q, dq, ddq)
    bounds = ianea(robot, q, dq, ddq, link_boxes(robot, FRAMES[frames](robot)))
    slack = 1e-9 * np.abs(exact.upper - exact.lower) + 1e-12 * np.abs(exact.upper).max()
    assert (bounds.lower <= exact.lower + slack).all()
    assert (bounds.upper >= exact.upper - slack).all()
    np.testing.assert_allclose(bounds.nominal, exact.nominal, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("seed", range(20))
def test_encloses_torques_of_sampled_parameters_on_random_chains(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = widened(synthesize(random_chain(rng, most_joints=6)[0]), 0.1)
    q, dq, ddq = states(robot, seed + 100, 20)
    bounds = ianea(robot, q, dq, ddq, link_boxes(robot, joint_frames(robot)))
    for _ in range(30):
        tau = rnea(with_parameters(robot, random_parameters(robot, rng)), q, dq, ddq)
        assert ((bounds.lower <= tau) & (tau <= bounds.upper)).all()


def test_with_auxiliary_velocity_encloses_sampled_parameters() -> None:
    # NEA*'s C depends on the links, so the members are joined links of one body each, here those of the arm.
    robot = bodies_alone(widened(shipped("lwa4p-table34"), 0.1))
    rng = np.random.default_rng(6)
    q, dq, dq_a, ddq = states(robot, 7, 50, 4)
    bounds = ianea(robot, q, dq, ddq, link_boxes(robot), dq_a)
    for _ in range(100):
        tau = rnea_star(with_parameters(robot, random_parameters(robot, rng)), q, dq, dq_a, ddq)
        assert ((bounds.lower <= tau) & (tau <= bounds.upper)).all()
    # the Christoffel C of the exact bounds is another one
    other = exact_bounds_star(robot, q, dq, dq_a, ddq)
    assert np.abs(other.nominal - bounds.nominal).max() > 1e-3


@pytest.mark.parametrize("name", ["lwa4p-table34", "lwa4p-6-tol5", "scara"])
def test_with_uncertain_acceleration_encloses_exact_bounds_inside_the_box(name: str) -> None:
    robot = shipped(name)
    rng = np.random.default_rng(8)
    q, dq, ddq = states(robot, 9, 50)
    tolerance = rng.uniform(0.0, 1.0, robot.dof)
    links = link_boxes(robot)
    bounds = ianea(robot, q, dq, ddq, links, ddq_tolerance=tolerance)
    for _ in range(30):
        share = rng.choice([-1.0, 1.0], ddq.shape) * rng.choice([1.0, rng.random()], ddq.shape)
        exact = exact_bounds(robot, q, dq, ddq + share * tolerance)
        slack = 1e-12 * np.abs(exact.upper).max()
        assert (bounds.lower <= exact.lower + slack).all()
        assert (bounds.upper >= exact.upper - slack).all()
    np.testing.assert_array_equal(bounds.nominal, ianea(robot, q, dq, ddq, links).nominal)


def degenerate(robot: Robot) -> tuple[Robot, LinkBoxes]:
    """The arm of one body per link with nominal parameters, and these as boxes in the frames of the bodies."""
    robot = bodies_alone(with_parameters(robot, nominal_parameters(robot)))
    bodies = [robot.bodies_of(i + 1)[0] for i in range(robot.dof)]
    mass, com, inertia = (
        Interval(np.stack([getattr(placed.body, name).nominal for placed in bodies]))
        for name in ("mass", "com", "inertia")
    )
    return robot, LinkBoxes(mass, com, inertia, np.stack([placed.pose for placed in bodies]))


def test_boxes_without_width_give_the_nominal_torque_within_the_margin() -> None:
    robot, links = degenerate(shipped("lwa4p-table34"))
    q, dq, ddq = states(robot, 10, 1000)
    bounds = ianea(robot, q, dq, ddq, links)
    assert ((bounds.lower <= bounds.nominal) & (bounds.nominal <= bounds.upper)).all()
    most = rounding_margin(robot.dof, 2.0 * torque_magnitude(robot, q.T, dq.T, ddq.T)).T
    # the margin and the last bits of adding it
    assert (bounds.upper - bounds.lower <= 2.0 * most * (1.0 + 1e-3)).all()
    assert (most <= 1e-9 * np.abs(bounds.nominal).max()).all()


@pytest.mark.parametrize("turns", [1.0, 1e3])
def test_boxes_without_width_enclose_the_torque_in_60_digits(turns: float) -> None:
    robot, links = degenerate(shipped("lwa4p-table34"))
    q, dq, ddq = states(robot, 11, 50)
    bounds = ianea(robot, turns * q, dq, ddq, links)
    for k in range(50):
        tau = rigid_torques(robot, turns * q[k], dq[k], ddq[k], nominal_parameters(robot))
        for j in range(robot.dof):
            assert bounds.lower[k, j] <= tau[j] <= bounds.upper[k, j]


# Figures of an independent prototype with two or three digits; 4 % covers their rounding and other random states.
@pytest.mark.parametrize(
    ("share", "expected"), [(None, [42.0, 2.8, 1.9, 1.4, 1.25, 1.0]), (0.1, [30.0, 2.0, 1.6, 1.5, 1.5, 1.0])]
)
def test_width_over_exact_width_is_as_known(share: float | None, expected: list[float]) -> None:
    robot = shipped("lwa4p-table34")
    robot = robot if share is None else widened(robot, share)
    np.testing.assert_allclose(width_ratio(robot, link_boxes(robot)), expected, rtol=0.04)


@pytest.mark.parametrize("factor", [(2.0, 2.0), (1.0, 2.0), (-2.0, -1.0), (-1.0, 3.0), (-3.0, 0.0), (0.0, 0.0)])
def test_products_of_intervals_are_the_hull_of_the_products_of_ends(factor: tuple[float, float]) -> None:
    rng = np.random.default_rng(12)
    mid, rad = rng.uniform(-2.0, 2.0, 500), rng.uniform(0.0, 2.0, 500)
    got_mid, got_rad = times(factor, mid, rad)
    ends = np.stack([x * y for x in factor for y in (mid - rad, mid + rad)])
    assert got_rad is not None
    np.testing.assert_allclose(got_mid - got_rad, ends.min(axis=0), atol=1e-14)
    np.testing.assert_allclose(got_mid + got_rad, ends.max(axis=0), atol=1e-14)


def test_cross_product_mixes_exact_and_interval_entries() -> None:
    box = Box(np.array([[1.0], [2.0], [3.0]]), np.array([[0.0], [0.5], [0.0]]))
    got = cross_parameter([(1.0, 1.0), (-1.0, 1.0), (2.0, 2.0)], box)
    # (1, [-1, 1], 2) x (1, [1.5, 2.5], 3)
    np.testing.assert_allclose(got.mid[:, 0], [-4.0, -1.0, 2.0])
    assert got.rad is not None
    np.testing.assert_allclose(got.rad[:, 0], [4.0, 0.0, 1.5])


def test_no_samples_and_massless_links() -> None:
    robot = shipped("planar-2r")
    empty = np.empty((0, robot.dof))
    assert ianea(robot, empty, empty, empty, link_boxes(robot)).lower.shape == (0, robot.dof)
    bare = bodies_alone(replace(robot, bodies=()))
    still = np.ones((3, robot.dof))
    bounds = ianea(bare, still, still, still, link_boxes(bare, joint_frames(bare)))
    assert np.abs(bounds.upper).max() < 1e-280
    assert np.abs(bounds.lower).max() < 1e-280


def test_many_chunks_equal_single_samples() -> None:
    robot = shipped("lwa4p-6-tol5")
    q, dq, ddq = states(robot, 13, 9000)
    links = link_boxes(robot)
    bounds = ianea(robot, q, dq, ddq, links)
    for k in (0, 4095, 4096, 8999):
        single = ianea(robot, q[k : k + 1], dq[k : k + 1], ddq[k : k + 1], links)
        # vectorised and single sines may differ in the last bit
        np.testing.assert_allclose(bounds.lower[k], single.lower[0], rtol=1e-12, atol=1e-12)


def test_bad_input_is_refused() -> None:
    robot = shipped("planar-2r")
    links, x = link_boxes(robot), np.zeros((3, robot.dof))
    with pytest.raises(ShapeError, match="states of shapes"):
        ianea(robot, x, x, x[:2], links)
    with pytest.raises(ShapeError, match="ddq_tolerance of shape"):
        ianea(robot, x, x, x, links, ddq_tolerance=np.zeros(3))
    with pytest.raises(NumericalError, match="negative value or NaN"):
        ianea(robot, x, x, x, links, ddq_tolerance=np.array([0.1, -0.1]))
    with pytest.raises(NumericalError, match="not finite"):
        ianea(robot, x + np.nan, x, x, links)
    with pytest.raises(ShapeError, match="parameters of 4 links"):
        ianea(robot, x, x, x, link_boxes(shipped("scara")))
    with pytest.raises(ShapeError, match="link parameters of shapes"):
        replace(links, com=links.mass)
    with pytest.raises(NumericalError, match="unbounded"):
        replace(links, mass=Interval(np.zeros(2), np.array([1.0, np.inf])))
    with pytest.raises(NumericalError, match="below zero"):
        replace(links, mass=Interval(np.array([-1.0, 0.0]), np.ones(2)))
