r"""The published interval Newton-Euler algorithm IANEA*, batch. [R] Alg. 1, [D] Algorithm 4.

Kinematics in numbers, forces and moments in intervals:

.. math:: [a_c] = a + \alpha \times [c] + \omega \times (\omega_a \times [c]), \quad [F] = [m]\,[a_c], \quad
          [n] = [c] \times [F] + [I]\,\alpha + \omega_a \times ([I]\,\omega),

summed from the tip to the base. [m] and [c] of a link enter several times, and intervals are turned from frame to
frame, so the bounds are wider than the exact ones (:mod:`modrob_cli.dynamics.exact_bounds`). They are kept for
comparison and for the published figures. With an interval [ddq], accelerations are intervals too.

Difference from the publication: links are placed by transforms, not D-H rows. A link's interval formulas are evaluated
in the frame in which its parameters are given; with D-H frames they are the published ones.

Rounding. Ends are computed in round-to-nearest and moved outward by a proven margin. For each link, its true force and
moment are mid + d with abs(d) <= rad in each component, but for rounding errors e; the torque is a sum of linear maps
(turns, levers) of these vectors.

1. Midpoints: the steps of :mod:`modrob_cli.dynamics.margin`, with its magnitude S_j taken over these boxes, over the
   larger of abs(dq) and abs(dq_a), and over abs(ddq) plus its tolerance. Interval operations multiply ends of the same
   magnitudes. A cross product of absolute values is at most 2 / sqrt(3) times as long as the product of the lengths;
   three in a row make 1.54; hence 2 S_j. What the width of a factor adds to the midpoint of a product is at most the
   product's half-width.
2. Half-widths are sums of products of non-negative numbers: off by the number of roundings times themselves. Ends of a
   product of intervals are off by roundings times midpoint (in S_j) plus half-width, component by component.
3. Computed maps L' differ from the true ones L by roundings: L d = L' d + (L - L') d. The first is within what is
   summed, abs(L') rad. The second is at most roundings times the length of d, which S_j contains: half-widths of links
   arise at the link itself, and those of [ddq] enter S_j times a bound of what turning boxes adds (``_growth``). An
   error e is turned by L, not by abs(L), so it does not grow; one in proportion to a half-width grows with it.

So the margin is roundings(n) u (2 S_j + rad_j) plus that of the drives; roundings per joint and per link are as many as
for the exact bounds.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import DriveBox, drive_boxes, drive_nominal
from modrob_cli.dynamics.exact_bounds import CHUNK, TorqueBounds
from modrob_cli.dynamics.ianea_links import LinkBox, LinkBoxes, link_boxes
from modrob_cli.dynamics.interval_vectors import (
    Box,
    cross_number,
    cross_parameter,
    cross_width,
    matrix_parameter,
    scaled,
    turn_width,
)
from modrob_cli.dynamics.link_inertia import LinearParameters
from modrob_cli.dynamics.link_motion import JointPosition, by_joint, joint_positions
from modrob_cli.dynamics.margin import rounding_margin, torque_magnitude
from modrob_cli.dynamics.newton_euler import nominal_links
from modrob_cli.dynamics.newton_euler_star import StarMotion, star_backward, star_motions
from modrob_cli.dynamics.vectors import apply, zeros
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class _Prepared:
    """What does not depend on the motion; ``sized`` carries the boxes as bodies, for the rounding margin."""

    robot: Robot
    sized: Robot
    links: list[LinkBox]
    nominal: list[LinearParameters]
    drives: list[DriveBox]
    tolerance: Array | None
    growth: float


def ianea(
    robot: Robot,
    q: Array,
    dq: Array,
    ddq: Array,
    links: LinkBoxes,
    dq_a: Array | None = None,
    ddq_tolerance: Array | None = None,
) -> TorqueBounds:
    """Bounds of M ddq + C dq_a + g + friction + rotor + disturbance by the published interval algorithm.

    Parameters
    ----------
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives
    links : interval parameters of the links; the robot's own bodies only give the nominal torque
    dq_a : auxiliary velocity for the Coriolis terms, shape (T, n); dq where left out. Friction is that at dq.
    ddq_tolerance : half-widths of [ddq] = ddq +- tolerance, shape (n,), >= 0; zero where left out

    Returns
    -------
    TorqueBounds
        Outward: they enclose the torques of all admissible parameters and accelerations. The nominal torque is that
        at ddq, rounded to nearest; its friction counts sgn(0) = 0.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If a tolerance is negative or a result is not finite.
    """
    dq_a = dq if dq_a is None else dq_a
    by_joint(robot, q, dq, dq_a, ddq)
    prepared = _prepare(robot, links, ddq_tolerance)
    pieces = [TorqueBounds.empty(robot.dof)]
    for start in range(0, len(q), CHUNK):
        piece = slice(start, start + CHUNK)
        pieces.append(_chunk(prepared, *by_joint(robot, q[piece], dq[piece], dq_a[piece], ddq[piece])))
    return TorqueBounds.joined(pieces)


def _prepare(robot: Robot, links: LinkBoxes, tolerance: Array | None) -> _Prepared:
    if len(links.frames) != robot.dof:
        raise ShapeError(f"parameters of {len(links.frames)} links for {robot.dof} joints")
    if tolerance is not None:
        if tolerance.shape != (robot.dof,):
            raise ShapeError(f"ddq_tolerance of shape {tolerance.shape} for {robot.dof} joints")
        if not (tolerance >= 0.0).all():
            raise NumericalError("ddq_tolerance: found a negative value or NaN, expected half-widths >= 0")
        tolerance = tolerance if tolerance.any() else None
    sized = replace(robot, bodies=links.bodies())
    boxes, nominal = link_boxes(links), nominal_links(robot)
    return _Prepared(robot, sized, boxes, nominal, drive_boxes(robot), tolerance, _growth(robot, boxes))


def _growth(robot: Robot, links: list[LinkBox]) -> float:
    """Bound of how much longer the vector of half-widths gets by all turns between base and tip together."""
    turns = [float(np.linalg.norm(np.abs(joint.zero_placement[:3, :3]), 2)) for joint in robot.joints]
    own = max(float(np.linalg.norm(np.abs(link.R), 2)) for link in links)
    return math.prod(turns, start=own) * math.sqrt(2.0) ** robot.dof


def _chunk(prepared: _Prepared, q: Array, dq: Array, dq_a: Array, ddq: Array) -> TorqueBounds:
    """Bounds of one chunk; states of shape (n, T)."""
    robot, count = prepared.robot, q.shape[1]
    tolerance = np.zeros(robot.dof) if prepared.tolerance is None else prepared.tolerance
    positions = joint_positions(robot, q)
    motions = star_motions(robot, positions, dq, dq_a, ddq)
    nominal = star_backward(positions, motions, prepared.nominal)
    mid, rad = _backward(positions, motions, _motion_widths(positions, prepared.tolerance, count), prepared.links)
    speed = np.maximum(np.abs(dq), np.abs(dq_a))
    most = np.abs(ddq) + prepared.growth * tolerance[:, None]
    magnitude = 2.0 * torque_magnitude(prepared.sized, q, speed, most) + rad
    lower, upper = mid - rad, mid + rad
    for i, drive in enumerate(prepared.drives):
        ends = _drive_range(drive, dq[i], ddq[i], tolerance[i])
        lower[i] += ends[0]
        upper[i] += ends[1]
        nominal[i] += drive_nominal(robot.joints[i], dq[i], ddq[i], robot.disturbance[i])
        magnitude[i] += drive.magnitude(dq[i], most[i])
    margin = rounding_margin(robot.dof, magnitude)
    lower, upper = lower - margin, upper + margin
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise NumericalError("a torque bound is not finite; check the motion and the model for absurd values")
    return TorqueBounds(*(np.ascontiguousarray(part.T) for part in (nominal, lower, upper)))


def _drive_range(drive: DriveBox, dq: Array, ddq: Array, tolerance: float) -> tuple[Array, Array]:
    """Range of a drive's torque over ddq +- tolerance: linear in ddq, so at one of the ends."""
    if tolerance == 0.0:
        return drive.torque_range(dq, ddq)
    first, second = drive.torque_range(dq, ddq - tolerance), drive.torque_range(dq, ddq + tolerance)
    return np.minimum(first[0], second[0]), np.maximum(first[1], second[1])


