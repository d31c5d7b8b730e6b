"""Joint states from CDR messages, many at a time.

One message is walked through by its definition. All messages that differ from it in nothing but numbers are then
decoded at once: their bytes are compared with it, and the columns of the numbers are taken out.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.cdr import walk
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import NO_STAMP, QUANTITIES, Batch, Faults, Source, check_names
from modrob_cli.io.joint_places import READERS, JointPlaces, Place, Tree
from modrob_cli.io.mcap_chunks import Block, Schema
from modrob_cli.io.ros_definitions import parse_definitions

Bytes = NDArray[np.uint8]

_MOST_TEMPLATES = 64
"""Templates of one length that are kept; messages that are all different are decoded one by one."""
_LARGEST_SECONDS = 2**31
"""Stamps beyond are damaged; nanoseconds and their differences then fit into 64 bits."""
_DTYPES = {
    "float64": "f8", "float32": "f4", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
}  # fmt: skip
_DEFAULT = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
"""
"""``sensor_msgs/msg/JointState``, for files that leave its text out."""


class CdrDecoder:
    """Decodes the messages of one channel.

    Parameters
    ----------
    reader : what to take from a message; by its type where left out

    Raises
    ------
    ValueError
        If the definition of the type cannot be used.
    """

    def __init__(self, channel: int, schema: Schema, reader: Callable[[Tree], JointPlaces] | None = None) -> None:
        parts = schema.name.split("/")
        self.name = f"{parts[0]}/{parts[-1]}"
        self.channel = channel
        self.faults = Faults()
        self._reader = reader or READERS[self.name]
        text = schema.data.decode() if schema.encoding == "ros2msg" else ""
        if not text.strip():
            if self.name != "sensor_msgs/JointState":
                raise ValueError(f"its definition is not in the file as ros2msg ({schema.encoding or 'none'})")
            text = _DEFAULT
        self._definitions = parse_definitions(self.name, text)
        self._templates: dict[int, list[_Template]] = {}

    def decode(self, block: Block, chosen: Indices, order: Indices) -> Iterator[Batch]:
        """Joint states of the chosen messages of a block, which have the numbers ``order`` in the file."""
        memory = np.frombuffer(block.data, np.uint8)
        lengths = block.lengths[chosen]
        for length in np.unique(lengths).tolist():
            same = np.flatnonzero(lengths == length)
            if length == 0:
                for _ in same:
                    self.faults.add("it is empty")
                continue
            rows = np.lib.stride_tricks.sliding_window_view(memory, length)[block.starts[chosen[same]]]
            for template, found in self._sorted(rows):
                if not len(found):
                    continue
                at = same[found]
                yield template.batch(self.channel, rows[found], order[at], block.log_times[chosen[at]])

    def _sorted(self, rows: Bytes) -> Iterator[tuple["_Template", Indices]]:
        """Templates and the rows that fit them; every row that can be decoded comes once."""
        known = self._templates.setdefault(rows.shape[1], [])
        left = np.arange(len(rows), dtype=np.intp)
        for template in list(known):
            if len(left):
                fits = template.fits(rows[left])
                yield template, left[fits]
                left = left[~fits]
        while len(left):
            try:
                template = self._learn(rows[left[0]].tobytes())
            except ValueError as error:
                self.faults.add(str(error))
                left = left[1:]
                continue
            if len(known) < _MOST_TEMPLATES:
                known.append(template)
                fits = template.fits(rows[left])
            else:
                fits = np.arange(len(left)) == 0
            yield template, left[fits]
            left = left[~fits]

    def _learn(self, data: bytes) -> "_Template":
        message = walk(data, self.name, self._definitions)
        places = self._reader(message.root)
        check_names(places.names)
        mask = np.full(len(data), 0xFF, dtype=np.uint8)
        for first, end in message.spans:
            mask[first:end] = 0
        return _Template(np.frombuffer(data, np.uint8), mask, message.order, places)


@dataclass(frozen=True)
class _Template:
    """A message and where its numbers are; ``mask`` is 0 there, 255 elsewhere."""

    data: Bytes
    mask: Bytes
    order: str
    places: JointPlaces

    def fits(self, rows: Bytes) -> NDArray[np.bool_]:
        """Whether messages (N, length) differ in nothing but numbers."""
        return np.asarray(~np.any((rows ^ self.data) & self.mask, axis=1))

    def batch(self, channel: int, rows: Bytes, order: Indices, log_times: Stamps) -> Batch:
        """Decode messages (N, length) that fit."""
        places = self.places
        values = np.stack([self._columns(rows, getattr(places, name)) for name in QUANTITIES])
        recorded = tuple(name for name in QUANTITIES if any(getattr(places, name)))
        source = Source(channel, places.names, places.frame, recorded)
        return Batch(source, order, self._stamps(rows), log_times, values)

    def _stamps(self, rows: Bytes) -> Stamps:
        seconds, nanoseconds = self.places.seconds, self.places.nanoseconds
        if seconds is None or nanoseconds is None:
            return np.full(len(rows), NO_STAMP)
        parts = [self._numbers(rows, place, 1)[:, 0].astype(np.int64) for place in (seconds, nanoseconds)]
        fits = np.abs(parts[0]) < _LARGEST_SECONDS
        return np.where(fits, np.where(fits, parts[0], 0) * 1_000_000_000 + parts[1], NO_STAMP)

    def _columns(self, rows: Bytes, places: tuple[Place, ...]) -> Array:
        """One column for each joint, NaN where it has no value."""
        out = np.full((len(rows), len(places)), np.nan)
        first = places[0] if places else None
        if first is not None and places == _in_a_row(first, len(places)):
            out[:] = self._numbers(rows, first, len(places))
            return out
        for k, place in enumerate(places):
            if place is not None:
                out[:, k] = self._numbers(rows, place, 1)[:, 0]
        return out

    def _numbers(self, rows: Bytes, place: tuple[int, str], count: int) -> NDArray[np.generic]:
        """Numbers that stand in a row, shape (N, count)."""
        start, kind = place
        dtype = np.dtype(self.order + _DTYPES[kind])
        part = np.ascontiguousarray(rows[:, start : start + dtype.itemsize * count])
        return part.view(dtype)


def _in_a_row(first: tuple[int, str], count: int) -> tuple[Place, ...]:
    start, kind = first
    size = np.dtype(_DTYPES[kind]).itemsize
    return tuple((start + k * size, kind) for k in range(count))
