"""What an MCAP log says beside joint states: desired motions of controllers, contacts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import Batch
from modrob_cli.io.joint_cdr import CdrDecoder
from modrob_cli.io.joint_places import JointPlaces, Tree, desired_state, external_torque, wrench
from modrob_cli.io.joint_reader import JointReader
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_chunks import Block
from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.io.mcap_records import McapFile
from modrob_cli.model.log import Recording

CONTACTS = "/contacts/"
"""Wrenches on topics below this are contacts: they push where they are not zero."""

_READERS: dict[str, Callable[[Tree], JointPlaces]] = {
    "control_msgs/JointTrajectoryControllerState": desired_state,
    "geometry_msgs/WrenchStamped": wrench,
    "modrob_msgs/JointTruth": external_torque,
}


@dataclass(frozen=True)
class TopicSeries:
    """Messages of one topic in the order of their times; N of them.

    Attributes
    ----------
    stamps : shape (N,), [ns], strictly increasing
    values : three quantities, shape (3, N, n); NaN where there is none
    """

    topic: str
    names: tuple[str, ...]
    stamps: Stamps
    values: Array

    @property
    def count(self) -> int:
        """Number of messages."""
        return len(self.stamps)

    @property
    def finite(self) -> NDArray[np.bool_]:
        """Whether the third quantity of each joint was finite in all messages."""
        return np.asarray(np.isfinite(self.values[2]).all(axis=0))

    def times(self, first: int, last: int) -> Stamps:
        """Times of the messages first .. last - 1, [ns]."""
        return self.stamps[first:last]

    def around(self, start: int, end: int) -> tuple[Stamps, Array]:
        """Times and third quantities of the messages from start to end [ns], and of others on either side."""
        return self.stamps, self.values[2]


@dataclass(frozen=True)
class ContactSeries:
    """When a contact pushed: from the first message that says so to the first one that does not.

    ``windows``: start and end of each push, [ns].
    """

    name: str
    windows: tuple[tuple[int, int], ...]


class PushTimes:
    """Finds the windows of one contact, whose messages come piece by piece in the order of their times."""

    def __init__(self) -> None:
        self._windows: list[tuple[int, int]] = []
        self._start: int | None = None
        self._last: list[int] = []

    def add(self, stamps: Stamps, values: Array) -> None:
        """Take the next messages: it pushes where any of the values (N, n) is not zero."""
        pushing = np.asarray((np.nan_to_num(values) != 0.0).any(axis=1))
        edges = np.flatnonzero(np.diff(pushing, prepend=self._start is not None)).tolist()
        for k in edges:
            if self._start is None:
                self._start = int(stamps[k])
            else:
                self._windows.append((self._start, int(stamps[k])))
                self._start = None
        self._last = [*self._last, *stamps[-2:].tolist()][-2:]

    @property
    def windows(self) -> tuple[tuple[int, int], ...]:
        """All up to now; one that does not end lasts for one more step."""
        if self._start is None:
            return tuple(self._windows)
        return (*self._windows, (self._start, 2 * self._last[-1] - self._last[0]))


@dataclass(frozen=True)
class RunTopics:
    """What was found.

    Attributes
    ----------
    desired : one for each topic of a controller: positions, velocities and accelerations by the names of the log
    contacts : labelled contacts; of a simulation without such topics, one by the truth; empty if there are none
    labelled : True if the log tells about contacts at all, even that there were none
    """

    desired: tuple[TopicSeries, ...]
    contacts: tuple[ContactSeries, ...]
    labelled: bool


def read_run(path: Path, joint_names: Sequence[str], options: LogOptions) -> tuple[Recording, RunTopics]:
    """Read joint states and the other topics of one log in one pass; a CSV file has no others.

    What is damaged among the other topics is passed over.

    Raises
    ------
    InputFileError
        As :func:`modrob_cli.io.mcap_reader.read_recording`.
    """
    if path.suffix.lower() == ".csv":
        return read_recording(path, joint_names, options), RunTopics((), (), False)
    reader = JointReader(path, joint_names, options)
    found: dict[tuple[str, str], list[Batch]] = {}
    reader.topics.file = WatchedFile(path, lambda topic, kind, batch: found.setdefault((topic, kind), []).append(batch))
    recording = reader.read()
    return recording, _run_topics(found, options)


class WatchedFile(McapFile):
    """An MCAP file whose messages of interest are decoded while somebody else reads it.

    Parameters
    ----------
    take : is given each batch with its topic and its type
    """

    def __init__(self, path: Path, take: Callable[[str, str, Batch], None]) -> None:
        super().__init__(path)
        self._take = take
        self._decoders: dict[int, CdrDecoder | None] = {}

    def blocks(self) -> Iterator[Block]:
        """Messages in the order of the file; errors as those of :class:`McapFile`."""
        for block in super().blocks():
            self._watch(block)
            yield block

    def _watch(self, block: Block) -> None:
        for number in np.unique(block.channels).tolist():
            channel = self.channels.get(number)
            if channel is None:
                continue
            if number not in self._decoders:
                self._decoders[number] = _decoder(self, number)
            decoder = self._decoders[number]
            if decoder is not None:
                chosen = np.flatnonzero(block.channels == number)
                for batch in decoder.decode(block, chosen, chosen):
                    self._take(channel.topic, decoder.name, batch)


def role_of(topic: str, kind: str) -> Literal["desired", "truth", "contact"] | None:
    """What messages of a type on a topic tell; None for nothing."""
    if kind.endswith("ControllerState"):
        return "desired"
    if kind.endswith("JointTruth"):
        return "truth"
    return "contact" if topic.startswith(CONTACTS) else None


def told_contacts(pushes: Mapping[str, PushTimes], truth: PushTimes | None) -> tuple[ContactSeries, ...]:
    """Contacts by their topics, in the order of these; if there are none, one by the truth of a simulation."""
    if pushes or truth is None:
        return tuple(ContactSeries(topic[len(CONTACTS) :], pushes[topic].windows) for topic in sorted(pushes))
    return (ContactSeries("truth", truth.windows),) if truth.windows else ()


def _run_topics(batches: Mapping[tuple[str, str], Sequence[Batch]], options: LogOptions) -> RunTopics:
    desired: list[TopicSeries] = []
    pushes: dict[str, PushTimes] = {}
    truth: PushTimes | None = None
    for (topic, kind), parts in sorted(batches.items()):
        role = role_of(topic, kind)
        if role is None or not parts:
            continue
        series = _series(topic, parts, options)
        if role == "desired":
            desired.append(series)
        elif role == "truth":
            truth = PushTimes()
            truth.add(series.stamps, series.values[2])
        else:
            pushes[topic] = PushTimes()
            pushes[topic].add(series.stamps, series.values[0])
    return RunTopics(tuple(desired), told_contacts(pushes, truth), bool(pushes) or truth is not None)


def _decoder(file: McapFile, number: int) -> CdrDecoder | None:
    channel = file.channels[number]
    schema = file.schemas.get(channel.schema)
    if schema is None or channel.encoding != "cdr":
        return None
    parts = schema.name.split("/")
    reader = _READERS.get(f"{parts[0]}/{parts[-1]}")
    if reader is None:
        return None
    try:
        return CdrDecoder(number, schema, reader)
    except ValueError:
        return None


def _series(topic: str, parts: Sequence[Batch], options: LogOptions) -> TopicSeries:
    """Batches of the first source's joints, put together in the order of time."""
    names = parts[0].source.names
    same = [part for part in parts if part.source.names == names]
    stamps = np.concatenate([part.stamps if options.time == "header" else part.log_times for part in same])
    values = np.concatenate([part.values for part in same], axis=1)
    keep = in_order(stamps)
    return TopicSeries(topic, tuple(options.joint_map.get(name, name) for name in names), stamps[keep], values[:, keep])


def in_order(stamps: Stamps) -> Indices:
    """Messages in the order of their times, the first of each time."""
    order = np.argsort(stamps, kind="stable")
    return np.asarray(order[np.concatenate([[True], np.diff(stamps[order]) > 0])])
