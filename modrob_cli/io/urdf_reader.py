"""URDF in: a serial arm as :class:`Robot`. Pinocchio does the parsing, after the text has passed our own checks."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.interval import Interval
from modrob_cli.io.urdf_chain import serial_chain
from modrob_cli.io.urdf_writer import NO_LIMIT
from modrob_cli.io.urdf_xml import XmlJoint, numbers, scan
from modrob_cli.io.yaml_loader import read_text
from modrob_cli.model.body import PlacedBody, RigidBody, tensor_entries
from modrob_cli.model.joint import Friction, Joint, Limits, Range
from modrob_cli.model.robot import STANDARD_GRAVITY, Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema.base import JOINT_NAME
from modrob_cli.spatial import invert

MAX_BYTES = 16 * 2**20


def read_urdf(path: Path) -> Robot:
    """Read a serial arm: revolute, continuous and prismatic joints about any axis; fixed joints are merged.

    The z axis of each link frame is the joint's axis, so link frames are those of the URDF turned so that z comes to
    lie there (not turned at all if it does already). Bodies are exact: a URDF has no uncertainty. Gravity is
    :data:`STANDARD_GRAVITY`. The base frame is the root link's.

    Raises
    ------
    InputFileError
        If the file cannot be read, is not a URDF, or is not a serial arm of such joints.
    """
    text = read_text(path, MAX_BYTES)
    xml = scan(text, str(path))
    chain, tip = serial_chain(xml)
    _check_names(chain, str(path))
    model = _parse(text, str(path))
    turns = [np.eye(4), *(_turn_to_z(_axis(joint)) for joint in chain)]
    joints, bodies = [], []
    for index, item in enumerate(chain, start=1):
        placement = invert(turns[index - 1]) @ model.jointPlacements[index].homogeneous @ turns[index]
        joints.append(_joint(item, placement))
    for index in range(len(chain) + 1):
        body = _body(model.inertias[index], chain[index - 1].child if index else "base")
        if not body.is_massless:
            bodies.append(PlacedBody(index, invert(turns[index]), body))
    tool = invert(turns[-1]) @ model.frames[model.getBodyId(tip)].placement.homogeneous
    disturbance = Interval(np.zeros(len(chain)))
    return Robot(file_name(xml.name), tuple(joints), tuple(bodies), tool, np.asarray(STANDARD_GRAVITY), disturbance)


def file_name(name: str) -> str:
    """A robot's name as modrob's own documents and file names allow it: other characters become ``_``."""
    return re.sub(r"^[^A-Za-z0-9]+|[^A-Za-z0-9_+-]", "_", name).lstrip("_")[:64] or "robot"


def _check_names(chain: list[XmlJoint], file: str) -> None:
    """Joint names are kept as they are, because logs use them; so they have to be usable in tables and files."""
    message = "found a name that is not letters, digits, _ . # / + - and spaces (at most 128); rename the joint"
    faults = [
        Fault(file, f"joint {j.name!a}: {message}", line=j.line) for j in chain if not re.match(JOINT_NAME, j.name)
    ]
    if faults:
        raise InputFileError(faults)


def _parse(text: str, file: str) -> Any:
    import pinocchio as pin

    try:
        return pin.buildModelFromXML(text)
    except (ValueError, RuntimeError, IndexError) as error:
        reason = str(error).strip().splitlines()[0] if str(error).strip() else "no reason given"
        raise InputFileError(Fault(file, f"the URDF parser refused it: {reason}")) from error


def _axis(joint: XmlJoint) -> Array:
    """Joint axis as a unit vector in the frame of the child link."""
    axis = np.asarray(numbers(joint.children.get("axis", {}).get("xyz", "1 0 0")))
    return np.asarray(axis / np.linalg.norm(axis))


def _turn_to_z(axis: Array) -> Array:
    """Rotation whose z axis is a unit vector, (4, 4); exact for coordinate axes, the identity for z."""
    first = np.eye(3)[np.argmin(np.abs(axis))]
    x = first - (first @ axis) * axis
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(axis, x), axis], axis=1)
    return T


def _body(inertia: Any, name: str) -> RigidBody:
    entries = tensor_entries(np.asarray(inertia.inertia))
    mass, com = Uncertain.exact(inertia.mass), Uncertain.exact(inertia.lever)
    return RigidBody(name, mass, com, Uncertain.exact(entries), inertia_about="com")


def _joint(item: XmlJoint, placement: Array) -> Joint:
    limit, dynamics = item.children.get("limit", {}), item.children.get("dynamics", {})
    friction = Friction(
        viscous=Uncertain.exact(max(_number(dynamics, "damping"), 0.0)),
        coulomb=Uncertain.exact(max(_number(dynamics, "friction"), 0.0)),
    )
    limits = Limits(
        position=_position(limit) if item.kind != "continuous" else None,
        velocity=_symmetric(_number(limit, "velocity")),
        torque=_symmetric(_number(limit, "effort")),
    )
    kind = "prismatic" if item.kind == "prismatic" else "revolute"
    return Joint(item.name, kind, placement, friction=friction, limits=limits)  # type: ignore[arg-type]


def _number(attributes: dict[str, str], key: str) -> float:
    return numbers(attributes.get(key, "0"))[0]


def _symmetric(size: float) -> Range | None:
    """Limits -size..size; None where the file says zero or something beyond all measure."""
    return (-size, size) if 0.0 < size < NO_LIMIT else None


def _position(limit: dict[str, str]) -> Range | None:
    lower, upper = _number(limit, "lower"), _number(limit, "upper")
    if not lower < upper or math.hypot(lower / NO_LIMIT, upper / NO_LIMIT) >= 1.0:
        return None
    return lower, upper
