"""MCAP files as rosbag2 writes them: ROS 2 messages in CDR, chunks packed with zstd, indexes, checksums.

Records of messages are made by columns, a chunk at a time, so that memory does not grow with their number beyond that
of the values, or of one piece of them. The same input gives the same bytes.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import numpy as np

from modrob_cli import __version__
from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import OutputError, ShapeError
from modrob_cli.io.cdr_layout import MessageLayout, Stamps, split_rows

_MAGIC = b"\x89MCAP0\r\n"
_CHUNK_BYTES = 2**20
_MESSAGE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
)
"""What stands before the data of a message; the opcode and the length of the record do not count into the length."""


@dataclass(frozen=True)
class Series:
    """Messages of one topic.

    Attributes
    ----------
    stamps : times that do not decrease, shape (N,), [ns]; they become header stamp, log time and publish time
    values : numbers in the order of the layout, shape (N, layout.width)
    """

    topic: str
    layout: MessageLayout
    stamps: Stamps
    values: Array

    def __post_init__(self) -> None:
        """Check what the layout does not.

        Raises
        ------
        ShapeError
            If the shapes do not fit or the stamps decrease.
        """
        if self.values.shape != (len(self.stamps), self.layout.width):
            raise ShapeError(f"{self.topic}: {len(self.stamps)} stamps for values of shape {self.values.shape}")
        if np.any(np.diff(self.stamps) < 0):
            raise ShapeError(f"{self.topic}: the stamps decrease")

    def records(self, channel: int, first: int, last: int, sent: int = 0) -> list[bytes]:
        """Records of the messages first .. last - 1; ``sent`` messages of the topic went before this series."""
        if first == last:
            return []
        span = slice(first, last)
        data = self.layout.rows(self.stamps[span], self.values[span])
        head = np.empty((last - first, 1), dtype=_MESSAGE)
        head["opcode"], head["channel"] = 0x05, channel
        head["length"] = _MESSAGE.itemsize - 9 + data.shape[1]
        head["sequence"][:, 0] = np.arange(sent + first, sent + last)
        head["log"][:, 0] = head["publish"][:, 0] = self.stamps[span]
        return split_rows(np.hstack([head.view(np.uint8), data]))


def write_mcap(path: Path, series: Sequence[Series], metadata: Mapping[str, Mapping[str, str]] | None = None) -> None:
    """Write messages, merged in the order of their times; at the same time in the order of ``series``.

    Parameters
    ----------
    series : one for each topic
    metadata : texts by name of the record and key, for MCAP Metadata records

    Raises
    ------
    ShapeError
        If two series have one topic.
    NumericalError
        If a stamp is out of range.
    OutputError
        If the file cannot be written.
    """
    try:
        with McapWriter(path, [(one.topic, one.layout) for one in series], metadata) as writer:
            writer.add(series)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error


class McapWriter:
    """A file that is written piece by piece; a context manager. Errors of the disk are raised as they are.

    Parameters
    ----------
    topics : topic and layout of each series, in the order in which the pieces have them
    metadata : as for :func:`write_mcap`

    Raises
    ------
    ShapeError
        If two series have one topic.
    """

    def __init__(
        self,
        path: Path,
        topics: Sequence[tuple[str, MessageLayout]],
        metadata: Mapping[str, Mapping[str, str]] | None = None,
    ) -> None:
        if len({topic for topic, _ in topics}) != len(topics):
            raise ShapeError("expected one series for each topic")
        self._path, self._topics, self._metadata = path, topics, metadata or {}

    def __enter__(self) -> Self:
        """Open the file."""
        stream = self._path.open("wb")
        try:
            self._file = _File(stream, self._topics)
        except BaseException:
            stream.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the summary, unless there was an error, and close the file."""
        with self._file.stream:
            if kind is None:
                self._file.finish(self._metadata)

    def add(self, series: Sequence[Series]) -> None:
        """Write the next messages, merged in the order of their times; none may be before those of an earlier piece.

        Raises
        ------
        ShapeError
            If the topics are others, or times go back.
        NumericalError
            If a stamp is out of range.
        """
        self._file.add(series)


