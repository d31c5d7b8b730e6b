"""The true robot of a simulation: one member of the box of admissible parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import UsageError
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.joint import Friction, Joint
from modrob_cli.model.realizable import TOLERANCE, inertia_about_com, second_moments
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Draw, Truth
from modrob_cli.model.uncertain import Uncertain

BODY_KEYS = ("mass", "com", "inertia")
JOINT_KEYS = ("viscous", "coulomb", "rotor_inertia", "friction_offset", "disturbance")

_TRIES = 100
"""Draws of a body before its box is taken to hold too few real bodies; then its nominal values stay."""


@dataclass(frozen=True)
class TrueRobot:
    """A robot whose parameters are numbers.

    Attributes
    ----------
    robot : the member: nominal values are the true ones, intervals have no width
    breakaway : friction that holds joints at rest, shape (n,), [N m] or [N]
    offset : constant torque of the friction band and of the disturbance, counted like friction, shape (n,)
    nominal_bodies : names of bodies that kept their nominal values, because draws from their boxes are no real bodies
    """

    robot: Robot
    breakaway: Array
    offset: Array
    nominal_bodies: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for key in ("breakaway", "offset"):
            object.__setattr__(self, key, frozen(getattr(self, key), (self.robot.dof,)))


def true_robot(robot: Robot, truth: Truth, rng: np.random.Generator, payload: RigidBody | None = None) -> TrueRobot:
    """Choose the true parameters.

    Numbers are also drawn for what is set by hand, so that setting one value does not change the others.

    Parameters
    ----------
    payload : body at the end effector that is added to those of the robot; its nominal values count

    Raises
    ------
    UsageError
        If a name is unknown, a value that was set lies outside its interval, or makes a body that cannot be real.
    """
    _check_names("body", truth.bodies, [placed.body.name for placed in robot.bodies], BODY_KEYS)
    _check_names("joint", truth.joints, list(robot.joint_names), JOINT_KEYS)
    bodies, kept = [], []
    for placed in robot.bodies:
        body, real = _draw_body(placed.body, truth, rng)
        bodies.append(replace(placed, body=body))
        kept += [] if real else [placed.body.name]
    if payload is not None:
        bodies.append(PlacedBody(robot.dof, robot.tool_transform, _exact_body(payload)))
    disturbances = [_around_zero(robot.disturbance[i]) for i in range(robot.dof)]
    drawn = [_draw_joint(*pair, truth, rng) for pair in zip(robot.joints, disturbances, strict=True)]
    joints = tuple(joint for joint, _ in drawn)
    member = replace(robot, joints=joints, bodies=tuple(bodies), disturbance=Interval(np.zeros(robot.dof)))
    breakaway = truth.breakaway * np.array([float(joint.friction.coulomb.nominal) for joint in joints])
    return TrueRobot(member, breakaway, np.array([offset for _, offset in drawn]), tuple(kept))


def _check_names(
    what: str, given: Mapping[str, Mapping[str, object]], known: Sequence[str], keys: tuple[str, ...]
) -> None:
    for name, values in given.items():
        if name not in known:
            raise UsageError(f"truth: found the {what} {name!r}, the robot has {', '.join(known)}")
        wrong = [key for key in values if key not in keys]
        if wrong:
            raise UsageError(f"truth: {what} {name}: found {', '.join(wrong)}, expected {', '.join(keys)}")


def _around_zero(interval: Interval) -> Uncertain:
    """An interval with 0 as its nominal value, or the end nearest to it."""
    return Uncertain(np.clip(0.0, interval.inf, interval.sup), interval)


def _draw_body(body: RigidBody, truth: Truth, rng: np.random.Generator) -> tuple[RigidBody, bool]:
    """A member of the body's box; False if only its nominal values were found to be those of a real body."""
    parts = {key: getattr(body, key) for key in BODY_KEYS}
    given = truth.bodies.get(body.name, {})
    values = {key: _draw(part, truth.draw, rng) for key, part in parts.items()}
    uncertain = truth.draw != "nominal" and not all(part.is_exact for part in parts.values())
    real, tries = True, 0
    while uncertain and not (real := _is_real(_with_values(body, values))) and tries < _TRIES:
        values = {key: _draw(part, truth.draw, rng) for key, part in parts.items()}
        tries += 1
    if not real:
        values = {key: part.nominal for key, part in parts.items()}
    values |= {key: _chosen(f"body {body.name}: {key}", given[key], parts[key]) for key in given}
    chosen = _with_values(body, values)
    if given and not _is_real(chosen):
        what = "mass, com and inertia together are not those of a real body"
        raise UsageError(f"truth: body {body.name}: {what}; expected other values, or values for all three")
    return chosen, real


def _with_values(body: RigidBody, values: Mapping[str, Array]) -> RigidBody:
    mass, com, inertia = (Uncertain.exact(values[key]) for key in BODY_KEYS)
    return replace(body, mass=mass, com=com, inertia=inertia)


def _exact_body(body: RigidBody) -> RigidBody:
    return _with_values(body, {key: getattr(body, key).nominal for key in BODY_KEYS})


def _is_real(body: RigidBody) -> bool:
    """Whether the nominal values are those of a distribution of mass."""
    inertia = inertia_about_com(body)
    return bool(np.linalg.eigvalsh(second_moments(inertia))[0] >= -TOLERANCE * np.abs(inertia).max())


def _draw_joint(joint: Joint, disturbance: Uncertain, truth: Truth, rng: np.random.Generator) -> tuple[Joint, float]:
    """A joint with true parameters, and the constant torque of its friction band and disturbance."""
    band = joint.friction.coulomb_band
    parts = {
        "viscous": joint.friction.viscous,
        "coulomb": joint.friction.coulomb,
        "rotor_inertia": joint.drive.rotor_inertia,
        "friction_offset": Uncertain(np.zeros(()), Interval(-band, band)),
        "disturbance": disturbance,
    }
    values = {key: _draw(part, truth.draw, rng) for key, part in parts.items()}
    given = truth.joints.get(joint.name, {})
    values |= {key: _chosen(f"joint {joint.name}: {key}", given[key], parts[key]) for key in given}
    exact = {key: Uncertain.exact(value) for key, value in values.items()}
    friction = Friction(exact["viscous"], exact["coulomb"])
    drive = replace(joint.drive, rotor_inertia=exact["rotor_inertia"])
    return replace(joint, friction=friction, drive=drive), float(values["friction_offset"] + values["disturbance"])


def _draw(part: Uncertain, draw: Draw, rng: np.random.Generator) -> Array:
    if draw == "nominal":
        return part.nominal
    share = rng.random(part.nominal.shape)
    if draw == "vertices":
        share = np.round(share)
    low, high = part.interval.inf, part.interval.sup
    return np.clip((1.0 - share) * low + share * high, low, high)  # the ends exactly where the share is 0 or 1


def _chosen(what: str, value: ArrayLike, part: Uncertain) -> Array:
    """A value that the scenario sets, if it is admissible."""
    out = np.asarray(value, dtype=float)
    if out.shape != part.nominal.shape:
        raise UsageError(f"truth: {what}: found {out.size} values, expected {part.nominal.size}")
    if not np.all(part.interval.contains(out)):
        low, high = part.interval.inf.tolist(), part.interval.sup.tolist()
        raise UsageError(f"truth: {what}: found {out.tolist()}, the robot's file admits {low} to {high}")
    return out
