"""Logs of any length: their samples lie in a temporary file and are read piece by piece."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.io.joint_places import READERS
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_reader import LongReader
from modrob_cli.io.long_store import SampleStore, row_type
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.io.mcap_records import McapFile
from modrob_cli.io.mcap_summary import Summary, read_summary
from modrob_cli.model.log import JointLog

LONG = 150_000
"""Samples from which on a log is long: read whole it would take more than half a gigabyte, and more time."""

LONG_BYTES = 2**24
"""Bytes from which on a file is long that does not tell how many messages it has."""

WINDOW = 2**16
"""Messages that are put in order at once."""


@dataclass
class LongLog:
    """A log whose samples are in a temporary file; a context manager, which gives the file up.

    Attributes
    ----------
    name : where it comes from, for reports
    joint_names : n names
    count : samples
    start : stamp of the first sample, [ns]
    duration : time of the last sample after the first one, [s]
    has_velocity : whether velocities were recorded
    largest : largest absolute position, velocity (NaN if there are none) and effort, shape (3,)
    repeated, notes : as those of :class:`JointLog`
    """

    name: str
    joint_names: tuple[str, ...]
    count: int
    start: int
    duration: float
    has_velocity: bool
    largest: Array
    repeated: int
    notes: tuple[str, ...]
    _store: SampleStore

    @classmethod
    def of(cls, log: JointLog) -> "LongLog":
        """Put a log that is in memory into a file; its times are rounded to nanoseconds."""
        store = SampleStore(len(log.joint_names))
        rows = np.empty(len(log.t), dtype=row_type(store.n))
        rows["time"] = (log.start or 0) + np.rint(log.t * 1e9).astype(np.int64)
        rows["values"][:, 0], rows["values"][:, 2] = log.q, log.effort
        rows["values"][:, 1] = np.nan if log.dq is None else log.dq
        largest = np.abs(rows["values"]).max(axis=(0, 2))
        store.append(rows)
        return _long_log(log.name, log.joint_names, store, log.dq is not None, largest, log.repeated, log.notes)

    def piece(self, first: int, last: int) -> JointLog:
        """Samples first <= k < last, as far as they are there; ``t`` counts from the first sample of the whole log."""
        first, last = max(first, 0), min(last, self.count)
        last = max(first, last)
        q, dq, effort = self._store.values(first, last).transpose(1, 0, 2)
        velocity = dq if self.has_velocity else None
        times = self.times(first, last)
        return JointLog(self.name, self.joint_names, times, q, velocity, effort, start=self.start)

    def times(self, first: int, last: int) -> Array:
        """Times of these samples from the first one of the whole log, shape (N,), [s]."""
        first, last = max(first, 0), min(last, self.count)
        return np.asarray((self._store.times(first, max(first, last)) - self.start) / 1e9)

    def find(self, t: float) -> int:
        """Number of samples before the time t [s] after the first one."""
        low, high = 0, self.count
        while low < high:
            middle = (low + high) // 2
            low, high = (middle + 1, high) if self.times(middle, middle + 1)[0] < t else (low, middle)
        return low

    def __enter__(self) -> Self:
        """Nothing has to be done."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give up the temporary file."""
        self._store.close()


def open_long_log(
    path: Path,
    joint_names: Sequence[str],
    options: LogOptions,
    window: int = WINDOW,
    file: McapFile | None = None,
) -> LongLog:
    """Read a log of any length; parameters and errors as those of :func:`modrob_cli.io.mcap_reader.read_joint_log`.

    A CSV file, and one whose joints are spread over several messages, goes through memory as a whole.

    Parameters
    ----------
    window : messages that are put in order at once
    file : the file at ``path``, for those who look at its other topics in the same pass

    Raises
    ------
    InputFileError
        If the file cannot be read or is no log of the robot.
    OutputError
        If there is no room for the temporary file.
    """
    if path.suffix.lower() != ".csv":
        reader = LongReader(path, joint_names, options, window)
        reader.topics.file = file or reader.topics.file
        found = reader.read_long()
        if found is not None:
            series, notes = found
            known = (series.completeness.has_velocity, series.largest, series.order.repeated, tuple(notes))
            return _long_log(path.stem, series.names, series.store, *known)
    return LongLog.of(read_joint_log(path, joint_names, options=options))


def _long_log(
    name: str,
    joint_names: tuple[str, ...],
    store: SampleStore,
    has_velocity: bool,
    largest: Array,
    repeated: int,
    notes: tuple[str, ...],
) -> LongLog:
    start, end = (int(store.times(k, k + 1)[0]) for k in (0, store.count - 1))
    largest = np.where([True, has_velocity, True], largest, np.nan)
    duration = (end - start) / 1e9
    return LongLog(
        name, joint_names, store.count, start, duration, has_velocity, largest, repeated, notes, store
    )  # fmt: skip


def is_long(path: Path, samples: int = LONG, size: int = LONG_BYTES) -> bool:
    """Whether a log should be read piece by piece, by what the end of the file says of its messages.

    Parameters
    ----------
    samples : messages of one topic from which on a log is long
    size : bytes from which on it is long if the file does not tell
    """
    if path.suffix.lower() == ".csv" or not path.is_file():
        return False
    try:
        total = path.stat().st_size
        with path.open("rb") as stream:
            summary = read_summary(stream, total)
    except OSError:
        return False  # reading will say what is wrong
    return _messages(summary) >= samples if summary.has_counts else total >= size


def _messages(summary: Summary) -> int:
    """Messages of the longest topic that may be about joints."""
    counts: dict[str, int] = {}
    for number, channel in summary.channels.items():
        schema = summary.schemas.get(channel.schema)
        parts = schema.name.split("/") if schema is not None else [""]
        if channel.encoding in ("json", "protobuf") or f"{parts[0]}/{parts[-1]}" in READERS:
            counts[channel.topic] = counts.get(channel.topic, 0) + summary.counts[number]
    return max(counts.values(), default=0)
