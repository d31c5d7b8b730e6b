"""ROS 2's CDR encoding (XCDR1, as DDS and rosbag2 write it): where in a message the values are.

The definition of the type leads through the bytes. The result holds places, not values: messages whose texts and
lengths are the same have the same places, so that one walk serves thousands of them.
"""

import struct
from dataclasses import dataclass, field

from modrob_cli.io.ros_definitions import SIZES, Definitions, RosField

_HEADER = 4
"""Bytes of the encapsulation header; alignment counts from its end."""
_DEEPEST = 16
_MOST_PLACES = 200_000


@dataclass(frozen=True)
class Numbers:
    """Numbers of one primitive type in a row: type, place of the first, how many."""

    type: str
    place: int
    count: int


@dataclass
class CdrMessage:
    """One message, walked through.

    Attributes
    ----------
    order : "<" or ">", the order of bytes
    root : tree of the fields: texts as ``str``, numbers as :class:`Numbers`, lists of texts or structures as ``list``
    spans : (first, end) of the bytes of all numbers
    """

    data: bytes
    order: str
    root: dict[str, object] = field(default_factory=dict)
    spans: list[tuple[int, int]] = field(default_factory=list)


def walk(data: bytes, name: str, definitions: Definitions) -> CdrMessage:
    """Find the fields of a message of the type ``name`` (``package/Name``).

    Raises
    ------
    ValueError
        If the bytes are not a message of this type.
    """
    if len(data) < _HEADER or data[0] != 0 or data[1] not in (0, 1):
        raise ValueError("not a CDR message")
    message = CdrMessage(data, "<" if data[1] == 1 else ">")
    message.root = _Walker(message, definitions).structure(name, 0)
    return message


class _Walker:
    """The place in a message, and what was found before it."""

    def __init__(self, message: CdrMessage, definitions: Definitions) -> None:
        self.message = message
        self.definitions = definitions
        self.place = _HEADER
        self.budget = _MOST_PLACES

    def structure(self, name: str, depth: int) -> dict[str, object]:
        if depth > _DEEPEST:
            raise ValueError("types are nested too deeply")
        return {field.name: self._field(field, depth) for field in self.definitions[name]}

    def _field(self, field: RosField, depth: int) -> object:
        count = self._count() if field.is_list else field.length
        if field.type in SIZES:
            return self._numbers(field.type, 1 if count is None else count)
        if count is None:
            return self._one(field.type, depth)
        out = []
        for _ in range(count):
            out.append(self._one(field.type, depth))
        return out

    def _one(self, kind: str, depth: int) -> object:
        # Structures may be empty: without a budget a damaged length would count to 2^32.
        self.budget -= 1
        if self.budget < 0:
            raise ValueError("a list is too long")
        return self._text(kind == "wstring") if kind in ("string", "wstring") else self.structure(kind, depth + 1)

    def _count(self) -> int:
        self.place += -(self.place - _HEADER) % 4
        try:
            (count,) = struct.unpack_from(f"{self.message.order}I", self.message.data, self.place)
        except struct.error as error:
            raise ValueError("the message is too short") from error
        self.place += 4
        return int(count)

    def _text(self, wide: bool) -> str:
        length = self._count()
        end = self.place + length * (2 if wide else 1)
        if end > len(self.message.data):
            raise ValueError("a text runs past the end of the message")
        raw = self.message.data[self.place : end]
        self.place = end
        if wide:
            return raw.decode("utf-16-le" if self.message.order == "<" else "utf-16-be")
        return raw.rstrip(b"\0").decode()

    def _numbers(self, kind: str, count: int) -> Numbers:
        size = SIZES[kind]
        if count:
            self.place += -(self.place - _HEADER) % size
        found = Numbers(kind, self.place, count)
        end = self.place + size * count
        if end > len(self.message.data):
            raise ValueError("a list runs past the end of the message" if count > 1 else "the message is too short")
        self.message.spans.append((self.place, end))
        self.place = end
        return found
