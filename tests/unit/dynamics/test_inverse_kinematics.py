"""Tool motions as joint motions: Jacobian by Pinocchio, plans by differences, the tool's way by forward kinematics."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from modrob_cli.dynamics.inverse_kinematics import SINGULAR, JointMotion, damped_inverse, joint_motion
from modrob_cli.dynamics.jacobian import ToolJacobian
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.dynamics.pinocchio_backend import TOOL_FRAME, build_model, tool_pose
from modrob_cli.errors import InputFileError, UsageError
from modrob_cli.io.documents import read_document
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.robot import Robot
from modrob_cli.model.task import Move, Task, axis_angle, quaternion, turned
from modrob_cli.schema import TaskDocument
from modrob_cli.workflows.trajectory_motion import load_trajectory
from tests.unit.simulate.arms import shipped

UP = np.array([0.0, 0.0, 1.0])


def shipped_task(name: str) -> Task:
    return read_document(shipped_folder("trajectories") / "tasks" / f"{name}.yaml", TaskDocument)[0].to_model()


def deviation(robot: Robot, task: Task, motion: JointMotion) -> tuple[float, float]:
    """Largest errors of position [m] and orientation [rad], by Pinocchio's forward kinematics."""
    found = tool_pose(robot, motion.q)
    plan = task.tool_motion(found[0], np.minimum(motion.t, task.duration))
    turns = Rotation.from_matrix(np.swapaxes(plan.R, 1, 2) @ found[:, :3, :3]).magnitude()
    return float(np.linalg.norm(found[:, :3, 3] - plan.p, axis=1).max()), float(turns.max())


@pytest.mark.parametrize("name", ["lwa4p-6", "scara", "lwa4p-8-tool", "planar-2r"])
def test_jacobian_and_its_derivative(name: str) -> None:
    robot = shipped(name)
    model = build_model(robot)
    data = model.createData()
    frame, jacobian = model.getFrameId(TOOL_FRAME), ToolJacobian(robot)
    for q, dq in np.random.default_rng(0).uniform(-2.0, 2.0, (5, 2, robot.dof)):
        T, J, dJ = jacobian(q, dq)
        pin.computeJointJacobiansTimeVariation(model, data, q, dq)
        pin.updateFramePlacements(model, data)
        axes = pin.LOCAL_WORLD_ALIGNED
        np.testing.assert_allclose(T, data.oMf[frame].homogeneous, atol=1e-13)
        np.testing.assert_allclose(J, pin.getFrameJacobian(model, data, frame, axes), atol=1e-13)
        np.testing.assert_allclose(dJ, pin.getFrameJacobianTimeVariation(model, data, frame, axes), atol=1e-12)


