"""The Pinocchio backend against closed forms and against models that are built another way."""

from typing import Any, Literal

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics, tool_pose
from modrob_cli.errors import ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody, tensor
from modrob_cli.model.joint import Joint, JointType
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import from_xyz_rpy, rotation, translation

GRAVITY = (0.3, -9.7, 0.5)


def body(
    mass: float,
    com: Any,
    inertia: Any,
    about: Literal["com", "frame"] = "com",
    pose: Array | None = None,
    link: int = 1,
) -> PlacedBody:
    m, c, entries = (Uncertain.exact(value) for value in (mass, com, inertia))
    return PlacedBody(link, np.eye(4) if pose is None else pose, RigidBody("b", m, c, entries, about))


def robot(joints: list[Joint], bodies: list[PlacedBody], gravity: Any = GRAVITY) -> Robot:
    tool = from_xyz_rpy([0.1, -0.2, 0.3], [0.4, 0.5, 0.6])
    return Robot("r", tuple(joints), tuple(bodies), tool, np.asarray(gravity), Interval(np.zeros(len(joints))))


def random_inertia(rng: np.random.Generator) -> Array:
    """Entries of a tensor that a real body can have: second moments of random points."""
    points = rng.normal(size=(8, 3))
    full = sum(np.eye(3) * (p @ p) - np.outer(p, p) for p in points)
    return np.asarray(full)[np.triu_indices(3)] * 0.01


def random_robot(seed: int, about: Literal["com", "frame"]) -> Robot:
    rng = np.random.default_rng(seed)
    kinds: list[JointType] = ["revolute", "prismatic", "revolute", "revolute"]
    joints = [
        Joint(f"j{k}", kind, from_xyz_rpy(rng.normal(size=3), rng.normal(size=3)), offset=rng.normal())
        for k, kind in enumerate(kinds)
    ]
    bodies = []
    for link in (0, 1, 1, 2, 3, 3, 3, 4):
        pose = from_xyz_rpy(rng.normal(size=3), rng.normal(size=3))
        mass, com, inertia = rng.uniform(0.5, 3.0), rng.normal(size=3) * 0.1, random_inertia(rng)
        if about == "frame":
            # A tensor about the frame holds m S(c)'S(c) already.
            shift = mass * (np.eye(3) * (com @ com) - np.outer(com, com))
            inertia = inertia + shift[np.triu_indices(3)]
        bodies.append(body(mass, com, inertia, about, pose, link))
    return robot(joints, bodies)


def separate_model(arm: Robot) -> Any:
    """Pinocchio model with one fixed joint per body and per offset, made of Pinocchio's own operations."""
    model = pin.Model()
    model.gravity.linear = arm.gravity
    for index, joint in enumerate(arm.joints):
        placement = pin.SE3(joint.placement) * pin.SE3(pin.utils.rotate("z", joint.offset), np.zeros(3))
        kind = pin.JointModelRevoluteUnaligned(0, 0, 1) if joint.type == "revolute" else pin.JointModelPZ()
        model.addJoint(index, kind, placement, joint.name)
    for placed in arm.bodies:
        mass, com = float(placed.body.mass.nominal), np.asarray(placed.body.com.nominal)
        about = tensor(placed.body.inertia.nominal)
        if placed.body.inertia_about == "frame":
            about = about + mass * pin.skew(com) @ pin.skew(com)
        model.appendBodyToJoint(placed.link, pin.Inertia(mass, com, about), pin.SE3(placed.pose))
    return model


def test_two_link_arm_has_the_closed_form_torques() -> None:
    m1, m2, l1, c1, c2, i1, i2, g = 3.0, 2.0, 0.7, 0.3, 0.25, 0.04, 0.03, 9.81
    joints = [Joint("a", "revolute", np.eye(4)), Joint("b", "revolute", translation("x", l1))]
    bodies = [body(m1, [c1, 0, 0], [0, 0, 0, 0, 0, i1]), body(m2, [c2, 0, 0], [0, 0, 0, 0, 0, i2], link=2)]
    arm = robot(joints, bodies, gravity=(0.0, -g, 0.0))
    q, v, a = np.random.default_rng(1).uniform(-3, 3, (3, 200, 2))
    # Textbook equations of the planar arm with the y axis up.
    cos2, sin2 = np.cos(q[:, 1]), np.sin(q[:, 1])
    m12 = i2 + m2 * (c2**2 + l1 * c2 * cos2)
    m11 = i1 + i2 + m1 * c1**2 + m2 * (l1**2 + c2**2 + 2 * l1 * c2 * cos2)
    h = m2 * l1 * c2 * sin2
    g2 = m2 * c2 * g * np.cos(q[:, 0] + q[:, 1])
    g1 = (m1 * c1 + m2 * l1) * g * np.cos(q[:, 0]) + g2
    tau1 = m11 * a[:, 0] + m12 * a[:, 1] - h * (2 * v[:, 0] * v[:, 1] + v[:, 1] ** 2) + g1
    tau2 = m12 * a[:, 0] + (i2 + m2 * c2**2) * a[:, 1] + h * v[:, 0] ** 2 + g2
    # 1e-12: torques are near 100 N m, so this is some hundred roundings.
    np.testing.assert_allclose(inverse_dynamics(arm, q, v, a), np.stack([tau1, tau2], axis=1), rtol=0, atol=1e-12)


