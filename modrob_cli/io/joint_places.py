"""Where in ROS 2 messages about joints the names and values are, for each message type.

Works on the tree that :func:`modrob_cli.io.cdr.walk` finds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from modrob_cli.io.cdr import Numbers

Place = tuple[int, str] | None
"""First byte of a number and its type; None if there is no such number."""


@dataclass(frozen=True)
class JointPlaces:
    """Places of one message.

    Attributes
    ----------
    seconds, nanoseconds : of the stamp
    frame : frame_id
    names : joints
    position, velocity, effort : one place for each joint
    """

    seconds: Place
    nanoseconds: Place
    frame: str
    names: tuple[str, ...]
    position: tuple[Place, ...]
    velocity: tuple[Place, ...]
    effort: tuple[Place, ...]


Tree = dict[str, Any]
_SIZES = {"float64": 8, "float32": 4}


def joint_state(tree: Tree) -> JointPlaces:
    """``sensor_msgs/msg/JointState``."""
    names = _names(tree, "name")
    lists = [_list(tree, key, len(names)) for key in ("position", "velocity", "effort")]
    return _with_header(tree, names, *lists)


def controller_state(tree: Tree) -> JointPlaces:
    """``control_msgs/msg/JointTrajectoryControllerState``: what was measured, ``feedback`` or (older) ``actual``."""
    names = _names(tree, "joint_names")
    measured = tree.get("feedback", tree.get("actual"))
    if not isinstance(measured, dict):
        raise ValueError("found neither feedback nor actual")
    lists = [_list(measured, key, len(names)) for key in ("positions", "velocities", "effort")]
    return _with_header(tree, names, *lists)


def desired_state(tree: Tree) -> JointPlaces:
    """``control_msgs/msg/JointTrajectoryControllerState``: what is wanted, ``reference`` or (older) ``desired``.

    Accelerations take the place of efforts.
    """
    names = _names(tree, "joint_names")
    wanted = tree.get("reference", tree.get("desired"))
    if not isinstance(wanted, dict):
        raise ValueError("found neither reference nor desired")
    lists = [_list(wanted, key, len(names)) for key in ("positions", "velocities", "accelerations")]
    return _with_header(tree, names, *lists)


def wrench(tree: Tree) -> JointPlaces:
    """``geometry_msgs/msg/WrenchStamped``: the six numbers in the place of positions."""
    inner = tree.get("wrench", {})
    parts = [(f"{kind}.{axis}", inner.get(kind, {}).get(axis)) for kind in ("force", "torque") for axis in "xyz"]
    places = tuple(_single(found) for _, found in parts)
    return _with_header(tree, tuple(name for name, _ in parts), places, (None,) * 6, (None,) * 6)


def external_torque(tree: Tree) -> JointPlaces:
    """``modrob_msgs/msg/JointTruth`` of a simulation: the torque of contacts in the place of efforts."""
    names = _names(tree, "name")
    none: tuple[Place, ...] = (None,) * len(names)
    return _with_header(tree, names, none, none, _list(tree, "external_torque", len(names)))


def dynamic_joint_state(tree: Tree) -> JointPlaces:
    """``control_msgs/msg/DynamicJointState``: interfaces by name, for each joint."""
    names = _names(tree, "joint_names")
    interfaces = tree.get("interface_values")
    if not isinstance(interfaces, list) or len(interfaces) != len(names):
        raise ValueError(f"expected interface_values for each of {len(names)} joints")
    lists: dict[str, list[Place]] = {"position": [], "velocity": [], "effort": []}
    for interface in interfaces:
        inner = _names(interface, "interface_names")
        values = dict(zip(inner, _list(interface, "values", len(inner)), strict=True))
        for key, places in lists.items():
            places.append(values.get(key))
    return _with_header(tree, names, *(tuple(places) for places in lists.values()))


def foxglove_joint_states(tree: Tree) -> JointPlaces:
    """``foxglove_msgs/msg/JointStates``: one structure for each joint."""
    joints = tree.get("joints")
    if not isinstance(joints, list):
        raise ValueError("found no joints")
    names = tuple(str(joint["name"]) for joint in joints)
    lists = [tuple(_single(joint.get(key)) for joint in joints) for key in ("position", "velocity", "effort")]
    stamp = tree.get("timestamp", {})
    return JointPlaces(_single(stamp.get("sec")), _single(stamp.get("nanosec")), "", names, *lists)


def _with_header(tree: Tree, names: tuple[str, ...], *lists: tuple[Place, ...]) -> JointPlaces:
    header = tree.get("header", {})
    stamp = header.get("stamp", {})
    frame = header.get("frame_id", "")
    return JointPlaces(_single(stamp.get("sec")), _single(stamp.get("nanosec")), frame, names, *lists)


def _names(tree: Tree, key: str) -> tuple[str, ...]:
    names = tree.get(key)
    if not isinstance(names, list):
        raise ValueError(f"found no {key}")
    return tuple(names)


def _single(found: object) -> Place:
    return (found.place, found.type) if isinstance(found, Numbers) and found.count == 1 else None


def _list(tree: Tree, key: str, wanted: int) -> tuple[Place, ...]:
    """One place for each joint; an empty list means that nothing was recorded."""
    numbers = tree.get(key)
    if numbers is None or (isinstance(numbers, Numbers) and numbers.count == 0):
        return (None,) * wanted
    if not isinstance(numbers, Numbers) or numbers.type not in _SIZES:
        raise ValueError(f"{key} is no list of floating-point numbers")
    if numbers.count != wanted:
        raise ValueError(f"{key} has {numbers.count} values for {wanted} joints")
    size = _SIZES[numbers.type]
    return tuple((numbers.place + k * size, numbers.type) for k in range(wanted))


READERS: dict[str, Callable[[Tree], JointPlaces]] = {
    "sensor_msgs/JointState": joint_state,
    "foxglove_msgs/JointStates": foxglove_joint_states,
    "control_msgs/DynamicJointState": dynamic_joint_state,
    "control_msgs/JointTrajectoryControllerState": controller_state,
}
"""By type, without the ``msg`` in the middle."""
