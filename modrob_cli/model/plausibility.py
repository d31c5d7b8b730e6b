"""Data that fit their schema but hardly any real robot: remarks for the people who wrote them.

Every limit below is a matter of judgement, chosen so that arms from finger size to the largest industrial robots
pass; what they catch are slips of units (mm, g mm^2, degrees), of frames, and of sides of the gear.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import Drive, Friction, JointType, Limits
from modrob_cli.model.module import Assembly, Module
from modrob_cli.model.realizable import inertia_about_com, realizability, second_moments
from modrob_cli.model.robot import Robot

Where = tuple[str | int, ...]
Level = Literal["impossible", "doubtful"]

MAX_MASS = 2000.0
"""Heaviest part [kg]."""
MAX_GYRATION = 2.0
"""Largest radius of gyration [m]."""
MAX_COM = 3.0
"""Largest distance of a part's centre of mass from its frame [m]."""
MAX_PAYLOAD_COM = 1.0
"""Largest distance of the payload's centre of mass from the flange [m]."""
MAX_LENGTH = 5.0
"""Largest distance between two frames of one part [m]."""
MAX_DENSITY = 22_600.0
"""Density of osmium, the densest material [kg/m^3]."""
MAX_GRAVITY = 30.0
"""Largest gravity [m/s^2]."""
MAX_REFLECTED_INERTIA = 500.0
"""Largest rotor inertia seen from the link [kg m^2]."""
HUGE = 1e9
"""Any mass, length or inertia from here on is no part of an arm in SI units."""
LARGEST_LIMITS = {
    "revolute": {"position": 100.0, "velocity": 100.0, "torque": 1e5},
    "prismatic": {"position": 20.0, "velocity": 50.0, "torque": 1e6},
}
"""Largest limits in rad, rad/s, N m or m, m/s, N."""
_UNITS = {
    "revolute": {"position": "rad", "velocity": "rad/s", "torque": "N m"},
    "prismatic": {"position": "m", "velocity": "m/s", "torque": "N"},
}


@dataclass(frozen=True)
class Remark:
    """Something implausible.

    Attributes
    ----------
    where : place in the document that the model mirrors
    message : what was found, what was expected, what to do
    level : "impossible" if no member of the box can be real, else "doubtful"
    """

    where: Where
    message: str
    level: Level = "doubtful"


def module_remarks(module: Module) -> Iterator[Remark]:
    """Remarks on a module: its body or bodies, joints, lengths."""
    for k, unit in enumerate(module.units):
        here: Where = ("units", k)
        yield from body_remarks(unit.proximal.body, (*here, "proximal", "body"))
        yield from _length_remarks(unit.proximal.transform, (*here, "proximal"))
        yield from drive_remarks(unit.joint.type, unit.joint.friction, unit.joint.drive, (*here, "joint"))
        yield from limit_remarks(unit.joint.type, unit.joint.limits, (*here, "joint", "limits"))
        yield from balance_remarks(unit.joint.friction, unit.joint.drive, unit.joint.limits, (*here, "joint", "limits"))
        yield from body_remarks(unit.distal.body, (*here, "distal", "body"))
        yield from _length_remarks(unit.distal.transform, (*here, "distal"))
    for name, part in module.outputs.items():
        yield from _length_remarks(part.transform, ("connections", name))
    for part in list(module.outputs.values())[:1]:
        yield from body_remarks(part.body, ("body",))


def robot_remarks(robot: Robot, has_payload: bool) -> Iterator[Remark]:
    """Remarks on a robot that was written as ``robot/1``; ``has_payload``: its last body is the payload."""
    yield from _gravity_remarks(robot.gravity)
    for k, joint in enumerate(robot.joints):
        here: Where = ("joints", k)
        yield from _length_remarks(joint.placement, here)
        yield from drive_remarks(joint.type, joint.friction, joint.drive, here)
        yield from limit_remarks(joint.type, joint.limits, (*here, "limits"))
        yield from balance_remarks(joint.friction, joint.drive, joint.limits, (*here, "limits"))
    bodies = [placed.body for placed in robot.bodies]
    for k, body in enumerate(bodies[:-1] if has_payload else bodies):
        yield from body_remarks(body, ("bodies", k))
    if has_payload:
        yield from payload_remarks(bodies[-1])
    yield from _length_remarks(robot.tool_transform, ("tool_transform",))