def test_quaternions_are_those_of_scipy() -> None:
    turns = [*Rotation.random(50, random_state=1), *(Rotation.from_rotvec(np.pi * axis) for axis in np.eye(3))]
    for turn in turns:
        x, y, z, w = turn.as_quat()
        found = quaternion(turn.as_matrix())
        assert found[0] >= 0.0
        assert abs(found @ [w, x, y, z]) == pytest.approx(1.0, abs=1e-14)
        axis, angle = axis_angle(turn.as_matrix())
        np.testing.assert_allclose(turned(axis, np.array([angle]))[0], turn.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("relative", [True, False])
def test_planned_velocities_are_derivatives(relative: bool) -> None:
    moves = (
        Move(1.0, np.array([0.1, 0.2, 0.3]), turned(UP, np.array([1.0]))[0]),
        Move(1.5, centre=np.array([0.1, 0.1, 0.3]), axis=np.array([0.0, 1.0, 2.0]), angle=3.0),
        Move(0.5),
    )
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix(), [0.5, -0.2, 0.1]
    t, h = np.linspace(0.051, 2.951, 117), 1e-4

    plan, after, before = (
        Task("x", np.zeros(6), moves, "pose", relative).tool_motion(start, t + d) for d in (0.0, h, -h)
    )
    np.testing.assert_allclose((after.p - before.p) / (2 * h), plan.dp, atol=1e-6)
    np.testing.assert_allclose((after.dp - before.dp) / (2 * h), plan.ddp, atol=1e-5)
    spin = Rotation.from_matrix(after.R @ np.swapaxes(before.R, 1, 2)).as_rotvec() / (2 * h)
    np.testing.assert_allclose(spin, plan.omega, atol=1e-6)
    np.testing.assert_allclose((after.omega - before.omega) / (2 * h), plan.alpha, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "task"),
    [("lwa4p-6", "board-6"), ("lwa4p-6-extended", "board-6"), ("lwa4p-table34", "board-6"), ("lwa4p-8", "board-8")],
)
def test_the_tool_follows_on_four_arms(name: str, task: str) -> None:
    robot, plan = shipped(name), shipped_task(task)
    motion = joint_motion(robot, plan)
    position, orientation = deviation(robot, plan, motion)
    assert position < 1e-6
    assert orientation < 1e-6
    assert motion.position_error.max() == pytest.approx(position, rel=0.02)
    # positions, velocities and accelerations fit together: Simpson's and the trapezoidal rule
    h = 1e-3
    np.testing.assert_allclose(
        np.diff(motion.dq, axis=0)[:-1], 0.5 * h * (motion.ddq[1:] + motion.ddq[:-1])[:-1], atol=1e-12
    )
    assert np.abs(motion.dq[-2]).max() < 1e-6  # at rest, the joint that the task does not need included


def test_near_singular_passage_without_torque_spikes() -> None:
    robot, task = shipped("lwa4p-6"), shipped_task("near-singular-6")
    motion = joint_motion(robot, task)
    assert SINGULAR < motion.least_singular.min() < 0.025
    assert deviation(robot, task, motion)[0] < 1e-4
    assert deviation(robot, task, motion)[1] < 1e-3
    rotors = np.array([j.drive.gear_ratio**2 * float(j.drive.rotor_inertia.nominal) for j in robot.joints])
    torque = rnea(robot, motion.q, motion.dq, motion.ddq) + rotors * motion.ddq
    assert np.abs(np.diff(torque, axis=0)).max() < 2e-3 * np.abs(torque).max()  # per millisecond
    assert np.abs(motion.dq).max() < 1.2566  # the limit of the joints


def test_through_a_singularity_accelerations_stay_bounded_and_the_tool_comes_back() -> None:
    """The wrist's axes line up in between: no joint motion follows the line there."""
    robot = shipped("lwa4p-6")
    q0 = np.array([0.0, -1.0, -1.6, 0.05, -0.3, 0.0])
    axis = ToolJacobian(robot)(q0, 0.0 * q0)
    turn = turned(axis.T[:3, :3].T @ axis.J[3:, 4], np.array([0.6]))[0]
    task = Task("through", q0, (Move(3.0, R=turn), Move(3.0, R=np.eye(3))), "pose", True)
    motion = joint_motion(robot, task)
    assert motion.least_singular.min() < 0.1 * SINGULAR
    assert np.abs(motion.ddq).max() < 60.0
    torque = rnea(robot, motion.q, motion.dq, motion.ddq)
    assert np.abs(torque).max() < 1.5 * np.abs(rnea(robot, q0[None], 0 * q0[None], 0 * q0[None])).max()
    assert motion.position_error[-1] < 1e-4
    assert motion.orientation_error[-1] < 1e-3


def test_position_tasks_leave_the_orientation_free() -> None:
    robot = shipped("lwa4p-6-compact")  # its geometry does not allow all orientations
    q0 = np.array([0.0, 0.8, -0.9, 0.4, 1.3, 0.0])
    motion = joint_motion(robot, Task("line", q0, (Move(2.0, np.array([0.03, 0.02, 0.03])),), "position", True))
    start, end = tool_pose(robot, q0), tool_pose(robot, motion.q[-1])
    np.testing.assert_allclose(end[:3, 3], start[:3, 3] + start[:3, :3] @ [0.03, 0.02, 0.03], atol=1e-6)
    assert motion.orientation_error.max() == 0.0


