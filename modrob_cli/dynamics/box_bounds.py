r"""Torque bounds over boxes of joint positions, velocities and accelerations: sensor noise, a time cell, a workspace.

Result: bounds of the torque for all states of the box and all admissible parameters (see docs/box-bounds.md). The
rigid bodies' part is the least of three bounds, per sample and joint (upper bound; the lower one mirrors it):

1. **Mean value.** Parameters that the torque is monotone in are fixed at their worse ends (``box_parameters``), and
   so are the joint variables whose derivative, over the box and these parameters, has one sign. With x* these ends,
   and the box's midpoint in the other variables, the mean-value theorem along the segment from x*, for each parameter
   vector, gives: exact upper bound at x*, plus the sum of max |derivative| times half-width over the other variables.
2. **Natural extension**: the torque evaluated with balls.
3. **A priori**: the bound S of absolute values from :mod:`modrob_cli.dynamics.margin`; it does not depend on angles.

Friction, rotor and disturbance are added exactly: each is monotone in dq or ddq, so its range over the box is
between its ranges at the box's ends.

Rounding: the ends of the box are doubles that enclose midpoint -+ radius; exact_bounds covers its own rounding, balls
theirs (:mod:`modrob_cli.dynamics.ball`); the few operations here are covered by ``EPS`` times absolute values.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import EPS, GROW, TINY, Ball
from modrob_cli.dynamics.box_derivatives import BoxTorques, box_torques
from modrob_cli.dynamics.box_motion import StateBox
from modrob_cli.dynamics.box_parameters import SIDES
from modrob_cli.dynamics.drive_torque import drive_boxes, drive_nominal
from modrob_cli.dynamics.exact_bounds import TorqueBounds, exact_bounds
from modrob_cli.dynamics.link_motion import by_joint
from modrob_cli.dynamics.margin import torque_magnitude
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot

CHUNK = 1024
"""Samples worked on at once; the derivatives need 36 n times as much memory as the states."""


@dataclass(frozen=True)
class Box:
    """Ends of the boxes of q, dq, ddq, stacked: shape (3, n, T) each."""

    lower: Array
    upper: Array

    @classmethod
    def of(cls, middle: Array, radius: Array) -> "Box":
        """Doubles that enclose middle -+ radius, of shape (3, n, T)."""
        box = Interval(middle) + Interval(-radius, radius)
        return cls(box.inf, box.sup)

    @property
    def balls(self) -> Ball:
        """The same as balls."""
        return Ball.between(self.lower, self.upper)


def box_bounds(
    robot: Robot, q: Array, dq: Array, ddq: Array, q_rad: Array, dq_rad: Array, ddq_rad: Array
) -> TorqueBounds:
    """Bounds of the torques over boxes of states and all admissible parameters.

    Parameters
    ----------
    q, dq, ddq : midpoints of the boxes, shape (T, n), [rad] or [m] and derivatives
    q_rad, dq_rad, ddq_rad : half-widths >= 0, shape (n,) or (T, n), in the same units

    Returns
    -------
    TorqueBounds
        Outward, for the box as the given doubles describe it. Nominal torque: at the midpoint, as in ``exact_bounds``.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If a half-width is negative or not finite, or a result is not finite.
    """
    parts = box_bounds_by_chunk(robot, q, dq, ddq, q_rad, dq_rad, ddq_rad)
    return TorqueBounds.joined([TorqueBounds.empty(robot.dof), *parts])


def box_bounds_by_chunk(
    robot: Robot, q: Array, dq: Array, ddq: Array, q_rad: Array, dq_rad: Array, ddq_rad: Array
) -> Iterator[TorqueBounds]:
    """As :func:`box_bounds`, in pieces of at most ``CHUNK`` samples."""
    by_joint(robot, q, dq, ddq)
    radii = [_radius(np.asarray(rad, dtype=float), q.shape) for rad in (q_rad, dq_rad, ddq_rad)]
    bare = _without_drives(robot)
    for start in range(0, len(q), CHUNK):
        piece = slice(start, start + CHUNK)
        middle = np.stack(by_joint(robot, q[piece], dq[piece], ddq[piece]))
        yield _chunk(robot, bare, middle, np.stack(by_joint(robot, *(rad[piece] for rad in radii))))


def _radius(rad: Array, shape: tuple[int, ...]) -> Array:
    if rad.shape not in (shape, shape[1:]):
        raise ShapeError(f"half-widths of shape {rad.shape}, expected {shape[1:]} or {shape}")
    if not np.all((rad >= 0.0) & np.isfinite(rad)):
        raise NumericalError("half-widths of a box of states must be finite and not negative")
    return np.broadcast_to(rad, shape)


def _without_drives(robot: Robot) -> Robot:
    """The rigid bodies alone."""
    joints = tuple(replace(joint, friction=Friction(), drive=Drive()) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))


def _chunk(robot: Robot, bare: Robot, middle: Array, radius: Array) -> TorqueBounds:
    """Bounds of one chunk, for midpoints and half-widths of shape (3, n, T)."""
    box = Box.of(middle, radius)
    nominal = exact_bounds(bare, *(state.T for state in middle)).nominal.T.copy()
    lower, upper = _rigid_range(bare, box)
    for i, drive in enumerate(drive_boxes(robot)):
        down, up = ((ends[1, i], ends[2, i]) for ends in (box.lower, box.upper))
        low, high = drive.torque_range(*down)[0], drive.torque_range(*up)[1]
        size = np.maximum(drive.magnitude(*down), drive.magnitude(*up))
        lower[i] = (lower[i] + low) - EPS * (np.abs(lower[i]) + size) - TINY
        upper[i] = (upper[i] + high) + EPS * (np.abs(upper[i]) + size) + TINY
        nominal[i] += drive_nominal(robot.joints[i], middle[1, i], middle[2, i], robot.disturbance[i])
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise NumericalError("a torque bound is not finite; check the motion, its box and the model for absurd values")
    return TorqueBounds(*(np.ascontiguousarray(part.T) for part in (nominal, lower, upper)))


def _rigid_range(bare: Robot, box: Box) -> tuple[Array, Array]:
    """Bounds (n, T) of the torque of the rigid bodies: the least of the three."""
    balls = box.balls
    found = box_torques(bare, StateBox(balls[0], balls[1], balls[2]))
    lower, upper = _mean_value(bare, box, found)
    natural, size = found.torque.c, found.torque.reach + EPS * found.torque.mag
    largest = torque_magnitude(bare, *np.maximum(np.abs(box.lower), np.abs(box.upper))) * GROW + TINY
    lower = np.maximum.reduce([lower, natural[:, 0] - size[:, 0], -largest])
    upper = np.minimum.reduce([upper, natural[:, 1] + size[:, 1], largest])
    return lower, upper


def _mean_value(bare: Robot, box: Box, found: BoxTorques) -> tuple[Array, Array]:
    """Mean-value bounds (n, T)."""
    n, count = box.lower.shape[1:]
    middle, reach = box.balls.c, box.balls.reach
    at = np.tile(middle[:, :, None, None], (1, 1, n, 2, 1))  # state, its joint; torque's joint, side, sample
    excess = np.zeros((n, 2, count))
    for k, (i, kind) in enumerate(found.directions):
        slope = found.slopes[:, :, k]
        toward = slope.sign * SIDES[:, None]
        at[kind, i] = np.where(toward > 0.0, box.upper[kind, i], at[kind, i])
        at[kind, i] = np.where(toward < 0.0, box.lower[kind, i], at[kind, i])
        excess += np.where(toward == 0.0, slope.mag * reach[kind, i], 0.0)
    ends = exact_bounds(bare, *(state.reshape(n, -1).T for state in at))
    own = np.arange(n)
    lower, upper = (end.T.reshape(n, n, 2, count)[own, own] for end in (ends.lower, ends.upper))
    size = EPS * (np.maximum(np.abs(lower), np.abs(upper)) + excess)
    return (lower - excess - size)[:, 0], (upper + excess + size)[:, 1]
