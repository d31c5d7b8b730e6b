"""The bytes of ROS 2 messages whose texts and lengths stay the same over a series (CDR, XCDR1, little endian).

The places of all numbers are then the same in every message: a template is filled by columns, without a loop over
messages.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError

Stamps = NDArray[np.int64]
"""Times in nanoseconds."""
Bytes = NDArray[np.uint8]

_ENCAPSULATION = b"\x00\x01\x00\x00"
_SECOND = 1_000_000_000
_LAST_SECOND = 2**31


@dataclass(frozen=True)
class StampField:
    """The time of the message: int32 seconds, uint32 nanoseconds."""


@dataclass(frozen=True)
class TextField:
    """A string that does not change."""

    value: str


@dataclass(frozen=True)
class TextsField:
    """A list of strings that does not change."""

    values: tuple[str, ...]


@dataclass(frozen=True)
class DoublesField:
    """A list (``float64[]``) of ``count`` numbers from the values of the series."""

    count: int


@dataclass(frozen=True)
class PlainDoublesField:
    """``count`` numbers from the values of the series, one after the other, as members or as ``float64[count]``."""

    count: int


@dataclass(frozen=True)
class ConstantField:
    """A number that does not change; ``form`` as in :mod:`struct`: i int32, I uint32, d float64."""

    form: str
    value: float


Field = StampField | TextField | TextsField | DoublesField | PlainDoublesField | ConstantField


class MessageLayout:
    """Places of the parts of a message.

    Attributes
    ----------
    type_name : such as ``sensor_msgs/msg/JointState``
    definition : its text, with those of the types that it uses, as rosbag2 stores it (``ros2msg``)
    size : bytes of a message
    width : number of values in a message
    """

    def __init__(self, type_name: str, definition: str, fields: Sequence[Field]) -> None:
        self.type_name = type_name
        self.definition = definition
        self.width = 0
        self._template = bytearray(_ENCAPSULATION)
        self._stamps: list[int] = []
        self._slices: list[tuple[int, int, int]] = []
        for field in fields:
            self._add(field)
        self.size = len(self._template)

    def _add(self, field: Field) -> None:
        if isinstance(field, StampField):
            self._align(4)
            self._stamps.append(len(self._template))
            self._template += bytes(8)
        elif isinstance(field, TextField):
            self._add_text(field.value)
        elif isinstance(field, TextsField):
            self._add_number("I", len(field.values))
            for value in field.values:
                self._add_text(value)
        elif isinstance(field, ConstantField):
            self._add_number(field.form, field.value)
        else:
            if isinstance(field, DoublesField):
                self._add_number("I", field.count)
            self._add_values(field.count)

    def _align(self, size: int) -> None:
        """Fill up; places count from the end of the encapsulation."""
        self._template += bytes(-(len(self._template) - len(_ENCAPSULATION)) % size)

    def _add_number(self, form: str, value: float) -> None:
        self._align(struct.calcsize(form))
        self._template += struct.pack(f"<{form}", value)

    def _add_text(self, value: str) -> None:
        raw = value.encode() + b"\0"
        self._add_number("I", len(raw))
        self._template += raw

    def _add_values(self, count: int) -> None:
        if not count:  # an empty list ends with its length: nothing is aligned
            return
        self._align(8)
        self._slices.append((len(self._template), self.width, count))
        self._template += bytes(8 * count)
        self.width += count

    def rows(self, stamps: Stamps, values: Array) -> Bytes:
        """Messages as rows of bytes.

        Parameters
        ----------
        stamps : times of the messages, shape (N,), [ns]
        values : numbers in the order of the fields, shape (N, width)

        Returns
        -------
        rows : shape (N, size)

        Raises
        ------
        ShapeError
            If the shapes do not fit.
        NumericalError
            If a stamp is negative or beyond what the message can hold (year 2038).
        """
        if stamps.ndim != 1 or values.shape != (len(stamps), self.width):
            raise ShapeError(f"expected values of shape ({stamps.size}, {self.width}), got {values.shape}")
        seconds, nanoseconds = np.divmod(stamps, _SECOND)
        if len(stamps) and not 0 <= seconds.min() <= seconds.max() < _LAST_SECOND:
            raise NumericalError(f"a time stamp is outside of 0 .. {_LAST_SECOND} s, which messages cannot hold")
        rows = np.tile(np.frombuffer(bytes(self._template), np.uint8), (len(stamps), 1))
        parts = np.stack([seconds, nanoseconds], axis=1).astype("<u4")
        for place in self._stamps:
            rows[:, place : place + 8] = parts.view(np.uint8).reshape(-1, 8)
        if len(self._slices) > len(stamps):
            self._fill_by_row(rows, values)
        else:
            for place, first, count in self._slices:
                part = np.ascontiguousarray(values[:, first : first + count], dtype="<f8")
                rows[:, place : place + 8 * count] = part.view(np.uint8).reshape(-1, 8 * count)
        return rows

    def _fill_by_row(self, rows: Bytes, values: Array) -> None:
        """Fill in values row by row: faster for few messages of very many parts."""
        if not len(rows) or not self._slices:
            return
        head = len(_ENCAPSULATION)
        place, first, count = np.array(self._slices).T
        index = np.repeat((place - head) // 8 - first, count) + np.arange(self.width)
        end = head + (self.size - head) // 8 * 8
        for row, numbers in zip(rows, values, strict=True):
            row[head:end].view("<f8")[index] = numbers

    def encode(self, stamps: Stamps, values: Array) -> list[bytes]:
        """Messages one by one; parameters and errors as in :meth:`rows`."""
        return split_rows(self.rows(stamps, values))


def split_rows(rows: Bytes) -> list[bytes]:
    """Rows of bytes one by one."""
    raw, size = rows.tobytes(), rows.shape[1]
    return [raw[k : k + size] for k in range(0, len(raw), size)]
