"""What an MCAP log says beside joint states: desired motions of controllers, contacts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import Batch
from modrob_cli.io.joint_cdr import CdrDecoder
from modrob_cli.io.joint_places import JointPlaces, Tree, desired_state, external_torque, wrench
from modrob_cli.io.joint_reader import JointReader
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_chunks import Block
from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.io.mcap_records import McapFile
from modrob_cli.model.log import Recording, TimeSource

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


@dataclass(frozen=True)
class ContactSeries:
    """When a contact pushed: ``active`` at ``stamps``, shape (N,)."""

    name: str
    stamps: Stamps
    active: NDArray[np.bool_]


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
    file = _Watched(path)
    reader.topics.file = file
    recording = reader.read()
    return recording, _run_topics(file.found, options.joint_map, options.time)


class _Watched(McapFile):
    """An MCAP file whose messages of interest are decoded while somebody else reads it."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.found: dict[tuple[str, str], list[Batch]] = {}
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
                batches = decoder.decode(block, chosen, chosen)
                self.found.setdefault((channel.topic, decoder.name), []).extend(batches)


def _run_topics(
    batches: Mapping[tuple[str, str], Sequence[Batch]], renamed: Mapping[str, str], time: TimeSource
) -> RunTopics:
    desired, contacts, truth = [], [], []
    for (topic, kind), parts in sorted(batches.items()):
        series = _series(topic, parts, renamed, time)
        if series is None:
            continue
        if kind.endswith("ControllerState"):
            desired.append(series)
        elif kind.endswith("JointTruth"):
            truth.append(ContactSeries("truth", series.stamps, _pushes(series.values[2])))
        elif topic.startswith(CONTACTS):
            contacts.append(ContactSeries(topic[len(CONTACTS) :], series.stamps, _pushes(series.values[0])))
    found = contacts or [one for one in truth if one.active.any()]
    return RunTopics(tuple(desired), tuple(found), bool(contacts or truth))


def _pushes(values: Array) -> NDArray[np.bool_]:
    return np.asarray((np.nan_to_num(values) != 0.0).any(axis=1))


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


def _series(topic: str, parts: Sequence[Batch], renamed: Mapping[str, str], time: TimeSource) -> TopicSeries | None:
    """Batches of the first source's joints, put together in the order of time."""
    if not parts:
        return None
    names = parts[0].source.names
    same = [part for part in parts if part.source.names == names]
    stamps = np.concatenate([part.stamps if time == "header" else part.log_times for part in same])
    values = np.concatenate([part.values for part in same], axis=1)
    order = np.argsort(stamps, kind="stable")
    keep = order[np.concatenate([[True], np.diff(stamps[order]) > 0])]
    return TopicSeries(topic, tuple(renamed.get(name, name) for name in names), stamps[keep], values[:, keep])
