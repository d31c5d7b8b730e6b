"""Joint states of one topic that go into a temporary file as they come."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import Batch, Source
from modrob_cli.io.joint_series import JointSeries
from modrob_cli.io.joint_topics import JointTopics
from modrob_cli.io.log_completeness import Completeness
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_jumps import PublisherCheck
from modrob_cli.io.long_order import TimeOrder
from modrob_cli.io.long_store import SampleStore, row_type

_Part = tuple[Source, Indices, Stamps, Array]


class LongSeries(JointSeries):
    """Collects a window of messages, puts it in order and writes it into a file.

    Parameters
    ----------
    topics : where the batches come from
    window : messages that are collected at least before they are put in order

    Attributes
    ----------
    spread : True if some source tells about a part of the joints only; nothing is collected from then on
    publishers, order, completeness : what was found out about the messages that count
    store : complete samples
    largest : largest absolute position, velocity and effort in the store, shape (3,); NaN where one is missing
    """

    def __init__(self, wanted: Sequence[str], options: LogOptions, topics: JointTopics, window: int) -> None:
        super().__init__(wanted, options.joint_map)
        self.names = tuple(wanted)
        self.options = options
        self.topics = topics
        self.window = window
        self.spread = False
        self.publishers = PublisherCheck(self.names)
        self.order = TimeOrder(len(self.names), options.time)
        self.completeness = Completeness(len(self.names))
        self.store = SampleStore(len(self.names))
        self.largest = np.zeros(3)
        self.used: dict[Source, int] = {}
        self._partial: set[Source] = set()
        self._buffer: list[_Part] = []
        self._buffered = 0
        self._block = 0

    def add(self, batch: Batch) -> None:
        """Take the next batch; those of one block of the file may come in any order."""
        if self.topics.seen != self._block:
            if self._buffered >= self.window:
                self._flush(last=False)
            self._block = self.topics.seen
        super().add(batch)

    def _store(self, source: Source, batch: Batch, values: Array) -> None:
        if self.spread:
            return
        stored = [name for name in source.names if name in self.names]
        times = batch.log_times if self.options.time == "log" else batch.stamps
        if not set(self.names) <= set(stored):
            self._partial.add(source)
            return
        if stored != list(self.names):
            values = values[:, :, [stored.index(name) for name in self.names]]
        self._buffer.append((source, batch.order, times, values))
        self._buffered += len(batch.order)

    def finish(self) -> None:
        """Take what was held back."""
        self._flush(last=True)

    def _flush(self, last: bool) -> None:
        """Put the messages of whole blocks in order and write those whose place is known."""
        buffer, self._buffer, self._buffered = self._buffer, [], 0
        chosen, numbers = self.options.publisher, self.numbers
        if any(chosen in (None, numbers[source]) for source in self._partial):
            self.spread = True
            self.store.close()
        if self.spread:
            return
        buffer = [part for part in buffer if chosen in (None, numbers[part[0]])]
        for part in buffer:
            self.used[part[0]] = self.used.get(part[0], 0) + len(part[1])
        rows, owner = self._in_file_order(buffer)
        if len(rows):
            channels = np.array([source.channel for source in self.used], dtype=np.intp)
            self.publishers.add(rows["values"][:, 0], owner, channels)
        rows = self.order.add(rows, last)
        values = rows["values"]
        good = self.completeness.add(values[:, 0], values[:, 1], values[:, 2])
        rows = rows if good.all() else rows[good]
        if len(rows):
            self.largest = np.maximum(self.largest, np.abs(rows["values"]).max(axis=(0, 2)))
            self.store.append(rows)

    def _in_file_order(self, parts: list[_Part]) -> tuple[NDArray[np.void], Indices]:
        """Rows in the order of the file, and the number of the source of each."""
        total = sum(len(order) for _, order, _, _ in parts)
        rows = np.empty(total, dtype=row_type(len(self.names)))
        owner, order = np.empty(total, dtype=np.intp), np.empty(total, dtype=np.intp)
        place = {source: k for k, source in enumerate(self.used)}
        done = 0
        for source, numbers, times, values in parts:
            span = slice(done, done + len(numbers))
            order[span], owner[span] = numbers, place[source]
            rows["time"][span] = times
            rows["values"][span] = values.transpose(1, 0, 2)
            done = span.stop
        if np.any(np.diff(order) < 0):
            sequence = np.argsort(order, kind="stable")
            rows, owner = rows[sequence], owner[sequence]
        return rows, owner

    def close(self) -> None:
        """Give up what was collected."""
        self.store.close()
        self._buffer, self._buffered = [], 0
