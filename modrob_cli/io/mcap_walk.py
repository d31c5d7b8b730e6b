"""One pass over an MCAP file, from its beginning to its end, one chunk at a time.

Where a record makes no sense, reading goes on at the next chunk that the index at the end of the file names. A chunk
whose checksum does not fit is left out as a whole, because nothing tells which of its bytes is wrong; of a chunk that
the end of the file cuts, the beginning is used.
"""

import zlib
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

from modrob_cli.io.mcap_chunks import (
    HEAD,
    PRIVATE,
    Block,
    BlockBuilder,
    Channel,
    ChunkHead,
    Fields,
    Opcode,
    Schema,
    read_channel,
    read_chunk_head,
    read_schema,
    unpack,
)
from modrob_cli.io.mcap_damage import Damage, DamageError, Loss
from modrob_cli.io.mcap_summary import MAGIC, Summary, read_summary

_PIECE = 2**20
_LONGEST = 2**28
"""Largest record outside of chunks that is loaded; larger ones are no joint states and are skipped."""
_UNPACKED = 2**20
"""Bytes of messages outside of chunks that make a block."""
_CHUNK_HEAD = 64
"""More than the head of a chunk has."""


@dataclass
class Findings:
    """What a pass found out.

    Attributes
    ----------
    schemas, channels : by number
    counts : messages that were read, by channel
    damage : what could not be read
    first_log_time : [ns]; None before the first message
    unchecked : messages that no checksum covers
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    counts: Counter[int] = field(default_factory=Counter)
    damage: Damage = field(default_factory=Damage)
    first_log_time: int | None = None
    unchecked: int = 0


class Walk:
    """One pass over a file."""

    def __init__(self, file: Findings, stream: BinaryIO, size: int) -> None:
        self.file = file
        self.stream = stream
        self.size = size
        self.place = len(MAGIC)
        self.summary: Summary = read_summary(stream, size)
        stream.seek(self.place)
        self._checked: int | None = zlib.crc32(MAGIC)  # of all bytes so far; None once some were jumped over
        self._data_fits = False  # whether the checksum of all data was there and right
        self._lost: Loss | None = None  # the chunk before, whose message indexes tell what it held
        self._tried = 0  # place of the last chunk that was read or tried
        self._plain = bytearray()  # messages outside of chunks
        self._builder = BlockBuilder()
        file.schemas |= self.summary.schemas
        file.channels |= self.summary.channels
        if self.summary.fault:
            file.damage.add(Loss(self.summary.start, 0, self.summary.fault))
        file.damage.cut = self.summary.cut

    def blocks(self) -> Iterator[Block]:
        """Messages in the order of the file, in pieces."""
        going = True
        while going:
            start = self.place
            try:
                block, going = self._record()
            except DamageError as error:
                block, going = None, self._jump(start, str(error))
            if self._plain and (len(self._plain) >= _UNPACKED or not going):
                yield self._count(self._plain_block())
            if block is not None:
                yield self._count(block)
        self._compare_counts()

    def _plain_block(self) -> Block:
        """Messages outside of chunks since the last call."""
        block = self._builder.build(bytes(self._plain))
        self.file.unchecked += 0 if self._data_fits else len(block.channels)
        self._plain, self._builder = bytearray(), BlockBuilder()
        return block

    def _count(self, block: Block) -> Block:
        self.file.counts.update(block.channels.tolist())
        if self.file.first_log_time is None and len(block.log_times):
            self.file.first_log_time = int(block.log_times.min())
        return block

    def _read(self, length: int) -> bytes:
        """Read the next bytes, fewer at the end of the file."""
        data = self.stream.read(length)
        self.place += len(data)
        if self._checked is not None:
            self._checked = zlib.crc32(data, self._checked)
        return data

    def _record(self) -> tuple[Block | None, bool]:
        """Messages of the next record, if it is a chunk; and whether there may be more."""
        start, checked = self.place, self._checked
        head = self._read(HEAD.size)
        if not head and self.file.damage.cut:
            return None, False
        if len(head) < HEAD.size:
            raise DamageError("a record ends with the file")
        opcode, length = HEAD.unpack(head)
        if opcode == Opcode.CHUNK:
            return self._chunk(start, length), True
        if length > self.size - self.place:
            what = "an index (which holds no messages)" if opcode == Opcode.MESSAGE_INDEX else "a record"
            raise DamageError(f"{what} runs past the end of the file")
        if opcode in (Opcode.DATA_END, Opcode.FOOTER):
            if self._next_chunk() is not None:
                raise DamageError("the data ends before its last chunk")
            if opcode == Opcode.DATA_END:
                self._check_data(start, self._read(length), checked)
            return None, False
        if opcode not in tuple(Opcode) and opcode < PRIVATE:
            raise DamageError("a record is of no known kind")
        try:
            self._small_record(opcode, length)
        except DamageError as error:
            self._lose(start, self.place - start, str(error))
        return None, True

    def _small_record(self, opcode: int, length: int) -> None:
        """Take a record of any other kind."""
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.MESSAGE_INDEX) and length <= _LONGEST:
            data = self._read(length)
            if opcode == Opcode.MESSAGE:
                self._builder.add(data, 0, length, len(self._plain))
                self._plain += data
            elif opcode == Opcode.MESSAGE_INDEX:
                self._add_index(data)
            else:
                self._define(opcode, data)
            return
        while length > 0:
            length -= len(self._read(min(length, _PIECE)))

    def _define(self, opcode: int, data: bytes) -> None:
        """Take a schema or a channel; the first of a number counts."""
        if opcode == Opcode.SCHEMA:
            number, schema = read_schema(data)
            self.file.schemas.setdefault(number, schema)
        else:
            number, channel = read_channel(data)
            self.file.channels.setdefault(number, channel)

    def _chunk(self, start: int, length: int) -> Block:
        begin = self.place
        front = self.stream.read(min(_CHUNK_HEAD, length))
        head, size = read_chunk_head(front, length)
        self.stream.seek(begin)
        self._read(size)
        cut = length - size > self.size - self.place
        if cut and not self.file.damage.cut:
            raise DamageError("a chunk runs past the end of the file")
        packed = self._read(min(head.packed, self.size - self.place))
        self._lost, self._tried = None, start
        try:
            data = unpack(packed, head, whole=not cut)
            if not cut and head.crc and zlib.crc32(data) != head.crc:
                raise DamageError("the checksum of a chunk does not fit")
        except DamageError as error:
            self._lost = self._lose(start, self.place - start, str(error), head)
            return BlockBuilder().build(b"")
        if cut:
            self._lose(start, 0, "the last chunk is cut; its beginning was read", head)
        block = self._split(data, start, cut)
        self.file.unchecked += 0 if head.crc and not cut else len(block.channels)
        return block

    def _lose(self, start: int, size: int, reason: str, head: ChunkHead | None = None) -> Loss:
        times = (None, None) if head is None else (head.start, head.end)
        return self.file.damage.add(Loss(start, size, reason, None, *times))

    def _split(self, data: bytes, start: int, cut: bool) -> Block:
        """Messages of an unpacked chunk; schemas and channels are taken on the way."""
        builder, place, end = BlockBuilder(), 0, len(data)
        try:
            while place < end:
                if end - place < HEAD.size:
                    raise DamageError("a record of a chunk is too long")
                opcode, length = HEAD.unpack_from(data, place)
                place += HEAD.size
                if length > end - place:
                    raise DamageError("a record of a chunk is too long")
                if opcode == Opcode.MESSAGE:
                    place = builder.add_alike(data, place, length)
                    continue
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._define(opcode, data[place : place + length])
                place += length
        except DamageError as error:
            if not cut:
                self._lose(start, end - place, str(error))
        return builder.build(data)

    def _add_index(self, data: bytes) -> None:
        """Count the messages that a lost chunk held."""
        if self._lost is not None:
            channel, size = Fields(data).numbers("HI")
            self._lost.messages = (self._lost.messages or 0) + size // 16
            self.summary.counts[channel] -= size // 16

    def _check_data(self, start: int, data: bytes, checked: int | None) -> None:
        (crc,) = Fields(data).numbers("I")
        if crc == 0 or checked is None:
            return
        if crc == checked:
            self._data_fits, self.file.unchecked = True, 0
        elif not self.file.damage:
            self._lose(start, 0, "the checksum of the data does not fit: some value may be wrong")

    def _jump(self, start: int, reason: str) -> bool:
        """Go on at the next chunk that the summary names, if there is one."""
        if self.file.damage.cut:
            # What cannot be read reaches to the end, which is missing anyway.
            self._lose(start, self.size - start, reason)
            return False
        after = self._next_chunk()
        self._lose(start, max((after or self.summary.start) - start, 0), reason)
        if after is None:
            return False
        self.place, self._tried, self._checked, self._lost = after, after, None, None
        self.stream.seek(after)
        return True

    def _next_chunk(self) -> int | None:
        """Place of the first chunk behind the last one tried, if the summary tells."""
        number = bisect_right(self.summary.chunks, self._tried)
        place = self.summary.chunks[number] if number < len(self.summary.chunks) else self.size
        return place if place < self.size else None

    def _compare_counts(self) -> None:
        """Messages that the summary counts but were neither read nor noted as lost."""
        if self.summary.has_counts:
            missing = self.summary.counts - self.file.counts  # keeps what is positive
            self.file.damage.missing = sum(missing.values())