@pytest.mark.parametrize("about", ["com", "frame"])
@pytest.mark.parametrize("seed", range(5))
def test_several_bodies_per_link_equal_a_model_of_separate_bodies(seed: int, about: Literal["com", "frame"]) -> None:
    arm = random_robot(seed, about)
    model = separate_model(arm)
    data = model.createData()
    q, v, a = np.random.default_rng(seed + 100).uniform(-2, 2, (3, 20, 4))
    expected = [pin.rnea(model, data, *sample) for sample in zip(q, v, a, strict=True)]
    # Torques are up to some 1000 N m; 1e-10 leaves room for a different order of summation.
    np.testing.assert_allclose(inverse_dynamics(arm, q, v, a), expected, rtol=0, atol=1e-10)


def test_static_torque_is_the_gradient_of_the_potential_energy() -> None:
    arm = random_robot(7, "frame")

    def energy(q: Array) -> float:
        frames = [np.eye(4), *arm.link_frames(q)]
        total = 0.0
        for placed in arm.bodies:
            com = frames[placed.link] @ placed.pose @ [*placed.body.com.nominal, 1.0]
            total -= float(placed.body.mass.nominal) * float(arm.gravity @ com[:3])
        return total

    q = np.random.default_rng(8).uniform(-2, 2, 4)
    step = 1e-5
    gradient = [(energy(q + step * e) - energy(q - step * e)) / (2 * step) for e in np.eye(4)]
    # Central differences: energy is near 100 J, so rounding leaves 100 * 1e-16 / 1e-5 = 1e-9, truncation about 1e-8.
    np.testing.assert_allclose(inverse_dynamics(arm, q, 0 * q, 0 * q), gradient, rtol=0, atol=1e-6)


def test_massless_bodies_contribute_their_inertia_or_nothing() -> None:
    joints = [Joint("a", "revolute", np.eye(4)), Joint("b", "prismatic", rotation("x", 0.5))]
    spin = body(0.0, [0.3, 0.1, 0], [0.1, 0, 0, 0.1, 0, 0.7], about="frame", pose=from_xyz_rpy([1, 2, 3], [0, 0, 0]))
    nothing = body(0.0, [1, 1, 1], np.zeros(6), link=2)
    arm = robot(joints, [spin, nothing])
    tau = inverse_dynamics(arm, np.array([0.3, 0.2]), np.array([1.0, 2.0]), np.array([2.0, 5.0]))
    # A couple without mass: 0.7 kg m^2 about the joint axis wherever it sits; no weight, nothing to push.
    np.testing.assert_allclose(tau, [1.4, 0.0], rtol=0, atol=1e-14)


def test_robot_without_bodies_needs_no_torque() -> None:
    arm = robot([Joint("universe", "revolute", np.eye(4)), Joint("x", "revolute", np.eye(4))], [])
    np.testing.assert_array_equal(inverse_dynamics(arm, *np.ones((3, 4, 2))), np.zeros((4, 2)))


def test_tool_pose_is_the_product_of_the_transforms() -> None:
    arm = random_robot(3, "com")
    q = np.random.default_rng(4).uniform(-3, 3, (2, 5, 4))
    poses = tool_pose(arm, q)
    assert poses.shape == (2, 5, 4, 4)
    # Four joints, lengths of a few metres: some tens of roundings of 4e-16.
    np.testing.assert_allclose(poses, arm.link_frames(q)[..., -1, :, :], rtol=0, atol=1e-13)


def test_batches_keep_their_shape() -> None:
    arm = random_robot(5, "com")
    q, v, a = np.random.default_rng(6).normal(size=(3, 2, 3, 4))
    tau = inverse_dynamics(arm, q, v, a)
    assert tau.shape == (2, 3, 4)
    np.testing.assert_array_equal(tau[1, 2], inverse_dynamics(arm, q[1, 2], v[1, 2], a[1, 2]))


def test_wrong_shapes_are_refused() -> None:
    arm = random_robot(5, "com")
    with pytest.raises(ShapeError):
        inverse_dynamics(arm, np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)))
    with pytest.raises(ShapeError):
        inverse_dynamics(arm, np.zeros((2, 4)), np.zeros((2, 4)), np.zeros(4))
    with pytest.raises(ShapeError):
        tool_pose(arm, np.zeros(3))
