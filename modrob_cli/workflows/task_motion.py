"""Tasks of the tool as motions of the joints of one arm."""

from pathlib import Path

import numpy as np

from modrob_cli.dynamics.inverse_kinematics import RATE, SETTLE, SINGULAR, JointMotion, joint_motion
from modrob_cli.errors import InputFileError, NumericalError, UsageError
from modrob_cli.io.documents import read_document
from modrob_cli.io.given_motion import MOST_POINTS, GivenMotion
from modrob_cli.io.yaml_loader import YamlDocument
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory_points import MotionPoints
from modrob_cli.schema import TaskDocument

KIND = "task"
POSITION_ERROR, ORIENTATION_ERROR = 1e-4, 1e-3
"""Deviations of the tool that are worth a warning [m], [rad]."""


def is_task(text: YamlDocument) -> bool:
    """Whether a document is a task."""
    return isinstance(text.data, dict) and str(text.data.get("modrob", "")).startswith("task/")


def read_task(text: YamlDocument, robot: Robot | None) -> tuple[GivenMotion, str]:
    """Joint motion of a ``task/1`` document, and its name; notes say how well the tool follows where it does not.

    Raises
    ------
    InputFileError
        With all faults of the document, or if the arm cannot do it.
    UsageError
        If there is no arm.
    """
    document, _ = read_document(Path(text.file), TaskDocument, text)
    place = text.fault(("start",), "")
    if robot is None:
        raise UsageError(f"{text.file}: a task/1 document is for a tool, and needs an arm; give one (--robot ROBOT)")
    if len(document.start) != robot.dof:
        found = f"found {len(document.start)} values, expected {robot.dof}: {', '.join(robot.joint_names)}"
        raise InputFileError(text.fault(("start",), found))
    task = document.to_model()
    if (task.duration + SETTLE) * RATE >= MOST_POINTS:
        most = f"expected less than {MOST_POINTS / RATE - SETTLE:g} s"
        raise InputFileError(text.fault(("moves",), f"found moves of {task.duration:g} s together, {most}"))
    try:
        with np.errstate(all="ignore"):
            motion = joint_motion(robot, task)
    except (NumericalError, np.linalg.LinAlgError) as error:
        message = f"{error}; the arm cannot follow; expected poses within its reach, or another start"
        raise InputFileError(text.fault(("moves",), message)) from error
    points = MotionPoints(motion.t, motion.q, motion.dq, motion.ddq)
    return GivenMotion(points, KIND, place, tuple(_notes(motion))), document.name


def _notes(motion: JointMotion) -> list[str]:
    """What a user should know of how well the tool follows."""
    notes = []
    k = int(np.argmax(motion.position_error / POSITION_ERROR + motion.orientation_error / ORIENTATION_ERROR))
    if motion.position_error.max() > POSITION_ERROR or motion.orientation_error.max() > ORIENTATION_ERROR:
        off = f"{1e3 * motion.position_error.max():.3g} mm and {1e3 * motion.orientation_error.max():.3g} mrad"
        notes.append(f"the tool leaves its way by up to {off}, most at t = {motion.t[k]:.4g} s; is it out of reach?")
    j = int(np.argmin(motion.least_singular))
    if motion.least_singular[j] < SINGULAR:
        size = f"smallest singular value {motion.least_singular[j]:.2g}"
        notes.append(
            f"the arm comes near a singularity at t = {motion.t[j]:.4g} s ({size}); the inverse is damped there"
        )
    return notes
