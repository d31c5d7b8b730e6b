"""``foxglove.JointStates`` in protobuf.

The wire format is taken apart by hand: two nested messages do not earn a dependency with generated code. Field numbers
come from the descriptor in the file. https://protobuf.dev/programming-guides/encoding
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from modrob_cli.io.joint_batch import NO_STAMP

_VARINT, _DOUBLE, _BYTES, _FLOAT = 0, 1, 2, 5
_FIELD_NAME, _FIELD_NUMBER, _PROTO3_OPTIONAL = 1, 3, 17


@dataclass(frozen=True)
class FoxgloveNumbers:
    """Numbers of the fields; a value that is left out is 0 unless the field is ``optional``."""

    timestamp: int = 1
    joints: int = 2
    fields: dict[str, int] = field(default_factory=lambda: {"name": 1, "position": 2, "velocity": 3, "effort": 5})
    missing: float = math.nan


def read_numbers(descriptor: bytes) -> FoxgloveNumbers:
    """Field numbers from a FileDescriptorSet.

    Raises
    ------
    ValueError
        If it does not define the two messages.
    """
    if not descriptor:
        return FoxgloveNumbers()
    messages: dict[str, dict[str, tuple[int, bool]]] = {}
    for number, _, file in _fields(descriptor):
        for inner, _, message in _fields(file) if number == 1 else ():
            if inner == 4:
                name, fields = _describe(message)
                messages[name] = fields
    outer, joint = messages.get("JointStates", {}), messages.get("JointState", {})
    wanted = ("name", "position", "velocity", "effort")
    if not {"timestamp", "joints"} <= outer.keys() or not set(wanted) <= joint.keys():
        raise ValueError("its descriptor does not define foxglove.JointStates as Foxglove does")
    missing = math.nan if joint["position"][1] else 0.0
    numbers = {key: joint[key][0] for key in wanted}
    return FoxgloveNumbers(outer["timestamp"][0], outer["joints"][0], numbers, missing)


def _describe(message: bytes) -> tuple[str, dict[str, tuple[int, bool]]]:
    """Name of a message type; number of each field and whether it may be left out."""
    name, fields = "", {}
    for number, _, value in _fields(message):
        if number == 1:
            name = value.decode()
        elif number == 2:
            parts = {key: part for key, _, part in _fields(value)}
            optional = bool(parts.get(_PROTO3_OPTIONAL, 0))
            fields[parts.get(_FIELD_NAME, b"").decode()] = (int(parts.get(_FIELD_NUMBER, 0)), optional)
    return name, fields


def decode_joint_states(
    data: bytes, numbers: FoxgloveNumbers
) -> tuple[int, tuple[str, ...], tuple[list[float], list[float], list[float]]]:
    """Stamp [ns], joints, and their positions, velocities and efforts.

    Raises
    ------
    ValueError
        If the bytes are not such a message.
    """
    stamp = NO_STAMP
    names: list[str] = []
    lists: tuple[list[float], list[float], list[float]] = ([], [], [])
    keys = [numbers.fields[key] for key in ("position", "velocity", "effort")]
    for number, wire, value in _fields(data):
        if number == numbers.timestamp and wire == _BYTES:
            parts = {key: part for key, kind, part in _fields(value) if kind == _VARINT}
            stamp = _signed(parts.get(1, 0)) * 1_000_000_000 + _signed(parts.get(2, 0))
        elif number == numbers.joints and wire == _BYTES:
            found = {key: part for key, _, part in _fields(value)}
            name = found.get(numbers.fields["name"], b"")
            if not isinstance(name, bytes):
                raise ValueError("the name of a joint is no text")
            names.append(name.decode())
            for column, key in zip(lists, keys, strict=True):
                column.append(_value(found.get(key), numbers.missing))
    return stamp, tuple(names), lists


def _value(found: Any, missing: float) -> float:
    if found is None:
        return missing
    if isinstance(found, bytes):  # a DoubleValue around the number
        return _value(next((part for key, _, part in _fields(found) if key == 1), None), 0.0)
    return float(found)


def _signed(value: int) -> int:
    return value - 2**64 if value >= 2**63 else value


def _fields(data: bytes) -> Iterator[tuple[int, int, Any]]:
    """Number, wire type and value of each field: ``int``, ``float`` or ``bytes``."""
    if not isinstance(data, bytes):
        raise ValueError("found a number in the place of a message")
    place, end = 0, len(data)
    while place < end:
        key, place = _varint(data, place)
        number, wire = key >> 3, key & 7
        value: Any
        if wire == _VARINT:
            value, place = _varint(data, place)
        elif wire in (_DOUBLE, _FLOAT):
            size = 8 if wire == _DOUBLE else 4
            if place + size > end:
                raise ValueError("a number runs past the end of the message")
            (value,) = struct.unpack_from("<d" if wire == _DOUBLE else "<f", data, place)
            place += size
        elif wire == _BYTES:
            length, place = _varint(data, place)
            if length > end - place:
                raise ValueError("a field runs past the end of the message")
            value = data[place : place + length]
            place += length
        else:
            raise ValueError(f"found the wire type {wire}")
        yield number, wire, value


def _varint(data: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while place < len(data) and shift < 70:
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & (2**64 - 1), place
        shift += 7
    raise ValueError("a number of variable length has no end")
