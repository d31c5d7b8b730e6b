"""Rigid-body dynamics of the nominal robot by Pinocchio.

The model is built joint by joint from :class:`Robot`, not through a file, so that nothing is lost in between.
Pinocchio is the reference here: the recursions of this package are compared with it.
"""

from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_inertia import joined
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.model.robot import Robot

TOOL_FRAME = "modrob_tool"


def build_model(robot: Robot) -> Any:
    """Pinocchio model of the robot with its nominal rigid bodies and its gravity.

    Joint i of the robot is joint i of the model (0 is the fixed base), the frames are those of the links, and the
    frame :data:`TOOL_FRAME` is the end effector. Friction, rotor inertia and limits are not carried over.

    Raises
    ------
    NumericalError
        If a link has a tensor of inertia that is not positive.
    """
    import pinocchio as pin

    model = pin.Model()
    model.name = robot.name
    model.gravity.linear = robot.gravity
    for index, joint in enumerate(robot.joints):
        kind = pin.JointModelRZ() if joint.type == "revolute" else pin.JointModelPZ()
        # The names carry the index, because Pinocchio wants them unique and the base is named "universe".
        model.addJoint(index, kind, pin.SE3(joint.zero_placement), f"{index + 1}:{joint.name}")
    for link in range(robot.dof + 1):
        try:
            inertia = pin.Inertia(*joined(robot.bodies_of(link)).central())
        except RuntimeError as error:
            bodies = ", ".join(placed.body.name for placed in robot.bodies_of(link))
            raise NumericalError(f"mass and inertia of {bodies} are not those of a real body") from error
        model.appendBodyToJoint(link, inertia, pin.SE3.Identity())
    model.addFrame(pin.Frame(TOOL_FRAME, robot.dof, 0, pin.SE3(robot.tool_transform), pin.FrameType.OP_FRAME))
    return model


def inverse_dynamics(robot: Robot, q: Array, dq: Array, ddq: Array) -> Array:
    """Joint torques of the rigid bodies, M(q) ddq + C(q, dq) dq + g(q), without friction and rotor inertia.

    Parameters
    ----------
    q, dq, ddq : joint positions, velocities, accelerations, shape (..., n), [rad] or [m] and derivatives

    Returns
    -------
    tau : array, shape (..., n), [N m] or [N]

    Raises
    ------
    ShapeError
        If the shapes differ or the last axis is not n.

    Notes
    -----
    Loops over the samples: Pinocchio's Python binding has no batch form.
    """
    import pinocchio as pin

    if not q.shape == dq.shape == ddq.shape or q.shape[-1:] != (robot.dof,):
        raise ShapeError(f"q, dq, ddq of shapes {q.shape}, {dq.shape}, {ddq.shape} for {robot.dof} joints")
    model = build_model(robot)
    data = model.createData()
    flat = [np.ascontiguousarray(x, dtype=float).reshape(-1, robot.dof) for x in (q, dq, ddq)]
    tau = np.empty_like(flat[0])
    for k, sample in enumerate(zip(*flat, strict=True)):
        tau[k] = pin.rnea(model, data, *sample)
    return tau.reshape(q.shape)


def tool_pose(robot: Robot, q: Array) -> Array:
    """End-effector frame in the base frame, shape (..., 4, 4), at joint positions q (..., n).

    Raises
    ------
    ShapeError
        If the last axis of q is not n.
    """
    import pinocchio as pin

    if q.shape[-1:] != (robot.dof,):
        raise ShapeError(f"q of shape {q.shape} for {robot.dof} joints")
    model = build_model(robot)
    data = model.createData()
    frame = model.getFrameId(TOOL_FRAME)
    flat = np.ascontiguousarray(q, dtype=float).reshape(-1, robot.dof)
    poses = np.empty((len(flat), 4, 4))
    for k, sample in enumerate(flat):
        pin.framesForwardKinematics(model, data, sample)
        poses[k] = data.oMf[frame].homogeneous
    return poses.reshape(*q.shape[:-1], 4, 4)
