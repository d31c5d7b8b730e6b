"""Joint states of several messages at once, as every decoder gives them."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.cdr_layout import Stamps

NO_STAMP = int(np.iinfo(np.int64).min)
"""Stands for the stamp of a message that has none."""

QUANTITIES = ("position", "velocity", "effort")


@dataclass(frozen=True)
class Source:
    """What messages of one publisher have in common: other values mean another publisher, or a change of its set-up.

    Attributes
    ----------
    channel : number of the channel in the file
    names : joints, in the order of the message
    frame : the frame_id of the header
    recorded : which of position, velocity and effort it sends
    """

    channel: int
    names: tuple[str, ...]
    frame: str = ""
    recorded: tuple[str, ...] = QUANTITIES


@dataclass(frozen=True)
class Batch:
    """Messages of one source.

    Attributes
    ----------
    order : numbers of the messages in the file, shape (N,)
    stamps, log_times : shape (N,), [ns]; a stamp may be :data:`NO_STAMP`
    values : positions, velocities and efforts, shape (3, N, n); NaN where there is none
    """

    source: Source
    order: Indices
    stamps: Stamps
    log_times: Stamps
    values: Array


@dataclass
class Faults:
    """Messages that could not be decoded: how many, and why the first could not."""

    count: int = 0
    reason: str = ""

    def add(self, reason: str) -> None:
        """Count a message."""
        self.count += 1
        self.reason = self.reason or reason


def check_names(names: tuple[str, ...]) -> None:
    """Make sure that a message names each joint once.

    Raises
    ------
    ValueError
        If it does not.
    """
    if len(set(names)) != len(names):
        twice = next(name for k, name in enumerate(names) if name in names[:k])
        raise ValueError(f"it names a joint twice: {twice}")
