"""Motions from files of every kind, and their samples."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from modrob_cli.errors import Fault, InputFileError, NumericalError, UsageError
from modrob_cli.io.documents import read_document
from modrob_cli.io.given_motion import GivenMotion
from modrob_cli.io.joint_trajectory import find_joint_trajectory, load_motion_text, read_joint_trajectory
from modrob_cli.io.joint_trajectory_csv import read_motion_csv
from modrob_cli.io.joint_trajectory_mcap import read_motion_mcap
from modrob_cli.io.motion_csv import MotionCsv
from modrob_cli.io.yaml_loader import YamlDocument
from modrob_cli.model.motion import MotionPiece
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.schema import TrajectoryDocument
from modrob_cli.workflows.task_motion import is_task, read_task

DEFAULT_RATE = 100.0
CSV_SUFFIX, MCAP_SUFFIX = ".csv", ".mcap"
SAMPLED_SUFFIXES = (".yaml", ".yml", ".json", MCAP_SUFFIX)
"""Of files that ``modrob bounds`` samples; others hold samples with accelerations, which it takes as they are."""
MOST_SAMPLES = 100_000_000
"""More would fill disks: a slip in the rate or the duration."""

_NO_TOPICS = "--topic is for MCAP files; {} has no topics"
_BLOCK = 10_000
_SAME_TIME = 1e-6
"""A last sample nearer to the end than this part of a period is the end."""


@dataclass(frozen=True)
class LoadedTrajectory:
    """A motion from a file.

    Attributes
    ----------
    name : for files and reports
    kind : that of a ``trajectory/1`` document, or ``joint-trajectory``, ``samples``, ``joint-states``
    detail : what else tells how the curve is made: the order of polynomials, the interpolation; may be ""
    joint_names : in the order of the curves; None where the file names no joints
    warnings : what an arm or a user may not expect
    place : file and place of the joints, for faults; its message is empty
    """

    path: Path
    name: str
    kind: str
    trajectory: Trajectory
    place: Fault
    detail: str = ""
    joint_names: tuple[str, ...] | None = None
    warnings: tuple[str, ...] = ()

    def check_joints(self, robot: Robot) -> None:
        """Make sure that the motion is one of the robot's joints.

        Raises
        ------
        InputFileError
            If it has another number of joints, or names others or in another order.
        """
        found = self.trajectory.dof
        wanted = f"expected {robot.dof} as the robot {robot.name} has: {', '.join(robot.joint_names)}"
        if found != robot.dof:
            raise InputFileError(replace(self.place, message=f"found a motion of {found} joints, {wanted}"))
        if self.joint_names is not None and self.joint_names != robot.joint_names:
            named = f"found a motion of the joints {', '.join(self.joint_names)}"
            raise InputFileError(replace(self.place, message=f"{named}, {wanted}"))


def load_trajectory(path: Path, robot: Robot | None = None, topic: str | None = None) -> LoadedTrajectory:
    """Read a motion: ``trajectory/1``, ``task/1``, JointTrajectory as YAML or JSON, samples as CSV, or MCAP.

    Parameters
    ----------
    robot : the arm that is to move; joints that the file names are put into its order, and the others have to fit
    topic : which one of an MCAP file

    Raises
    ------
    InputFileError
        With all faults of the file, or if its joints are not those of the robot.
    UsageError
        If a topic is named and the file has none, or a task has no arm to do it.
    """
    suffix = path.suffix.lower()
    names = robot.joint_names if robot is not None else None
    if topic is not None and suffix != MCAP_SUFFIX:
        raise UsageError(_NO_TOPICS.format(path))
    if suffix == MCAP_SUFFIX:
        loaded = _through(path, read_motion_mcap(path, names, topic), robot)
    elif suffix == CSV_SUFFIX:
        loaded = _through(path, read_motion_csv(path, names), robot)
    else:
        text = load_motion_text(path)
        at = find_joint_trajectory(text)
        if is_task(text):
            given, name = read_task(text, robot)
            loaded = replace(_through(path, given, robot), name=name)
        else:
            loaded = _document(path, text) if at is None else _through(path, read_joint_trajectory(text, at), robot)
    if robot is not None:
        loaded.check_joints(robot)
    return loaded


def _document(path: Path, text: YamlDocument) -> LoadedTrajectory:
    document, _ = read_document(path, TrajectoryDocument, text)
    with np.errstate(all="ignore"):  # absurd sizes; what is not finite is refused when it is sampled
        trajectory = document.to_model()
    place = text.fault(("points" if document.points is not None else "joints",), "")
    detail = f"order {document.order}" if document.order else ""
    return LoadedTrajectory(path, document.name, document.kind, trajectory, place, detail)


def _through(path: Path, given: GivenMotion, robot: Robot | None) -> LoadedTrajectory:
    """Return the motion through points."""
    if robot is not None:
        given = given.for_joints(robot.joint_names)
    points, name = given.points, _name_of(path)
    with np.errstate(all="ignore"):
        curves = points.curves()
        warnings = (*given.notes, *points.warnings(curves))
    trajectory = Trajectory(name, curves)
    return LoadedTrajectory(
        path, name, given.kind, trajectory, given.place, points.interpolation, points.joint_names, warnings
    )


def _name_of(path: Path) -> str:
    """Name of a motion from that of its file, as documents may have it."""
    return re.sub(r"[^A-Za-z0-9_+-]", "_", path.stem).lstrip("_+-")[:64] or "trajectory"


class TrajectoryMotion:
    """Samples of a trajectory at 0, 1/rate, 2/rate, ... and at the end, piece by piece; can be iterated over again.

    Attributes
    ----------
    done : fraction that was sampled so far
    warnings : of the file that the motion is from

    Raises
    ------
    UsageError
        If the rate is not positive and finite, or gives too many samples.
    """

    def __init__(self, trajectory: Trajectory, rate: float, warnings: tuple[str, ...] = ()) -> None:
        if not (rate > 0.0 and np.isfinite(rate)):
            raise UsageError(f"--rate: found {rate:g}, expected a number > 0 [Hz]")
        steps = trajectory.duration * rate
        if not steps <= MOST_SAMPLES:
            message = f"{trajectory.duration:g} s at {rate:g} Hz are {steps:.3g} samples, at most {MOST_SAMPLES:.0e}"
            raise UsageError(f"--rate: {message} are possible; expected a lower rate")
        self.trajectory = trajectory
        self.rate = rate
        self.warnings = warnings
        self.samples = int(np.ceil(steps - _SAME_TIME)) + 1 if steps > _SAME_TIME else 2
        self.done = 0.0

    def __iter__(self) -> Iterator[MotionPiece]:
        """Sample the motion.

        Raises
        ------
        NumericalError
            If a value is not finite.
        """
        for first in range(0, self.samples, _BLOCK):
            k = np.arange(first, min(first + _BLOCK, self.samples))
            t = np.where(k == self.samples - 1, self.trajectory.duration, k / self.rate)
            with np.errstate(all="ignore"):
                piece = self.trajectory.motion(t)
            if not all(np.isfinite(part).all() for part in (piece.q, piece.dq, piece.ddq)):
                raise NumericalError("the motion has values beyond the range of numbers; look at its sizes and times")
            self.done = (k[-1] + 1) / self.samples
            yield piece


def motion_reader(
    path: Path, robot: Robot, rate: float | None, topic: str | None = None
) -> MotionCsv | TrajectoryMotion:
    """MOTION on the command line: samples as CSV, or another motion, which is sampled.

    Parameters
    ----------
    rate : samples per second of a motion that is sampled; None for the default, and for CSV
    topic : which one of an MCAP file

    Raises
    ------
    InputFileError
        If the file cannot be used or does not fit the robot; CSV is checked while it is read.
    UsageError
        If the rate or the topic makes no sense.
    """
    if path.suffix.lower() in SAMPLED_SUFFIXES:
        loaded = load_trajectory(path, robot, topic)
        return TrajectoryMotion(loaded.trajectory, DEFAULT_RATE if rate is None else rate, loaded.warnings)
    if topic is not None:
        raise UsageError(_NO_TOPICS.format(path))
    if rate is not None:
        kinds = ", ".join(SAMPLED_SUFFIXES)
        raise UsageError(f"--rate is for trajectory documents and messages ({kinds}); {path} has its own times")
    return MotionCsv(path, robot.joint_names)
