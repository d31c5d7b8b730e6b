"""``JointTrajectory`` and ``JointState`` in ROS 2's CDR encoding (XCDR1), as plain lists."""

import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from modrob_cli.arrays import Array

_HEADER = 4
_POINT_LISTS = ("positions", "velocities", "accelerations", "effort")
_SMALLEST_TEXT, _SMALLEST_POINT = 4, 24
_SECOND = 10**9


@dataclass(frozen=True)
class StateMessage:
    """Time stamp [ns], names, positions and velocities (empty where not sent)."""

    stamp: int
    names: tuple[str, ...]
    positions: Array
    velocities: Array


def decode_joint_trajectory(data: bytes) -> dict[str, Any]:
    """Decode a ``trajectory_msgs/msg/JointTrajectory`` into what its YAML would hold; times in seconds.

    Raises
    ------
    ValueError
        If the bytes are not a message of this type.
    """
    reader = _Reader.of(data)
    reader.numbers("iI")
    reader.text()
    names = [reader.text() for _ in range(reader.count(_SMALLEST_TEXT))]
    return {"joint_names": names, "points": [reader.point() for _ in range(reader.count(_SMALLEST_POINT))]}


def decode_state(data: bytes) -> StateMessage:
    """Decode a ``sensor_msgs/msg/JointState``; errors as in :func:`decode_joint_trajectory`."""
    reader = _Reader.of(data)
    seconds, nanoseconds = reader.numbers("iI")
    reader.text()
    names = tuple(reader.text() for _ in range(reader.count(_SMALLEST_TEXT)))
    return StateMessage(seconds * _SECOND + nanoseconds, names, reader.doubles(), reader.doubles())


@dataclass
class _Reader:
    """A place in a message; lengths are checked before anything is made of them."""

    data: bytes
    order: str
    place: int = field(default=_HEADER)

    @classmethod
    def of(cls, data: bytes) -> "_Reader":
        if len(data) < _HEADER or data[0] != 0 or data[1] not in (0, 1):
            raise ValueError("not a CDR message")
        return cls(data, "<" if data[1] == 1 else ">")

    def numbers(self, form: str) -> tuple[int, ...]:
        """Four-byte numbers."""
        self.place += -(self.place - _HEADER) % 4
        try:
            out = struct.unpack_from(f"{self.order}{form}", self.data, self.place)
        except struct.error as error:
            raise ValueError("the message is too short") from error
        self.place += 4 * len(form)
        return out

    def count(self, smallest: int) -> int:
        """Length of a list whose items have at least this many bytes."""
        count = self.numbers("I")[0]
        if count * smallest > len(self.data) - self.place:
            raise ValueError("a list runs past the end of the message")
        return count

    def text(self) -> str:
        length = self.count(1)
        self.place += length
        return self.data[self.place - length : self.place].rstrip(b"\0").decode()

    def doubles(self) -> Array:
        count = self.count(8)
        if count:
            self.place += -(self.place - _HEADER) % 8
        if self.place + 8 * count > len(self.data):
            raise ValueError("a list runs past the end of the message")
        self.place += 8 * count
        return np.frombuffer(self.data, f"{self.order}f8", count, self.place - 8 * count).astype(float)

    def point(self) -> dict[str, Any]:
        lists = {name: self.doubles().tolist() for name in _POINT_LISTS}
        seconds, nanoseconds = self.numbers("iI")
        return {**lists, "time_from_start": seconds + nanoseconds / _SECOND}
