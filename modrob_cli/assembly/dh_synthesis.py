"""The extended D-H table of a robot, as a view of its joint placements. [D] 2.3.3, Algorithm 1."""

import math

import numpy as np

from modrob_cli.arrays import frozen
from modrob_cli.assembly.common_normal import decompose
from modrob_cli.model.dh import DhTable
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import rotation, translation


def dh_table(robot: Robot) -> DhTable:
    r"""Extended D-H parameters of all links.

    Each placement of the next joint axis in the frame of link i (for the last link: of the end effector) is split as
    T_z(-p) R_z(\phi') T_x(a) R_x(\alpha) T_z(n) R_z(\psi), with psi_i = -phi_i of [D]; then [D] (2.4), (2.12) give

    .. math:: d_i = n_{i-1} - p_i, \qquad \gamma_i = \phi'_i + \delta_{J,i} + \psi_{i-1}, \qquad n_0 = \psi_0 = 0.

    The two frames that the dissertation leaves open: frame 0 is the frame of the first joint before its offset, and
    the end effector is placed in frame n by T_z(n_n) R_z(psi_n).

    Accuracy: the chain of D-H transforms equals the product of the placements to rounding, except for nearly parallel
    axes, where the convention is ill-conditioned (see :mod:`modrob_cli.assembly.common_normal`). Nothing in modrob
    computes with this table; it is for people and other programs.
    """
    following = [*(joint.placement for joint in robot.joints[1:]), robot.tool_transform]
    splits = [decompose(T) for T in following]
    n = np.array([split.n for split in splits])
    p = np.array([split.p for split in splits])
    psi = np.array([0.0, *(split.psi for split in splits[:-1])])
    phi = np.array([split.phi for split in splits])
    offset = np.array([joint.offset for joint in robot.joints])
    frames = [
        translation("z", -s.p) @ rotation("z", s.phi) @ translation("x", s.a) @ rotation("x", s.alpha) for s in splits
    ]
    last = splits[-1]
    size = robot.dof
    return DhTable(
        joint_types=tuple(joint.type for joint in robot.joints),
        a=frozen([split.a for split in splits], (size,)),
        alpha=frozen([split.alpha for split in splits], (size,)),
        d=frozen(np.concatenate([[0.0], n[:-1]]) - p, (size,)),
        gamma=frozen(wrap(phi + offset + psi), (size,)),
        p=frozen(p, (size,)),
        n=frozen(n, (size,)),
        base_transform=robot.joints[0].placement,
        tool_transform=frozen(translation("z", last.n) @ rotation("z", last.psi), (4, 4)),
        frames=frozen(frames, (size, 4, 4)),
    )


def wrap(angle: np.ndarray) -> np.ndarray:
    """Angles moved into (-pi, pi] by whole turns; those inside stay as they are."""
    turns = np.ceil((angle - math.pi) / (2.0 * math.pi))
    return np.asarray(np.where(np.abs(angle) <= math.pi, angle, angle - 2.0 * math.pi * turns))
