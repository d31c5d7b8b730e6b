"""Desired accelerations of a log: from a planned motion in a file, or from a controller's topic in the log."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError, NumericalError
from modrob_cli.identify.long_steps import step_statistics
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.trajectory_motion import load_trajectory


class Desired(Protocol):
    """A desired motion."""

    @property
    def source(self) -> str:
        """Where it comes from."""
        ...

    @property
    def span(self) -> tuple[float, float]:
        """Between which times of the log it tells, [s]."""
        ...

    def at(self, t: Array) -> Array:
        """Accelerations, shape (N, n), at times of the log (N,), [s]."""
        ...


@dataclass(frozen=True)
class FromFile:
    """A planned motion that begins at a time of the log, [s]."""

    source: str
    trajectory: Trajectory
    start: float
    span: tuple[float, float]

    def at(self, t: Array) -> Array:
        """Accelerations at times of the log.

        Raises
        ------
        NumericalError
            If one is not finite.
        """
        with np.errstate(all="ignore"):
            ddq = self.trajectory.sample(np.clip(t - self.start, 0.0, self.trajectory.duration), 2)[:, 2]
        if not np.isfinite(ddq).all():
            raise NumericalError("the desired motion has accelerations beyond the range of numbers")
        return np.asarray(ddq)


class ControllerTopic(Protocol):
    """Messages of a controller, as in :class:`modrob_cli.io.run_topics.TopicSeries`."""

    @property
    def topic(self) -> str:
        """Its name."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Joints, as the robot calls them."""
        ...

    @property
    def count(self) -> int:
        """Number of messages."""
        ...

    @property
    def finite(self) -> NDArray[np.bool_]:
        """Whether the acceleration of each joint was finite in all messages."""
        ...

    def times(self, first: int, last: int) -> Stamps:
        """Times of the messages first .. last - 1, [ns]."""
        ...

    def around(self, start: int, end: int) -> tuple[Stamps, Array]:
        """Times and accelerations of the messages from start to end [ns], and of others on either side."""
        ...


@dataclass(frozen=True)
class FromTopic:
    """Accelerations along straight lines between messages; ``start``: stamp of the first sample of the log, [ns]."""

    source: str
    series: ControllerTopic
    columns: Sequence[int]
    start: int
    span: tuple[float, float]

    def at(self, t: Array) -> Array:
        """Accelerations at times of the log."""
        first, last = (self.start + int(np.rint(time * 1e9)) for time in (t[0], t[-1]))
        stamps, values = self.series.around(first, last)
        own = (stamps - self.start) / 1e9
        return np.stack([np.interp(t, own, values[:, k]) for k in self.columns], axis=1)


@dataclass(frozen=True)
class _Seconds:
    """Times of messages from the first sample of the log on, [s]."""

    series: ControllerTopic
    start: int

    @property
    def count(self) -> int:
        return self.series.count

    def times(self, first: int, last: int) -> Array:
        return np.asarray((self.series.times(first, min(last, self.count)) - self.start) / 1e9)


def find_desired(
    path: Path, topics: Sequence[ControllerTopic], robot: Robot, options: CollisionOptions, step: float, start: int
) -> Desired:
    """The desired motion that the options ask for, or else that in the log.

    Parameters
    ----------
    step, start : median step of the log, [s], and stamp of its first sample, [ns]

    Raises
    ------
    InputFileError
        If there is none, or it does not fit.
    """
    if options.ddq_tolerance is None:
        message = "how far real accelerations may be from the desired ones has to be said: --ddq-tolerance"
        raise InputFileError(Fault(str(path), f"{message} [rad/s^2, m/s^2] (0 for not at all)"))
    if options.desired is not None:
        trajectory = load_trajectory(options.desired, robot).trajectory
        # A sample that is late by rounding or jitter still belongs to the end.
        span = (options.desired_start - 0.5 * step, options.desired_start + trajectory.duration + 0.5 * step)
        return FromFile(f"desired, from {options.desired.name}", trajectory, options.desired_start, span)
    series = _controller_topic(path, topics, robot)
    if series.count < 2:
        raise InputFileError(Fault(str(path), f"{series.topic} has {series.count} messages, expected 2 or more"))
    own = _Seconds(series, start)
    slack = 0.5 * step_statistics(own).median
    ends = float(own.times(0, 1)[0]), float(own.times(own.count - 1, own.count)[0])
    columns = [series.names.index(name) for name in robot.joint_names]
    return FromTopic(f"desired, from {series.topic}", series, columns, start, (ends[0] - slack, ends[1] + slack))


def _controller_topic(path: Path, topics: Sequence[ControllerTopic], robot: Robot) -> ControllerTopic:
    fitting = [series for series in topics if set(robot.joint_names) <= set(series.names)]
    if len(fitting) != 1:
        found = ", ".join(series.topic for series in topics) or "none"
        message = f"found controller topics {found}, expected one with all joints of the robot"
        raise InputFileError(Fault(str(path), f"{message}; give the planned motion with --desired"))
    (series,) = fitting
    if not series.finite[[series.names.index(name) for name in robot.joint_names]].all():
        message = f"{series.topic} has no desired accelerations (or not in all messages)"
        raise InputFileError(Fault(str(path), f"{message}; give the planned motion with --desired"))
    return series
