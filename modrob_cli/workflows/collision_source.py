"""Logs in memory and in temporary files, as collision bands see them."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.long_source import LongSource
from modrob_cli.model.log import JointLog


class LogParts(LongSource, Protocol):
    """A log of any length."""

    @property
    def start(self) -> int:
        """Stamp of the first sample, [ns]."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, ignored, repaired or lost."""
        ...


@dataclass(frozen=True)
class WholeLog:
    """A log that is in memory."""

    log: JointLog

    @property
    def name(self) -> str:
        """Of the log."""
        return self.log.name

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the log."""
        return self.log.notes

    @property
    def start(self) -> int:
        """Stamp of the first sample, [ns]."""
        return self.log.start or 0

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.log.t)

    @property
    def duration(self) -> float:
        """Time of the last sample, [s]."""
        return float(self.log.t[-1])

    @property
    def has_velocity(self) -> bool:
        """Whether velocities were recorded."""
        return self.log.dq is not None

    def times(self, first: int, last: int) -> Array:
        """Times of the samples first <= k < last, [s]."""
        return self.log.t[first:last]

    def find(self, t: float) -> int:
        """Number of samples before a time."""
        return int(np.searchsorted(self.log.t, t))

    def piece(self, first: int, last: int) -> JointLog:
        """Samples first <= k < last, as far as they are there."""
        log, span = self.log, slice(max(first, 0), last)
        dq = None if log.dq is None else log.dq[span]
        return replace(log, t=log.t[span], q=log.q[span], dq=dq, effort=log.effort[span])
