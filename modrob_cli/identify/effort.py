"""From what a log calls effort to the torque at the joint."""

from typing import Literal, get_args

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError
from modrob_cli.model.robot import Robot

EffortKind = Literal["torque", "current", "motor-torque", "net-torque"]
"""What a log calls effort.

``torque``: at the joint, [N m] or [N]; ``motor-torque``: at the motor, [N m]; ``current``: of the motor, [A];
``net-torque``: at the joint, without gravity: what a controller that compensates gravity commands on top of it.
"""

EFFORT_KINDS: tuple[EffortKind, ...] = get_args(EffortKind)


def holds_gravity(kind: EffortKind) -> bool:
    """Whether the effort includes what it takes to carry the arm; else predictions must leave gravity out."""
    return kind != "net-torque"


def effort_factors(robot: Robot, kind: EffortKind) -> Array:
    """Joint torque per unit of effort, shape (n,).

    ``torque`` and ``net-torque`` are joint torque already ([N m], or [N] for a prismatic joint); ``motor-torque`` [N m]
    is multiplied by the gear ratio; ``current`` [A] by torque constant and gear ratio ([D] 2.4).

    Raises
    ------
    UsageError
        If the robot lacks the constants, with the names of the joints.
    """
    drives = [joint.drive for joint in robot.joints]
    if kind in ("torque", "net-torque"):
        return np.ones(robot.dof)
    ratios = np.array([drive.gear_ratio for drive in drives])
    if kind == "current":
        missing = [joint.name for joint in robot.joints if joint.drive.torque_constant is None]
        if missing:
            raise UsageError(
                f"--effort current needs torque_constant [N m/A], which {robot.name} lacks for: {', '.join(missing)}; "
                "give it (with gear_ratio) in a robot/1 or module/1 file, or say --effort torque if it is joint torque"
            )
        return np.asarray(ratios * np.array([drive.torque_constant for drive in drives], dtype=float))
    if np.all(ratios == 1.0):
        raise UsageError(
            f"--effort motor-torque needs gear_ratio, which {robot.name} gives for no joint "
            f"({', '.join(robot.joint_names)}); give it in a robot/1 or module/1 file, or say --effort torque if the "
            "gear ratio is in the effort already"
        )
    return ratios