def assembly_remarks(assembly: Assembly, robot: Robot) -> Iterator[Remark]:
    """Remarks on what an assembly adds to its modules; ``robot`` is the arm made from it."""
    yield from _gravity_remarks(assembly.gravity)
    yield from _length_remarks(assembly.base_pose, ("base_pose",))
    if assembly.payload is not None:
        yield from payload_remarks(assembly.payload)
    joints = {joint.name: joint for joint in robot.joints}
    for override in assembly.limit_overrides:
        joint, here = joints[override.joint], ("limits", override.joint)
        yield from limit_remarks(joint.type, override.limits, here)
        if override.limits.torque or override.limits.current:
            yield from balance_remarks(joint.friction, joint.drive, joint.limits, here)


def payload_remarks(payload: RigidBody) -> Iterator[Remark]:
    """Remarks on a body at the end effector."""
    yield from body_remarks(payload, ("payload",))
    farthest = _length(payload.com.interval.mag)
    if MAX_PAYLOAD_COM < farthest <= MAX_COM:
        message = (
            f"the centre of mass is up to {farthest:.4g} m from the flange, expected at most {MAX_PAYLOAD_COM:g} m; "
            "check that the unit is m and the frame is the end effector's"
        )
        yield Remark(("payload", "com"), message)


def body_remarks(body: RigidBody, where: Where) -> Iterator[Remark]:
    """Remarks on mass, centre of mass and inertia tensor of a body."""
    mass, farthest = float(body.mass.nominal), _length(body.com.interval.mag)
    if mass == 0.0:
        has_rest = np.any(body.inertia.interval.mag) or np.any(body.com.interval.mag)
        if body.mass.interval.sup == 0.0 and has_rest:
            message = "found mass 0 with a centre of mass or an inertia other than 0, expected a mass > 0; add the mass"
            yield Remark((*where, "mass"), message, "impossible")
        return
    if max(body.mass.interval.sup, body.com.interval.mag.max(), body.inertia.interval.mag.max()) > HUGE:
        yield Remark(where, f"found a value above {HUGE:g}, expected SI units; the tensor was not checked")
        return
    if mass > MAX_MASS:
        message = f"found {mass:.4g} kg, expected at most {MAX_MASS:g} kg; check that the unit is kg"
        yield Remark((*where, "mass"), message)
    if farthest > MAX_COM:
        message = (
            f"the centre of mass is up to {farthest:.4g} m from the origin of its frame, "
            f"expected at most {MAX_COM:g} m; check that the unit is m"
        )
        yield Remark((*where, "com"), message)
    yield from _inertia_remarks(body, mass, (*where, "inertia"))


def _inertia_remarks(body: RigidBody, mass: float, where: Where) -> Iterator[Remark]:
    verdict = realizability(body)
    if not verdict.nominal:
        level: Level = "doubtful" if verdict.some else "impossible"
        scope = "this nominal tensor (some of its box are possible)" if verdict.some else "this tensor"
        if not verdict.some and not _is_exact(body):
            scope += ", nor any of its box"
        yield Remark(where, f"no real body has {scope}: {_broken_rule(verdict.moments)}; {_advice(body)}", level)
    elif not verdict.every:
        problem = _broken_rule(verdict.worst)
        message = (
            f"no real body has some of the tensors of this box (the nominal one is possible): at the worst corner "
            f"{problem}; narrow the box, or accept bounds that are wider than they need to be"
        )
        yield Remark(where, message)
    if verdict.nominal:
        yield from _size_remarks(body, mass, verdict.moments, where)


def _is_exact(body: RigidBody) -> bool:
    """True if neither the tensor nor what shifts it to the centre of mass has any width."""
    shift_exact = body.inertia_about == "com" or (body.mass.is_exact and body.com.is_exact)
    return body.inertia.is_exact and shift_exact


def _broken_rule(moments: Array) -> str:
    """Say which condition the principal moments (ascending, about the centre of mass) break."""
    shown = ", ".join(f"{value:.4g}" for value in moments)
    found = f"found the principal moments {shown} kg m^2 about the centre of mass"
    if moments[0] < 0.0:
        return f"{found}, expected none below 0"
    return f"{found}, expected the largest to be at most the sum of the other two"


def _advice(body: RigidBody) -> str:
    if body.inertia_about == "frame":
        return "check mass and com, and whether the tensor is about the centre of mass (inertia_about: com)"
    return "check the order of the entries and the signs of xy, xz, yz"


