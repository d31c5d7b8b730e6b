"""The torque regressor: joint torques as a linear function of the links' dynamic parameters."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.body_terms import body_terms, joint_screws
from modrob_cli.dynamics.link_motion import base_motion, by_joint, joint_positions, link_motions
from modrob_cli.model.robot import Robot

PARAMETERS = ("m", "mc_x", "mc_y", "mc_z", "I_xx", "I_xy", "I_yy", "I_xz", "I_yz", "I_zz")
"""Columns of one link: mass, first moment and tensor about the origin of the link's frame, in Pinocchio's order."""

_ENTRY = (0, 1, 3, 2, 4, 5)
"""Where I_xx, I_xy, I_yy, I_xz, I_yz, I_zz are in modrob's order xx, xy, xz, yy, yz, zz."""
_TIMES = np.array([1.0, 2.0, 1.0, 2.0, 2.0, 1.0])[:, None]


def regressor(robot: Robot, q: Array, dq: Array, ddq: Array) -> Array:
    """Matrix Y with rnea(q, dq, ddq) = Y pi, for the stacked parameters pi of links 1..n in their link frames.

    Parameters
    ----------
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives

    Returns
    -------
    Y : shape (T, n, 10 n); columns 10 i to 10 i + 9 belong to link i + 1 in the order of :data:`PARAMETERS`. The
        fixed base has no columns. Entries of links before a joint are zero. Rounded to nearest.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    """
    q, dq, ddq = by_joint(robot, q, dq, ddq)
    n, count = q.shape
    positions = joint_positions(robot, q)
    motions = link_motions(positions, dq, ddq, base_motion(robot, count))
    Y = np.zeros((count, n, len(PARAMETERS) * n))
    for i, screws in enumerate(joint_screws(positions)):
        for joint, screw in enumerate(screws):
            terms = body_terms(motions[i], screw)
            columns = np.concatenate([terms.y0[None], terms.y, terms.B[list(_ENTRY)] * _TIMES])
            Y[:, joint, len(columns) * i : len(columns) * (i + 1)] = columns.T
    return Y
