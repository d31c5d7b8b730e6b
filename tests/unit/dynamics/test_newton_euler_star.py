"""NEA*: torques with an auxiliary velocity. Reference: Pinocchio on random chains of revolute and prismatic joints."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.dynamics.newton_euler_star import rnea_star
from modrob_cli.errors import ShapeError
from modrob_cli.model.robot import Robot
from tests.random_chains import random_chain, reference_model

CHAINS = range(30)


def assert_close(actual: Array, expected: Array) -> None:
    # Torques of these chains reach some 1e4 N m; sums of a few hundred terms are good to 1e-13 of that.
    np.testing.assert_allclose(actual, expected, rtol=1e-10, atol=1e-9)


def chain(seed: int) -> tuple[Robot, Any, np.random.Generator]:
    """A robot of up to 8 joints and Pinocchio's model of it, made from the modules without modrob's synthesis."""
    rng = np.random.default_rng(seed)
    assembly, raw = random_chain(rng, most_joints=8)
    return synthesize(assembly), reference_model(raw, assembly.gravity)[0], rng


def coriolis(robot: Robot, q: Array, dq: Array) -> Array:
    """C(q, dq), shape (n, n), column by column."""
    n = robot.dof
    still = np.zeros((n, n))
    q, dq = np.tile(q, (n, 1)), np.tile(dq, (n, 1))
    return (rnea_star(robot, q, dq, np.eye(n), still) - rnea_star(robot, q, still, still, still)).T


def test_chains_have_both_joint_types() -> None:
    types = {joint.type for seed in CHAINS for joint in chain(seed)[0].joints}
    assert types == {"revolute", "prismatic"}


@pytest.mark.parametrize("seed", CHAINS)
def test_equal_velocities_give_inverse_dynamics(seed: int) -> None:
    robot, model, rng = chain(seed)
    data = model.createData()
    q, dq, ddq = rng.uniform(-3.0, 3.0, (3, 5, robot.dof))
    expected = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    assert_close(rnea_star(robot, q, dq, dq, ddq), expected)


@pytest.mark.parametrize("seed", CHAINS)
def test_mass_matrix_and_gravity_are_those_of_pinocchio(seed: int) -> None:
    robot, model, rng = chain(seed)
    data = model.createData()
    q, dq, dq_a, ddq = rng.uniform(-3.0, 3.0, (4, 1, robot.dof))
    change = rnea_star(robot, q, dq, dq_a, ddq) - rnea_star(robot, q, dq, dq_a, 0.0 * ddq)
    M = pin.crba(model, data, q[0])
    M = np.triu(M) + np.triu(M, 1).T
    assert_close(change[0], M @ ddq[0])
    gravity = pin.computeGeneralizedGravity(model, data, q[0])
    assert_close(rnea_star(robot, q, dq, 0.0 * dq, 0.0 * ddq)[0], gravity)


@pytest.mark.parametrize("seed", CHAINS)
def test_bilinear_in_the_two_velocities(seed: int) -> None:
    robot, _, rng = chain(seed)
    q, a, b, c, still = np.concatenate([rng.uniform(-3.0, 3.0, (4, 1, robot.dof)), np.zeros((1, 1, robot.dof))])

    def term(dq: Array, dq_a: Array) -> Array:
        return rnea_star(robot, q, dq, dq_a, still) - rnea_star(robot, q, still, still, still)

    assert_close(term(a + 2.0 * b, c), term(a, c) + 2.0 * term(b, c))
    assert_close(term(c, a + 2.0 * b), term(c, a) + 2.0 * term(c, b))


@pytest.mark.parametrize("seed", CHAINS)
def test_rate_of_mass_matrix_minus_two_c_is_skew(seed: int) -> None:
    robot, model, rng = chain(seed)
    data = model.createData()
    for _ in range(3):
        q, dq = rng.uniform(-3.0, 3.0, (2, robot.dof))
        C = pin.computeCoriolisMatrix(model, data, q, dq)
        rate = C + C.T  # Pinocchio's own C has the property; the next test takes the rate from its mass matrix
        N = rate - 2.0 * coriolis(robot, q, dq)
        np.testing.assert_allclose(N, -N.T, rtol=0.0, atol=1e-11 * max(1.0, np.abs(rate).max()))


@pytest.mark.parametrize("seed", range(10))
def test_power_of_twice_c_is_the_rate_of_the_mass_matrix(seed: int) -> None:
    robot, model, rng = chain(seed)
    data = model.createData()
    q, dq, x = rng.uniform(-1.0, 1.0, (3, robot.dof))
    h = 1e-5

    def kinetic(step: float) -> float:
        M = np.triu(pin.crba(model, data, q + step * dq))
        return float(x @ (M + np.triu(M, 1).T) @ x)

    # Central difference: truncation h^2 / 6 times the third derivative, rounding 1e-16 / h, both below 1e-9 relative.
    rate = (kinetic(h) - kinetic(-h)) / (2.0 * h)
    scale = abs(kinetic(0.0)) + abs(rate)
    assert 2.0 * x @ coriolis(robot, q, dq) @ x == pytest.approx(rate, abs=1e-8 * scale + 1e-10)


def test_the_two_velocities_are_not_interchangeable() -> None:
    # C is not the symmetric factorisation; a test against one that mixes dq and dq_a up.
    robot, _, rng = chain(4)
    assert robot.dof >= 3
    q, dq, dq_a, ddq = rng.uniform(-3.0, 3.0, (4, 1, robot.dof))
    assert np.abs(rnea_star(robot, q, dq, dq_a, ddq) - rnea_star(robot, q, dq_a, dq, ddq)).max() > 1e-3


def test_wrong_shape_is_refused() -> None:
    robot, _, _ = chain(0)
    good, bad = np.zeros((2, robot.dof)), np.zeros((2, robot.dof + 1))
    with pytest.raises(ShapeError, match="states of shapes"):
        rnea_star(robot, good, good, bad, good)
