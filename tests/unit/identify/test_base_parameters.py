"""Base parameters: their number, their formulas, the torques that they predict."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.dynamics.pinocchio_backend import build_model, inverse_dynamics
from modrob_cli.errors import NumericalError
from modrob_cli.identify.base_columns import columns, complete_regressor, nominal_values
from modrob_cli.identify.base_grouping import group
from modrob_cli.identify.base_parameters import base_model
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import rotation
from modrob_cli.workflows.robots import load_robot
from tests.random_chains import random_chain
from tests.shared_data import shared

ASSEMBLIES = shipped_folder("assemblies")


def shipped(name: str) -> Robot:
    return load_robot(ASSEMBLIES / f"{name}.yaml").robot


def pinocchio_rank(robot: Robot) -> int:
    """Singular values of Pinocchio's own regressor at states of another distribution and seed."""
    model = build_model(robot)
    data = model.createData()
    rng = np.random.default_rng(99)
    rows = [
        pin.computeJointTorqueRegressor(
            model, data, *rng.normal(scale=[[2.0], [2.0], [5.0]], size=(3, robot.dof))
        ).copy()
        for _ in range(60 + 20 * robot.dof)
    ]
    values = np.linalg.svd(np.vstack(rows), compute_uv=False)
    # Structural zeros are rounding (1e-15 of the largest); the least true value of these arms is above 1e-5.
    return int(np.count_nonzero(values > 1e-10 * values[0]))


@pytest.mark.parametrize(
    ("name", "rigid"),
    [
        # Mayeda, Yoshida, Osuka (1990): 7 n - 4 beta for arms of parallel and perpendicular axes, beta parallel axes
        # at the base, two less if the first is along gravity: 7 * 6 - 4 - 2, 7 * 8 - 4 - 2; planar arm 7 * 2 - 8.
        ("lwa4p-6", 36),
        ("lwa4p-8", 50),
        ("planar-2r", 6),
    ],
)
def test_number_as_in_the_literature(name: str, rigid: int) -> None:
    robot = shipped(name)
    model = base_model(robot)
    assert model.rigid_count == rigid == pinocchio_rank(robot)
    assert model.grouping.is_clear
    # Friction is always told; rotors add to the links but where the joint turns about a fixed axis in inertial space.
    assert sum(column.kind in ("offset", "coulomb", "viscous") for column in model.representatives) == 3 * robot.dof


def test_a_tilted_base_adds_two() -> None:
    """With gravity across the first axis, two first moments of link 1 matter (Mayeda et al.)."""
    robot = shipped("lwa4p-6")
    tilted = replace(robot, gravity=rotation("x", 0.7)[:3, :3] @ robot.gravity)
    assert base_model(tilted).rigid_count == 38 == pinocchio_rank(tilted)


@pytest.mark.parametrize("name", ["ur10/model.urdf", "staubli_tx40/model.urdf"])
def test_industrial_arms(name: str) -> None:
    """Angles with few digits in a URDF (1.57079632679) do not count as directions of their own."""
    assert base_model(load_robot(shared(name)).robot).rigid_count == 36


@pytest.mark.parametrize("seed", range(12))
def test_random_chains(seed: int) -> None:
    """Rank against Pinocchio; torque of any parameters against Pinocchio and friction by hand, at new states."""
    rng = np.random.default_rng(seed)
    robot = synthesize(random_chain(rng, most_joints=7)[0])
    model = base_model(robot)
    assert model.rigid_count == pinocchio_rank(robot)
    q, dq, ddq = rng.normal(scale=2.0, size=(3, 40, robot.dof))
    standard = nominal_values(robot)
    drive = rng.uniform(0.5, 5.0, size=(4, robot.dof))
    standard[10 * robot.dof :] = drive.ravel()
    offset, coulomb, viscous, armature = drive
    torque = inverse_dynamics(robot, q, dq, ddq) + offset + coulomb * np.sign(dq) + viscous * dq + armature * ddq
    W = model.regressor(complete_regressor(robot, q, dq, ddq))
    # Dropped columns leave at most 1e-12 of themselves here; the rest is rounding of sums of 140 terms.
    np.testing.assert_allclose(W @ model.base(standard), torque, rtol=0, atol=1e-10 * np.abs(torque).max())


