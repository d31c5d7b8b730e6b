"""Joint states of one topic, collected piece by piece and merged into one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import Batch, Source

RARE = 0.1
"""Joints in fewer messages than this share of those of the most frequent one are left out unless asked for."""


@dataclass(frozen=True)
class JointTable:
    """All messages about certain joints, in the order of the file.

    Attributes
    ----------
    names : n joints
    sources : S sources, in the order in which they begin
    owner : source of each message, shape (M,)
    has : which joints a source tells about, shape (S, n)
    stamps, log_times : shape (M,), [ns]
    values : positions, velocities, efforts, shape (3, M, n); NaN where there is none
    """

    names: tuple[str, ...]
    sources: tuple[Source, ...]
    owner: Indices
    has: NDArray[np.bool_]
    stamps: Stamps
    log_times: Stamps
    values: Array

    def pick(self, rows: Indices) -> "JointTable":
        """Keep these messages, in this order."""
        return replace(
            self,
            owner=self.owner[rows],
            stamps=self.stamps[rows],
            log_times=self.log_times[rows],
            values=self.values[:, rows],
        )


class JointSeries:
    """Collects batches; keeps arrays only, and of them the columns of the joints that are wanted.

    Attributes
    ----------
    others : messages that are about other joints only
    ignored : joints that are not wanted, in the order in which they come
    """

    def __init__(self, wanted: Sequence[str] | None, renamed: Mapping[str, str]) -> None:
        self.wanted = None if wanted is None else tuple(wanted)
        self.renamed = renamed
        self.others = 0
        self.ignored: dict[str, None] = {}
        self.original: dict[str, None] = {}
        self._sources: dict[Source, tuple[Source, list[int]]] = {}
        self._begins: dict[Source, int] = {}
        self._counts: dict[Source, int] = {}
        self._parts: dict[Source, list[tuple[Indices, Stamps, Stamps, Array]]] = {}

    def add(self, batch: Batch) -> None:
        """Take the next batch."""
        source, columns = self._source(batch.source)
        self._begins[source] = min(int(batch.order[0]), self._begins.get(source, int(batch.order[0])))
        if not columns:
            self.others += len(batch.order)
            return
        values = batch.values if len(columns) == len(batch.source.names) else batch.values[:, :, columns]
        self._counts[source] = self._counts.get(source, 0) + len(batch.order)
        self._store(source, batch, values)

    def _store(self, source: Source, batch: Batch, values: Array) -> None:
        """Keep the messages of a batch; ``values`` are those of the joints that are wanted."""
        self._parts.setdefault(source, []).append((batch.order, batch.stamps, batch.log_times, values))

    @property
    def numbers(self) -> dict[Source, int]:
        """Numbers of all sources, joints renamed, from 1, in the order in which they begin."""
        return {source: k for k, source in enumerate(sorted(self._begins, key=self._begins.__getitem__), start=1)}

    @property
    def counts(self) -> dict[Source, int]:
        """Messages of each source that is about wanted joints, in the order in which they begin."""
        return {source: self._counts[source] for source in self.numbers if source in self._counts}

    def _source(self, raw: Source) -> tuple[Source, list[int]]:
        """Rename the joints of a source; and the columns that are kept of it."""
        if raw not in self._sources:
            self.original |= dict.fromkeys(raw.names)
            names = tuple(self.renamed.get(name, name) for name in raw.names)
            columns = [k for k, name in enumerate(names) if self.wanted is None or name in self.wanted]
            self.ignored |= dict.fromkeys(name for k, name in enumerate(names) if k not in columns)
            self._sources[raw] = replace(raw, names=names), columns
        return self._sources[raw]

    def found(self) -> tuple[str, ...]:
        """Joints that were found and are wanted, in the order in which they come.

        If none is asked for, those that come rarely (a damaged name, a tool that was attached for a while) are ignored.
        """
        counts: dict[str, int] = {}
        for source, count in self.counts.items():
            for name in source.names:
                counts[name] = counts.get(name, 0) + count
        if self.wanted is not None:
            return tuple(name for name in counts if name in self.wanted)
        rare = [name for name, count in counts.items() if count < RARE * max(counts.values())]
        self.ignored |= dict.fromkeys(rare)
        return tuple(name for name in counts if name not in rare)

    def keep(self, source: Source) -> None:
        """Give up all other sources."""
        self._counts = {source: self._counts[source]}
        self._parts = {key: parts for key, parts in self._parts.items() if key == source}

    def table(self, names: Sequence[str]) -> JointTable:
        """Merge what came from all sources; what was collected is given up."""
        counts = self.counts
        chosen = tuple(source for source in counts if any(name in names for name in source.names))
        total = sum(counts[source] for source in chosen)
        order, stamps, log_times = (np.empty(total, dtype=np.int64) for _ in range(3))
        owner = np.empty(total, dtype=np.intp)
        values = np.full((3, total, len(names)), np.nan)
        has = np.zeros((len(chosen), len(names)), dtype=bool)
        place = {name: k for k, name in enumerate(names)}
        done = 0
        for number, source in enumerate(chosen):
            stored = [name for name in source.names if self.wanted is None or name in self.wanted]
            kept = [k for k, name in enumerate(stored) if name in place]
            columns = [place[stored[k]] for k in kept]
            has[number, columns] = True
            parts = self._parts.pop(source)[::-1]
            while parts:  # given up one by one, so that they are not held twice
                part = parts.pop()
                span = slice(done, done + len(part[0]))
                order[span], stamps[span], log_times[span] = part[:3]
                values[:, span, columns] = part[3][:, :, kept]
                owner[span] = number
                done = span.stop
        table = JointTable(tuple(names), chosen, owner, has, stamps, log_times, values)
        if np.any(np.diff(order) < 0):
            table = table.pick(np.argsort(order, kind="stable"))
        return table
