r"""Columns of the complete regressor of a robot: rigid bodies and drives, each a standard parameter.

.. math:: \tau = Y(q, \dot q, \ddot q)\,\pi + J \ddot q + F_v \dot q + F_c\,\mathrm{sgn}(\dot q) + o

Friction, reflected rotor inertia (armature) J and offset o have one column per joint, link side. [D] 2.4, 2.6.2.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import nominal_links
from modrob_cli.dynamics.regressor import PARAMETERS, regressor
from modrob_cli.model.body import tensor_entries
from modrob_cli.model.robot import Robot

DRIVE_PARAMETERS = ("offset", "coulomb", "viscous", "armature")
"""Columns of one joint's drive, after the columns of all links."""

TENSOR_ORDER = [0, 1, 3, 2, 4, 5]
"""Where I_xx, I_xy, I_yy, I_xz, I_yz, I_zz are in modrob's order xx, xy, xz, yy, yz, zz."""


@dataclass(frozen=True)
class Column:
    """One standard parameter.

    Attributes
    ----------
    kind : one of PARAMETERS or DRIVE_PARAMETERS
    number : of the link or joint, from 1
    unit : as text
    """

    kind: str
    number: int
    unit: str

    @property
    def name(self) -> str:
        """Name for people, such as ``mc_x4``: the kind and the number of link or joint."""
        return f"{self.kind}{self.number}"

    @property
    def is_rigid(self) -> bool:
        """True for mass, first moments and tensor of a link."""
        return self.kind in PARAMETERS


def columns(robot: Robot) -> tuple[Column, ...]:
    """All standard parameters: ten per link, then four per joint (offsets of all joints, then Coulomb, ...)."""
    rigid = [Column(kind, i, _rigid_unit(kind)) for i in range(1, robot.dof + 1) for kind in PARAMETERS]
    drive = [
        Column(kind, j, _drive_unit(kind, joint.type == "revolute"))
        for kind in DRIVE_PARAMETERS
        for j, joint in enumerate(robot.joints, start=1)
    ]
    return (*rigid, *drive)


def _rigid_unit(kind: str) -> str:
    return "kg" if kind == "m" else "kg m" if kind.startswith("mc") else "kg m^2"


def _drive_unit(kind: str, revolute: bool) -> str:
    if kind == "viscous":
        return "N m s/rad" if revolute else "N s/m"
    if kind == "armature":
        return "kg m^2" if revolute else "kg"
    return "N m" if revolute else "N"


def complete_regressor(robot: Robot, q: Array, dq: Array, ddq: Array) -> Array:
    """Regressor of all standard parameters of :func:`columns`, shape (T, n, 14 n), at states of shape (T, n).

    The sign of zero is zero. Rounded to nearest.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    """
    rigid = regressor(robot, q, dq, ddq)
    drive = [np.ones_like(dq), np.sign(dq), dq, ddq]
    return np.concatenate([rigid, *(part[:, :, None] * np.eye(robot.dof) for part in drive)], axis=2)


def nominal_values(robot: Robot) -> Array:
    """Values of all standard parameters as the robot file gives them, shape (14 n,); offsets are zero."""
    rigid = []
    for link in nominal_links(robot):
        rigid.append(np.concatenate([[link.mass], link.moment, tensor_entries(link.inertia)[TENSOR_ORDER]]))
    joints = robot.joints
    drive = [
        [0.0] * robot.dof,
        [float(joint.friction.coulomb.nominal) for joint in joints],
        [float(joint.friction.viscous.nominal) for joint in joints],
        [joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal) for joint in joints],
    ]
    return np.concatenate([*rigid, *np.asarray(drive)])
