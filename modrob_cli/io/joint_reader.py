"""The joint states of one topic of an MCAP file.

``sensor_msgs/msg/JointState`` comes first; other types are used only where there is none, or where a topic is named.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.joint_assembly import Samples, assemble, put_in_order
from modrob_cli.io.joint_batch import Source
from modrob_cli.io.joint_publishers import conflict, describe
from modrob_cli.io.joint_series import JointSeries
from modrob_cli.io.joint_topics import ACCEPTED, JointTopics
from modrob_cli.io.log_options import LogOptions
from modrob_cli.model.log import Recording


class JointReader:
    """One pass over an MCAP file; every error names the file, and what is damaged in it."""

    def __init__(self, path: Path, wanted: Sequence[str] | None, options: LogOptions) -> None:
        self.path = path
        self.wanted = wanted
        self.options = options
        self.topics = JointTopics(path, options.topic)
        self._series: dict[str, JointSeries] = {}
        self._ranks: dict[str, int] = {}

    def read(self) -> Recording:
        """Read the file."""
        topic, names, losses = self._collect()
        series = self._series.pop(topic)
        try:
            table = series.table(names)
            contradiction = conflict(table)
            if contradiction and self.options.publisher is None:
                counts = np.bincount(table.owner, minlength=len(table.sources)).tolist()
                self._raise_publishers(contradiction, dict(zip(table.sources, counts, strict=True)), series.numbers)
            table, times, notes = put_in_order(table, self.options.time)
            samples = assemble(table, times)
        except ValueError as error:
            self._raise(str(error))
        return self._recording(topic, names, samples, [*losses, *self._ignored(series), *notes, *samples.notes])

    def _collect(self) -> tuple[str, tuple[str, ...], list[str]]:
        """Read the whole file into series; the topic, the joints and the losses that count."""
        for channel, batch in self.topics.batches(best_only=self.options.topic is None):
            if channel.topic not in self._series or channel.rank < self._ranks[channel.topic]:
                self._give_up(channel.topic)
                self._series[channel.topic] = self._new_series(channel.topic)
                self._ranks[channel.topic] = channel.rank
                self._forget(channel.rank)
            self._series[channel.topic].add(batch)
        topic = self._choose_topic()
        losses = self._losses(topic)
        if self.options.strict and losses:
            self._raise(f"--strict refuses a file that is damaged: {'; '.join(losses)}")
        self._choose_publisher(self._series[topic])
        return topic, self._names(self._series[topic], topic), losses

    def _new_series(self, topic: str) -> JointSeries:
        """Something that collects the batches of a topic."""
        return JointSeries(self.wanted, self.options.joint_map)

    def _give_up(self, topic: str) -> None:
        """Forget what was collected of a topic."""
        self._series.pop(topic, None)
        self._ranks.pop(topic, None)

    def _forget(self, rank: int) -> None:
        """Give up topics of higher ranks than one that has messages, unless the topic is named."""
        if self.options.topic is None:
            for topic in [topic for topic, other in self._ranks.items() if other > rank]:
                self._give_up(topic)

    def _losses(self, topic: str | None) -> list[str]:
        """What of the file, and of a topic (None: of any), cannot be used, for people."""
        out = [f"damaged: {text}" for text in self.topics.file.sentences()]
        for channel in self.topics.channels.values():
            if topic not in (None, channel.topic):
                continue
            if channel.problem:
                out.append(f"the topic {channel.topic} ({channel.kind}) cannot be decoded: {channel.problem}")
            faults = channel.decoder.faults if channel.decoder is not None else None
            if faults is not None and faults.count:
                found = f"{faults.count} messages of {channel.topic} could not be decoded and were left out"
                out.append(f"{found} (the first: {faults.reason})")
        if self.topics.unknown:
            out.append(f"{self.topics.unknown} messages belong to no topic that the file describes")
        return out

    def _choose_topic(self) -> str:
        if len(self._series) > 1:
            # Topics about other joints only, such as those of a gripper, are no choice.
            about = [topic for topic, series in self._series.items() if series.counts]
            if len(about) == 1:
                return about[0]
        if len(self._series) != 1:
            self._raise(self._why_no_topic())
        return next(iter(self._series))

    def _why_no_topic(self) -> str:
        """Why not exactly one topic can be read, and what to do."""
        if self._series:
            found = "; ".join(
                f"{topic} ({sum(series.counts.values()) + series.others} messages: {some(series.original)})"
                for topic, series in sorted(self._series.items())
            )
            return f"found several topics with joint states: {found}; choose one with --topic"
        known = sorted({channel.topic for channel in self.topics.channels.values()})
        topic = self.options.topic
        if topic in known or (topic is None and known):
            return f"the topic {topic or ', '.join(known)} has no messages that can be read"
        if known:
            return f"found no topic {topic}, joint states are on {', '.join(known)}"
        schemas = self.topics.file.schemas
        kinds = {
            f"{channel.topic} ({schemas[channel.schema].name if channel.schema in schemas else 'no type'}, "
            f"{channel.encoding})"
            for channel in self.topics.file.channels.values()
        }
        return f"found no topic with joint states ({ACCEPTED}), only: {', '.join(sorted(kinds)) or 'nothing'}"

    def _names(self, series: JointSeries, topic: str) -> tuple[str, ...]:
        """Joints that are wanted, all of which are in the log."""
        unused = [name for name in self.options.joint_map if name not in series.original]
        if unused:
            self._raise(f"--map renames {', '.join(unused)}, but the log has {some(series.original)}")
        for source in series.counts:
            if len(set(source.names)) != len(source.names):
                self._raise(f"--map gives two joints of the log one name: {', '.join(source.names)}")
        found = series.found()
        wanted = found if self.wanted is None else tuple(self.wanted)
        if not series.original:
            self._raise(f"the messages of {topic} name no joints; a log needs names")
        missing = [name for name in wanted if name not in found]
        if missing:
            in_log = some(sorted({*found, *series.ignored}))
            others = {channel.topic for channel in self.topics.channels.values()} - {topic}
            hint = f"; other topics with joints: {', '.join(sorted(others))} (--topic)" if others else ""
            self._raise(
                f"joints of the robot are not in the log: {', '.join(missing)}; the robot has {', '.join(wanted)}; the "
                f"log has {in_log}; rename those of the log with --map LOG=ROBOT,... (or those of the robot with "
                f"joint_names: in an assembly){hint}"
            )
        return wanted

    def _choose_publisher(self, series: JointSeries) -> None:
        """Keep the messages of one publisher, if one is chosen."""
        if self.options.publisher is None:
            return
        numbers = series.numbers
        chosen = [source for source in series.counts if numbers[source] == self.options.publisher]
        if not chosen:
            found = f"found {self.options.publisher}, expected a number of the list"
            raise UsageError(f"--publisher: {found}: {describe(numbers, series.counts)}")
        series.keep(chosen[0])

    def _raise_publishers(self, contradiction: str, counts: dict[Source, int], numbers: dict[Source, int]) -> NoReturn:
        if len(counts) == 1:
            self._raise(
                f"{contradiction}, and nothing tells their messages apart; record one publisher alone, or take the log "
                f"as it is with --publisher {numbers[next(iter(counts))]}"
            )
        self._raise(f"{contradiction}; choose one with --publisher: {describe(numbers, counts)}")

    def _ignored(self, series: JointSeries) -> list[str]:
        out = [f"ignored joints of the log: {some(series.ignored)}"] if series.ignored else []
        if series.others:
            out.append(f"{series.others} messages are about other joints only")
        return out

    def _recording(self, topic: str, names: tuple[str, ...], samples: Samples, notes: list[str]) -> Recording:
        stamps = samples.stamps
        notes = notes + self._repeated(len(stamps), samples.repeated)
        q, *others = samples.values
        dq, effort = (None if np.isnan(part).all() else part for part in others)
        return Recording(
            self.path.stem, topic, self.options.time, names, stamps, q, dq, effort, samples.repeated, tuple(notes)
        )

    def _repeated(self, count: int, repeated: int) -> list[str]:
        """A note on times that were there already; an error if there is only one time."""
        if count < 2:
            what = "header stamp" if self.options.time == "header" else "log time"
            advice = "; take the times of the recorder: --time log" if self.options.time == "header" else ""
            self._raise(f"all {repeated + count} messages have the same {what}; a log needs times that advance{advice}")
        return [f"{repeated} messages repeated the time before and were left out"] if repeated else []

    def _raise(self, message: str) -> NoReturn:
        damage = self._losses(self.options.topic)
        known = f" ({'; '.join(damage)})" if damage and not message.startswith("--strict") else ""
        raise InputFileError(Fault(str(self.path), message + known))


def some(names: Sequence[str] | Mapping[str, None]) -> str:
    """The first names of a list."""
    listed = list(names)
    return ", ".join(listed[:20]) + (f" and {len(listed) - 20} more" if len(listed) > 20 else "") or "none"
