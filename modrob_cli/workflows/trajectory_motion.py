"""Trajectory documents as sampled motions."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modrob_cli.errors import InputFileError, NumericalError, UsageError
from modrob_cli.io.documents import read_document
from modrob_cli.io.motion_csv import MotionCsv
from modrob_cli.io.yaml_loader import YamlDocument
from modrob_cli.model.motion import MotionPiece
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.schema import TrajectoryDocument

DEFAULT_RATE = 100.0
DOCUMENT_SUFFIXES = (".yaml", ".yml")
MOST_SAMPLES = 100_000_000
"""More would fill disks: a slip in the rate or the duration."""

_BLOCK = 10_000
_SAME_TIME = 1e-6
"""A last sample nearer to the end than this part of a period is the end."""


@dataclass(frozen=True)
class LoadedTrajectory:
    """A trajectory document, its text with places, and its motion."""

    path: Path
    document: TrajectoryDocument
    text: YamlDocument
    trajectory: Trajectory

    def check_joints(self, robot: Robot) -> None:
        """Make sure that the motion has as many joints as the robot.

        Raises
        ------
        InputFileError
            If it has not.
        """
        found = self.trajectory.dof
        if found != robot.dof:
            where = "points" if self.document.points is not None else "joints"
            wanted = f"expected {robot.dof} as the robot {robot.name} has: {', '.join(robot.joint_names)}"
            raise InputFileError(self.text.fault((where,), f"found a motion of {found} joints, {wanted}"))


def load_trajectory(path: Path) -> LoadedTrajectory:
    """Read a ``trajectory/1`` document.

    Raises
    ------
    InputFileError
        With all faults of the file.
    """
    document, text = read_document(path, TrajectoryDocument)
    with np.errstate(all="ignore"):  # absurd sizes; what is not finite is refused when it is sampled
        return LoadedTrajectory(path, document, text, document.to_model())


class TrajectoryMotion:
    """Samples of a trajectory at 0, 1/rate, 2/rate, ... and at the end, piece by piece; can be iterated over again.

    Attributes
    ----------
    done : fraction that was sampled so far

    Raises
    ------
    UsageError
        If the rate is not positive and finite, or gives too many samples.
    """

    def __init__(self, trajectory: Trajectory, rate: float) -> None:
        if not (rate > 0.0 and np.isfinite(rate)):
            raise UsageError(f"--rate: found {rate:g}, expected a number > 0 [Hz]")
        steps = trajectory.duration * rate
        if not steps <= MOST_SAMPLES:
            message = f"{trajectory.duration:g} s at {rate:g} Hz are {steps:.3g} samples, at most {MOST_SAMPLES:.0e}"
            raise UsageError(f"--rate: {message} are possible; expected a lower rate")
        self.trajectory = trajectory
        self.rate = rate
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


def motion_reader(path: Path, robot: Robot, rate: float | None) -> MotionCsv | TrajectoryMotion:
    """MOTION on the command line: a trajectory document, which is sampled, or samples as CSV.

    Parameters
    ----------
    rate : samples per second of a trajectory document; None for the default, and for CSV

    Raises
    ------
    InputFileError
        If a trajectory document cannot be used or does not fit the robot; CSV is checked while it is read.
    UsageError
        If the rate makes no sense.
    """
    if path.suffix.lower() in DOCUMENT_SUFFIXES:
        loaded = load_trajectory(path)
        loaded.check_joints(robot)
        return TrajectoryMotion(loaded.trajectory, DEFAULT_RATE if rate is None else rate)
    if rate is not None:
        raise UsageError(
            f"--rate is for trajectory documents ({', '.join(DOCUMENT_SUFFIXES)}); {path} has its own times"
        )
    return MotionCsv(path, robot.joint_names)
