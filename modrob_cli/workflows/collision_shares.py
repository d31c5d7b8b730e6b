"""Where the width of collision bands comes from."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import Ball
from modrob_cli.dynamics.box_derivatives import box_torques
from modrob_cli.dynamics.box_motion import StateBox
from modrob_cli.dynamics.drive_torque import drive_boxes
from modrob_cli.dynamics.width_share import (
    Widths,
    WidthShare,
    acceleration_widths,
    parameter_widths,
    ranked,
    without_width,
)
from modrob_cli.model.motion import MotionPiece
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.bounds_method import Tolerances


def width_shares(
    robot: Robot, motion: MotionPiece, tolerances: Tolerances, effort_noise: Array
) -> list[list[WidthShare]]:
    """For each joint, what its width comes from: parameters, tolerance and noise, largest first.

    The noise of positions and velocities counts by its half-width times the slope of the torque, as in the bands; of
    one log :func:`modrob_cli.workflows.bounds_method.shares` would take half of all the time with exact ranges.

    Parameters
    ----------
    motion : a few hundred samples
    effort_noise : half-width of the noise of the measured torque, shape (n,)
    """
    widths = parameter_widths(robot, motion.q, motion.dq, motion.ddq)
    parts = [acceleration_widths(robot, motion.q, tolerances.ddq)]
    if tolerances.has_noise:
        parts.append(_noise_widths(without_width(robot), motion, tolerances))
    for more in parts:
        for joint, found in zip(widths, more, strict=True):
            joint.update(found)
    for joint, name, noise in zip(widths, robot.joint_names, effort_noise.tolist(), strict=True):
        if noise > 0.0:
            joint[f"{name} effort noise"] = 2.0 * noise
    return [ranked(joint) for joint in widths]


def _noise_widths(bare: Robot, motion: MotionPiece, tolerances: Tolerances) -> list[Widths]:
    """Mean width by the noise of each position and velocity alone, at nominal parameters."""
    middle = np.stack([motion.q.T, motion.dq.T, motion.ddq.T])
    rad = np.stack([tolerances.q, tolerances.dq, np.zeros(bare.dof)])[:, :, None]
    box = Ball.between(middle - rad, middle + rad)
    found = box_torques(bare, StateBox(box[0], box[1], box[2]))
    slopes = found.slopes.mag.sum(axis=1).mean(axis=2)  # lower and upper side together, shape (n, K)
    widths: list[Widths] = [{} for _ in bare.joints]
    for k, (i, kind) in enumerate(found.directions):
        noise = rad[kind, i, 0]
        if kind == 2 or noise == 0.0:
            continue
        name = f"{bare.joint_names[i]} {('position', 'velocity')[kind]} noise"
        for j, slope in enumerate(slopes[:, k].tolist()):
            widths[j][name] = slope * noise
        if kind == 1:
            widths[i][name] += _drive_width(bare, i, motion, noise)
    return widths


def _drive_width(bare: Robot, i: int, motion: MotionPiece, noise: float) -> float:
    """Mean width that the noise of the velocity gives a joint's own friction."""
    drive, dq, ddq = drive_boxes(bare)[i], motion.dq[:, i], motion.ddq[:, i]
    width = drive.torque_range(dq + noise, ddq)[1] - drive.torque_range(dq - noise, ddq)[0]
    still = np.subtract(*reversed(drive.torque_range(dq, ddq)))
    return float(np.maximum(width - still, 0.0).mean())