def _size_remarks(body: RigidBody, mass: float, moments: Array, where: Where) -> Iterator[Remark]:
    """Remarks on a tensor too large or too small for its mass.

    The density is that of the uniform ellipsoid with this mass and tensor; among all bodies with these second
    moments and a bounded density, it is the one that fills the largest volume, so none can be less dense throughout.
    """
    gyration = float(np.sqrt(max(moments[2], 0.0) / mass))
    if gyration > MAX_GYRATION:
        message = (
            f"found a radius of gyration of {gyration:.4g} m at {mass:.4g} kg, expected at most {MAX_GYRATION:g} m; "
            "check that the unit is kg m^2 (1 kg mm^2 = 1e-6, 1 g mm^2 = 1e-9)"
        )
        yield Remark(where, message)
    spread = np.linalg.eigvalsh(second_moments(inertia_about_com(body))) / mass
    if spread[0] <= 1e-6 * spread[2]:
        return  # point masses, rods and plates have no volume
    volume = 4.0 / 3.0 * np.pi * np.sqrt(np.prod(5.0 * spread))
    if mass / volume > MAX_DENSITY:
        message = (
            f"found {mass:.4g} kg with a tensor that fits into {volume * 1e6:.4g} cm^3 ({mass / volume:.3g} kg/m^3), "
            f"expected at most {MAX_DENSITY:g} kg/m^3; check that the tensor's unit is kg m^2 and the mass is in kg"
        )
        yield Remark(where, message)


def drive_remarks(kind: JointType, friction: Friction, drive: Drive, where: Where) -> Iterator[Remark]:
    """Remarks on motor and gear."""
    rotor = float(drive.rotor_inertia.interval.sup)
    if drive.gear_ratio == 0.0:
        message = "found 0, expected motor turns per joint turn; leave the key out for a direct drive"
        yield Remark((*where, "gear_ratio"), message, "impossible")
    reflected = rotor * drive.gear_ratio * drive.gear_ratio
    if kind == "revolute" and reflected > MAX_REFLECTED_INERTIA:
        message = (
            f"found {rotor:.4g} kg m^2, which is {reflected:.4g} kg m^2 at the link (times gear_ratio squared), "
            f"expected at most {MAX_REFLECTED_INERTIA:g}; give the value at the motor, before the gear"
        )
        yield Remark((*where, "rotor_inertia"), message)


def limit_remarks(kind: JointType, limits: Limits, where: Where) -> Iterator[Remark]:
    """Remarks on ranges: too large for their unit, without room, or without the state of rest."""
    for name, found in vars(limits).items():
        if found is None:
            continue
        low, high = found
        largest = LARGEST_LIMITS[kind].get(name, np.inf)
        if max(abs(low), abs(high)) > largest:
            unit = _UNITS[kind][name]
            hint = "; write degrees as '170 deg'" if kind == "revolute" and name != "torque" else "; check the unit"
            message = f"found [{low:.6g}, {high:.6g}], expected at most {largest:g} {unit}{hint}"
            yield Remark((*where, name), message)
        if low == high:
            yield Remark((*where, name), f"found an empty range [{low:.6g}, {high:.6g}], expected lower < upper")
        elif name != "position" and not low <= 0.0 <= high:
            message = (
                f"found [{low:.6g}, {high:.6g}], expected a range that contains 0, or the joint cannot stand still"
            )
            yield Remark((*where, name), message)


def balance_remarks(friction: Friction, drive: Drive, limits: Limits, where: Where) -> Iterator[Remark]:
    """Remarks on a torque limit against what the motor can give and what friction takes."""
    if limits.torque is None:
        return
    torque = max(abs(limits.torque[0]), abs(limits.torque[1]))
    brake = float(friction.coulomb.interval.inf)
    if torque < brake:
        message = (
            f"found at most {torque:.6g}, expected more than the Coulomb friction of {brake:.6g}; check both sides"
        )
        yield Remark((*where, "torque"), message)
    if limits.current is None or drive.torque_constant is None:
        return
    current = max(abs(limits.current[0]), abs(limits.current[1]))
    available = abs(drive.gear_ratio) * drive.torque_constant * current
    if torque > 1.01 * available:
        message = (
            f"found up to {torque:.6g}, expected at most the {available:.6g} that the motor gives: torque_constant "
            f"{drive.torque_constant:g} x gear_ratio {drive.gear_ratio:g} x current {current:g}; check the motor side"
        )
        yield Remark((*where, "torque"), message)


def _length(vector: Array) -> float:
    """Euclidean norm of a vector (3,), without overflow on the way."""
    return math.hypot(*vector.tolist())


def _length_remarks(transform: Array, where: Where) -> Iterator[Remark]:
    length = _length(transform[:3, 3])
    if length > MAX_LENGTH:
        message = f"found a distance of {length:.4g} m between two frames, expected at most {MAX_LENGTH:g} m; use m"
        yield Remark(where, message)


def _gravity_remarks(gravity: Array) -> Iterator[Remark]:
    size = _length(gravity)
    if size > MAX_GRAVITY:
        message = f"found {size:.4g} m/s^2, expected at most {MAX_GRAVITY:g}; check that the unit is m/s^2"
        yield Remark(("gravity",), message)
