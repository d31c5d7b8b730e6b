"""From rigid transforms back to the module data of [D] Table 2.1."""

from dataclasses import replace

from modrob_cli.arrays import Array
from modrob_cli.assembly.common_normal import decompose
from modrob_cli.model.module import ConnectionData, JointUnit


def connection_data(T: Array) -> ConnectionData:
    r"""Module data of a rigid transform.

    .. math:: T = R_z(-\delta_{in}) T_z(-p) T_x(a) R_x(\alpha) T_z(n) R_z(\delta_{out})

    Parameters
    ----------
    T : output frame in the input frame, shape (4, 4)

    Returns
    -------
    ConnectionData
        One of the two equivalent sets; accuracy as for :func:`modrob_cli.assembly.common_normal.decompose`.
    """
    normal = decompose(T)
    return ConnectionData(normal.a, normal.alpha, normal.p, normal.n, delta_in=-normal.phi, delta_out=normal.psi)


def unit_data(unit: JointUnit) -> tuple[ConnectionData, ConnectionData, float]:
    """Module data of a joint unit whose parts are given as transforms.

    A part has five parameters and a rigid transform six degrees of freedom. The sixth is a rotation about the joint
    axis, which commutes with the joint's motion and is added to delta_J. [D] Table 2.1.

    Returns
    -------
    proximal : with delta_out = 0
    distal : with delta_in = 0
    delta_J : [rad]
    """
    proximal = connection_data(unit.proximal.transform)
    distal = connection_data(unit.distal.transform)
    delta_j = unit.joint.offset + proximal.delta_out - distal.delta_in
    return replace(proximal, delta_out=0.0), replace(distal, delta_in=0.0), delta_j
