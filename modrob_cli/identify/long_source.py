"""A log that is too long for memory, as the algorithms see it."""

from typing import Protocol

from modrob_cli.arrays import Array
from modrob_cli.model.log import JointLog


class SampleTimes(Protocol):
    """When samples were taken."""

    @property
    def count(self) -> int:
        """Number of samples."""
        ...

    def times(self, first: int, last: int) -> Array:
        """Times of the samples first <= k < last, [s]."""
        ...


class LongSource(SampleTimes, Protocol):
    """Pieces of a log; times count from its first sample."""

    @property
    def name(self) -> str:
        """Where it comes from, for reports."""
        ...

    @property
    def duration(self) -> float:
        """Time of the last sample, [s]."""
        ...

    @property
    def has_velocity(self) -> bool:
        """Whether velocities were recorded."""
        ...

    def piece(self, first: int, last: int) -> JointLog:
        """Samples first <= k < last, as far as they are there."""
        ...

    def find(self, t: float) -> int:
        """Number of samples before the time t [s]."""
        ...
