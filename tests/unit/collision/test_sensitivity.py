"""Smallest contact forces, against Pinocchio's Jacobian and directions tried one by one."""

from pathlib import Path

import numpy as np
import pinocchio as pin

from modrob_cli.collision.events import Band
from modrob_cli.collision.sensitivity import LinkPoint, contact_forces, point_jacobian
from modrob_cli.collision.tables import threshold_table
from modrob_cli.dynamics.pinocchio_backend import TOOL_FRAME, build_model
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]


def robot_of(name: str) -> Robot:
    return load_robot(ROOT / "assemblies" / f"{name}.yaml").robot


def test_jacobian_is_pinocchios() -> None:
    rng = np.random.default_rng(1)
    for name in ("lwa4p-6-payload", "scara"):
        robot = robot_of(name)
        model = build_model(robot)
        data = model.createData()
        q = rng.uniform(-1.0, 1.0, (5, robot.dof))
        for link in (1, robot.dof - 1, robot.dof + 1):
            point = rng.uniform(-0.3, 0.3, 3)
            found = point_jacobian(robot, q, LinkPoint("p", link, point))
            for k in range(len(q)):
                kind = pin.FrameType.OP_FRAME
                parent = min(link, robot.dof)
                place = pin.SE3(np.eye(3), point)
                if link > robot.dof:
                    place = model.frames[model.getFrameId(TOOL_FRAME)].placement * place
                extended = model.copy()
                frame = extended.addFrame(pin.Frame("p", parent, 0, place, kind))
                world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
                wanted = pin.computeFrameJacobian(extended, extended.createData(), q[k], frame, world)[:3]
                assert np.allclose(found[k], wanted, atol=1e-12)  # rounding
        assert data is not None


def test_forces_against_many_directions() -> None:
    """No direction of 20000 needs more than the worst or less than the best; the worst is nearly reached."""
    robot, rng = robot_of("lwa4p-6-payload"), np.random.default_rng(2)
    q, width = rng.uniform(-2.0, 2.0, (8, 6)), rng.uniform(0.5, 10.0, (8, 6))
    where = LinkPoint("tool", 7, np.zeros(3))
    found = contact_forces(robot, q, width, where)
    directions = rng.normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    felt = np.abs(directions @ point_jacobian(robot, q, where)) / width[:, None]
    needed = 1.0 / felt.max(axis=2)
    assert (needed <= found.hardest[:, None] * (1 + 1e-9)).all()
    assert (needed >= found.easiest[:, None] * (1 - 1e-9)).all()
    assert (needed.max(axis=1) > 0.8 * found.hardest).all()  # the corner of a polytope is seldom hit
    assert np.allclose(needed.min(axis=1), found.easiest, rtol=1e-3)  # 20000 directions are 1 degree apart
    own = np.abs(np.eye(3) @ point_jacobian(robot, q, where)) / width[:, None]
    assert np.allclose(found.axes, 1.0 / own.max(axis=2))


def test_a_force_that_no_joint_feels() -> None:
    """A push at the second link of the arm: two joints span a plane at most."""
    robot = robot_of("lwa4p-6-payload")
    found = contact_forces(robot, np.zeros((1, 6)), np.ones((1, 6)), LinkPoint("2", 2, np.array([0.1, 0.0, 0.0])))
    assert np.isinf(found.hardest).all()
    assert np.isfinite(found.easiest).all()


def test_constant_thresholds_hold_the_band() -> None:
    """lower is the largest distance of the band from the nominal torque, by phase; forces against a plain loop."""
    robot, rng = robot_of("lwa4p-6-payload"), np.random.default_rng(3)
    q = rng.uniform(-1.0, 1.0, (60, 6))
    ddq = np.zeros((60, 6))
    ddq[:30] = rng.uniform(0.5, 1.0, (30, 6))
    middle = rng.normal(size=(60, 6))
    below, above = rng.uniform(0.1, 2.0, (2, 60, 6))
    bands = Band(np.arange(60.0), middle, middle - below, middle + above, middle)
    half = np.maximum(below, above)
    table = threshold_table(robot, q, ddq, bands)
    assert np.allclose(table.acceleration.torque, half[:30].max(axis=0))
    assert np.allclose(table.nominal.torque, half[30:].max(axis=0))
    assert (table.acceleration.samples, table.nominal.samples) == (30, 30)
    model = build_model(robot)
    frame = model.getFrameId(TOOL_FRAME)
    forces = []
    for k in range(30, 60):
        J = pin.computeFrameJacobian(model, model.createData(), q[k], frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        forces.append(np.abs(np.linalg.pinv(J.T)) @ half[k])
    assert np.allclose(table.nominal.force, np.max(forces, axis=0), rtol=1e-9)
    # A filter that remembers ten samples keeps the first ten of constant velocity in the other phase.
    longer = threshold_table(robot, q, ddq, bands, 10)
    assert longer.acceleration.samples == 40
    # A motion that never accelerates has one phase; both tables are its own.
    only = threshold_table(robot, q, np.zeros((60, 6)), bands)
    assert np.allclose(only.acceleration.torque, half.max(axis=0))
    assert np.array_equal(only.acceleration.torque, only.nominal.torque)
