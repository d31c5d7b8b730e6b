"""Robots as URDF: placements, nominal inertias, friction and limits (URDF has no room for intervals)."""

import math
from xml.etree import ElementTree as Xml

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.joint import Joint, Range
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import to_xyz_rpy

NO_LIMIT = 1e9
"""Written where no limit is known: URDF asks for numbers, and a ``continuous`` joint is read as two coordinates.
Read back, a limit of this size or more (some tools write the largest double) means none."""

_RADIUS = 0.03


def urdf_text(robot: Robot, mass: Array, com: Array, inertia_com: Array) -> str:
    """URDF text of a robot.

    Parameters
    ----------
    mass, com, inertia_com : nominal parameters of links 1..n in the link frames of :class:`Robot`, shapes (n,),
        (n, 3) and (n, 6) with entries xx, xy, xz, yy, yz, zz about the centre of mass

    Notes
    -----
    Links are ``base_link``, ``link_1`` to ``link_n`` and ``tool0``; the frame of ``link_i`` is the frame of joint i,
    whose axis is z. Bodies of the fixed base are left out: they move nothing. Friction is written as damping and
    friction, rotor inertia has no place in URDF.
    """
    root = Xml.Element("robot", name=robot.name)
    ends = [*(joint.zero_placement[:3, 3] for joint in robot.joints[1:]), robot.tool_transform[:3, 3]]
    base = Xml.SubElement(root, "link", name="base_link")
    _add_visual(base, robot.joints[0].placement[:3, 3])
    parent = "base_link"
    for i, joint in enumerate(robot.joints):
        name = f"link_{i + 1}"
        _add_joint(root, joint, parent, name)
        link = Xml.SubElement(root, "link", name=name)
        if mass[i] > 0.0 or np.any(inertia_com[i] != 0.0):
            _add_inertial(link, float(mass[i]), com[i], inertia_com[i])
        _add_visual(link, ends[i])
        parent = name
    tool = Xml.SubElement(root, "joint", name="tool0_fixed", type="fixed")
    _connect(tool, parent, "tool0", robot.tool_transform)
    Xml.SubElement(root, "link", name="tool0")
    Xml.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + Xml.tostring(root, encoding="unicode") + "\n"


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def _add_origin(element: Xml.Element, T: Array) -> None:
    xyz, rpy = to_xyz_rpy(T)
    Xml.SubElement(element, "origin", xyz=_numbers(xyz), rpy=_numbers(rpy))


def _connect(element: Xml.Element, parent: str, child: str, T: Array) -> None:
    _add_origin(element, T)
    Xml.SubElement(element, "parent", link=parent)
    Xml.SubElement(element, "child", link=child)


def _add_joint(root: Xml.Element, joint: Joint, parent: str, child: str) -> None:
    element = Xml.SubElement(root, "joint", name=joint.name, type=joint.type)
    _connect(element, parent, child, joint.zero_placement)
    Xml.SubElement(element, "axis", xyz="0 0 1")
    lower, upper = joint.limits.position or (-NO_LIMIT, NO_LIMIT)
    limits = {
        "lower": repr(lower),
        "upper": repr(upper),
        "effort": repr(_symmetric(torque_range(joint))),
        "velocity": repr(_symmetric(joint.limits.velocity)),
    }
    Xml.SubElement(element, "limit", limits)
    damping, friction = float(joint.friction.viscous.nominal), float(joint.friction.coulomb.nominal)
    Xml.SubElement(element, "dynamics", damping=repr(damping), friction=repr(friction))


def torque_range(joint: Joint) -> Range | None:
    """Torque limit of a joint: as given, or what the current limit allows; None if neither is known."""
    constant, current = joint.drive.torque_constant, joint.limits.current
    if joint.limits.torque is not None or constant is None or current is None:
        return joint.limits.torque
    factor = constant * abs(joint.drive.gear_ratio)
    return current[0] * factor, current[1] * factor


def _symmetric(limits: Range | None) -> float:
    """URDF's one number for both directions: the stricter one."""
    return min(abs(limits[0]), abs(limits[1])) if limits else NO_LIMIT


def _add_inertial(link: Xml.Element, mass: float, com: Array, inertia: Array) -> None:
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=_numbers(com), rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=repr(mass))
    entries = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), inertia, strict=True)
    Xml.SubElement(inertial, "inertia", {key: repr(float(value)) for key, value in entries})


def _add_visual(link: Xml.Element, end: Array) -> None:
    """A cylinder from the link's origin to where the next joint sits, so that viewers show something."""
    length = float(np.linalg.norm(end))
    if length < _RADIUS:
        return
    visual = Xml.SubElement(link, "visual")
    pitch, yaw = math.acos(float(np.clip(end[2] / length, -1.0, 1.0))), math.atan2(end[1], end[0])
    Xml.SubElement(visual, "origin", xyz=_numbers(0.5 * end), rpy=f"0 {pitch!r} {yaw!r}")
    geometry = Xml.SubElement(visual, "geometry")
    Xml.SubElement(geometry, "cylinder", radius=repr(_RADIUS), length=repr(length))