class _File:
    """A file that is being written."""

    def __init__(self, stream: BinaryIO, topics: Sequence[tuple[str, MessageLayout]]) -> None:
        from mcap.records import Channel, Header, Schema

        self.stream = stream
        self._topics = [topic for topic, _ in topics]
        self._sent = [0] * len(topics)
        self._first: int | None = None
        self._last = 0
        self._chunks: list[Any] = []
        kinds = {layout.type_name: layout.definition for _, layout in topics}
        ids = {name: k for k, name in enumerate(kinds, start=1)}
        self._schemas = [
            Schema(id=ids[name], name=name, encoding="ros2msg", data=kinds[name].encode()) for name in kinds
        ]
        self._channels = [
            Channel(
                id=k, topic=topic, message_encoding="cdr", metadata={"offered_qos_profiles": ""},
                schema_id=ids[layout.type_name],
            )
            for k, (topic, layout) in enumerate(topics, start=1)
        ]  # fmt: skip
        stream.write(_MAGIC)
        for record in (Header(profile="ros2", library=f"modrob {__version__}"), *self._schemas, *self._channels):
            self._put(record)

    def add(self, series: Sequence[Series]) -> None:
        if [one.topic for one in series] != self._topics:
            raise ShapeError(f"expected series of the topics {', '.join(self._topics)}")
        ends = [int(one.stamps[k]) for one in series if len(one.stamps) for k in (0, -1)]
        if not ends:
            return
        if self._first is not None and min(ends) < self._last:
            raise ShapeError("a piece begins before the one before it ends")
        self._chunks += [self._put_chunk(series, spans) for spans in _chunks(series)]
        self._first = min(ends) if self._first is None else self._first
        self._last = max(ends)
        self._sent = [sent + len(one.stamps) for sent, one in zip(self._sent, series, strict=True)]

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        from mcap.records import DataEnd, Metadata, MetadataIndex, Statistics

        places = []
        for name, texts in metadata.items():
            offset, length = self._put(Metadata(name=name, metadata=dict(texts)))
            places.append(MetadataIndex(offset=offset, length=length, name=name))
        self._put(DataEnd(data_section_crc=0))
        counts = {k: sent for k, sent in enumerate(self._sent, start=1) if sent}
        statistics = Statistics(
            message_count=sum(counts.values()), channel_message_counts=counts, schema_count=len(self._schemas),
            channel_count=len(self._channels), chunk_count=len(self._chunks), metadata_count=len(places),
            attachment_count=0, message_start_time=self._first or 0, message_end_time=self._last,
        )  # fmt: skip
        self._finish([self._schemas, self._channels, [statistics], self._chunks, places])

    def _put(self, record: Any) -> tuple[int, int]:
        """Write a record; returns its place and length."""
        offset, raw = self.stream.tell(), _bytes_of(record)
        self.stream.write(raw)
        return offset, len(raw)

    def _put_chunk(self, series: Sequence[Series], spans: Sequence[tuple[int, int]]) -> Any:
        """Write the messages of these spans of the series and their indexes; returns the index of the chunk."""
        import zstandard
        from mcap.records import Chunk, ChunkIndex

        whole = zip(series, spans, self._sent, strict=True)
        parts = [one.records(k, *span, sent) for k, (one, span, sent) in enumerate(whole, start=1)]
        stamps = [one.stamps[first:last] for one, (first, last) in zip(series, spans, strict=True)]
        records = [record for part in parts for record in part]
        order = np.argsort(np.concatenate(stamps), kind="stable")
        raw = b"".join([records[k] for k in order.tolist()])
        packed = zstandard.ZstdCompressor(level=1).compress(raw)
        start, end = (int(times) for times in np.concatenate(stamps)[order[[0, -1]]])
        chunk = Chunk(
            compression="zstd", data=packed, message_start_time=start, message_end_time=end,
            uncompressed_crc=zlib.crc32(raw), uncompressed_size=len(raw),
        )  # fmt: skip
        offset, length = self._put(chunk)
        places, index_start = {}, self.stream.tell()
        for channel, index in _message_indexes(stamps, [len(part[0]) if part else 0 for part in parts], order):
            places[channel] = self.stream.tell()
            self.stream.write(index)
        return ChunkIndex(
            chunk_length=length, chunk_start_offset=offset, compression="zstd", compressed_size=len(packed),
            message_end_time=end, message_start_time=start, uncompressed_size=len(raw),
            message_index_length=self.stream.tell() - index_start, message_index_offsets=places,
        )  # fmt: skip

    def _finish(self, groups: Sequence[Sequence[Any]]) -> None:
        """Write the summary, its offsets, and the footer."""
        from mcap.records import Footer, SummaryOffset

        start = self.stream.tell()
        summary, offsets = b"", b""
        for group in (group for group in groups if group):
            raw = b"".join(_bytes_of(record) for record in group)
            place = start + len(summary)
            offsets += _bytes_of(SummaryOffset(group_opcode=raw[0], group_start=place, group_length=len(raw)))
            summary += raw
        offset_start = start + len(summary)
        head = struct.pack("<BQQQ", 0x02, 20, start, offset_start)  # of the footer, which the checksum covers too
        crc = zlib.crc32(summary + offsets + head)
        self.stream.write(summary + offsets)
        self._put(Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc))
        self.stream.write(_MAGIC)


def _bytes_of(record: Any) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def _chunks(series: Sequence[Series]) -> Iterator[list[tuple[int, int]]]:
    """First and last + 1 message of each series, chunk by chunk, so that times never go back between chunks."""
    if not any(len(one.stamps) for one in series):
        return
    owner = np.concatenate([np.full(len(one.stamps), k) for k, one in enumerate(series)])
    order = np.argsort(np.concatenate([one.stamps for one in series]), kind="stable")
    owner = owner[order]
    sizes = np.array([one.layout.size + _MESSAGE.itemsize for one in series])[owner]
    chunk = np.cumsum(sizes) // _CHUNK_BYTES
    edges = np.flatnonzero(np.diff(chunk, prepend=-1, append=chunk[-1] + 1))
    done = np.zeros(len(series), dtype=np.intp)
    for first, last in zip(edges[:-1], edges[1:], strict=True):
        after = done + np.bincount(owner[first:last], minlength=len(series))
        yield list(zip(done.tolist(), after.tolist(), strict=True))
        done = after


def _message_indexes(stamps: Sequence[Stamps], sizes: Sequence[int], order: Indices) -> Iterator[tuple[int, bytes]]:
    """Channel and MessageIndex record of each series that has messages in a chunk: pairs of time and place."""
    owner = np.concatenate([np.full(len(times), k) for k, times in enumerate(stamps)])[order]
    ends = np.cumsum(np.array(sizes)[owner])
    places = ends - np.array(sizes)[owner]
    for k, times in enumerate(stamps):
        if len(times):
            pairs = np.stack([times, places[owner == k]], axis=1).astype("<u8").tobytes()
            yield k + 1, struct.pack("<BQHI", 0x07, len(pairs) + 6, k + 1, len(pairs)) + pairs