Widths = tuple[Array | None, Array | None]


def _motion_widths(positions: list[JointPosition], tolerance: Array | None, count: int) -> list[Widths]:
    """Half-widths of alpha and acc (3, T) of each link; None where accelerations are exact."""
    if tolerance is None:
        return [(None, None)] * len(positions)
    alpha, acc = zeros(count), zeros(count)
    widths: list[Widths] = []
    for position, rad in zip(positions, tolerance, strict=True):
        acc = acc + cross_width(np.abs(position.p), alpha)
        alpha, acc = (turn_width(position, apply(np.abs(position.R.T), x)) for x in (alpha, acc))
        (alpha if position.is_revolute else acc)[2] += rad
        widths.append((alpha, acc))
    return widths


def _backward(
    positions: list[JointPosition], motions: list[StarMotion], widths: list[Widths], links: list[LinkBox]
) -> tuple[Array, Array]:
    """Midpoints and half-widths (n, T) of the torques. [D] Alg. 4, lines 25-34."""
    count = motions[0].omega.shape[1]
    force = moment = Box(zeros(count))
    mid, rad = np.empty((len(links), count)), np.zeros((len(links), count))
    for i in reversed(range(len(links))):
        if not links[i].is_massless:
            f, n = _wrench(motions[i], widths[i], links[i])
            force, moment = force + f, moment + n
        drawn = moment if positions[i].is_revolute else force
        mid[i] = drawn.mid[2]
        if drawn.rad is not None:
            rad[i] = drawn.rad[2]
        if i:
            force, moment = force.to_previous(positions[i]), moment.to_previous(positions[i])
            moment = moment + cross_number(positions[i].p, force)
    return mid, rad


