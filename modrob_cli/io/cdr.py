"""``sensor_msgs/msg/JointState`` in ROS 2's CDR encoding (XCDR1, as DDS and rosbag2 write it).

Hand-written for one message type: several times faster than a general decoder, with which the tests compare it.
"""

import struct
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array

_HEADER = 4
"""Bytes of the encapsulation header; alignment counts from its end."""


@dataclass(frozen=True)
class JointState:
    """One message: time stamp [ns], names, and values (empty where they were not sent)."""

    stamp: int
    names: tuple[str, ...]
    position: Array
    velocity: Array
    effort: Array


class JointStateDecoder:
    """Decodes messages; remembers the last list of names, which rarely changes."""

    def __init__(self) -> None:
        self._prefix = b""
        self._names: tuple[str, ...] = ()
        self._end = 0

    def decode(self, data: bytes) -> JointState:
        """Decode one message.

        Raises
        ------
        ValueError
            If the bytes are not a message of this type.
        """
        if len(data) < _HEADER + 8 or data[0] != 0 or data[1] not in (0, 1):
            raise ValueError("not a CDR message")
        order = "<" if data[1] == 1 else ">"
        try:
            sec, nanosec = struct.unpack_from(f"{order}iI", data, _HEADER)
            prefix = self._prefix
            if not prefix or data[1] != prefix[1] or data[12 : self._end] != prefix[12:]:
                self._read_names(data, order)
            position, place = _doubles(data, self._end, order)
            velocity, place = _doubles(data, place, order)
            effort, _ = _doubles(data, place, order)
        except struct.error as error:
            raise ValueError("the message is too short") from error
        return JointState(sec * 1_000_000_000 + nanosec, self._names, position, velocity, effort)

    def _read_names(self, data: bytes, order: str) -> None:
        self._prefix = b""
        _, place = _text(data, _HEADER + 8, order)
        count, place = _count(data, place, order)
        names = []
        for _ in range(count):
            name, place = _text(data, place, order)
            names.append(name)
        self._names, self._end, self._prefix = tuple(names), place, data[:place]


def _count(data: bytes, place: int, order: str) -> tuple[int, int]:
    place += -(place - _HEADER) % 4
    return struct.unpack_from(f"{order}I", data, place)[0], place + 4


def _text(data: bytes, place: int, order: str) -> tuple[str, int]:
    length, place = _count(data, place, order)
    end = place + length
    if end > len(data):
        raise ValueError("a text runs past the end of the message")
    return data[place:end].rstrip(b"\0").decode(), end


def _doubles(data: bytes, place: int, order: str) -> tuple[Array, int]:
    count, place = _count(data, place, order)
    if count:
        place += -(place - _HEADER) % 8
    if place + 8 * count > len(data):
        raise ValueError("a list runs past the end of the message")
    return np.frombuffer(data, f"{order}f8", count, place), place + 8 * count
