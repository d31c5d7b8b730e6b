"""Joint states in JSON: the fields of ``sensor_msgs/msg/JointState`` or of ``foxglove.JointStates``."""

import json
import math
from typing import Any

from modrob_cli.io.joint_batch import NO_STAMP

Decoded = tuple[int, str, tuple[str, ...], tuple[list[float], list[float], list[float]]]
"""Stamp [ns], frame, joints, and their positions, velocities and efforts (each empty or one for each joint)."""

_KEYS = ("position", "velocity", "effort")
_SECONDS = ("sec", "secs", "seconds")
_LATEST = 9e9
"""Numbers of seconds must be below this: nanoseconds then fit into 64 bits."""
_NANOSECONDS = ("nanosec", "nsec", "nsecs", "nanos")


def decode_json(data: bytes) -> Decoded:
    """Decode one message.

    Raises
    ------
    ValueError
        If it is not of one of the two forms.
    """
    try:
        message = json.loads(data)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    if not isinstance(message, dict):
        raise ValueError("it is no JSON object")
    if isinstance(message.get("joints"), list):
        return _joint_states(message)
    if isinstance(message.get("name"), list):
        return _joint_state(message)
    raise ValueError("it has neither name nor joints")


def _joint_state(message: dict[str, Any]) -> Decoded:
    names = tuple(_text(name) for name in message["name"])
    lists = tuple(_numbers(message.get(key), key, len(names)) for key in _KEYS)
    header = message.get("header")
    header = header if isinstance(header, dict) else {}
    frame = header.get("frame_id", "")
    return _stamp(header.get("stamp")), frame if isinstance(frame, str) else "", names, (lists[0], lists[1], lists[2])


def _joint_states(message: dict[str, Any]) -> Decoded:
    joints = message["joints"]
    if not all(isinstance(joint, dict) for joint in joints):
        raise ValueError("a joint is no JSON object")
    names = tuple(_text(joint.get("name")) for joint in joints)
    lists = [[_number(joint.get(key)) for joint in joints] for key in _KEYS]
    return _stamp(message.get("timestamp")), "", names, (lists[0], lists[1], lists[2])


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError("the name of a joint is no text")
    return value


def _number(value: object) -> float:
    """A number, or NaN for null and the texts by which JSON writers say it."""
    if value is None or value == "NaN":
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"found {str(value)[:20]!r} in the place of a number")
    try:
        return float(value)
    except OverflowError as error:
        raise ValueError("a number is too large") from error


def _numbers(value: object, key: str, wanted: int) -> list[float]:
    if value is None or value == []:
        return []
    if not isinstance(value, list):
        raise ValueError(f"{key} is no list")
    if len(value) != wanted:
        raise ValueError(f"{key} has {len(value)} values for {wanted} joints")
    return [_number(item) for item in value]


def _stamp(value: object) -> int:
    """Nanoseconds; from seconds and nanoseconds, or from a number of seconds."""
    if isinstance(value, dict):
        seconds = next((value[key] for key in _SECONDS if key in value), None)
        nanoseconds = next((value[key] for key in _NANOSECONDS if key in value), 0)
        if type(seconds) is int and type(nanoseconds) is int:
            return seconds * 1_000_000_000 + nanoseconds
    elif isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _LATEST:
        return round(value * 1e9)
    return NO_STAMP
