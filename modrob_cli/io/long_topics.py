"""What a long MCAP log says beside joint states, through temporary files instead of memory."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import Batch
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_log import WINDOW, LongLog, open_long_log
from modrob_cli.io.long_store import SampleStore, row_type
from modrob_cli.io.run_topics import ContactSeries, PushTimes, WatchedFile, in_order, role_of, told_contacts

LATE = 1_000_000_000
"""Messages that come so much later than a newer one, [ns], are passed over."""


class LongTopic:
    """Messages of one topic, put in the order of their times window by window.

    Attributes
    ----------
    names : of the joints, as the robot calls them
    count : messages in the file
    finite : whether all third quantities (accelerations, external torques) were finite
    """

    def __init__(self, topic: str, role: str, names: tuple[str, ...], window: int) -> None:
        self.topic, self.role, self.names = topic, role, names
        self.pushes = PushTimes()
        self.finite = np.ones(len(names), dtype=bool)
        self._store = SampleStore(len(names))
        self._parts: list[tuple[Stamps, Array]] = []
        self._buffered, self._window = 0, window
        self._newest: int | None = None

    def add(self, stamps: Stamps, values: Array) -> None:
        """Take messages (N,) with their three quantities, shape (3, N, n)."""
        self._parts.append((stamps, values))
        self._buffered += len(stamps)
        if self._buffered >= self._window:
            self.flush(last=False)

    def flush(self, last: bool) -> None:
        """Give out those that no other can come before."""
        if not self._parts:
            return
        stamps = np.concatenate([part[0] for part in self._parts])
        values = np.concatenate([part[1] for part in self._parts], axis=1)
        order = in_order(stamps)
        if self._newest is not None:
            order = order[stamps[order] > self._newest]
        ready = order if last else order[stamps[order] <= stamps.max() - LATE]
        held = order[len(ready) :]
        self._parts = [(stamps[held], values[:, held])]
        self._buffered = len(held)
        if len(ready):
            self._newest = int(stamps[ready[-1]])
            self._give(stamps[ready], values[:, ready])

    def _give(self, stamps: Stamps, values: Array) -> None:
        if self.role == "desired":
            rows = np.empty(len(stamps), dtype=row_type(len(self.names)))
            rows["time"], rows["values"] = stamps, values.transpose(1, 0, 2)
            self.finite &= np.isfinite(values[2]).all(axis=0)
            self._store.append(rows)
        else:
            self.pushes.add(stamps, values[2 if self.role == "truth" else 0])

    @property
    def count(self) -> int:
        """Messages that were given out."""
        return self._store.count

    def times(self, first: int, last: int) -> Stamps:
        """Times of the messages first .. last - 1, [ns]."""
        return self._store.times(first, last)

    def around(self, start: int, end: int) -> tuple[Stamps, Array]:
        """Times and third quantities (N, n) of the messages from start to end [ns] and one more on either side."""
        first, last = max(self._find(start) - 1, 0), min(self._find(end) + 1, self.count)
        return self._store.times(first, last), self._store.values(first, last)[:, 2]

    def _find(self, stamp: int) -> int:
        """Number of messages before a time."""
        low, high = 0, self.count
        while low < high:
            middle = (low + high) // 2
            low, high = (middle + 1, high) if self._store.times(middle, middle + 1)[0] < stamp else (low, middle)
        return low

    def close(self) -> None:
        """Give up the messages."""
        self._store.close()


@dataclass
class LongRun:
    """A long log and its other topics; a context manager, which gives the files up.

    Attributes
    ----------
    desired : one for each topic of a controller
    contacts, labelled : as those of :class:`modrob_cli.io.run_topics.RunTopics`
    """

    log: LongLog
    desired: tuple[LongTopic, ...]
    contacts: tuple[ContactSeries, ...]
    labelled: bool

    def __enter__(self) -> Self:
        """Nothing has to be done."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give up the temporary files."""
        with ExitStack() as stack:
            stack.push(self.log)
            for topic in self.desired:
                stack.callback(topic.close)


class _Topics:
    """Takes the messages of interest."""

    def __init__(self, options: LogOptions, window: int) -> None:
        self._options, self._window = options, window
        self._topics: dict[tuple[str, str], tuple[tuple[str, ...], LongTopic]] = {}

    def take(self, topic: str, kind: str, batch: Batch) -> None:
        role = role_of(topic, kind)
        if role is None:
            return
        names = batch.source.names
        if (topic, kind) not in self._topics:
            renamed = tuple(self._options.joint_map.get(name, name) for name in names)
            self._topics[topic, kind] = names, LongTopic(topic, role, renamed, self._window)
        first, series = self._topics[topic, kind]
        if names == first:
            series.add(batch.stamps if self._options.time == "header" else batch.log_times, batch.values)

    def finish(self) -> list[LongTopic]:
        found = [self._topics[key][1] for key in sorted(self._topics)]
        for series in found:
            series.flush(last=True)
        return found

    def close(self) -> None:
        for _, series in self._topics.values():
            series.close()


def open_long_run(path: Path, joint_names: Sequence[str], options: LogOptions, window: int = WINDOW) -> LongRun:
    """Read joint states and the other topics of a long log in one pass; what is damaged among those is passed over.

    Raises
    ------
    InputFileError
        As :func:`modrob_cli.io.long_log.open_long_log`.
    OutputError
        If there is no room for the temporary files.
    """
    topics = _Topics(options, window)
    try:
        log = open_long_log(path, joint_names, options, window, WatchedFile(path, topics.take))
        found = topics.finish()
    except BaseException:
        topics.close()
        raise
    pushes = {series.topic: series.pushes for series in found if series.role == "contact"}
    truths = [series.pushes for series in found if series.role == "truth"]
    truth = truths[-1] if truths else None
    desired = tuple(series for series in found if series.role == "desired")
    return LongRun(log, desired, told_contacts(pushes, truth), bool(pushes or truths))
