"""Parts of MCAP files as bytes: fields of records, unpacking of chunks, messages of a chunk.

Every length is checked against what is there before anything is allocated for it.
https://mcap.dev/spec
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Indices
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.mcap_damage import DamageError

MAX_CHUNK = 2**30
"""A chunk that claims to be larger than this when unpacked is taken for damaged."""
HEAD = struct.Struct("<BQ")
"""Opcode and length of a record."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time."""

_PIECE = 2**22
_MOST_ALIKE = 4096
"""Records that are taken at once."""
_HEAD_TYPE = np.dtype([("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")])


class Opcode(IntEnum):
    """Kinds of records."""

    HEADER = 1
    FOOTER = 2
    SCHEMA = 3
    CHANNEL = 4
    MESSAGE = 5
    CHUNK = 6
    MESSAGE_INDEX = 7
    CHUNK_INDEX = 8
    ATTACHMENT = 9
    ATTACHMENT_INDEX = 10
    STATISTICS = 11
    METADATA = 12
    METADATA_INDEX = 13
    SUMMARY_OFFSET = 14
    DATA_END = 15


PRIVATE = 128
"""Opcodes from here on belong to applications and are skipped."""


@dataclass(frozen=True)
class Schema:
    """A message type: its name, the language of its text, its text."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class Channel:
    """A topic as one writer announced it; ``schema`` is the number of its type."""

    topic: str
    encoding: str
    schema: int


@dataclass(frozen=True)
class ChunkHead:
    """What a chunk says about itself; times are log times [ns]."""

    start: int
    end: int
    size: int
    crc: int
    compression: str
    packed: int


@dataclass(frozen=True)
class Block:
    """Messages that lie in one piece of memory.

    Attributes
    ----------
    data : the bytes
    channels, starts, lengths : of each message's data, shape (N,)
    log_times : shape (N,), [ns]
    """

    data: bytes
    channels: Indices
    starts: Indices
    lengths: Indices
    log_times: Stamps


class Fields:
    """Reads the fields of one record from the left to the right."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.place = 0

    def numbers(self, form: str) -> tuple[int, ...]:
        """Little-endian numbers as :mod:`struct` names them.

        Raises
        ------
        DamageError
            If the record is too short; so do the others.
        """
        try:
            values = struct.unpack_from(f"<{form}", self.data, self.place)
        except struct.error as error:
            raise DamageError("a record is too short") from error
        self.place += struct.calcsize(f"<{form}")
        return values

    def bytes(self, length: int) -> bytes:
        """The next ``length`` bytes."""
        if length > len(self.data) - self.place:
            raise DamageError("a record is too short")
        self.place += length
        return self.data[self.place - length : self.place]

    def text(self) -> str:
        """A text with its length before it."""
        try:
            return self.bytes(self.numbers("I")[0]).decode()
        except UnicodeDecodeError as error:
            raise DamageError("a text is not UTF-8") from error


def read_schema(data: bytes) -> tuple[int, Schema]:
    """Number and content of a Schema record."""
    fields = Fields(data)
    number = fields.numbers("H")[0]
    name, encoding = fields.text(), fields.text()
    return number, Schema(name, encoding, fields.bytes(fields.numbers("I")[0]))


def read_channel(data: bytes) -> tuple[int, Channel]:
    """Number and content of a Channel record."""
    fields = Fields(data)
    number, schema = fields.numbers("HH")
    topic, encoding = fields.text(), fields.text()
    fields.bytes(fields.numbers("I")[0])
    return number, Channel(topic, encoding, schema)


def read_chunk_head(data: bytes, length: int) -> tuple[ChunkHead, int]:
    """Head of a Chunk record of ``length`` bytes, and its size.

    Raises
    ------
    DamageError
        If the lengths do not fit together.
    """
    fields = Fields(data)
    start, end, size, crc = fields.numbers("QQQI")
    compression = fields.text()
    (packed,) = fields.numbers("Q")
    if packed != length - fields.place:
        raise DamageError("the lengths of a chunk do not fit together")
    if size > MAX_CHUNK:
        raise DamageError(f"a chunk claims {size} bytes")
    if compression not in ("", "zstd", "lz4"):
        raise DamageError(f"found the compression {compression[:20]!r}, expected zstd, lz4 or none")
    return ChunkHead(start, end, size, crc, compression, packed), fields.place


