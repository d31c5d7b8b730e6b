"""Logs in: ROS 2 ``sensor_msgs/msg/JointState`` from MCAP files.

Times are the header stamps, counted from the first sample. Joints are found by name in every message. A message
whose stamp repeats that of the one before is left out and counted; a stamp that goes back is an error.
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.cdr import JointState, JointStateDecoder
from modrob_cli.model.log import JointLog

JOINT_STATE = "sensor_msgs/msg/JointState"
MAGIC = b"\x89MCAP0\r\n"
MAX_CHUNK = 2**30
"""A chunk that claims to be larger than this when unpacked is taken for damaged."""


def read_joint_log(path: Path, joint_names: Sequence[str] | None = None, topic: str | None = None) -> JointLog:
    """Read the joint states of one topic.

    Parameters
    ----------
    path : MCAP file; chunks may be compressed (zstd, lz4)
    joint_names : joints that are wanted, in this order; others are ignored. None: those of the first message.
    topic : which topic; may be left out if only one carries joint states

    Raises
    ------
    InputFileError
        If the file cannot be read, is no MCAP or damaged; has no such topic or several; lacks joints, positions or
        efforts; or its stamps go back.
    """
    _check_path(path)
    messages = list(_joint_states(path, topic))
    wanted = tuple(joint_names) if joint_names is not None else messages[0].names
    return _Assembler(path, wanted).assemble(messages)


def _check_path(path: Path) -> None:
    if path.is_dir():
        raise InputFileError(Fault(str(path), "found a folder, expected an MCAP file; name the .mcap file inside it"))
    if not path.is_file():
        what = "is not a regular file" if path.exists() else "file not found"
        raise InputFileError(Fault(str(path), f"{what}; check the path"))


def _joint_states(path: Path, topic: str | None) -> Iterator[JointState]:
    """Messages of the topic, in the order of the file."""
    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    decoders: dict[int, JointStateDecoder] = {}
    raw: list[tuple[int, bytes]] = []
    for record in _records(path):
        kind = type(record).__name__
        if kind == "Schema":
            schemas[record.id] = record
        elif kind == "Channel":
            channels[record.id] = record
            schema = schemas.get(record.schema_id)
            if record.message_encoding == "cdr" and schema is not None and schema.name == JOINT_STATE:
                decoders[record.id] = JointStateDecoder()
        elif record.channel_id in decoders and topic in (None, channels[record.channel_id].topic):
            raw.append((record.channel_id, record.data))
    used = {channel for channel, _ in raw}
    _check_topics(path, topic, channels, schemas, set(decoders), used)
    for index, (channel, data) in enumerate(raw, start=1):
        try:
            yield decoders[channel].decode(data)
        except ValueError as error:
            message = f"message {index} of {channels[channel].topic} is not a {JOINT_STATE}: {error}"
            raise InputFileError(Fault(str(path), message)) from error


def _check_topics(
    path: Path, topic: str | None, channels: dict[int, Any], schemas: dict[int, Any], known: set[int], used: set[int]
) -> None:
    topics = sorted({channels[channel].topic for channel in known})
    if topic is None and len({channels[channel].topic for channel in used}) > 1:
        message = f"found several topics with joint states: {', '.join(topics)}; choose one with --topic"
        raise InputFileError(Fault(str(path), message))
    if used:
        return
    if topic in topics or (topic is None and topics):
        found = f"the topic {topic or ', '.join(topics)} has no messages"
    elif topics:
        found = f"found no topic {topic}, joint states are on {', '.join(topics)}"
    else:
        kinds = {f"{item.topic} ({_schema_name(item, schemas)}, {item.message_encoding})" for item in channels.values()}
        found = f"found no topic of type {JOINT_STATE} (cdr), only: {', '.join(sorted(kinds)) or 'nothing'}"
    raise InputFileError(Fault(str(path), found))


def _schema_name(channel: Any, schemas: dict[int, Any]) -> str:
    return schemas[channel.schema_id].name if channel.schema_id in schemas else "no schema"


def _records(path: Path) -> Iterator[Any]:
    """Schemas, channels and messages of the file, checksums verified.

    Raises
    ------
    InputFileError
        If anything in the file is damaged.
    """
    import zstandard
    from mcap.exceptions import EndOfFile, McapError

    try:
        with path.open("rb") as stream:
            start = stream.read(len(MAGIC))
            if start != MAGIC:
                what = "an empty file" if not start else "something else"
                raise InputFileError(Fault(str(path), f"found {what}, expected an MCAP file"))
            stream.seek(0)
            yield from _stream_records(stream, path.stat().st_size)
    except EndOfFile as error:
        raise _damaged(path, "it ends in the middle") from error
    except OSError as error:
        raise InputFileError(Fault(str(path), f"cannot be read: {error.strerror or error}")) from error
    except (McapError, zstandard.ZstdError, struct.error, ValueError, RuntimeError, KeyError, MemoryError) as error:
        raise _damaged(path, " ".join(str(error).split())[:200] or type(error).__name__) from error


def _damaged(path: Path, reason: str) -> InputFileError:
    message = f"the MCAP file is damaged: {reason}; record it again, or repair it with 'mcap recover'"
    return InputFileError(Fault(str(path), message))


def _stream_records(stream: BinaryIO, size: int) -> Iterator[Any]:
    from mcap.records import Channel, Chunk, DataEnd, Message, Schema, Statistics
    from mcap.stream_reader import StreamReader, breakup_chunk

    # No record can be longer than the file: a damaged length must not ask for gigabytes.
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=size)
    in_data, count = True, 0
    for record in reader.records:
        if isinstance(record, Chunk):
            if record.uncompressed_size > MAX_CHUNK:
                raise ValueError(f"a chunk claims {record.uncompressed_size} bytes")
            inside = breakup_chunk(record, validate_crc=True)
            count += sum(isinstance(item, Message) for item in inside)
            yield from inside
        elif isinstance(record, DataEnd):
            in_data = False
        elif isinstance(record, Statistics) and record.message_count != count:
            # A damaged record may be skipped like one of an unknown kind; the count of the summary tells.
            raise ValueError(f"found {count} messages, its summary says {record.message_count}")
        elif in_data and isinstance(record, Schema | Channel | Message):
            count += isinstance(record, Message)
            yield record


class _Assembler:
    """Turns messages into a log; every error names the file."""

    def __init__(self, path: Path, wanted: tuple[str, ...]) -> None:
        self.path = path
        self.wanted = wanted
        self._columns: dict[tuple[str, ...], list[int] | None] = {}

    def _error(self, message: str) -> InputFileError:
        return InputFileError(Fault(str(self.path), message))

    def assemble(self, messages: list[JointState]) -> JointLog:
        """Order the joints, check the values, drop repeated stamps."""
        used = [message for message in messages if self._find(message.names) is not None]
        if not used:
            self._raise_missing({name for message in messages for name in message.names})
        stamps = np.array([message.stamp for message in used], dtype=np.int64)
        steps = np.diff(stamps)
        if np.any(steps < 0):
            k = int(np.argmax(steps < 0))
            message = f"time goes back by {-steps[k] / 1e9:.6g} s after message {k + 1}"
            raise self._error(f"{message}; is more than one publisher on the topic? Cut or sort the log")
        keep = np.concatenate([[True], steps > 0])
        if keep.sum() < 2:
            raise self._error(f"all {len(used)} messages have the same header stamp; a log needs times that advance")
        kept = [message for message, wanted in zip(used, keep, strict=True) if wanted]
        q = self._required("position", kept)
        effort = self._required("effort", kept)
        t = (stamps[keep] - stamps[0]) / 1e9
        repeated = int(np.count_nonzero(~keep))
        dq, _ = self._values("velocity", kept)
        return JointLog(self.path.stem, self.wanted, t, q, dq, effort, repeated)

    def _find(self, names: tuple[str, ...]) -> list[int] | None:
        """Columns of the wanted joints in a message; None for a message about other joints only."""
        if names not in self._columns:
            place = {name: index for index, name in enumerate(names)}
            if len(place) != len(names):
                raise self._error(f"a message names a joint twice: {', '.join(names)}")
            found = [name for name in self.wanted if name in place]
            if found and len(found) < len(self.wanted):
                self._raise_missing(set(names))
            self._columns[names] = [place[name] for name in found] if found else None
        return self._columns[names]

    def _raise_missing(self, found: set[str]) -> NoReturn:
        missing = ", ".join(name for name in self.wanted if name not in found)
        raise self._error(
            f"joints of the robot are not in the log: {missing}; the robot has {', '.join(self.wanted)}; the log has "
            f"{', '.join(sorted(found)) or 'none'}; give both the same names (joint_names: in an assembly renames them)"
        )

    def _values(self, field: str, messages: list[JointState]) -> tuple[Array | None, str]:
        """Values of the wanted joints, (N, n); or None and the first reason why they cannot be used."""
        rows = []
        for index, message in enumerate(messages, start=1):
            values = getattr(message, field)
            if len(values) != len(message.names):
                found = f"{len(values)} values for {len(message.names)} joints"
                return None, f"{field} in message {index}: found {found}, expected one for each joint"
            rows.append(values[self._find(message.names)])
        out = np.array(rows, dtype=float)
        bad = np.argwhere(~np.isfinite(out))
        if len(bad):
            k, joint = bad[0]
            found = f"found {out[k, joint]} for {self.wanted[joint]}, expected a finite number"
            return None, f"{field} in message {k + 1}: {found} ({len(bad)} such values)"
        return out, ""

    def _required(self, field: str, messages: list[JointState]) -> Array:
        values, reason = self._values(field, messages)
        if values is None:
            raise self._error(reason)
        return values
