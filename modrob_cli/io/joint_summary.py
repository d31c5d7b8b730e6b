"""What is in a log: topics, joints, times, ranges, damage; without keeping the values."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import NO_STAMP, Batch, Source
from modrob_cli.io.joint_topics import JointChannel, JointTopics
from modrob_cli.io.mcap_chunks import Schema

GAP = 3.0
"""Steps longer than this many usual steps are gaps."""
_LISTED = 10


@dataclass
class TimeSummary:
    """Times of the messages of a topic in the order of the file, [s]; None where too few are known.

    Attributes
    ----------
    start, end : since 1970, or since whatever the clock counts from
    step : usual (median) step
    gaps : start since the first time and length, of the first gaps;  gap_count : of all
    repeated, backward : steps of zero and of less;  worst_back : largest way back
    missing : messages without a time
    """

    start: float | None
    end: float | None
    step: float | None
    gaps: list[tuple[float, float]]
    gap_count: int
    repeated: int
    backward: int
    worst_back: float
    missing: int


def summarize_times(stamps: Stamps) -> TimeSummary:
    """Summarise times in the order of the file, shape (M,), [ns]."""
    known = stamps[stamps != NO_STAMP]
    missing = len(stamps) - len(known)
    if not len(known):
        return TimeSummary(None, None, None, [], 0, 0, 0, 0.0, missing)
    steps = np.diff(known)
    forward = steps[steps > 0]
    step = float(np.median(forward)) if len(forward) else None
    gaps = np.flatnonzero(steps > GAP * step) if step else np.empty(0, dtype=np.intp)
    listed = [((int(known[k]) - int(known[0])) / 1e9, int(steps[k]) / 1e9) for k in gaps[:_LISTED]]
    back = steps[steps < 0]
    return TimeSummary(
        start=int(known.min()) / 1e9,
        end=int(known.max()) / 1e9,
        step=None if step is None else step / 1e9,
        gaps=listed,
        gap_count=len(gaps),
        repeated=int(np.count_nonzero(steps == 0)),
        backward=len(back),
        worst_back=-int(back.min()) / 1e9 if len(back) else 0.0,
        missing=missing,
    )


@dataclass
class Range:
    """Smallest and largest value, and how many were missing, of the messages that name the joint."""

    least: float = np.inf
    most: float = -np.inf
    missing: int = 0

    def add(self, values: Array) -> None:
        """Take values (N,)."""
        finite = values[np.isfinite(values)]
        self.missing += len(values) - len(finite)
        if len(finite):
            self.least = min(self.least, float(finite.min()))
            self.most = max(self.most, float(finite.max()))


@dataclass
class JointTopicSummary:
    """What a topic says about joints.

    Attributes
    ----------
    rank : of two topics the one with the lower rank is read
    sources : number of messages of each publisher
    ranges : by joint, for position, velocity and effort
    """

    kind: str
    rank: int
    problem: str = ""
    sources: dict[Source, int] = field(default_factory=dict)
    ranges: dict[str, tuple[Range, Range, Range]] = field(default_factory=dict)
    undecoded: int = 0
    _first: dict[Source, int] = field(default_factory=dict)
    _parts: list[tuple[Stamps, Stamps, Stamps]] = field(default_factory=list)

    def add(self, batch: Batch) -> None:
        """Take the next messages."""
        self.sources[batch.source] = self.sources.get(batch.source, 0) + len(batch.order)
        self._first[batch.source] = min(int(batch.order[0]), self._first.get(batch.source, int(batch.order[0])))
        self._parts.append((batch.order, batch.stamps, batch.log_times))
        for j, name in enumerate(batch.source.names):
            ranges = self.ranges.setdefault(name, (Range(), Range(), Range()))
            for one, values in zip(ranges, batch.values[:, :, j], strict=True):
                one.add(values)

    def times(self) -> tuple[TimeSummary, TimeSummary]:
        """Summaries of header stamps and of log times."""
        parts = self._parts or [(np.empty(0, dtype=np.int64),) * 3]
        order, stamps, log_times = (np.concatenate(part) for part in zip(*parts, strict=True))
        rows = np.argsort(order, kind="stable")
        return summarize_times(stamps[rows]), summarize_times(log_times[rows])

    def publishers(self) -> list[tuple[Source, int]]:
        """Publishers and the number of their messages, in the order in which they begin."""
        return sorted(self.sources.items(), key=lambda pair: self._first[pair[0]])


@dataclass
class LogSummary:
    """What is in a file.

    Attributes
    ----------
    topics : type, encoding and number of messages of every topic
    joints : topics with joint states
    damage : sentences, and plain data
    unknown : messages of no topic that the file describes;  unchecked : messages without a checksum
    """

    topics: list[tuple[str, str, str, int]]
    joints: dict[str, JointTopicSummary]
    damage: tuple[list[str], dict[str, object]]
    unknown: int
    unchecked: int

    def candidates(self) -> list[str]:
        """Topics among which a reader chooses: one is read, of several one must be named."""
        ranks = {topic: one.rank for topic, one in self.joints.items() if one.sources}
        return sorted(topic for topic, rank in ranks.items() if rank == min(ranks.values()))


def summarize_mcap(path: Path) -> LogSummary:
    """Read a file once.

    Raises
    ------
    InputFileError
        If it cannot be read or is no MCAP file.
    """
    reader = JointTopics(path)
    joints: dict[str, JointTopicSummary] = {}
    for channel, batch in reader.batches(best_only=False):
        _of(joints, channel).add(batch)
    for channel in reader.channels.values():
        topic = _of(joints, channel)
        topic.problem = topic.problem or channel.problem
        topic.undecoded += channel.decoder.faults.count if channel.decoder is not None else 0
    file = reader.file
    counts: dict[tuple[str, str, str], int] = {}
    for number, channel_record in file.channels.items():
        schema = file.schemas.get(channel_record.schema, Schema("", "", b""))
        key = (channel_record.topic, schema.name, channel_record.encoding)
        counts[key] = counts.get(key, 0) + file.counts[number]
    topics = [(*key, count) for key, count in sorted(counts.items())]
    return LogSummary(topics, joints, (file.sentences(), file.damage.record()), reader.unknown, file.unchecked)


def _of(joints: dict[str, JointTopicSummary], channel: JointChannel) -> JointTopicSummary:
    return joints.setdefault(channel.topic, JointTopicSummary(channel.kind, channel.rank))
