r"""The exact range of joint torques over all admissible parameters, for given motions.

For given q, dq, ddq the torque is a sum of contributions that depend on different parameters: one per body (see
:mod:`modrob_cli.dynamics.body_terms`), friction, rotor, disturbance. Each range is attained, the parameters vary
independently, so the sum of the ranges is the range: there is no over-approximation but the rounding margin. Bodies
are taken where they are given, in their modules' own frames with their own boxes, so nothing is lost in composing
links.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.body_terms import BodyTerms, Screw, body_terms, joint_screws
from modrob_cli.dynamics.drive_torque import DriveBox, drive_boxes, drive_nominal
from modrob_cli.dynamics.link_inertia import LinearParameters, joined
from modrob_cli.dynamics.link_motion import (
    JointPosition,
    Motion,
    base_motion,
    by_joint,
    joint_positions,
    link_motions,
)
from modrob_cli.dynamics.margin import most_bodies, rounding_margin, torque_magnitude
from modrob_cli.dynamics.newton_euler import backward, nominal_links
from modrob_cli.dynamics.uncertain_body import UncertainBody, is_exact, uncertain_bodies
from modrob_cli.errors import NumericalError
from modrob_cli.model.robot import Robot

CHUNK = 16_384
"""Samples worked on at once: enough that calls cost little, few enough that memory does not grow with the motion."""


@dataclass(frozen=True)
class TorqueBounds:
    """Nominal torque and bounds, shape (T, n) each, [N m] or [N]."""

    nominal: Array
    lower: Array
    upper: Array

    @classmethod
    def joined(cls, pieces: "list[TorqueBounds]") -> "TorqueBounds":
        """Pieces put one after the other; at least one."""
        names = ("nominal", "lower", "upper")
        return cls(*(np.concatenate([getattr(piece, name) for piece in pieces]) for name in names))

    @classmethod
    def empty(cls, dof: int) -> "TorqueBounds":
        """Bounds of no samples."""
        return cls(*(np.empty((0, dof)) for _ in range(3)))


def exact_bounds(robot: Robot, q: Array, dq: Array, ddq: Array) -> TorqueBounds:
    """Range of the torques over all admissible parameters at each sample.

    Parameters
    ----------
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives

    Returns
    -------
    TorqueBounds
        Outward: lower and upper enclose the exact real range for the given doubles. The nominal torque is rounded to
        nearest, its friction counts sgn(0) = 0.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If a result is not finite.
    """
    by_joint(robot, q, dq, ddq)
    return TorqueBounds.joined([TorqueBounds.empty(robot.dof), *bounds_by_chunk(robot, q, dq, ddq)])


def bounds_by_chunk(robot: Robot, q: Array, dq: Array, ddq: Array) -> Iterator[TorqueBounds]:
    """As :func:`exact_bounds`, in pieces of at most ``CHUNK`` samples."""
    prepared = Prepared.of(robot)
    for start in range(0, len(q), CHUNK):
        piece = slice(start, start + CHUNK)
        with np.errstate(over="ignore", invalid="ignore"):  # not finite in the end is an error of its own
            bounds = _chunk(prepared, *by_joint(robot, q[piece], dq[piece], ddq[piece]))
        yield bounds


@dataclass(frozen=True)
class Prepared:
    """What does not depend on the motion.

    Attributes
    ----------
    nominal : all bodies of each link at their nominal values;  known : those without any width
    """

    robot: Robot
    nominal: list[LinearParameters]
    known: list[LinearParameters]
    uncertain: list[UncertainBody]
    drives: list[DriveBox]

    @classmethod
    def of(cls, robot: Robot) -> "Prepared":
        """Prepare a robot.

        Raises
        ------
        NumericalError
            If it has more bodies than the proof of the rounding margin covers.
        """
        if len(robot.bodies) > most_bodies(robot.dof):
            message = f"bounds are proven for up to {most_bodies(robot.dof)} bodies on {robot.dof} joints"
            raise NumericalError(f"{robot.name} has {len(robot.bodies)} bodies; {message}; join some of them")
        moving = [robot.bodies_of(i + 1) for i in range(robot.dof)]
        known = [joined(placed for placed in bodies if is_exact(placed.body)) for bodies in moving]
        return cls(robot, nominal_links(robot), known, uncertain_bodies(robot), drive_boxes(robot))


def _chunk(prepared: Prepared, q: Array, dq: Array, ddq: Array) -> TorqueBounds:
    """Bounds of one chunk; states of shape (n, T)."""
    robot = prepared.robot
    positions = joint_positions(robot, q)
    motion = (1.0, link_motions(positions, dq, ddq, base_motion(robot, q.shape[1])))
    ranges = rigid_ranges(prepared, positions, [motion])
    return with_drives(prepared, ranges, q, dq, ddq, torque_magnitude(robot, q, dq, ddq))


Ranges = tuple[Array, Array, Array]
SignedMotions = list[tuple[float, list[Motion]]]


def rigid_ranges(prepared: Prepared, positions: list[JointPosition], parts: SignedMotions) -> Ranges:
    """Nominal, smallest and largest torque (n, T) of the rigid bodies for a signed sum of motions; round to nearest.

    Torque is linear in the coefficients that each motion gives, so a sum of motions is as exact as a single one.
    """
    shape = (prepared.robot.dof, parts[0][1][0].omega.shape[1])
    nominal, lower = np.zeros(shape), np.zeros(shape)
    for sign, motions in parts:
        nominal += sign * backward(positions, motions, prepared.nominal)
        lower += sign * backward(positions, motions, prepared.known)
    upper = lower.copy()
    for joint, body, terms in uncertain_terms(prepared.uncertain, positions, parts):
        ends = body.torque_range(terms)
        lower[joint] += ends[0]
        upper[joint] += ends[1]
    return nominal, lower, upper


def with_drives(prepared: Prepared, ranges: Ranges, q: Array, dq: Array, ddq: Array, magnitude: Array) -> TorqueBounds:
    """Add friction, rotor and disturbance, and move the ends outward by the rounding margin of the whole sum."""
    nominal, lower, upper = ranges
    size = magnitude.copy()
    for i, drive in enumerate(prepared.drives):
        ends = drive.torque_range(dq[i], ddq[i])
        lower[i] += ends[0]
        upper[i] += ends[1]
        nominal[i] += drive_nominal(prepared.robot.joints[i], dq[i], ddq[i], prepared.robot.disturbance[i])
        size[i] += drive.magnitude(dq[i], ddq[i])
    margin = rounding_margin(prepared.robot.dof, size)
    lower, upper = lower - margin, upper + margin
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise NumericalError("a torque bound is not finite; check the motion and the model for absurd values")
    return TorqueBounds(*(np.ascontiguousarray(part.T) for part in (nominal, lower, upper)))


def uncertain_terms(
    bodies: list[UncertainBody], positions: list[JointPosition], parts: SignedMotions
) -> Iterator[tuple[int, UncertainBody, BodyTerms]]:
    """For every uncertain body and every joint before it: joint index, body, coefficients in the body's frame."""
    last = max((body.link for body in bodies), default=-1)
    for i, screws in enumerate(joint_screws(positions[: last + 1])):
        for body in bodies:
            if body.link == i:
                moving = [(sign, motions[i].seen_from(body.R, body.t)) for sign, motions in parts]
                for joint, screw in enumerate(screws):
                    yield joint, body, _summed(moving, screw.seen_from(body.R, body.t))


def _summed(moving: list[tuple[float, Motion]], screw: Screw) -> BodyTerms:
    """Signed sum of the coefficients of several motions."""
    sign, motion = moving[0]
    terms = body_terms(motion, screw)
    total = terms if sign == 1.0 else terms.times(sign)
    for sign, motion in moving[1:]:
        total = total + body_terms(motion, screw).times(sign)
    return total