def test_damped_inverse() -> None:
    J = np.random.default_rng(0).normal(size=(6, 7))
    inverse, least = damped_inverse(J)
    np.testing.assert_allclose(inverse, np.linalg.pinv(J), atol=1e-12)
    assert least == pytest.approx(np.linalg.svd(J, compute_uv=False)[-1])
    U, _, V = np.linalg.svd(J, full_matrices=False)
    for size in (0.0, 1e-9, 1e-3):
        near = U * np.array([3.0, 2.0, 1.0, 1.0, 1.0, size]) @ V
        assert np.linalg.norm(damped_inverse(near)[0], 2) < 1.0 / SINGULAR
    assert damped_inverse(J[:, :4])[1] == 0.0


TASK = "modrob: task/1\nname: t\nstart: [0, -1.7, -1.8, 0.4, -1.4, 0]\nmoves:\n"


def refused(tmp_path: Path, text: str) -> str:
    (tmp_path / "t.yaml").write_text(text)
    with pytest.raises(InputFileError) as caught:
        load_trajectory(tmp_path / "t.yaml", shipped("lwa4p-6"))
    return str(caught.value)


@pytest.mark.parametrize(
    ("move", "expected"),
    [
        ("{duration: 0}", "moves[0].duration"),
        ("{duration: 1, xyz: [0, 0]}", "moves[0].xyz"),
        ("{duration: 1, rpy: [0, 0, 0], quaternion: [1, 0, 0, 0]}", "rpy or quaternion, not both"),
        ("{duration: 1, quaternion: [1, 1, 0, 0]}", "length 1, found 1.41421"),
        ("{duration: 1, arc: {centre: [0, 0, 0], axis: [0, 0, 0], angle: 1}}", "axis that is not zero"),
        ("{duration: 1, xyz: [0, 0, 0], arc: {centre: [0, 0, 0], axis: [0, 0, 1], angle: 1}}", "not both"),
        ("{duration: 1, speed: 3}", "speed"),
        ("{duration: 3000}", "expected less than 199.5 s"),
    ],
)
def test_faults_of_tasks_are_found_at_their_places(tmp_path: Path, move: str, expected: str) -> None:
    message = refused(tmp_path, f"{TASK}- {move}\n")
    assert expected in message
    assert "t.yaml:" in message


@pytest.mark.parametrize("xyz", ["[1e300, 0, 0]", "[1e12, 0, 0]"])
def test_absurd_tasks_are_refused(tmp_path: Path, xyz: str) -> None:
    assert "the arm cannot follow" in refused(tmp_path, f"{TASK}- {{duration: 1, xyz: {xyz}}}\n")


def test_wrong_number_of_joints(tmp_path: Path) -> None:
    text = "modrob: task/1\nname: t\nstart: [0, 1]\nmoves:\n- {duration: 1}\n"
    assert "found 2 values, expected 6" in refused(tmp_path, text)


def test_a_task_needs_an_arm_and_says_where_it_cannot_follow(tmp_path: Path) -> None:
    path = tmp_path / "t.yaml"
    path.write_text(f"{TASK}- {{duration: 2, xyz: [2, 0, 0]}}\n")
    with pytest.raises(UsageError, match="needs an arm"):
        load_trajectory(path)
    loaded = load_trajectory(path, shipped("lwa4p-6"))
    assert any("out of reach" in warning for warning in loaded.warnings)


def test_quaternion_and_angles_of_a_document_agree(tmp_path: Path) -> None:
    x, y, z, w = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_quat()
    path = tmp_path / "t.yaml"
    found = []
    for turn in ("rpy: [0.1, 0.2, 0.3]", f"quaternion: [{w}, {x}, {y}, {z}]"):
        path.write_text(f"{TASK}- {{duration: 1, {turn}}}\n")
        found.append(read_document(path, TaskDocument)[0].to_model().moves[0].R)
    np.testing.assert_allclose(np.array(found[0]), np.array(found[1]), atol=1e-12)
