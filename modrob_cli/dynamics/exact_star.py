r"""Exact range of M(q) ddq + C(q, dq) dq_a + g(q) for dq_a different from dq, as passivity-based control needs it.

With C from the Christoffel symbols, C(q, v) w is symmetric and bilinear in (v, w), hence

.. math:: C(q, v)\,w = c\big((v + w)/2\big) - c\big((v - w)/2\big), \qquad c(v) = C(q, v)\,v,

so the coefficients of each body are those of three motions added up: gravity and acceleration at rest, and two at
constant joint velocity. The published algorithm (NEA*) has another valid C; the two agree for dq_a = dq only, and for
both dM/dt - 2C is skew-symmetric.
"""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import CHUNK, Prepared, TorqueBounds, rigid_ranges, with_drives
from modrob_cli.dynamics.link_motion import base_motion, by_joint, joint_positions, link_motions, weightless
from modrob_cli.dynamics.margin import torque_magnitude
from modrob_cli.model.robot import Robot


def exact_bounds_star(robot: Robot, q: Array, dq: Array, dq_a: Array, ddq: Array) -> TorqueBounds:
    """Range over all admissible parameters at each sample; friction acts at dq, rotors at ddq.

    Parameters
    ----------
    q, dq, dq_a, ddq : shape (T, n); dq is the joints' velocity, dq_a the auxiliary one that C is multiplied by

    Returns
    -------
    TorqueBounds
        Outward as those of :func:`modrob_cli.dynamics.exact_bounds.exact_bounds`, which it equals for dq_a = dq.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If a result is not finite.
    """
    by_joint(robot, q, dq, dq_a, ddq)
    prepared = Prepared.of(robot)
    pieces = [TorqueBounds.empty(robot.dof)]
    for start in range(0, len(q), CHUNK):
        piece = slice(start, start + CHUNK)
        with np.errstate(over="ignore", invalid="ignore"):  # not finite in the end is an error of its own
            pieces.append(_chunk(prepared, *by_joint(robot, q[piece], dq[piece], dq_a[piece], ddq[piece])))
    return TorqueBounds.joined(pieces)


def _chunk(prepared: Prepared, q: Array, dq: Array, dq_a: Array, ddq: Array) -> TorqueBounds:
    robot, count = prepared.robot, q.shape[1]
    positions = joint_positions(robot, q)
    still = np.zeros_like(dq)
    parts = [
        (1.0, link_motions(positions, still, ddq, base_motion(robot, count))),
        (1.0, link_motions(positions, 0.5 * (dq + dq_a), still, weightless(count))),
        (-1.0, link_motions(positions, 0.5 * (dq - dq_a), still, weightless(count))),
    ]
    # All three motions together have terms no larger than one motion at the sum of the speeds.
    magnitude = torque_magnitude(robot, q, np.abs(dq) + np.abs(dq_a), ddq)
    return with_drives(prepared, rigid_ranges(prepared, positions, parts), q, dq, ddq, magnitude)
