"""Logs and planned motions as streams of stretches: in memory, or long ones through temporary files."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import estimation_windows, measured_acceleration
from modrob_cli.collision.bands import cell_size
from modrob_cli.collision.events import Contact
from modrob_cli.errors import Fault, InputFileError, NumericalError
from modrob_cli.identify.effort import effort_factors, holds_gravity
from modrob_cli.identify.long_steps import step_statistics
from modrob_cli.io.long_log import WINDOW, is_long
from modrob_cli.io.long_topics import open_long_run
from modrob_cli.io.mcap_reader import complete_log
from modrob_cli.io.run_topics import ContactSeries, read_run
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.collision_desired import ControllerTopic, Desired, find_desired
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_runs import PLANNED, CollisionRun, RunHead
from modrob_cli.workflows.collision_smoothed import smooth_log, smooth_long
from modrob_cli.workflows.collision_source import LogParts, WholeLog
from modrob_cli.workflows.collision_stream import STRETCH, RunStream, Stretches, stream_of, survey_stream, whole_cells
from modrob_cli.workflows.trajectory_motion import TrajectoryMotion, load_trajectory


@contextmanager
def open_run(
    robot: Robot,
    path: Path,
    name: str,
    options: CollisionOptions,
    stretch: int = STRETCH,
    long: bool | None = None,
    window: int = WINDOW,
) -> Iterator[RunStream]:
    """Read one log or planned motion.

    Parameters
    ----------
    stretch : samples that are judged at once, about
    long : read through temporary files, which are gone at the end of the block; None: if the log is long
    window : messages of a long log that are put in order at once

    Raises
    ------
    InputFileError
        If it cannot be read, or lacks what the options ask for.
    UsageError
        If the robot lacks constants that the effort needs, or options do not fit.
    NumericalError
        If the log is too short.
    OutputError
        If there is no room for the temporary files.
    """
    if path.suffix.lower() in PLANNED:
        yield stream_of(_planned(robot, path, name, options), stretch)
    elif is_long(path) if long is None else long:
        with open_long_run(path, robot.joint_names, options.reading, window) as found:
            loader = _Loader(robot, path, name, options, stretch, found.log, found.desired, None)
            yield loader.stream(told(found.contacts, found.log.start) if found.labelled else None)
    else:
        recording, topics = read_run(path, robot.joint_names, options.reading)
        log = complete_log(path, recording)
        loader = _Loader(robot, path, name, options, stretch, WholeLog(log), topics.desired, log)
        yield loader.stream(told(topics.contacts, log.start or 0) if topics.labelled else None)


def load_run(robot: Robot, path: Path, name: str, options: CollisionOptions) -> CollisionRun:
    """One log or planned motion in one piece; errors as for :func:`open_run`."""
    with open_run(robot, path, name, options, 2**62, long=False) as stream:
        return next(stream.stretches())


@dataclass(frozen=True)
class _Loader:
    """Makes a stream of a log; ``whole``: the log if it is in memory."""

    robot: Robot
    path: Path
    name: str
    options: CollisionOptions
    stretch: int
    log: LogParts
    desired: Sequence[ControllerTopic]
    whole: JointLog | None

    def stream(self, contacts: tuple[Contact, ...] | None) -> RunStream:
        log, options = self.log, self.options
        effort_factors(self.robot, options.effort)
        steps = step_statistics(log)
        notes = list(log.notes)
        if steps.longest > 1.5 * steps.median:
            gap = f"the longest step is {steps.longest:.4g} s, the median one {steps.median:.4g} s"
            notes.append(f"{gap}; filters count samples, not seconds")
        robot = self.robot if holds_gravity(options.effort) else replace(self.robot, gravity=np.zeros(3))
        head = RunHead(self.path, self.name, robot, log.start, steps.median)
        source = options.acceleration or ("desired" if options.desired is not None or self.desired else None)
        if source == "smoothed":
            make: Stretches = self._smoothed(head)
        elif source == "measured":
            make = self._measured(head)
        elif source == "desired":
            make = self._along(head, notes)
        else:
            message = "the log has no topic of a controller with desired accelerations; give the planned motion with"
            message += " --desired, or say --acceleration measured or --acceleration smoothed"
            raise self._fault(message)
        return survey_stream(partial(self._told, make, contacts, tuple(notes)))

    def _told(
        self, make: Stretches, contacts: tuple[Contact, ...] | None, notes: tuple[str, ...]
    ) -> Iterator[CollisionRun]:
        """The stretches with what is known besides."""
        empty = True
        for run in make():
            empty = False
            yield replace(run, contacts=contacts, notes=notes)
        if empty:
            raise self._fault(f"--skip {self.options.skip:g} leaves nothing of the log")

    def _fault(self, message: str) -> InputFileError:
        return InputFileError(Fault(str(self.path), message))

    def _smoothed(self, head: RunHead) -> Stretches:
        stretch = whole_cells(self.stretch, cell_size(1.0 / head.step))
        if self.whole is not None:
            return smooth_log(head, self.whole, self.options, stretch).stretches
        return smooth_long(head, self.log, self.options, stretch).stretches

    def _check_velocities(self) -> None:
        if not self.log.has_velocity:
            message = "the log has no velocities; say --acceleration smoothed, which derives them from the positions"
            raise self._fault(message)

    def _spans(self, head: RunHead, first: int, last: int) -> Iterator[tuple[int, int]]:
        """First and last + 1 sample of each stretch."""
        size = whole_cells(self.stretch, cell_size(1.0 / head.step))
        first = max(first, self.log.find(self.options.skip)) if self.options.skip else first
        for begin in range(first, last, size):
            yield begin, min(begin + size, last)

    def _measured(self, head: RunHead) -> Stretches:
        self._check_velocities()
        known, log = self.options.velocity_knowledge(head.robot), self.log
        windows = estimation_windows(known, head.step)
        longest = int(windows.max())
        if longest >= log.count:
            raise NumericalError("the log is shorter than the window over which accelerations are estimated")
        length = windows * head.step
        widths = 2.0 * known.noise / length + 0.5 * known.jerk * length
        text = ", ".join(f"{value:.3g}" for value in widths)
        source = f"backward differences of the measured velocity, known to +- {text} away from reversals"

        def stretches() -> Iterator[CollisionRun]:
            for begin, end in self._spans(head, longest, log.count):
                # The window, the sample before it, and the one behind the stretch.
                early = max(begin - longest - 1, 0)
                piece, part = log.piece(early, end + 1), slice(begin - early, end - early)
                dq = velocities(piece)
                ddq, tolerance, _ = measured_acceleration(piece.t, dq, known, head.step)
                states = (piece.q[part], dq[part], ddq[part])
                yield head.run(self.options, piece.t[part], states, tolerance[part], piece.effort[part], source)

        return stretches

    def _along(self, head: RunHead, notes: list[str]) -> Stretches:
        """Along a desired motion; a note says how much is outside of it."""
        self._check_velocities()
        log = self.log
        desired: Desired = find_desired(self.path, self.desired, head.robot, self.options, head.step, head.start)
        first, last = log.find(desired.span[0]), log.find(float(np.nextafter(desired.span[1], np.inf)))
        if first >= last:
            raise self._fault("the desired motion and the log have no time in common")
        if last - first < log.count:
            notes.append(f"{log.count - (last - first)} samples outside the desired motion were left out")
        tolerance = self.options.radii(head.robot)["ddq"]

        def stretches() -> Iterator[CollisionRun]:
            for begin, end in self._spans(head, first, last):
                piece = log.piece(begin, end)
                states = (piece.q, velocities(piece), desired.at(piece.t))
                yield head.run(self.options, piece.t, states, tolerance, piece.effort, desired.source)

        return stretches


def velocities(log: JointLog) -> Array:
    """Velocities of a log that has them."""
    if log.dq is None:
        raise ValueError("a log without velocities")
    return log.dq


def _planned(robot: Robot, path: Path, name: str, options: CollisionOptions) -> CollisionRun:
    loaded = load_trajectory(path, robot)
    pieces = list(TrajectoryMotion(loaded.trajectory, options.rate, loaded.warnings))
    t, *states = (np.concatenate([getattr(piece, key) for piece in pieces]) for key in ("t", "q", "dq", "ddq"))
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    head, still = RunHead(path, name, robot, 0, step), np.zeros_like(states[0])
    run = head.run(options, t, states, options.radii(robot)["ddq"], still, "planned")
    return replace(run, tau=None, notes=loaded.warnings)


def told(series: Sequence[ContactSeries], start: int) -> tuple[Contact, ...]:
    """Windows in which contacts push, [s] from the first sample on, by their starts."""
    found = [
        Contact(one.name, (first - start) / 1e9, (last - start) / 1e9) for one in series for first, last in one.windows
    ]
    return tuple(sorted(found, key=lambda contact: contact.start))
