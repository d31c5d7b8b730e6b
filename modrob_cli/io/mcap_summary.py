"""The summary at the end of an MCAP file: schemas, channels, places of the chunks, numbers of messages."""

import zlib
from collections import Counter
from dataclasses import dataclass, field
from typing import BinaryIO

from modrob_cli.io.mcap_chunks import HEAD, Channel, Fields, Opcode, Schema, read_channel, read_schema
from modrob_cli.io.mcap_damage import DamageError

MAGIC = b"\x89MCAP0\r\n"
_FOOTER = HEAD.size + 20
_LARGEST = 2**28
"""Bytes of a summary beyond which it is not used; about 50 bytes a chunk are usual."""


@dataclass
class Summary:
    """What the end of a file says about it.

    Attributes
    ----------
    cut : True if the file does not end as it should
    fault : what is wrong with it; "" if nothing is
    start : where the data ends, as far as known
    schemas, channels : by number
    chunks : places of the chunks, increasing
    counts, has_counts : messages by channel, and whether the file tells them
    """

    start: int
    cut: bool = False
    fault: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[int] = field(default_factory=list)
    counts: Counter[int] = field(default_factory=Counter)
    has_counts: bool = False


def read_summary(stream: BinaryIO, size: int) -> Summary:
    """Read the summary of a file of ``size`` bytes; what is not there or damaged is left empty."""
    place = max(size - _FOOTER - len(MAGIC), 0)
    stream.seek(place)
    tail = stream.read()
    if not tail.endswith(MAGIC) or size < _FOOTER + 2 * len(MAGIC):
        return Summary(size, cut=True)
    try:
        if HEAD.unpack_from(tail) != (Opcode.FOOTER, 20):
            raise DamageError("the footer is damaged")
        start, _, crc = Fields(tail[HEAD.size :]).numbers("QQI")
        if start == 0:
            return Summary(place)
        if not len(MAGIC) < start < place or place - start > _LARGEST:
            raise DamageError("the footer is damaged")
        stream.seek(start)
        data = stream.read(place - start)
        if crc and zlib.crc32(data + tail[: HEAD.size + 16]) != crc:
            raise DamageError("the summary is damaged")
        summary = Summary(start)
        _fill(summary, data)
    except DamageError as error:
        return Summary(place, fault=str(error))
    return summary


def _fill(summary: Summary, data: bytes) -> None:
    fields = Fields(data)
    while fields.place < len(data):
        opcode, length = fields.numbers("BQ")
        record = fields.bytes(length)
        if opcode == Opcode.SCHEMA:
            number, schema = read_schema(record)
            summary.schemas[number] = schema
        elif opcode == Opcode.CHANNEL:
            number, channel = read_channel(record)
            summary.channels[number] = channel
        elif opcode == Opcode.CHUNK_INDEX:
            summary.chunks.append(Fields(record).numbers("QQQ")[2])
        elif opcode == Opcode.STATISTICS:
            parts = Fields(record)
            *_, size = parts.numbers("QHIIIIQQI")
            pairs = Fields(parts.bytes(size))
            for _ in range(size // 10):
                channel_id, count = pairs.numbers("HQ")
                summary.counts[channel_id] = count
            summary.has_counts = True
    summary.chunks.sort()