def test_planar_arm_in_closed_form() -> None:
    """The textbook's: link 2's mass moves on to link 1's first moment and, times l1^2, to its inertia."""
    model = base_model(shipped("planar-2r"))  # l1 = 1 m
    formulas = [model.formula(k) for k in range(model.count)]
    friction = [f"{kind}{j}" for j in (1, 2) for kind in ("offset", "coulomb", "viscous")]
    rigid = ["I_zz1 + m2 + armature1", "mc_x1 + m2", "mc_y1", "I_zz2", "mc_x2", "mc_y2", "armature2"]
    assert formulas == friction + rigid


def test_spherical_wrist_by_khalils_rules() -> None:
    """I_yy, mc_z and m of a link move on to the link before (Khalil, Dombre); 0.0748 m is a length of module PB3."""
    model = base_model(shipped("lwa4p-6"))
    formulas = [model.formula(k) for k in range(model.count)]
    for wanted in (
        "I_zz6",
        "mc_x6",
        "I_xx6 - I_yy6",
        "mc_x5",
        "mc_y5 + 0.0748 m6 + mc_z6",
        "I_yz5 - 0.00559504 m6 - 0.0748 mc_z6",
    ):
        assert wanted in formulas


def test_a_vertical_slide_confuses_weight_and_offset() -> None:
    """Quill of the SCARA: m (ddq - g) is a rotor of mass m with an offset of -9.81 m."""
    model = base_model(shipped("scara"))
    formulas = [model.formula(k) for k in range(model.count)]
    assert "offset3 - 9.81 m3 - 9.81 m4" in formulas
    assert "armature3 + m3 + m4" in formulas


def test_joints_at_rest() -> None:
    """With joint 1 of the planar arm at rest, link 2 is a pendulum: inertia with rotor, two first moments, friction."""
    model = base_model(shipped("planar-2r"), moving=[1])
    assert [model.formula(k) for k in range(model.count)] == [
        *("offset2", "coulomb2", "viscous2", "I_zz2 + armature2", "mc_x2", "mc_y2")
    ]


def test_columns_have_names_and_units() -> None:
    robot = shipped("scara")
    parameters = columns(robot)
    assert len(parameters) == 14 * robot.dof
    units = {column.name: column.unit for column in parameters}
    assert (units["m1"], units["mc_x2"], units["I_zz4"]) == ("kg", "kg m", "kg m^2")
    assert (units["viscous1"], units["viscous3"], units["armature3"]) == ("N m s/rad", "N s/m", "kg")


def test_grouping_finds_combinations_and_says_how_clear_it_is() -> None:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(50, 3)) * [1.0, 1e4, 1e-4]
    W = np.column_stack([A, A @ [2.0, 0.0, -3.0], A @ [0.0, 1.0, 0.0], np.zeros(50)])
    found = group(W, np.array([4, 0, 1, 2, 3, 5]), negligible=1e-12)
    assert found.independent.tolist() == [4, 0, 2]
    np.testing.assert_allclose(found.transform[1], [1, 0, 0, 2, 0, 0], atol=1e-9)
    np.testing.assert_allclose(found.transform[0], [0, 1, 0, 0, 1, 0], atol=1e-9)
    assert found.is_clear
    assert found.dropped < 1e-10
    W[:, 3] += 1e-5 * np.linalg.norm(W[:, 3]) * rng.normal(size=50) / np.sqrt(50)
    blurred = group(W, np.arange(6), tolerance=3e-5, negligible=1e-12)
    assert blurred.rank == 3
    assert 1e-6 < blurred.dropped < 3e-5


def test_numbers_beyond_range() -> None:
    with pytest.raises(NumericalError, match="not finite"):
        group(np.array([[1.0, np.inf]]), np.arange(2))
