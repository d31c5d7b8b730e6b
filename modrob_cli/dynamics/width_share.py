"""Where the width of torque bounds comes from: what to measure better.

Each uncertain parameter alone runs through its interval while all others keep their nominal values; the width of the
torque range that this gives, averaged over samples, is the parameter's share. The widths of all parameters together
are not exactly the width of the bounds, because a mass and its centre of mass are multiplied; the order is what counts.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.body_terms import BodyTerms
from modrob_cli.dynamics.exact_bounds import uncertain_terms
from modrob_cli.dynamics.link_inertia import joined
from modrob_cli.dynamics.link_motion import base_motion, by_joint, joint_positions, link_motions, weightless
from modrob_cli.dynamics.newton_euler import backward
from modrob_cli.dynamics.quadratic_range import entry, quadratic_range
from modrob_cli.dynamics.uncertain_body import UncertainBody, is_exact, trace_minus
from modrob_cli.errors import ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.body import INERTIA_ENTRIES, PlacedBody, RigidBody
from modrob_cli.model.joint import Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

NOISE = 1e-12
"""Shares up to this are rounding noise (a lever of 1e-17 m instead of 0) and left out."""

Widths = dict[str, float]


@dataclass(frozen=True)
class WidthShare:
    """One parameter's part in the width of a joint's torque range.

    Attributes
    ----------
    parameter : in words, e.g. ``payload com z``
    width : mean over the samples, the others at their nominal values, [N m] or [N]
    share : the width divided by the sum of those of all parameters
    """

    parameter: str
    width: float
    share: float


def ranked(widths: Widths) -> list[WidthShare]:
    """Shares of one joint, largest first; those that are only noise left out."""
    total = sum(widths.values())
    shares = [WidthShare(name, width, width / total) for name, width in widths.items() if width > NOISE * total]
    return sorted(shares, key=lambda share: -share.width)


def parameter_widths(robot: Robot, q: Array, dq: Array, ddq: Array) -> list[Widths]:
    """Mean width that each uncertain parameter gives each joint's torque; one mapping from its name per joint.

    Parameters
    ----------
    q, dq, ddq : a few thousand samples, shape (T, n), [rad] or [m] and derivatives

    Raises
    ------
    ShapeError
        If a shape does not fit the robot, or there are no samples.
    """
    if not len(q):
        raise ShapeError("expected at least one sample")
    q, dq, ddq = by_joint(robot, q, dq, ddq)
    widths = [dict(_drive_widths(robot, i, dq[i], ddq[i])) for i in range(robot.dof)]
    placed = [(label, item) for label, item in _labelled(robot) if item.link > 0 and not is_exact(item.body)]
    bodies = [UncertainBody.of(item) for _, item in placed]
    known = {id(prepared): (label, item.body) for prepared, (label, item) in zip(bodies, placed, strict=True)}
    positions = joint_positions(robot, q)
    motions = link_motions(positions, dq, ddq, base_motion(robot, q.shape[1]))
    for joint, prepared, terms in uncertain_terms(bodies, positions, [(1.0, motions)]):
        label, body = known[id(prepared)]
        for quantity, width in _body_widths(body, terms):
            widths[joint][f"{label} {quantity}"] = float(width.mean())
    return widths


def acceleration_widths(robot: Robot, q: Array, tolerance: Array) -> list[Widths]:
    """Mean width by the tolerance of each joint's acceleration alone, 2 |M_jk| tolerance_k at nominal parameters.

    Parameters
    ----------
    q : shape (T, n);  tolerance : half-widths of ddq, shape (n,)
    """
    (q,) = by_joint(robot, q)
    positions, still = joint_positions(robot, q), np.zeros_like(q)
    links = [joined(list(robot.bodies_of(i + 1))) for i in range(robot.dof)]
    widths: list[Widths] = [{} for _ in robot.joints]
    for k in np.flatnonzero(tolerance):
        unit = still.copy()
        unit[k] = 1.0
        column = backward(positions, link_motions(positions, still, unit, weightless(q.shape[1])), links)
        drive = robot.joints[k].drive
        column[k] += drive.gear_ratio**2 * drive.rotor_inertia.nominal
        for j, width in enumerate(2.0 * np.abs(column).mean(axis=1) * tolerance[k]):
            widths[j][f"{robot.joints[k].name} acceleration tolerance"] = float(width)
    return widths


def without_width(robot: Robot) -> Robot:
    """The robot with every parameter at its nominal value, without bands and disturbance."""

    def exact(value: Uncertain) -> Uncertain:
        return Uncertain.exact(value.nominal)

    def point(body: RigidBody) -> RigidBody:
        return replace(body, mass=exact(body.mass), com=exact(body.com), inertia=exact(body.inertia))

    joints = tuple(
        replace(
            joint,
            friction=Friction(exact(joint.friction.viscous), exact(joint.friction.coulomb)),
            drive=replace(joint.drive, rotor_inertia=exact(joint.drive.rotor_inertia)),
        )
        for joint in robot.joints
    )
    bodies = tuple(replace(placed, body=point(placed.body)) for placed in robot.bodies)
    return replace(robot, joints=joints, bodies=bodies, disturbance=Interval(np.zeros(robot.dof)))


def _labelled(robot: Robot) -> Iterator[tuple[str, PlacedBody]]:
    """Every body with a name of its own: where several share one, with its number in the list of bodies."""
    count = Counter(placed.body.name for placed in robot.bodies)
    for k, placed in enumerate(robot.bodies, start=1):
        name = placed.body.name
        yield (name if count[name] == 1 else f"{name} (body {k})"), placed


def _body_widths(body: RigidBody, terms: BodyTerms) -> Iterator[tuple[str, Array]]:
    """Widths (T,) that each parameter of a body gives one joint, see :mod:`modrob_cli.dynamics.body_terms`."""
    mass, com = float(body.mass.nominal), body.com.nominal
    Q = trace_minus(terms.B) if body.inertia_about == "com" else np.zeros_like(terms.B)
    slope = np.stack([sum(entry(Q, k, m) * com[m] for m in range(3)) for k in range(3)])
    if not body.mass.is_exact:
        yield "mass", body.mass.interval.wid * np.abs(terms.y0 + com @ terms.y + com @ slope)
    for k in map(int, np.flatnonzero(body.com.interval.wid)):
        # About the middle of the interval: f(mid + x) - f(mid) = (y + 2 Q c) x + Q_kk x^2, with c at the middle.
        middle, reach = body.com.interval.mid, np.zeros(3)
        reach[k] = body.com.interval.rad[k]
        b = np.zeros_like(terms.y)
        b[k] = terms.y[k] + 2.0 * (slope[k] + entry(Q, k, k) * (middle[k] - com[k]))
        low, high = quadratic_range(b, Q, reach)
        yield f"com {'xyz'[k]}", mass * (high - low)
    for k in map(int, np.flatnonzero(body.inertia.interval.wid)):
        name = INERTIA_ENTRIES[k]
        times = 1.0 if name[0] == name[1] else 2.0  # an entry off the diagonal stands for two
        yield f"inertia {name}", body.inertia.interval.wid[k] * times * np.abs(terms.B[k])


def _drive_widths(robot: Robot, i: int, dq: Array, ddq: Array) -> Iterator[tuple[str, float]]:
    """Mean widths by friction, rotor and disturbance of joint i; states of shape (T,)."""
    joint = robot.joints[i]
    friction, drive = joint.friction, joint.drive
    standing = np.abs(dq) <= friction.velocity_band
    parts = (
        ("viscous friction", friction.viscous.interval.wid * np.abs(dq)),
        ("Coulomb friction", friction.coulomb.interval.wid * (dq != 0.0)),
        ("friction sign near standstill", 2.0 * friction.coulomb.nominal * standing),
        ("friction band", np.full_like(dq, 2.0 * friction.coulomb_band)),
        ("rotor inertia", drive.gear_ratio**2 * drive.rotor_inertia.interval.wid * np.abs(ddq)),
        ("disturbance", np.full_like(dq, robot.disturbance.wid[i])),
    )
    yield from ((f"{joint.name} {name}", float(width.mean())) for name, width in parts if width.any())