def _wrench(motion: StarMotion, widths: Widths, link: LinkBox) -> tuple[Box, Box]:
    """Force and moment about the link's origin, in its frame; worked out in the frame of the link's parameters."""
    alpha, acc = Box(motion.alpha, widths[0]), Box(motion.acc, widths[1])
    if not link.is_moved:
        return _own_wrench(motion, alpha, acc, link)
    t = link.t[:, None]
    if acc.rad is not None and alpha.rad is not None:
        acc = Box(acc.mid, acc.rad + cross_width(np.abs(t), alpha.rad))
    seen = motion.seen_from(link.R, link.t)
    alpha, acc = Box(seen.alpha, alpha.turned(link.R.T).rad), Box(seen.acc, acc.turned(link.R.T).rad)
    force, moment = (x.turned(link.R) for x in _own_wrench(seen, alpha, acc, link))
    return force, moment + cross_number(t, force)


def _own_wrench(motion: StarMotion, alpha: Box, acc: Box, link: LinkBox) -> tuple[Box, Box]:
    """As published, [D] Alg. 4, lines 22-28, about the origin of the frame of the link's parameters."""
    low, high = (np.array([[ends[k]] for ends in link.com]) for k in range(2))
    com = Box(0.5 * (low + high), 0.5 * (high - low) if (low < high).any() else None)
    swing = cross_parameter(link.com, alpha)
    spin = cross_number(motion.omega, cross_number(motion.omega_a, com))
    force = scaled(link.mass, acc + Box(-swing.mid, swing.rad) + spin)
    momentum = matrix_parameter(link.inertia, Box(motion.omega))
    moment = cross_parameter(link.com, force) + matrix_parameter(link.inertia, alpha)
    return force, moment + cross_number(motion.omega_a, momentum)