def unpack(data: bytes, head: ChunkHead, whole: bool = True) -> bytes:
    """Unpacked bytes of a chunk; if not ``whole``, those that the beginning of a chunk gives.

    Raises
    ------
    DamageError
        If they cannot be unpacked, or are not as many as the head says.
    """
    if head.compression == "":
        out = data
    else:
        try:
            out = _unpack_zstd(data, head.size) if head.compression == "zstd" else _unpack_lz4(data, head.size)
        except (ValueError, RuntimeError, EOFError, MemoryError) as error:
            raise DamageError(f"a chunk cannot be unpacked ({' '.join(str(error).split())[:80]})") from error
    if len(out) > head.size or (whole and len(out) != head.size):
        raise DamageError(f"a chunk has {len(out)} bytes, its head says {head.size}")
    return out


def _unpack_zstd(data: bytes, size: int) -> bytes:
    import zstandard

    # A frame that asks for a window of more than 2^27 bytes is refused by zstd's own default.
    reader = zstandard.ZstdDecompressor().stream_reader(data, read_across_frames=True)
    pieces, wanted = [], size + 1
    try:
        while wanted > 0 and (piece := reader.read(min(wanted, _PIECE))):
            pieces.append(piece)
            wanted -= len(piece)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error
    return b"".join(pieces)


def _unpack_lz4(data: bytes, size: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    unpacker = LZ4FrameDecompressor()
    pieces, wanted = [unpacker.decompress(data, max_length=min(size + 1, _PIECE))], size + 1
    wanted -= len(pieces[-1])
    while wanted > 0 and pieces[-1] and not unpacker.eof:
        pieces.append(unpacker.decompress(b"", max_length=min(wanted, _PIECE)))
        wanted -= len(pieces[-1])
    return b"".join(pieces)


class BlockBuilder:
    """Collects where messages lie in a piece of memory."""

    def __init__(self) -> None:
        self._rows: list[tuple[int, int, int, int]] = []
        self._tables: list[NDArray[np.int64]] = []  # of what came before the rows

    def add(self, data: bytes, place: int, length: int, base: int = 0) -> None:
        """Take the Message record at ``place``; the memory begins ``base`` bytes before ``data``."""
        if length < MESSAGE_HEAD.size:
            raise DamageError("a message is too short")
        channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(data, place)
        if log_time >= 2**63:
            raise DamageError("a log time is out of range")
        self._rows.append((channel, base + place + MESSAGE_HEAD.size, length - MESSAGE_HEAD.size, log_time))

    def add_alike(self, data: bytes, place: int, length: int) -> int:
        """Take the Message record at ``place`` and those behind it of the same length; returns the place behind them.

        A topic of joint states fills whole chunks with such records, so they are compared and taken many at a time.
        """
        self.add(data, place, length)
        head, size, count = data[place - HEAD.size : place], HEAD.size + length, 1
        place += length
        while data[place : place + HEAD.size] == head and (most := (len(data) - place) // size) > 0:
            count = min(2 * count, _MOST_ALIKE, most)  # doubled, so that few are looked at in vain
            records = np.frombuffer(data, np.uint8, count * size, place).reshape(count, size)
            alike = (records[:, : HEAD.size] == records[0, : HEAD.size]).all(axis=1)
            found = count if alike.all() else int(np.argmin(alike))
            heads = records[:found, HEAD.size : HEAD.size + MESSAGE_HEAD.size].copy().view(_HEAD_TYPE)[:, 0]
            if np.any(heads["log"] >= 2**63):
                return self._add_until_damage(data, place, length)
            table = np.empty((found, 4), dtype=np.int64)
            table[:, 0], table[:, 2], table[:, 3] = heads["channel"], length - MESSAGE_HEAD.size, heads["log"]
            table[:, 1] = place + HEAD.size + MESSAGE_HEAD.size + size * np.arange(found)
            self._close_rows()
            self._tables.append(table)
            place += found * size
        return place

    def _add_until_damage(self, data: bytes, place: int, length: int) -> int:
        """Take records one by one; one of them raises an error."""
        while True:
            self.add(data, place + HEAD.size, length)
            place += HEAD.size + length

    def _close_rows(self) -> None:
        if self._rows:
            self._tables.append(np.array(self._rows, dtype=np.int64))
            self._rows = []

    def build(self, data: bytes) -> Block:
        """Messages in ``data`` that were added."""
        self._close_rows()
        table = np.concatenate([np.empty((0, 4), dtype=np.int64), *self._tables])
        return Block(data, *(np.ascontiguousarray(column) for column in table.T))
