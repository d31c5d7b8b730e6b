"""Recordings of an arm in motion."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import ShapeError

TimeSource = Literal["header", "log"]
"""Which times count: those in the messages (when it was measured), or those of the recorder (when it arrived)."""


@dataclass(frozen=True)
class Recording:
    """What a file says about joints, put in order but not judged: values may be NaN, velocities and efforts absent.

    Attributes
    ----------
    name : where it comes from, for reports
    topic : topic of the messages; "" for a CSV file
    time : which times the stamps are
    joint_names : n names
    stamps : strictly increasing times, shape (N,), [ns]
    q : positions, shape (N, n), [rad] or [m]
    dq, effort : shape (N, n); None if there is no value at all
    repeated : number of samples that were left out because their time was that of the sample before
    notes : what was left out, ignored, repaired or lost, in words
    """

    name: str
    topic: str
    time: TimeSource
    joint_names: tuple[str, ...]
    stamps: NDArray[np.int64]
    q: Array
    dq: Array | None
    effort: Array | None
    repeated: int = 0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check that the arrays fit together, and make them read-only.

        Raises
        ------
        ShapeError
            If they do not, or the times do not increase.
        """
        shape = (len(self.stamps), len(self.joint_names))
        if any(part is not None and part.shape != shape for part in (self.q, self.dq, self.effort)):
            raise ShapeError(f"expected arrays of shape {shape}")
        if np.any(np.diff(self.stamps) <= 0):
            raise ShapeError("the times of a recording must increase strictly")
        for part in (self.stamps, self.q, self.dq, self.effort):
            if part is not None:
                part.setflags(write=False)


@dataclass(frozen=True)
class JointLog:
    """Joint positions and efforts over time, as recorded; columns in the order of ``joint_names``.

    Attributes
    ----------
    name : where it comes from, for reports
    joint_names : n names
    t : strictly increasing times from the first sample, shape (N,), [s]
    q : positions, shape (N, n), [rad] or [m]
    dq : velocities, shape (N, n), [rad/s] or [m/s]; None if they were not recorded
    effort : shape (N, n); what it means (joint torque, motor torque, current) is for the user to say
    repeated : number of samples that were left out because their time was that of the sample before
    notes : what was left out, ignored, repaired or lost, in words
    start : stamp of the first sample, [ns] since 1970; None if nothing tells
    """

    name: str
    joint_names: tuple[str, ...]
    t: Array
    q: Array
    dq: Array | None
    effort: Array
    repeated: int = 0
    notes: tuple[str, ...] = ()
    start: int | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit together."""
        object.__setattr__(self, "t", frozen(self.t, (-1,)))
        shape = (len(self.t), len(self.joint_names))
        for key in ("q", "dq", "effort"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, frozen(value, shape))
        if np.any(np.diff(self.t) <= 0.0):
            raise ShapeError("the times of a log must increase strictly")


@dataclass(frozen=True)
class UsedLog:
    """A stretch of a log that values were fitted to.

    Attributes
    ----------
    log : name of the file;  sha256 : of the file, hex digits
    start, end : after the start of the log, [s]; None for its end
    """

    log: str
    sha256: str
    start: float = 0.0
    end: float | None = None
